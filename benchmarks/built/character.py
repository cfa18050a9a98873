"""numbers -> a figure of skin and subdivision modifiers with a monkey's head, on a sweep.

Limbs are a skeleton of edges, which modifiers make into smooth skin; clothes are sheen, eyes and
boots are coated. Three area lamps: key, fill and rim. No hair.
"""

import bpy

from ...examples._stage import ball, camera, lamp, mesh, put
from .shapes import begin, lathe, metal, plastic, rounded, soft_box, suzanne

# Joints of the left half: name, (x, y, z), radius of the skin there; the right half mirrors it.
JOINTS = {
    "hip": ((0.0, 0.0, 1.00), 0.17),
    "belly": ((0.0, -0.02, 1.18), 0.16),
    "chest": ((0.0, 0.0, 1.42), 0.21),
    "neck": ((0.0, 0.02, 1.66), 0.07),
    "thigh": ((0.14, 0.0, 0.90), 0.12),
    "knee": ((0.17, -0.05, 0.52), 0.085),
    "ankle": ((0.19, 0.02, 0.12), 0.06),
    "toe": ((0.21, -0.20, 0.06), 0.06),
    "shoulder": ((0.24, 0.0, 1.54), 0.085),
    "elbow": ((0.44, 0.06, 1.30), 0.062),
    "wrist": ((0.52, -0.16, 1.12), 0.045),
    "hand": ((0.54, -0.24, 1.08), 0.055),
}
BONES = (
    *("hip belly", "belly chest", "chest neck", "hip thigh", "thigh knee", "knee ankle"),
    *("ankle toe", "chest shoulder", "shoulder elbow", "elbow wrist", "wrist hand"),
)


def build():
    """Make the figure, its sweep and its lamps in an empty file."""
    begin(264, 360, world=(0.03, 0.035, 0.045))
    cloth = plastic("Cloth", (0.10, 0.17, 0.32), 0.8)
    skin = plastic("Skin", (0.50, 0.29, 0.20), 0.45)
    leather = plastic("Leather", (0.05, 0.03, 0.02), 0.35)
    set_inputs(cloth, {"Sheen Weight": 0.6, "Sheen Roughness": 0.4})
    set_inputs(leather, {"Coat Weight": 0.5, "Coat Roughness": 0.15})
    _body(cloth)
    suzanne("Head", skin, (0, -0.03, 1.87), (-6, 0, 0), 0.24, levels=3)
    for side in (-1, 1):
        put("Boot", soft_box(0.15, 0.34, 0.14, 0.05, 4), leather, at=(0.205 * side, -0.09, 0.07))
    belt = rounded([(0.19, 0), (0.205, 0.01), (0.205, 0.06), (0.19, 0.07)])
    put("Belt", lathe(belt, 96), leather, at=(0, 0, 1.02))
    put("Buckle", soft_box(0.08, 0.02, 0.06, 0.008), metal("Brass", (0.8, 0.55, 0.2), 0.25),
        at=(0, -0.205, 1.055))  # fmt: skip
    put("Ball", ball(0.13), metal("Steel", (0.6, 0.62, 0.66), 0.3), at=(0.55, -0.36, 0.13))
    _sweep()
    lamp("Key", "AREA", 110, (-1.8, -2.4, 2.9), (0, 0, 1.3), (1, 0.9, 0.78), size=0.9)
    lamp("Fill", "AREA", 35, (2.4, -1.8, 1.6), (0, 0, 1.1), (0.72, 0.84, 1), size=1.6)
    lamp("Rim", "AREA", 90, (1.4, 1.9, 2.7), (0, 0, 1.5), size=0.5)
    camera(at=(-0.5, -4.6, 1.35), to=(0.04, 0, 1.02), lens=68)


def set_inputs(material, values):
    """Set sockets of a material's shader by name."""
    shader = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    for name, value in values.items():
        shader.inputs[name].default_value = value


def _body(material):
    """Put the figure: the skeleton, its skin, and two subdivisions of it."""
    places, radii, number = [], [], {}
    for side in (1, -1):
        for name, ((x, y, z), radius) in JOINTS.items():
            if side < 0 and x == 0:
                number[name, -1] = number[name, 1]
                continue
            number[name, side] = len(places)
            places.append((side * x, y, z))
            radii.append(radius)
    edges = {
        tuple(sorted((number[a, side], number[b, side])))
        for side in (1, -1)
        for a, b in (bone.split() for bone in BONES)
    }
    data = bpy.data.meshes.new("Body")
    data.from_pydata(places, sorted(edges), [])
    body = put("Body", data, material)
    skin = body.modifiers.new("Skin", "SKIN")
    skin.use_smooth_shade = True
    for vertex, radius in zip(data.skin_vertices[0].data, radii, strict=True):
        vertex.radius = (radius, radius)
    data.skin_vertices[0].data[number["hip", 1]].use_root = True
    divide = body.modifiers.new("Divide", "SUBSURF")
    divide.levels = divide.render_levels = 3


def _sweep():
    import math

    arc = [k * math.pi / 48 for k in range(1, 25)]
    bend = [(-5, 0), (1.4, 0), *((1.4 + math.sin(a), 1 - math.cos(a)) for a in arc), (2.4, 6)]
    faces = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(len(bend) - 1)]
    paper = plastic("Paper", (0.42, 0.40, 0.38), 0.7)
    put("Sweep", mesh([(x, y, z) for y, z in bend for x in (-7, 7)], faces, smooth=True), paper)
