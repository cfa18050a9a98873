"""light linking collections -> sets of receivers and of blockers.  As Blender makes them.

Its depsgraph_light_linking.cc makes them for Cycles.  A light or a glowing object may name a
collection of receivers and one of blockers, of which each item is included or excluded.  Objects
that are linked by the same emitters in the same way are one set, of at most 63 besides that of
all others, number 0.  An emitter then has two masks of sets: those included, or all if none is,
less those excluded.
"""

from collections.abc import Iterable, Iterator

import bpy

from ...core.scene import EVERY_SET

MOST = 64  # collections, and sets with that of all others

Address = int  # of an original datablock


class Linking:
    """Which set each object belongs to, and which sets each collection stands for.

    `kind` is "receiver" or "blocker".
    """

    def __init__(self, objects: Iterable[bpy.types.Object], kind: str) -> None:
        self._name = f"{kind}_collection"
        self._set: dict[Address, int] = {}
        self._mask: dict[Address, int] = {}

        # Say for each object which collections include and which exclude it.
        bits: dict[Address, int] = {}
        states: dict[Address, tuple[int, int]] = {}
        for emitter in objects:
            collection = getattr(emitter.light_linking, self._name)
            if collection is None or collection.as_pointer() in bits or len(bits) == MOST:
                continue
            bit = bits[collection.as_pointer()] = 1 << len(bits)
            for address, state in _items(collection):
                include, exclude = states.get(address, (0, 0))
                if state == "EXCLUDE":
                    states[address] = include & ~bit, exclude | bit
                else:
                    states[address] = include | bit, exclude & ~bit

        # Number the different answers.
        sets: dict[tuple[int, int], int] = {}
        for address, state in states.items():
            if state in sets or len(sets) < MOST - 1:
                self._set[address] = sets.setdefault(state, len(sets) + 1)
        for address, bit in bits.items():
            included = sum(1 << n for (include, _), n in sets.items() if include & bit)
            excluded = sum(1 << n for (_, exclude), n in sets.items() if exclude & bit)
            self._mask[address] = (included or EVERY_SET) & ~excluded

    def set_of(self, object: bpy.types.Object, parent: bpy.types.Object | None = None) -> int:
        """Return the set of an object; that of a `parent` that makes it goes first."""
        number = self._set.get(parent.original.as_pointer(), 0) if parent else 0
        return number or self._set.get(object.original.as_pointer(), 0)

    def mask_of(self, object: bpy.types.Object) -> int:
        """Return the mask of the sets that an object lights, or that cast shadows of its light."""
        collection = getattr(object.original.light_linking, self._name)
        return (
            EVERY_SET if collection is None else self._mask.get(collection.as_pointer(), EVERY_SET)
        )


def _items(collection: bpy.types.Collection) -> Iterator[tuple[Address, str]]:
    """Yield the objects in a collection and their state: that of the collection they came by."""
    for held, child in zip(collection.collection_children, collection.children, strict=True):
        for object in _below(child):
            yield object.as_pointer(), held.light_linking.link_state
    for held, object in zip(collection.collection_objects, collection.objects, strict=True):
        yield object.as_pointer(), held.light_linking.link_state


def _below(collection: bpy.types.Collection) -> Iterator[bpy.types.Object]:
    for child in collection.children:
        yield from _below(child)
    yield from collection.objects
