"""machine -> what it is.  The system check: versions, processor, memory, and does it render?"""

import os
import platform
from importlib import metadata, util
from pathlib import Path

import bpy
import numpy as np

from .. import __version__, core
from ..core.scene import Camera, Instance, Material, Mesh, Node, Scene
from .preferences import LIMITS, read_preferences

# Of the features that numpy finds, those that tell how fast it and Embree will be
_FEATURES = ("SSE42", "AVX", "AVX2", "FMA3", "AVX512F", "AVX512_SKX", "NEON", "ASIMD")


def check() -> list[tuple[str, str]]:
    """Return what a bug report should say, as (name, value); nothing is raised."""
    rows = [
        ("Penumbra", __version__),
        ("Blender", f"{bpy.app.version_string} ({bpy.app.build_platform.decode()})"),
        ("Python", platform.python_version()),
        ("NumPy", np.__version__),
        ("embreex", _version("embreex")),
        ("embreex from", _folder("embreex")),
        ("OpenImageIO", _openimageio()),
        ("System", platform.platform()),
        ("Processor", f"{_processor()}, {os.cpu_count()} threads"),
        ("Features", ", ".join(_features()) or "unknown"),
        ("Cycles' settings", "readable" if hasattr(bpy.types.Scene, "cycles") else "not enabled"),
    ]
    wished = read_preferences()
    if wished is not None:
        limits = ((name.replace("_", " "), getattr(wished, name)) for name in LIMITS)
        said = [f"{name} {f'{limit:g} GB' if limit else 'no limit'}" for name, limit in limits]
        rows.append(("Preferences", ", ".join([f"threads {wished.threads or 'all'}", *said])))
    rows.append(("Test render", _test()))
    return rows


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "without metadata"


def _folder(package: str) -> str:
    found = util.find_spec(package)
    return str(Path(found.origin).parent) if found and found.origin else "missing"


def _openimageio() -> str:
    try:
        import OpenImageIO
    except ImportError as error:
        return f"missing ({error}): image textures cannot be read"
    return OpenImageIO.VERSION_STRING


def _processor() -> str:
    cpus = Path("/proc/cpuinfo")
    if cpus.exists():
        for line in cpus.read_text("utf-8", "replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _features() -> list[str]:
    try:
        from numpy._core._multiarray_umath import __cpu_features__ as found
    except ImportError:  # numpy 1.26
        from numpy.core._multiarray_umath import __cpu_features__ as found
    return [name for name in _FEATURES if found.get(name)]


def _test() -> str:
    """Render a triangle that glows and fills the picture, whose brightness is known."""
    corners = np.array([(-9.0, -9.0, -1.0), (9.0, -9.0, -1.0), (0.0, 18.0, -1.0)])
    mesh = Mesh("Triangle", corners, np.array([(0, 1, 2)], np.int32))
    glow = Node("Emission", inputs={"Color": (1.0, 0.5, 0.25), "Strength": 2.0})
    triangle = Instance("Triangle", mesh, np.eye(3, 4), (Material("Glow", glow),))
    camera = Camera(np.eye(3, 4), (-1.0, 1.0, -1.0, 1.0), 8, 8)
    try:
        plan = core.compile_plan(Scene(camera, (triangle,)), core.Settings(samples=4))
        pixels = core.render(plan).combined()
    except Exception as error:  # noqa: BLE001  (what is wrong is what the user wants to know)
        return f"FAILED: {type(error).__name__}: {error}"
    if not np.allclose(pixels, (2.0, 1.0, 0.5, 1.0), rtol=1e-4):
        return f"FAILED: {pixels.reshape(-1, 4).mean(axis=0).tolist()} instead of (2, 1, 0.5, 1)"
    return "passed"
