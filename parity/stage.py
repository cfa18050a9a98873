"""names and numbers -> objects in bpy.  What the builders of the scenes are handed, as `s`.

The standard stage: a ball on a floor before a wall of coloured stripes, under one square lamp
and a dim sky. What a scene is about is the ball, unless it says otherwise.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from .keys import bent_by_bones, blur, child, empty, instancer, keyed, shape  # noqa: F401
from .nodes import Node, Output

# isort: split
from mathutils import Vector  # which the bpy module brings along

from .nodes import diffuse, node

Vec = Sequence[float]
FLOOR = diffuse(0.55, 0.52, 0.48)
STRIPES = ((0.7, 0.12, 0.08), (0.75, 0.7, 0.6), (0.1, 0.35, 0.12), (0.12, 0.2, 0.6))
SKY = (0.35, 0.40, 0.48)


class Missing(Exception):
    """Blender lacks what was asked for, in this version."""


def start(width: int, height: int) -> None:
    """Empty the file and set the size of the picture."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    bpy.context.scene.render.engine = "CYCLES"


# ---- whole stages


def standard(
    ball_of: Node, lamp_on: bool = True, sky: Vec | Node = SKY, **ball_options: Any
) -> Any:
    """Put the standard stage with a ball of this shader; return the ball."""
    room(sky)
    if lamp_on:
        key()
    return ball(ball_of, **ball_options)


def room(sky: Vec | Node = SKY, floor_of: Node = FLOOR) -> None:
    """Put floor, wall, camera and sky."""
    world(sky)
    floor(floor_of)
    wall()
    camera()


# ---- things


def floor(shader: Node = FLOOR) -> Any:
    """Put the floor, 12 m square."""
    return plane(shader, size=12, name="Floor")


def wall() -> None:
    """Put four coloured stripes behind the ball."""
    for k, colour in enumerate(STRIPES):
        at = (1.25 * (k - 1.5), 2.4, 1.5)
        plane(diffuse(*colour), at=at, turn=(90, 0, 0), size=(1.25, 3), name=f"Stripe {k}")


def ball(
    shader: Node,
    at: Vec = (0, 0, 1),
    radius: float = 1.0,
    segments: int = 48,
    smooth: bool = True,
    name: str = "Ball",
) -> Any:
    """Put a sphere of longitudes and latitudes, its poles up and down."""
    rings = segments // 2
    points = [(0.0, 0.0, radius)]
    for ring in range(1, rings):
        theta = math.pi * ring / rings
        for k in range(segments):
            phi = 2 * math.pi * k / segments
            x, y = math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi)
            points.append((radius * x, radius * y, radius * math.cos(theta)))
    points.append((0.0, 0.0, -radius))
    last, faces = len(points) - 1, []
    for k in range(segments):
        after = (k + 1) % segments
        faces.append((0, 1 + k, 1 + after))
        for ring in range(rings - 2):
            a, b = 1 + ring * segments, 1 + (ring + 1) * segments
            faces.append((a + k, b + k, b + after, a + after))
        bottom = last - segments
        faces.append((bottom + after, bottom + k, last))
    return mesh(name, points, faces, shader, at, smooth=smooth)


def plane(
    shader: Node,
    at: Vec = (0, 0, 0),
    turn: Vec = (0, 0, 0),
    size: float | Vec = 1.0,
    name: str = "Plane",
) -> Any:
    """Put a rectangle that looks up until it is turned by these Euler angles [degrees]."""
    x, y = (size, size) if isinstance(size, int | float) else size
    points = [(-x / 2, -y / 2, 0), (x / 2, -y / 2, 0), (x / 2, y / 2, 0), (-x / 2, y / 2, 0)]
    return mesh(name, points, [(0, 1, 2, 3)], shader, at, turn)


