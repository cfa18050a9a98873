"""variant -> ten things on a floor under a lamp and a pale sky, of the materials of this variant.

CONSTANT  plain Principled shaders;
IMAGE     each with a picture as its colour;
PBR       each with a set of five pictures (colour, roughness, metallic, specular, occlusion) and a
          normal map, 2048 x 2048 each, of three sets;
PROCEDURAL  each with noise, cells, waves and a ramp, and a bump of noise;
MANY      200 materials of all these kinds, all in view;
ONE       the same 200, of which the camera sees one.
"""

import os
from pathlib import Path

import bpy
import numpy as np

from ...examples._stage import box, camera, lamp, put
from . import fingerprint
from .shapes import begin, lathe, rounded, soft_box

SIZE = 2048  # of the pictures
CACHE = Path(__file__).resolve().parent.parent / "cache"
KINDS = ("CONSTANT", "IMAGE", "PBR", "PROCEDURAL")
MANY = 200


def build(variant):
    """Make the scene of a variant in an empty file."""
    begin(320, 240, world=(0.25, 0.28, 0.33))
    if variant in KINDS:
        made = [_material(variant, number) for number in range(11)]
        _things(made)
    else:
        made = [_material(KINDS[number % 4], number) for number in range(MANY)]
        _tiles(made, variant == "ONE")
    lamp("Lamp", "AREA", 320, (-2.5, -3.0, 4.5), (0, 0, 0.5), size=2.2)
    camera(at=(0, -7.0, 3.0), to=(0, 0, 0.55), lens=45)


