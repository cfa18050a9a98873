"""noisy picture, guides -> picture.  What OpenImageDenoise makes of it, where Blender brings it.

Blender's own files hold the library, loaded already; it is called through its C interface, so that
nothing is shipped and nothing downloaded.  Colours and normals of the first surfaces tell it edges
from noise.  Biased: it guesses.  Source: Afra 2024, "Intel Open Image Denoise".
"""

import ctypes
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32

Image = NDArray[np.float32]  # (H, W, 3)

# By which names the library is known to the system's loader once Blender has loaded it
NAMES = {
    "win32": ("OpenImageDenoise.dll",),
    "darwin": ("@rpath/libOpenImageDenoise.2.dylib", "libOpenImageDenoise.2.dylib"),
}
LINUX = ("libOpenImageDenoise.so.2",)
VARIABLE = "PENUMBRA_OIDN"  # in the environment: another library's file, or none if it is empty

QUALITIES = {"FAST": 4, "BALANCED": 5, "HIGH": 6}
CPU, FLOAT3 = 1, 3  # OIDN_DEVICE_TYPE_CPU, OIDN_FORMAT_FLOAT3

_POINTER, _TEXT, _SIZE = ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t
_FUNCTIONS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "oidnNewDevice": (_POINTER, (ctypes.c_int,)),
    "oidnSetDeviceInt": (None, (_POINTER, _TEXT, ctypes.c_int)),
    "oidnSetDeviceBool": (None, (_POINTER, _TEXT, ctypes.c_bool)),
    "oidnCommitDevice": (None, (_POINTER,)),
    "oidnGetDeviceError": (ctypes.c_int, (_POINTER, ctypes.POINTER(_TEXT))),
    "oidnReleaseDevice": (None, (_POINTER,)),
    "oidnNewFilter": (_POINTER, (_POINTER, _TEXT)),
    "oidnSetSharedFilterImage": (
        None,
        (_POINTER, _TEXT, _POINTER, ctypes.c_int, _SIZE, _SIZE, _SIZE, _SIZE, _SIZE),
    ),
    "oidnSetFilterBool": (None, (_POINTER, _TEXT, ctypes.c_bool)),
    "oidnSetFilterInt": (None, (_POINTER, _TEXT, ctypes.c_int)),
    "oidnCommitFilter": (None, (_POINTER,)),
    "oidnExecuteFilter": (None, (_POINTER,)),
    "oidnReleaseFilter": (None, (_POINTER,)),
}


class DenoiseError(RuntimeError):
    """The library refused; the message is its own."""


@dataclass(frozen=True)
class Denoising:
    """How a picture is denoised: by which guides, whether they are cleaned before, how well."""

    has_albedo: bool
    has_normal: bool
    prefilter: str  # NONE, FAST or ACCURATE
    quality: str

    @property
    def guides(self) -> tuple[str, ...]:
        """Names of the film's sums that guide it."""
        asked = {"albedo": self.has_albedo, "bearing": self.has_normal}
        return tuple(name for name, is_asked in asked.items() if is_asked)


@cache
def library() -> Any:
    """Return the library with its functions declared, None if it cannot be had."""
    names = NAMES.get(sys.platform, LINUX)
    if VARIABLE in os.environ:
        names = tuple(filter(None, [os.environ[VARIABLE]]))
    for name in names:
        try:
            found = ctypes.CDLL(name)
            for function, (result, arguments) in _FUNCTIONS.items():
                getattr(found, function).restype = result
                getattr(found, function).argtypes = arguments
        except (OSError, AttributeError):
            continue
        return found
    return None


def is_there() -> bool:
    """Tell whether pictures can be denoised."""
    return library() is not None


def denoise(
    colour: Image, albedo: Image | None, normal: Image | None, how: Denoising, threads: int = 0
) -> Image:
    """Return a picture (H, W, 3) without its noise; albedo and normal are its guides.

    Raises: DenoiseError if the library refuses.
    """
    with _device(threads) as device:
        guides = {"albedo": albedo, "normal": normal}
        images = {name: np.ascontiguousarray(g, F32) for name, g in guides.items() if g is not None}
        if how.prefilter == "ACCURATE":
            images = {name: _filtered(device, {name: g}, how, {}) for name, g in images.items()}
        flags = {"hdr": True, "cleanAux": bool(images) and how.prefilter != "FAST"}
        images["color"] = np.ascontiguousarray(colour, F32)
        return _filtered(device, images, how, flags)


@contextmanager
def _device(threads: int) -> Iterator[Any]:
    lib = library()
    if lib is None:
        raise DenoiseError("OpenImageDenoise is not there")
    device = lib.oidnNewDevice(CPU)
    try:
        lib.oidnSetDeviceInt(device, b"numThreads", threads)
        lib.oidnSetDeviceBool(device, b"setAffinity", False)
        lib.oidnCommitDevice(device)
        _check(device)
        yield device
    finally:
        lib.oidnReleaseDevice(device)


def _filtered(
    device: Any, images: dict[str, Image], how: Denoising, flags: dict[str, bool]
) -> Image:
    """Return what a filter makes of images by their names."""
    lib = library()
    some = next(iter(images.values()))
    height, width, _ = some.shape
    out = np.empty_like(some)
    worker = lib.oidnNewFilter(device, b"RT")
    try:
        for name, image in {**images, "output": out}.items():
            place = image.ctypes.data, FLOAT3, width, height, 0, 0, 0
            lib.oidnSetSharedFilterImage(worker, name.encode(), *place)
        for flag, value in flags.items():
            lib.oidnSetFilterBool(worker, flag.encode(), value)
        lib.oidnSetFilterInt(worker, b"quality", QUALITIES[how.quality])
        lib.oidnCommitFilter(worker)
        lib.oidnExecuteFilter(worker)
        _check(device)
    finally:
        lib.oidnReleaseFilter(worker)
    return out


def _check(device: Any) -> None:
    message = _TEXT()
    if library().oidnGetDeviceError(device, ctypes.byref(message)):
        raise DenoiseError((message.value or b"unknown error").decode("utf-8", "replace"))
