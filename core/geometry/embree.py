"""vertices, corners -> Embree's tree.  Building through Embree's own C interface.

embreex answers queries without the interpreter lock, but it uploads triangle by triangle through
Python (0.4 us each) and builds under the lock.  The library that its wheel carries shares our
arrays instead and builds on all cores while Python goes on.  The scene stays embreex's own: its
handle is read from the object, whose published layout (rtcore_scene.pxd) is verified first.
Where any of this fails, `open_library` or `handle` return None and `accel` uploads through
embreex.
"""

import ctypes
import sys
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene import Cancelled

# embree4/rtcore_*.h
TRIANGLE, INDEX, VERTEX, UINT3, FLOAT3 = 0, 0, 1, 0x5003, 0x9003
INSTANCE, AFFINE_BY_ROWS, ROBUST = 121, 0x9134, 4
LOW, MEDIUM = 0, 1

TICK = 0.05  # seconds between two looks at the caller

PADDING = 4  # floats that Embree may read past the last vertex

_POINTER, _UINT, _SIZE = ctypes.c_void_p, ctypes.c_uint, ctypes.c_size_t
_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "rtcGetSceneDevice": (_POINTER, (_POINTER,)),
    "rtcReleaseDevice": (None, (_POINTER,)),
    "rtcGetDeviceError": (ctypes.c_int, (_POINTER,)),
    "rtcNewGeometry": (_POINTER, (_POINTER, ctypes.c_int)),
    "rtcSetSharedGeometryBuffer": (
        None,
        (_POINTER, ctypes.c_int, _UINT, ctypes.c_int, _POINTER, _SIZE, _SIZE, _SIZE),
    ),
    "rtcSetGeometryBuildQuality": (None, (_POINTER, ctypes.c_int)),
    "rtcCommitGeometry": (None, (_POINTER,)),
    "rtcAttachGeometry": (_UINT, (_POINTER, _POINTER)),
    "rtcReleaseGeometry": (None, (_POINTER,)),
    "rtcSetSceneBuildQuality": (None, (_POINTER, ctypes.c_int)),
    "rtcCommitScene": (None, (_POINTER,)),
    "rtcNewScene": (_POINTER, (_POINTER,)),
    "rtcReleaseScene": (None, (_POINTER,)),
    "rtcSetSceneFlags": (None, (_POINTER, ctypes.c_int)),
    "rtcSetGeometryTimeStepCount": (None, (_POINTER, _UINT)),
    "rtcSetGeometryInstancedScene": (None, (_POINTER, _POINTER)),
    "rtcSetGeometryTransform": (None, (_POINTER, _UINT, ctypes.c_int, _POINTER)),
    "rtcIntersect16": (None, (_POINTER,) * 4),
    "rtcOccluded16": (None, (_POINTER,) * 4),
}


@lru_cache(maxsize=1)
def open_library(package: str) -> ctypes.CDLL | None:
    """Return the Embree library that embreex, whose package is the folder `package`, runs on.

    Where Blender links Embree itself, the loader gives embreex that library and not the wheel's:
    symbols of the program come first on Linux, a loaded DLL of the same name on Windows.  Handles
    of one library hang in the other, so the loader is asked in the same way.
    """
    folder = Path(package)
    patterns = {
        "win32": ((folder.parent / "embreex.libs", "embree4*.dll"), (folder, "embree4*.dll")),
        "darwin": ((folder / ".dylibs", "libembree4*.dylib"),),
    }.get(sys.platform, ((folder.parent / "embreex.libs", "libembree4*.so*"),))
    paths = [path for place, pattern in patterns for path in sorted(place.glob(pattern))]
    names: list[str | None] = [str(path) for path in paths]
    if sys.platform == "linux":
        names.insert(0, None)
    if sys.platform == "win32":
        names = [path.name for path in paths]
    for name in names:
        try:
            library = ctypes.CDLL(name)
            for symbol, (result, arguments) in _SIGNATURES.items():
                function = getattr(library, symbol)
                function.restype, function.argtypes = result, arguments
        except (OSError, AttributeError):
            continue
        return library
    return None


def handle(scene: Any, device: Any) -> int | None:
    """Return the RTCScene of an embreex scene made on `device`, None if its layout is unknown.

    The object holds {RTCScene, int is_committed, device} after Python's header: if the second
    and third are found where they belong, so is the first.
    """
    header = object.__basicsize__
    if type(scene).__basicsize__ != header + 24:
        return None
    words = (_SIZE * 3).from_address(id(scene) + header)
    mark, before = 0x5EED, scene.is_committed
    scene.is_committed = mark
    seen = words[1] & 0xFFFFFFFF
    scene.is_committed = before
    return int(words[0]) if seen == mark and words[2] == id(device) and words[0] else None