def box(shader: Node, at: Vec, size: Vec, name: str = "Box") -> Any:
    """Put a box of these edge lengths about `at`."""
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    points = [tuple(c * s for c, s in zip(corner, size, strict=True)) for corner in corners]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return mesh(name, points, faces, shader, at)


def mesh(
    name: str,
    points: Sequence[Vec],
    faces: Sequence[Sequence[int]],
    shader: Node,
    at: Vec = (0, 0, 0),
    turn: Vec = (0, 0, 0),
    smooth: bool = False,
) -> Any:
    """Put a mesh of these vertices and polygons."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(points, [], faces)
    data.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    data.materials.append(material(shader))
    thing = bpy.data.objects.new(name, data)
    thing.location = at
    thing.rotation_euler = [math.radians(angle) for angle in turn]
    bpy.context.scene.collection.objects.link(thing)
    return thing


def key(**properties: Any) -> Any:
    """Put the square lamp of the standard stage."""
    return lamp("AREA", 260, (-2.6, -2.8, 4.6), (0, 0, 0.7), **({"size": 2.4} | properties))


def lamp(kind: str, energy: float, at: Vec, to: Vec = (0, 0, 0), **properties: Any) -> Any:
    """Put a lamp that looks from `at` to `to`; return its object, whose data is the lamp."""
    data = bpy.data.lights.new(kind.title(), kind)
    data.energy = energy
    for name, value in properties.items():
        _set(data, name, value)
    return _aim(bpy.data.objects.new(data.name, data), at, to)


def terminator(thing: Any, name: str, value: float) -> None:
    """Set an object's shadow terminator offset: of its own, or of Cycles before Blender 5."""
    if hasattr(thing, f"shadow_terminator_{name}"):
        setattr(thing, f"shadow_terminator_{name}", value)
    else:
        old = {"geometry_offset": "geometry_offset", "shading_offset": "offset"}
        setattr(thing.cycles, f"shadow_terminator_{old[name]}", value)


def camera(
    at: Vec = (0, -7.2, 2.5), to: Vec = (0, 0, 0.95), lens: float = 60.0, **properties: Any
) -> Any:
    """Put the camera."""
    data = bpy.data.cameras.new("Camera")
    data.lens = lens
    for name, value in properties.items():
        _set(data, name, value)
    thing = _aim(bpy.data.objects.new("Camera", data), at, to)
    bpy.context.scene.camera = thing
    return thing


def world(sky: Vec | Node = SKY) -> Any:
    """Set the world: a colour, or the shader of its background."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    shader = sky if isinstance(sky, Node) else node("Background", Color=sky)
    tree(_with_nodes(scene.world), shader, "OutputWorld")
    return scene.world


def transparent_film() -> None:
    """Let the camera see alpha 0 where it sees the world."""
    bpy.context.scene.render.film_transparent = True


def collection(name: str, *members: Any) -> Any:
    """Move objects into a collection of their own; return its layer collection."""
    scene = bpy.context.scene
    group = bpy.data.collections.new(name)
    scene.collection.children.link(group)
    for thing in members:
        scene.collection.objects.unlink(thing)
        group.objects.link(thing)
    return bpy.context.view_layer.layer_collection.children[name]


def linked(name: str, members: Sequence[Any], state: str = "INCLUDE") -> Any:
    """Return a collection for light linking that includes or excludes these objects."""
    group = bpy.data.collections.new(name)
    for thing in members:
        group.objects.link(thing)
    for each in group.collection_objects:
        each.light_linking.link_state = state
    return group


# ---- shaders


def material(shader: Node) -> Any:
    """Return a material of this shader."""
    made = bpy.data.materials.new(shader.kind)
    tree(_with_nodes(made), shader, "OutputMaterial")
    return made


def light_nodes(thing: Any, shader: Node) -> Any:
    """Give a lamp a node tree; return the lamp's object."""
    tree(_with_nodes(thing.data), shader, "OutputLight")
    return thing


