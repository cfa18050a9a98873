"""axis, value -> scene in Blender.  What a picture may have more of, one at a time, for scaling.

Each makes a small scene for a value: samples, pixels, triangles, lights, materials, graphs of
nodes, bounces.  All else stays, so a curve of the time over the values is the cost of that alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .scenes import EXAMPLES

SIDE, SAMPLES, BOUNCES = 96, 16, 4
FILE = "cornell_box"


@dataclass(frozen=True)
class Axis:
    """What grows: `build` makes the scene of a value, and returns how many samples it shall have.

    offset is added to values where they begin at 0, so that they have a logarithm.
    """

    name: str
    values: tuple[int, ...]
    build: Callable[[Any, int], int]
    offset: int = 0


def open_box(bpy: Any, side: int = SIDE, bounces: int = BOUNCES) -> Any:
    """Open the Cornell box with so many pixels and bounces; return the scene."""
    bpy.ops.wm.open_mainfile(filepath=str(EXAMPLES / f"{FILE}.blend"))
    return _prepared(bpy.context.scene, side, bounces)


def _prepared(scene: Any, side: int, bounces: int) -> Any:
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.resolution_percentage = 100
    for options in (scene.penumbra, scene.cycles):
        options.max_bounces = options.diffuse_bounces = bounces
    return scene


def _samples(bpy: Any, value: int) -> int:
    open_box(bpy)
    return value


def _pixels(bpy: Any, value: int) -> int:
    open_box(bpy, round(value**0.5))
    return SAMPLES


def _bounces(bpy: Any, value: int) -> int:
    scene = open_box(bpy, bounces=value)
    for thing in scene.objects:
        for slot in thing.material_slots if thing.type == "MESH" else ():
            for node in slot.material.node_tree.nodes:
                if node.bl_idname == "ShaderNodeBsdfDiffuse":
                    node.inputs["Color"].default_value = (0.95, 0.95, 0.95, 1)
    return SAMPLES


def _stage(bpy: Any, suns: int = 1) -> Any:
    """Return an empty scene with a camera that looks down at the origin, and a sun if asked."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = _prepared(bpy.context.scene, SIDE, BOUNCES)
    camera = _put(bpy, scene, bpy.data.cameras.new("Camera"), (0, -5, 5))
    camera.rotation_euler = (0.785, 0, 0)
    scene.camera = camera
    for _ in range(suns):
        _put(bpy, scene, bpy.data.lights.new("Sun", "SUN"), (0, 0, 9)).rotation_euler = (0.5, 0, 0)
    return scene


def _put(bpy: Any, scene: Any, data: Any, place: tuple[float, float, float]) -> Any:
    thing = bpy.data.objects.new(data.name, data)
    thing.location = place
    scene.collection.objects.link(thing)
    return thing


def _triangles(bpy: Any, value: int) -> int:
    import numpy as np

    from .built.five_million import sheet

    scene = _stage(bpy)
    count = max(1, round((value / 2) ** 0.5))
    x, y = np.meshgrid(*[np.linspace(-3, 3, count + 1, dtype=np.float32)] * 2)
    z = 0.3 * np.sin(3 * x) * np.cos(2 * y) + 0.05 * np.sin(21 * x) * np.sin(19 * y)
    _put(bpy, scene, sheet("Carpet", np.stack([x, y, z], axis=-1)), (0, 0, 0))
    return SAMPLES


def _grid(side: int) -> list[tuple[float, float]]:
    """Return side x side places on a square of 6 m."""
    steps = [6 * (k + 0.5) / side - 3 for k in range(side)]
    return [(x, y) for y in steps for x in steps]


def _lights(bpy: Any, value: int) -> int:
    scene = _stage(bpy, suns=0)
    _put(bpy, scene, _square(bpy, 4.0), (0, 0, 0))
    for number, (x, y) in enumerate(_grid(round(value**0.5))):
        data = bpy.data.lights.new("Lamp", "POINT")
        data.energy = (50 + 100 * (number * 7 % 11) / 11) / value
        _put(bpy, scene, data, (x, y, 0.7))
    return SAMPLES


def _square(bpy: Any, half: float) -> Any:
    mesh = bpy.data.meshes.new("Square")
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
    return mesh


def _tiles(bpy: Any, value: int, graphs: bool) -> int:
    """Make 256 tiles of so many materials: of the same nodes with other numbers, or of others."""
    scene = _stage(bpy)
    made = [_material(bpy, number, number if graphs else 0) for number in range(value)]
    meshes = []
    for material in made:
        meshes.append(_square(bpy, 0.18))
        meshes[-1].materials.append(material)
    for number, (x, y) in enumerate(_grid(16)):
        tile = _put(bpy, scene, meshes[number * 7 % value], (x, y, 0.1 * (number % 3)))
        tile.rotation_euler = (0.2 * (number % 5) - 0.4, 0.2 * (number % 7) - 0.6, 0)
    return SAMPLES


def _material(bpy: Any, number: int, steps: int) -> Any:
    """Return a material; the more steps, the longer its roughness is computed, from the place."""
    material = bpy.data.materials.new("Tile")
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    tree = material.node_tree
    shader = tree.nodes["Principled BSDF"]
    share = number * 5 % 17 / 17
    shader.inputs["Base Color"].default_value = (0.2 + 0.7 * share, 0.8 - 0.6 * share, 0.5, 1)
    shader.inputs["Roughness"].default_value = 0.3 + 0.6 * share
    last = None
    for step in range(steps):
        node = tree.nodes.new("ShaderNodeMath")
        node.operation = "SINE"
        source = last or tree.nodes.new("ShaderNodeNewGeometry").outputs["Parametric"]
        tree.links.new(source, node.inputs[0])
        last = node.outputs[0]
        if step == steps - 1:
            tree.links.new(last, shader.inputs["Roughness"])
    return material


AXES = (
    Axis("samples", (4, 8, 16, 32, 64, 128), _samples),
    Axis("pixels", (32**2, 48**2, 64**2, 96**2, 128**2, 192**2, 256**2), _pixels),
    Axis("triangles", (200, 2_000, 20_000, 200_000, 2_000_000), _triangles),
    Axis("lights", (1, 4, 16, 64, 256, 1024), _lights),
    Axis("materials", (1, 4, 16, 64, 256), lambda bpy, value: _tiles(bpy, value, False)),
    Axis("node graphs", (1, 2, 4, 8, 16, 32), lambda bpy, value: _tiles(bpy, value, True)),
    Axis("bounces", (0, 1, 2, 4, 8, 16), _bounces, offset=1),
)
BY_NAME = {axis.name: axis for axis in AXES}