def build(
    library: ctypes.CDLL,
    owner: Any,
    scene: int,
    vertices: NDArray[np.float32],
    corners: NDArray[np.int32],
    is_quick: bool,
    should_stop: Callable[[], bool],
) -> None:
    """Build the tree of `scene`, the handle of embreex's scene `owner`, over shared triangles.

    vertices (V, 3) with PADDING floats behind them, corners (F, 3), C-contiguous; both must
    outlive the scene.  `is_quick` trades speed of rays for speed of building.
    Raises: Cancelled within TICK; MemoryError if Embree reports an error.
    """
    device = library.rtcGetSceneDevice(scene)
    geometry = library.rtcNewGeometry(device, TRIANGLE)
    share = library.rtcSetSharedGeometryBuffer
    share(geometry, VERTEX, 0, FLOAT3, vertices.ctypes.data, 0, 12, len(vertices))
    share(geometry, INDEX, 0, UINT3, corners.ctypes.data, 0, 12, len(corners))
    # Both must ask for it, or Embree does not take its quick (Morton) builder.
    quality = LOW if is_quick else MEDIUM
    library.rtcSetGeometryBuildQuality(geometry, quality)
    library.rtcSetSceneBuildQuality(scene, quality)
    library.rtcCommitGeometry(geometry)
    library.rtcAttachGeometry(scene, geometry)
    library.rtcReleaseGeometry(geometry)
    library.rtcReleaseDevice(device)
    _commit(library, scene, len(corners), should_stop, owner, vertices, corners)


def new_scene(
    library: ctypes.CDLL,
    scene: int,
    vertices: list[NDArray[np.float32]],
    corners: NDArray[np.int32],
    should_stop: Callable[[], bool],
) -> int:
    """Return a scene, on the device of `scene`, of shared triangles that change with time.

    vertices (V, 3) at equal steps from time 0 to 1, one if they do not change, with PADDING floats
    behind each, and corners (F, 3) must outlive it.  Raises: see `build`.
    """
    device = library.rtcGetSceneDevice(scene)
    made: int = library.rtcNewScene(device)
    library.rtcSetSceneFlags(made, ROBUST)
    geometry = library.rtcNewGeometry(device, TRIANGLE)
    library.rtcSetGeometryTimeStepCount(geometry, len(vertices))
    share = library.rtcSetSharedGeometryBuffer
    for step, each in enumerate(vertices):
        share(geometry, VERTEX, step, FLOAT3, each.ctypes.data, 0, 12, len(each))
    share(geometry, INDEX, 0, UINT3, corners.ctypes.data, 0, 12, len(corners))
    library.rtcCommitGeometry(geometry)
    library.rtcAttachGeometry(made, geometry)
    library.rtcReleaseGeometry(geometry)
    library.rtcReleaseDevice(device)
    _commit(library, made, len(corners), should_stop, vertices, corners)
    return made


def build_instances(
    library: ctypes.CDLL,
    owner: Any,
    scene: int,
    instances: list[tuple[int, NDArray[np.float32]]],
    should_stop: Callable[[], bool],
) -> None:
    """Build `scene`, the handle of embreex's scene `owner`, of instances of other scenes.

    Each has a scene and affines (steps + 1, 12) from time 0 to 1, between which it goes straight;
    their numbers are those in the list.  Raises: see `build`.
    """
    device = library.rtcGetSceneDevice(scene)
    for shown, affines in instances:
        geometry = library.rtcNewGeometry(device, INSTANCE)
        library.rtcSetGeometryInstancedScene(geometry, shown)
        library.rtcSetGeometryTimeStepCount(geometry, len(affines))
        for step, affine in enumerate(affines):
            library.rtcSetGeometryTransform(geometry, step, AFFINE_BY_ROWS, affine.ctypes.data)
        library.rtcCommitGeometry(geometry)
        library.rtcAttachGeometry(scene, geometry)
        library.rtcReleaseGeometry(geometry)
    library.rtcReleaseDevice(device)
    _commit(library, scene, len(instances), should_stop, owner)


def _commit(
    library: ctypes.CDLL, scene: int, count: int, should_stop: Callable[[], bool], *kept: Any
) -> None:
    errors = []

    def commit(*kept_alive: Any) -> None:
        device = library.rtcGetSceneDevice(scene)
        library.rtcCommitScene(scene)
        errors.append(library.rtcGetDeviceError(device))
        library.rtcReleaseDevice(device)

    # A build cannot be broken off (its progress monitor crashes Embree 4.4.0 when it says no):
    # one that nobody waits for any more ends in its own time, on a thread that keeps it alive.
    builder = threading.Thread(target=commit, args=kept, name="penumbra-build", daemon=True)
    builder.start()
    while builder.is_alive():
        builder.join(TICK)
        if should_stop() and builder.is_alive():
            raise Cancelled
    if errors != [0]:
        raise MemoryError(f"Embree could not build its tree over {count} triangles or objects")
