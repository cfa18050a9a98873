"""bpy datablocks, earlier exports -> what need not be read again.  For the viewport.

What was read is known by the datablock's `session_uid`, which Blender gives to one datablock only,
and forgotten when Blender says that it has changed.  What depends on more than Blender tells is
not remembered: meshes in edit mode, shaders that look at an object or the time, or show a film.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, NamedTuple, TypeVar

import bpy

from ...core.images import ImageSource
from ...core.images.shelf import Shelf
from ...core.scene import Note
from .geometry import Exported

T = TypeVar("T")
Uid = int


class _Read(NamedTuple):
    """Something that was read, and what was noted of it."""

    what: Any
    notes: tuple[Note, ...]


class Known:
    """Meshes, shaders and images of an earlier export; empty for one that stands alone.

    shelf: where pixels of packed images stay for exports that know nothing else of each other.
    """

    def __init__(self, shelf: Shelf | None = None) -> None:
        self.shelf = shelf
        self._meshes: dict[tuple[Any, ...], tuple[frozenset[Uid], Exported]] = {}
        self._shaders: dict[Uid, _Read] = {}
        self._images: dict[tuple[Uid, str], _Read] = {}
        self._limits: dict[str, float] = {}

    def forget(self) -> None:
        """Forget all."""
        self.__init__(self.shelf)  # type: ignore[misc]

    def keep_limits(self, limits: Mapping[str, float]) -> None:
        """Forget shaders and images if images are limited in another way than so far."""
        if limits != self._limits:
            self._images, self._shaders, self._limits = {}, {}, dict(limits)

    def forget_changed(self, updates: Iterable[bpy.types.DepsgraphUpdate]) -> None:
        """Forget what Blender says has changed since it was read."""
        for update in updates:
            changed = update.id.original
            uid = changed.session_uid
            if isinstance(changed, bpy.types.Image):
                self._images = {k: v for k, v in self._images.items() if k[0] != uid}
                self._shaders.clear()
            elif isinstance(changed, bpy.types.Material | bpy.types.World | bpy.types.Light):
                self._shaders.pop(uid, None)
            elif isinstance(changed, bpy.types.NodeTree) and not changed.is_embedded_data:
                self._shaders.clear()
            elif isinstance(changed, bpy.types.Object):
                if update.is_updated_geometry:
                    self._forget_meshes(uid)
            elif not isinstance(changed, bpy.types.Scene | bpy.types.Collection):
                self._forget_meshes(uid)

    def _forget_meshes(self, uid: Uid) -> None:
        for key in [key for key, (depends, _) in self._meshes.items() if uid in depends]:
            del self._meshes[key]

    def mesh(
        self,
        object: bpy.types.Object,
        parent: bpy.types.Object | None,
        names: frozenset[str],
        read: Callable[[], Exported],
    ) -> Exported:
        """Return the mesh of an evaluated object with the attributes `names`."""
        data = object.data
        if data.is_editmode:
            return read()
        # Blender evaluates into new memory; what generates a mesh without a name of its own is
        # the object that it is made by.
        depends = {object.original.session_uid, data.original.session_uid}
        if parent is not None:
            depends.add(parent.original.session_uid)
        key = (frozenset(depends), data.as_pointer(), names)
        if key not in self._meshes:
            self._meshes[key] = key[0], read()
        return self._meshes[key][1]

    def shader(
        self, owner: bpy.types.ID | None, notes: list[Note], read: Callable[[list[Note]], T]
    ) -> T:
        """Return the shader of a material or world, with what is to be noted of it."""
        if owner is None or not _is_still(owner):
            return read(notes)
        return _remembered(self._shaders, owner.original.session_uid, notes, read)

    def image(
        self,
        image: bpy.types.Image,
        path: str,
        notes: list[Note],
        read: Callable[[list[Note]], ImageSource],
    ) -> ImageSource:
        """Return the source of an image that is read from `path`."""
        if image.is_dirty:
            return read(notes)
        return _remembered(self._images, (image.original.session_uid, path), notes, read)


def _remembered(
    known: dict[Any, _Read], key: Any, notes: list[Note], read: Callable[[list[Note]], T]
) -> T:
    if key not in known:
        own: list[Note] = []
        what = read(own)
        known[key] = _Read(what, tuple(own))
    notes.extend(known[key].notes)
    return known[key].what


def _is_still(owner: bpy.types.ID) -> bool:
    """Does a shader change only if Blender says so?"""
    tree = owner.node_tree
    return tree is None or not any(map(_looks_elsewhere, _nodes(tree, set())))


def _nodes(tree: bpy.types.NodeTree, seen: set[int]) -> Iterator[bpy.types.Node]:
    if tree.as_pointer() in seen:
        return
    seen.add(tree.as_pointer())
    for node in tree.nodes:
        yield node
        group = getattr(node, "node_tree", None)
        if group is not None:
            yield from _nodes(group, seen)


def _looks_elsewhere(node: bpy.types.Node) -> bool:
    image = getattr(node, "image", None)
    is_film = image is not None and image.source in ("SEQUENCE", "MOVIE", "VIEWER")
    is_timed = node.bl_idname == "GeometryNodeInputSceneTime"
    return is_film or is_timed or getattr(node, "object", None) is not None
