"""plan -> a block of memory -> plan.  How a frame gets to a process that shares nothing.

Arrays go into one block of shared memory, where all processes read them: they are there once.  The
rest is small and is pickled; Embree's trees are built anew from the arrays.
"""

import io
import mmap
import os
import pickle
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from types import MappingProxyType, ModuleType
from typing import Any
from uuid import uuid4

import numpy as np

from .geometry.accel import remade
from .geometry.part import Part, with_traits

ALIGNED = 64  # bytes between the starts of arrays are multiples of it
BEHIND = 64  # bytes behind each array, which Embree may read


class Block:
    """Memory that other processes map: of an unlinked file, on Windows of a name.

    inherited: file descriptors that they have to inherit; place: what `unpack` takes there.  It is
    gone when nobody has it open: of a name, before the first of them has opened it.
    """

    def __init__(self) -> None:
        self._file: int | None = None
        self._map: mmap.mmap | None = None
        self.place: int | str = f"penumbra-{uuid4()}"
        if sys.platform == "linux":
            self.place = self._file = os.memfd_create("penumbra")
        elif sys.platform != "win32":
            with tempfile.TemporaryFile() as file:
                self.place = self._file = os.dup(file.fileno())
        self.inherited = () if self._file is None else (self._file,)

    def fill(self, parts: Sequence[pickle.PickleBuffer]) -> list[tuple[int, int]]:
        """Copy buffers into it; return where they begin and end."""
        spans, size = [], 0
        for part in parts:
            length = part.raw().nbytes
            spans.append((size, size + length))
            size += -(-(length + BEHIND) // ALIGNED) * ALIGNED
        size = max(size, ALIGNED)
        if self._file is not None:
            # A mapping would end the process where the disk is full; this raises
            os.ftruncate(self._file, size)
            for (begin, _), part in zip(spans, parts, strict=True):
                rest = part.raw()
                while rest.nbytes:
                    written = os.pwrite(self._file, rest, begin)
                    begin, rest = begin + written, rest[written:]
        else:
            self._map = _map(self.place, size)
            whole = np.frombuffer(self._map, np.uint8)
            for (begin, end), part in zip(spans, parts, strict=True):
                whole[begin:end] = np.frombuffer(part.raw(), np.uint8)
        return spans

    def close(self) -> None:
        """Let go of it."""
        self._map = None
        if self._file is not None:
            os.close(self._file)
            self._file = None


def _map(place: int | str, size: int, access: int = mmap.ACCESS_WRITE) -> mmap.mmap:
    if isinstance(place, int):
        return mmap.mmap(place, size, access=access)
    return mmap.mmap(-1, size, tagname=place, access=access)  # type: ignore[call-arg]


def pack(thing: Any, block: Block) -> tuple[bytes, int | str, list[tuple[int, int]]]:
    """Return what `unpack` takes, with the arrays in the block.

    Raises: TypeError, AttributeError or pickle.PicklingError that names what cannot be sent.
    """
    parts: list[pickle.PickleBuffer] = []
    out = io.BytesIO()
    _Pickler(out, 5, buffer_callback=parts.append).dump(thing)
    return out.getvalue(), block.place, block.fill(parts)


def unpack(data: bytes, place: int | str, spans: Sequence[tuple[int, int]]) -> Any:
    """Return what was packed, in another process.

    What is written to the arrays is seen by this process alone.
    """
    size = max((end for _, end in spans), default=0) + BEHIND
    whole = memoryview(_map(place, size, access=mmap.ACCESS_COPY))
    if isinstance(place, int):
        os.close(place)
    return pickle.loads(data, buffers=[whole[begin:end] for begin, end in spans])


class _Pickler(pickle.Pickler):
    """Pickles modules by name, and trees of Embree by what they are made from."""

    def __init__(self, *of: Any, **more: Any) -> None:
        super().__init__(*of, **more)
        self._of_tree: dict[int, Part] = {}  # the first part that has it, by the tree's id

    def reducer_override(self, thing: Any) -> Any:
        """Return how a thing is made again."""
        if isinstance(thing, ModuleType):
            return import_module, (thing.__name__,)
        if isinstance(thing, MappingProxyType):
            return MappingProxyType, (dict(thing),)
        if isinstance(thing, Part):
            first = self._of_tree.setdefault(id(thing.scene), thing)
            if first is not thing:  # other rays see the same tree
                return with_traits, (first, thing.traits)
            return remade, (*thing.made_from, thing.traits, thing.number)
        return NotImplemented