def tree(planted: Any, shader: Node, output: str) -> None:
    """Plant a shader in an empty node tree; raises Missing."""
    planted.nodes.clear()
    made: dict[int, Any] = {}
    end = planted.nodes.new(f"ShaderNode{output}")
    planted.links.new(_plant(planted, shader, made).outputs[0], end.inputs["Surface"])


def link(thing: Any) -> None:
    """Put an object that was made elsewhere."""
    bpy.context.scene.collection.objects.link(thing)


def displace(thing: Any, displacement: Node) -> None:
    """Displace what shows an object's first material."""
    planted = thing.data.materials[0].node_tree
    end = next(n for n in planted.nodes if n.bl_idname == "ShaderNodeOutputMaterial")
    made = _plant(planted, displacement, {}).outputs[0]
    planted.links.new(made, end.inputs["Displacement"])


def _plant(planted: Any, spec: Node, made: dict[int, Any]) -> Any:
    if id(spec) in made:
        return made[id(spec)]
    try:
        new = planted.nodes.new(f"ShaderNode{spec.kind}")
    except RuntimeError:
        raise Missing(f"there is no node {spec.kind}") from None
    made[id(spec)] = new
    for name, value in spec.properties.items():
        _set(new, name, value)
    for name, value in spec.inputs.items():
        socket = _socket(new, name)
        source = value.node if isinstance(value, Output) else value
        if isinstance(source, Node):
            outputs = _plant(planted, source, made).outputs
            planted.links.new(outputs[value.name if value is not source else 0], socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1.0)
        else:
            socket.default_value = value
    return new


def _socket(new: Any, name: str) -> Any:
    for wanted in (name, name.replace("_", " ")):
        for socket in new.inputs:
            if wanted == socket.identifier or wanted == socket.name:
                return socket
    raise Missing(f"{new.bl_idname} has no input {name}")


def _set(item: Any, name: str, value: Any) -> None:
    """Set a property; raises Missing if this Blender lacks it, or this choice for it."""
    if not hasattr(item, name):
        raise Missing(f"{item.bl_rna.identifier} has no {name}")
    try:
        setattr(item, name, value)
    except TypeError as error:
        raise Missing(f"{item.bl_rna.identifier}.{name}: {error}") from None


def _with_nodes(datablock: Any) -> Any:
    if datablock.node_tree is None or bpy.app.version < (5, 0):
        datablock.use_nodes = True
    return datablock.node_tree


# ---- pictures


def sky_picture(name: str) -> Any:
    """Return an image (64 x 32) of a sky: bluish above, dark below, a small, bright sun."""
    width, height = 64, 32
    picture = np.empty((height, width, 4), np.float32)
    up = np.linspace(-1, 1, height, dtype=np.float32)[:, None]
    around = np.sin(np.linspace(0, 2 * np.pi, width, endpoint=False, dtype=np.float32))
    picture[..., 0] = 0.15 + 0.15 * np.maximum(up, 0) + 0.05 * around
    picture[..., 1] = 0.17 + 0.25 * np.maximum(up, 0)
    picture[..., 2] = 0.15 + 0.45 * np.maximum(up, 0) - 0.05 * around
    picture[: height // 2, :, :3] *= 0.5
    picture[23:25, 21:23, :3] = (90, 80, 60)  # [row from the bottom, column]
    picture[..., 3] = 1
    image = bpy.data.images.new(name, width, height, float_buffer=True)
    image.colorspace_settings.name = "Linear Rec.709"
    image.pixels.foreach_set(picture.ravel())
    image.filepath_raw = str(Path(bpy.app.tempdir) / f"{name}.exr")
    image.file_format = "OPEN_EXR"
    image.save()
    return bpy.data.images.load(image.filepath_raw)


def _aim(thing: Any, at: Vec, to: Vec) -> Any:
    thing.location = at
    thing.rotation_euler = (Vector(to) - Vector(at)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(thing)
    return thing