def _things(materials):
    put("Floor", _unwrapped(box(12, 12, 0.1), 1.0), materials[10], at=(0, 0, -0.05))
    pot = [(0, 0), (0.45, 0), (0.62, 0.25), (0.5, 0.62), (0.3, 0.75), (0, 0.78)]
    for number in range(10):
        x, y = (number % 5 - 2) * 1.15, (number // 5 - 0.5) * 1.6
        shape = soft_box(0.8, 0.8, 0.8, 0.12, 4) if number % 2 else lathe(rounded(pot), 64)
        height = 0.4 if number % 2 else 0.0
        put(f"Thing {number}", _unwrapped(shape, 1.5), materials[number], at=(x, y, height),
            turn=(0, 0, 25 * number))  # fmt: skip


def _tiles(materials, is_one):
    """Put a floor of tiles, a material each; if only one is to be seen, the others lie behind."""
    for number, material in enumerate(materials):
        x, y = (number % 20 - 9.5) * 0.6, (number // 20 - 4.5) * 0.9
        if is_one and number:
            y -= 60
        size = 12 if is_one and not number else 0.58
        at = (0, 0, -0.05) if is_one and not number else (x, y, -0.05)
        put(f"Tile {number}", _unwrapped(box(size, size, 0.1), 1.0), material, at=at)


def _unwrapped(mesh, scale):
    """Give a mesh a UV map: each face as seen along the axis it looks along most."""
    uv = mesh.uv_layers.new(name="UV")
    numbers = np.empty((len(mesh.loops), 2), np.float32)
    for face in mesh.polygons:
        axis = max(range(3), key=lambda k: abs(face.normal[k]))
        for corner in face.loop_indices:
            place = mesh.vertices[mesh.loops[corner].vertex_index].co
            numbers[corner] = [place[k] * scale for k in range(3) if k != axis]
    uv.data.foreach_set("uv", numbers.ravel())
    return mesh


# ---- materials


def _material(kind, number):
    """Return the number-th material of a kind; colours and scales differ, pictures repeat."""
    material = bpy.data.materials.new(f"{kind.title()} {number}")
    material.use_nodes = True
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    hue = np.array([0.15, 0.12, 0.1]) + 0.6 * np.random.default_rng(number).random(3)
    shader.inputs["Base Color"].default_value = (*hue, 1)
    shader.inputs["Roughness"].default_value = 0.3 + 0.4 * (number % 7) / 7
    if kind == "IMAGE":
        _show(tree, shader.inputs["Base Color"], number % 3, "colour")
    elif kind == "PBR":
        _pbr(tree, shader, number % 3)
    elif kind == "PROCEDURAL":
        _procedural(tree, shader, 2.0 + number % 5)
    return material


def _node(tree, kind, **choices):
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in choices.items():
        setattr(node, name, value)
    return node


def _show(tree, socket, which, name):
    node = _node(tree, "TexImage", image=_image(which, name))
    tree.links.new(node.outputs["Color"], socket)
    return node


def _pbr(tree, shader, which):
    multiply = _node(tree, "Mix", data_type="RGBA", blend_type="MULTIPLY")
    multiply.inputs[0].default_value = 1.0
    _show(tree, multiply.inputs[6], which, "colour")
    _show(tree, multiply.inputs[7], which, "occlusion")
    tree.links.new(multiply.outputs[2], shader.inputs["Base Color"])
    for name in ("Roughness", "Metallic", "Specular IOR Level"):
        _show(tree, shader.inputs[name], which, name.split()[0].lower())
    bend = _node(tree, "NormalMap")
    _show(tree, bend.inputs["Color"], which, "normal")
    tree.links.new(bend.outputs["Normal"], shader.inputs["Normal"])


def _procedural(tree, shader, scale):
    link, where = tree.links.new, _node(tree, "TexCoord").outputs["Object"]
    noise, cells = _node(tree, "TexNoise"), _node(tree, "TexVoronoi")
    wave, ramp, mix = _node(tree, "TexWave"), _node(tree, "ValToRGB"), _node(tree, "Mix")
    mix.data_type = "RGBA"
    for node in (noise, cells, wave):
        node.inputs["Scale"].default_value = scale
        link(where, node.inputs["Vector"])
    noise.inputs["Detail"].default_value = 6.0
    wave.inputs["Distortion"].default_value = 4.0
    ramp.color_ramp.elements[0].color = (0.5, 0.2, 0.08, 1)
    ramp.color_ramp.elements[1].color = (0.15, 0.3, 0.55, 1)
    link(noise.outputs[0], ramp.inputs["Fac"])
    link(cells.outputs["Distance"], mix.inputs[0])
    link(ramp.outputs["Color"], mix.inputs[6])
    link(wave.outputs["Color"], mix.inputs[7])
    link(mix.outputs[2], shader.inputs["Base Color"])
    link(noise.outputs[0], shader.inputs["Roughness"])
    bump = _node(tree, "Bump")
    bump.inputs["Distance"].default_value = 0.02
    link(noise.outputs[0], bump.inputs["Height"])
    link(bump.outputs["Normal"], shader.inputs["Normal"])


# ---- pictures


def _image(which, name):
    title = f"{name} {which}"
    if title not in bpy.data.images:
        image = bpy.data.images.load(str(_picture(which, name)))
        image.name = title
        image.colorspace_settings.name = "sRGB" if name == "colour" else "Non-Color"
    return bpy.data.images[title]


def _picture(which, name):
    """Return the path of a picture of a set; the set is written if it is not there."""
    code = fingerprint("materials").hex()[:16]
    path = CACHE / f"{name}-{which}-{code}.png"
    if not path.exists():
        CACHE.mkdir(exist_ok=True)
        for each, pixels in picture_set(which).items():
            _write(CACHE / f"{each}-{which}-{code}.png", pixels)
    return path


def _write(path, pixels):
    import OpenImageIO as oiio

    partial = path.with_name(f"{os.getpid()}.partial.png")
    spec = oiio.ImageSpec(*pixels.shape[1::-1], pixels.shape[2], "uint8")
    output = oiio.ImageOutput.create(str(partial))
    if not output or not output.open(str(partial), spec) or not output.write_image(pixels):
        raise OSError(f"{partial} cannot be written: {oiio.geterror()}")
    output.close()
    partial.replace(path)


def picture_set(which):
    """Return the pictures (SIZE, SIZE, channels) uint8 of a set: stones with joints, and grain."""
    random = np.random.default_rng(which)
    grain = random.random((SIZE, SIZE), np.float32)
    soft = sum(np.roll(grain, shift, axis) for shift in (-2, -1, 1, 2) for axis in (0, 1)) / 8
    stones = 8 * (which + 1)
    y, x = np.mgrid[0:SIZE, 0:SIZE].astype(np.float32) * (stones / SIZE)
    x = x + 0.5 * (np.floor(y) % 2)
    edge = np.minimum(np.abs(x % 1 - 0.5), np.abs(y % 1 - 0.5))
    joint = np.clip((np.maximum(np.abs(x % 1 - 0.5), np.abs(y % 1 - 0.5)) - 0.44) * 25, 0, 1)
    tint = random.random((stones, stones + 1, 3), np.float32)
    stone = tint[np.floor(y).astype(int) % stones, np.floor(x).astype(int)]
    height = (1 - joint) * (0.7 + 0.3 * soft)
    slope = np.stack([np.roll(height, 2, 1) - height, np.roll(height, 2, 0) - height], -1) * 0.8
    normal = np.concatenate([0.5 + slope, np.ones((SIZE, SIZE, 1), np.float32)], axis=-1)
    colour = (0.25 + 0.5 * stone + 0.2 * soft[..., None]) * (1 - 0.6 * joint[..., None])
    found = {
        "colour": colour,
        "roughness": 0.35 + 0.3 * soft + 0.2 * joint,
        "metallic": (stone[..., 0] > 0.7) * (1 - joint),
        "specular": 0.4 + 0.3 * edge,
        "occlusion": 1 - 0.6 * joint,
        "normal": normal,
    }
    return {
        name: np.rint(np.clip(np.atleast_3d(values), 0, 1) * 255).astype(np.uint8)
        for name, values in found.items()
    }
