"""numbers -> still_life.blend: everything that Blender can turn into a mesh, on one table.

Look for text, a bevelled curve (the spring), a NURBS surface (the vase), metaballs (the drop), a
collection that is instanced (the pawns), hair particles that are objects (the grass in the pot),
geometry-node instances (the ring of pebbles) and a ball with three material slots.
"""

import math

import bpy
from _stage import ball, camera, cone, lamp, matte, mesh, mirror, orb, put, save, start

start(720, 450, exposure=0.1, world=(0.14, 0.16, 0.2), max_bounces=8, diffuse_bounces=4)
linen, coral, teal = (
    matte("Linen", (0.62, 0.58, 0.52)),
    matte("Coral", (0.70, 0.16, 0.09)),
    matte("Teal", (0.03, 0.25, 0.28)),
)
cream, moss = matte("Cream", (0.76, 0.70, 0.58)), matte("Moss", (0.13, 0.32, 0.06))
ochre, chrome = matte("Ochre", (0.72, 0.38, 0.06)), mirror("Chrome", (0.8, 0.82, 0.85))


def group(name):
    """Return a collection that only instances show: it is not in the scene."""
    return bpy.data.collections.new(name)


# A cloth that curves up into the backdrop.
arc = [k * math.pi / 48 for k in range(1, 25)]
bend = [(-6, 0), (1.8, 0), *((1.8 + math.sin(a), 1 - math.cos(a)) for a in arc), (2.8, 7)]
faces = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(len(bend) - 1)]
put("Cloth", mesh([(x, y, z) for y, z in bend for x in (-9, 9)], faces, smooth=True), linen)

text = bpy.data.curves.new("Text", "FONT")
text.body, text.align_x, text.size = "penumbra", "CENTER", 0.62
text.extrude, text.bevel_depth = 0.05, 0.008
put("Text", text, coral, at=(0, -1.15, 0.058), turn=(62, 0, 0))

spring = bpy.data.curves.new("Spring", "CURVE")
spring.dimensions, spring.bevel_depth, spring.bevel_resolution = "3D", 0.035, 6
spline = spring.splines.new("NURBS")
spline.points.add(112)
for k, point in enumerate(spline.points):
    a = k * math.pi / 8
    point.co = (0.27 * math.cos(a), 0.27 * math.sin(a), 0.036 + 0.02 * a, 1)
spline.use_endpoint_u, spline.order_u = True, 4
put("Spring", spring, ochre, at=(-0.7, 0.3, 0))

bpy.ops.surface.primitive_nurbs_surface_torus_add(location=(-1.6, 0.75, 0))
vase = bpy.context.object.data
outside = [(0.24, -0.05), (0.62, 0.1), (0.44, 0.8), (0.04, 1.0), (0.34, 1.4)]
profile = [*outside, (0.02, 1.0), (0.4, 0.75), (0.5, 0.1)]
for k, point in enumerate(vase.splines[0].points):
    (x, y, _, w), (radius, height) = point.co, profile[k % 8]
    wide = max(abs(x), abs(y)) / radius
    point.co = (x / wide, y / wide, height, w)
vase.resolution_u = vase.resolution_v = 12
vase.materials.append(teal)

drop = bpy.data.metaballs.new("Drop")
drop.resolution = drop.render_resolution = 0.04
for x, z, radius in ((0, 0.28, 0.5), (0.34, 0.5, 0.34), (-0.1, 0.75, 0.34), (0.06, 1.02, 0.24)):
    element = drop.elements.new()
    element.co, element.radius = (x, 0, z), radius
put("Drop", drop, chrome, at=(0.75, 0.85, 0))

striped = ball(0.3)
put("Ball of three slots", striped, [cream, coral, teal], at=(1.6, -0.35, 0.3), turn=(50, 30, 0))
striped.polygons.foreach_set("material_index", [k // 256 % 3 for k in range(len(striped.polygons))])

pawn = group("Pawn")
put("Body", cone(0.13, 0.04, 0.34), cream, inside=pawn)
orb("Head", 0.09, cream, at=(0, 0, 0.38), levels=4, inside=pawn)
for k in range(4):
    place, size = (-0.1 + 0.33 * k, -0.5 + 0.1 * k, 0), [1.1 - 0.1 * k] * 3
    empty = put(f"Pawn {k}", None, at=place, scale=size)
    empty.instance_type, empty.instance_collection = "COLLECTION", pawn

put("Pot", cone(0.24, 0.32, 0.42), coral, at=(1.75, 0.75, 0))
blade = put("Blade", cone(0.02, 0.0, 1.0, 6), moss, inside=group("Grass"))
soil = put("Soil", ball(0.28, 32), teal, at=(1.75, 0.75, 0.42), scale=(1, 1, 0.3))
grass = soil.modifiers.new("Grass", "PARTICLE_SYSTEM").particle_system.settings
grass.type, grass.count, grass.render_type, grass.instance_object = "HAIR", 260, "OBJECT", blade
grass.hair_length, grass.particle_size, grass.size_random = 1, 0.55, 0.6

nodes = bpy.data.node_groups.new("Pebbles", "GeometryNodeTree")
nodes.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
kinds = "MeshCircle", "ObjectInfo", "InstanceOnPoints"
circle, pebble, place = (nodes.nodes.new("GeometryNode" + kind) for kind in kinds)
size, end = nodes.nodes.new("FunctionNodeRandomValue"), nodes.nodes.new("NodeGroupOutput")
circle.inputs["Vertices"].default_value, circle.inputs["Radius"].default_value = 21, 0.52
pebble.inputs["Object"].default_value = orb("Pebble", 0.06, cream, levels=3, inside=group("Stone"))
size.inputs[2].default_value, size.inputs[3].default_value = 0.5, 1.1
for start_, end_ in (
    (circle.outputs["Mesh"], place.inputs["Points"]),
    (pebble.outputs["Geometry"], place.inputs["Instance"]),
    (size.outputs[1], place.inputs["Scale"]),
    (place.outputs["Instances"], end.inputs[0]),
):
    nodes.links.new(start_, end_)
ring = put("Ring of pebbles", mesh([], []), at=(-0.7, 0.3, 0.035))
ring.modifiers.new("Pebbles", "NODES").node_group = nodes

lamp("Key", "AREA", 190, (-3.2, -2.2, 3.6), (0, 0.2, 0.3), (1, 0.86, 0.7), shape="SQUARE", size=1.6)
lamp("Fill", "AREA", 45, (3.6, -2.4, 2.4), (0, 0.2, 0.3), (0.7, 0.84, 1), shape="DISK", size=1.6)
camera(at=(0, -5.6, 2.1), to=(0.05, 0.1, 0.42), lens=50)
save(__file__)
