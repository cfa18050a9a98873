"""a thing, its size -> bytes.  A process of its own that makes the thing and says what it takes.

`memory.py` starts it, three sizes of each thing.  Each step tells what it leaves resident, and the
largest it was meanwhile, beyond what the process had before it began (Linux: proc(5)).
"""

import ctypes
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

TRIM: Callable[[int], int] = getattr(ctypes.CDLL(None), "malloc_trim", lambda _: 0)
STATUS, RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")
PASSES = ("Depth", "Normal", "Position", "Diffuse Direct", "Diffuse Indirect", "Diffuse Color")


class Steps:
    """What each step takes [bytes]; call it with a name for a step."""

    def __init__(self) -> None:
        TRIM(0)  # what was freed before would be given back within a step
        self.start = _resident()[0]
        self.found: dict[str, dict[str, int]] = {}

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Measure what happens in the block."""
        RESET.write_text("5")  # forget the peak so far
        yield
        peak = _resident()[1]
        TRIM(0)  # what is freed is given back, or it would count as kept
        now = _resident()[0]
        self.found[name] = {"kept": now - self.start, "peak": peak - self.start}


def _resident() -> tuple[int, int]:
    """Return the resident memory of this process, now and at most [bytes]."""
    found = dict(line.split(":", 1) for line in STATUS.read_text().splitlines())
    now, peak = (int(found[name].split()[0]) << 10 for name in ("VmRSS", "VmHWM"))
    return now, peak


# ---- in the core


def _carpet(count: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return about `count` triangles: vertices (V, 3) of a wavy sheet, and corners (F, 3)."""
    side = round((count / 2) ** 0.5)
    x, y = np.meshgrid(*[np.linspace(-1, 1, side + 1, dtype=np.float32)] * 2)
    places = np.stack([x, y, 0.05 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)
    first = (np.arange(side, dtype=np.int32)[:, None] * (side + 1)).repeat(side, axis=1)
    first += np.arange(side, dtype=np.int32)
    corners = np.empty((side * side, 2, 3), np.int32)
    for half, offsets in enumerate(((0, 1, side + 2), (0, side + 2, side + 1))):
        for corner, offset in enumerate(offsets):
            corners[:, half, corner] = first.ravel() + np.int32(offset)
    return places, corners.reshape(-1, 3)


def _scene(mesh: Any, side: int = 64, image: Any = None, passes: tuple[str, ...] = ()) -> Any:
    """Return a scene of one mesh under a sun, seen from above in side x side pixels."""
    from penumbra.core import Camera, Instance, Lamp, Link, Material, Node, Scene
    from penumbra.core.layer import Layer

    colour: Any = (0.7, 0.7, 0.7)
    if image is not None:
        colour = Link(Node("TexImage", "", {}, {"image": image}), "Color")
    matte = Material("Matte", Node("BsdfDiffuse", "", {"Color": colour}))
    upright = np.eye(4)[:3]
    above = upright.copy()
    above[2, 3] = 3.0
    return Scene(
        Camera(above, (-0.4, 0.4, -0.4, 0.4), side, side),
        (Instance(mesh.name, mesh, upright, (matte,)),),
        (Lamp("Sun", "SUN", upright, (1.0, 1.0, 1.0)),),
        None,
        layer=Layer(passes=passes),
    )


def _settings(**more: Any) -> Any:
    from penumbra.core import Settings

    plain = {"use_adaptive_sampling": False, "use_denoising": False, "instance_memory": 64.0}
    return Settings(**(plain | {"samples": 1} | more))


def _triangles(count: int, at: Steps, smooth: bool, hits: float | None) -> int:
    from penumbra.core import Mesh, compile_plan, render

    with at("description"):
        places, corners = _carpet(count)
        normals = np.tile(np.array([0, 0, 1], np.float32), (len(places), 1)) if smooth else None
        scene = _scene(Mesh("Carpet", places, corners, normals))
    with at("tables and Embree"):
        plan = compile_plan(scene, _settings(), hits_expected=hits)
    with at("picture"):
        render(plan, threads=1)
    return len(corners)


def _pixels(count: int, at: Steps, passes: tuple[str, ...]) -> int:
    from penumbra.core import Mesh, compile_plan, render

    side = round(count**0.5)
    plan = compile_plan(_scene(Mesh("Carpet", *_carpet(200)), side, passes=passes), _settings())
    with at("film"):
        picture = render(plan, threads=1)
    with at("pictures"):
        shown = [picture.combined(), *picture.passes()]
    assert len(shown) == 1 + len(passes)
    return side * side


def _written(side: int, kind: str) -> str:
    """Write an image of noise in three channels to a file; return its path."""
    import OpenImageIO as oiio

    path = str(Path(tempfile.gettempdir()) / f"penumbra-{os.getpid()}.tif")
    file = oiio.ImageOutput.create(path)
    file.open(path, oiio.ImageSpec(side, side, 3, kind.removesuffix("32")))
    pixels = np.random.default_rng(1).integers(0, 255, (side, side, 3), np.uint8)
    file.write_image(pixels if kind == "uint8" else pixels.astype(kind))
    file.close()
    return path


def _texels(count: int, at: Steps, kind: str, has_levels: bool) -> int:
    from penumbra.core import Mesh, compile_plan, render
    from penumbra.core.images import ImageSource
    from penumbra.core.scene import ACTIVE_UV, Attribute

    side = round(count**0.5)
    source = ImageSource("Image", path=_written(side, kind))
    places, corners = _carpet(200)
    uv = {ACTIVE_UV: Attribute("POINT", np.ascontiguousarray(8 * places[:, :2]))}
    scene = _scene(Mesh("Carpet", places, corners, attributes=uv), 128, source)
    whole = _settings(samples=1 << 20, use_sample_subset=True, sample_subset_length=1)
    TRIM(0)
    at.start = _resident()[0]
    with at("image"):
        plan = compile_plan(scene, replace(whole, texture_filter=has_levels))
    Path(source.path).unlink()
    assert plan.prepared.textures == 1
    with at("image and its first use"):  # levels are made when something is seen from far
        render(plan, threads=1)
    expected = (1 + has_levels / 3) * side * side * 4 * np.dtype(kind).itemsize
    assert 0.99 < plan.prepared.texture_bytes / expected < 1.01
    return side * side


def _processes(count: int, at: Steps) -> int:
    """Measure what forked processes have for themselves while they work."""
    from penumbra.core import Mesh, compile_plan, render

    scene = _scene(Mesh("Carpet", *_carpet(20_000)), 256)
    plan = compile_plan(scene, _settings(samples=32, workers="PROCESSES"))
    most = [0, 0]

    def look(_progress: Any) -> None:
        found = [_private(pid) for pid in _children()]
        if len(found) == count:
            most[0] = max(most[0], sum(found))

    with at("all"):
        picture = render(plan, threads=count, on_tick=look)
    assert picture.statistics["processes"] == count
    at.found = {"processes": {"kept": most[0], "peak": most[0]}}
    return count


def _children() -> list[int]:
    """Return the processes that threads of this one have started."""
    lists = Path("/proc/self/task").glob("*/children")
    return [int(word) for each in lists for word in each.read_text().split()]


def _private(pid: int) -> int:
    """Return the memory that a process shares with no other [bytes]; 0 if it is gone."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) << 10 for line in lines if line.startswith("Private_"))


# ---- through Blender


def _in_blender(side: int, passes: tuple[str, ...] = ()) -> Any:
    """Return an empty scene that Penumbra renders, one sample for each pixel."""
    import bpy

    import penumbra

    penumbra.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if not hasattr(bpy.context.scene, "penumbra"):
        penumbra.register()
    scene = bpy.context.scene
    scene.render.engine = "PENUMBRA"
    scene.render.resolution_x = scene.render.resolution_y = side
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    scene.penumbra.samples, scene.penumbra.use_denoising = 1, False
    scene.penumbra.use_adaptive_sampling, scene.penumbra.instance_memory = False, 64.0
    for name in passes:
        setattr(scene.view_layers[0], f"use_pass_{name}", True)
    return scene


def _add(scene: Any, data: Any, height: float) -> Any:
    import bpy

    thing = bpy.data.objects.new(data.name, data)
    thing.location.z = height
    scene.collection.objects.link(thing)
    return thing


def _blender_triangles(count: int, at: Steps, full: bool) -> int:
    """Make triangles in Blender; `full`: smooth, and with the tables that many samples pay for."""
    import bpy

    scene = _in_blender(64)
    if full:
        scene.penumbra.samples, scene.penumbra.time_limit = 1 << 20, 1.0
    at.start = _resident()[0]
    with at("Blender's own"):
        places, corners = _carpet(count)
        quads = corners.reshape(-1, 6).take([0, 1, 2, 5], axis=1)
        mesh = bpy.data.meshes.new("Carpet")
        mesh.vertices.add(len(places))
        mesh.vertices.foreach_set("co", places.ravel())
        mesh.loops.add(quads.size)
        mesh.loops.foreach_set("vertex_index", quads.ravel())
        mesh.polygons.add(len(quads))
        mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
        mesh.update(calc_edges=True)
        if full:
            mesh.shade_smooth()
        else:
            mesh.shade_flat()
        count = len(corners)
        del places, corners, quads
        _add(scene, mesh, 0)
        _add(scene, bpy.data.lights.new("Sun", "SUN"), 3)
        scene.camera = _add(scene, bpy.data.cameras.new("Camera"), 3)
        bpy.context.evaluated_depsgraph_get()
    with at("render"):
        bpy.ops.render.render()
    return count


def _blender_pixels(count: int, at: Steps, passes: tuple[str, ...]) -> int:
    import bpy

    side = round(count**0.5)
    scene = _in_blender(side, passes)
    mesh = bpy.data.meshes.new("Carpet")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    _add(scene, mesh, 0)
    scene.camera = _add(scene, bpy.data.cameras.new("Camera"), 3)
    at.start = _resident()[0]
    with at("render"):
        bpy.ops.render.render()
    return side * side


LOBE = ("diffuse_direct", "diffuse_indirect", "diffuse_color")
BLENDER_PASSES = ("z", "normal", "position", *LOBE)
MAKERS: dict[str, Callable[[int, Steps], int]] = {
    "triangle: flat, few samples": lambda n, at: _triangles(n, at, False, None),
    "triangle: flat, many samples": lambda n, at: _triangles(n, at, False, 1e12),
    "triangle: smooth, many samples": lambda n, at: _triangles(n, at, True, 1e12),
    "triangle: flat, few samples, through Blender": lambda n, at: _blender_triangles(n, at, False),
    "triangle: smooth, many samples, through Blender": lambda n, at: _blender_triangles(
        n, at, True
    ),
    "pixel": lambda n, at: _pixels(n, at, ()),
    "pixel: and six passes": lambda n, at: _pixels(n, at, PASSES),
    "pixel: through Blender": lambda n, at: _blender_pixels(n, at, ()),
    "pixel: and six passes, through Blender": lambda n, at: _blender_pixels(n, at, BLENDER_PASSES),
    "texel: 8 bits": lambda n, at: _texels(n, at, "uint8", False),
    "texel: 8 bits, with levels": lambda n, at: _texels(n, at, "uint8", True),
    "texel: float": lambda n, at: _texels(n, at, "float32", False),
    "texel: float, with levels": lambda n, at: _texels(n, at, "float32", True),
    "worker process": _processes,
}


def main() -> None:
    """Make what the arguments say; write what it takes to stdout, as JSON."""
    name, count = sys.argv[1], int(sys.argv[2])
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # Blender prints to stdout
    import penumbra.core  # noqa: F401  what the process is without the thing

    at = Steps()
    units = MAKERS[name](count, at)
    answers.write(json.dumps({"units": units, "start": at.start, "steps": at.found}) + "\n")
    answers.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
