"""depsgraph -> core.scene.Scene.  The only way from Blender's data into the renderer.

Everything is read from the evaluated depsgraph, so modifiers, drivers and visibility for
rendering are Blender's business.  Its list of instances is the whole scene: an object that
makes geometry other than a mesh (text, curve, surface, metaball) comes twice, as itself and as
the mesh it makes; only meshes are taken, so each counts once.
"""

from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.images.shelf import Shelf
from ...core.layer import Layer
from ...core.scene import (
    ACTIVE_UV,
    Camera,
    Cancelled,
    Instance,
    Lamp,
    Material,
    Mesh,
    Note,
    Scene,
    Stars,
    World,
)
from ...core.shading.attributes import attributes_wanted
from .attributes import export_properties
from .geometry import NO_CORNERS, Exported, export_mesh, export_mesh_with_corners
from .images import Images
from .known import Known
from .labels import read_label
from .layers import export_layer, layer_notes, layer_world
from .lights import Light, export_world, place_lamp, read_light
from .materials import export_material
from .motion import (
    Key,
    Moved,
    Shutter,
    Track,
    Wish,
    export_motion,
    key_of,
    may_deform,
    move_camera,
    read_curve,
    read_lamp_wish,
    read_shutter,
    read_wish,
)
from .stars import export_points
from .view import Frame, export_camera, read_frame
from .viewport import EVERYTHING, Viewport
from .visibility import read_flags, read_light_flags, read_links

__all__ = [
    "Frame",
    "Known",
    "export_content",
    "export_scene",
    "export_view",
    "read_frame",
]

LIGHT_ONLY = Layer()
_POLLED = 256  # instances between two looks at the Escape key
_NOT_RENDERED = {
    "CURVES": "hair curves are not rendered",
    "POINTCLOUD": "point clouds are not rendered but as stars",
    "VOLUME": "volumes are not rendered",
}


def export_scene(
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    frame: Frame,
    should_stop: Callable[[], bool] = lambda: False,
    shelf: Shelf | None = None,
) -> Scene:
    """Return all that is rendered in one frame, view layer and view.

    shelf: where pixels of packed images stay for later renders, if anywhere.
    Raises: SceneError that names the culprit; Cancelled if `should_stop` says so.
    """
    notes: list[Note] = []
    camera = export_camera(engine, depsgraph, frame, notes)
    shutter = read_shutter(depsgraph.scene_eval, depsgraph.view_layer_eval)
    known = Known(shelf)
    still, content = _read(depsgraph, camera, notes, should_stop, known, shutter=shutter)
    if shutter is None:
        return still
    if shutter.blurs:
        still = replace(still, shutter=read_curve(depsgraph.scene_eval, notes), notes=tuple(notes))
    return _moved(still, content, shutter, engine, depsgraph, frame, should_stop)


def export_content(
    depsgraph: bpy.types.Depsgraph,
    camera: Camera,
    notes: list[Note],
    should_stop: Callable[[], bool] = lambda: False,
    known: Known | None = None,
    view: Viewport = EVERYTHING,
) -> Scene:
    """Return what `camera` sees, without motion, as viewports show it; `notes` are those on it.

    `known` are meshes, materials and images of an earlier export; `view` is what a viewport hides.
    Raises: SceneError that names the culprit; Cancelled if `should_stop` says so.
    """
    return _read(depsgraph, camera, notes, should_stop, known, view)[0]


def _read(
    depsgraph: bpy.types.Depsgraph,
    camera: Camera,
    notes: list[Note],
    should_stop: Callable[[], bool],
    known: Known | None = None,
    view: Viewport = EVERYTHING,
    shutter: Shutter | None = None,
) -> "tuple[Scene, _Content]":
    """Return what `camera` sees in the frame, and what is known of it."""
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    notes.extend(layer_notes(scene, view_layer))
    # Viewports show light, whatever passes a picture has.
    layer = export_layer(scene, view_layer) if view.space is None else LIGHT_ONLY
    content = _Content(depsgraph, notes, known or Known(), view, layer, shutter)
    for count, item in enumerate(depsgraph.object_instances):
        if count % _POLLED == 0 and should_stop():
            raise Cancelled
        content.add(item)
    still = Scene(
        camera=camera,
        instances=tuple(content.instances),
        lamps=tuple(content.lamps),
        world=content.world(scene, view_layer),
        film_transparent=scene.render.film_transparent,
        spare_passes=0 if bpy.app.version >= (5, 0) else 1,  # as that version's Cycles
        frame=scene.frame_current,
        layer=layer,
        notes=tuple(dict.fromkeys(notes)),
        stars=tuple(content.stars),
    )
    return still, content


def export_view(
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    frame: Frame,
    notes: list[Note],
    should_stop: Callable[[], bool] = lambda: False,
) -> Camera:
    """Return the camera of the engine's active view, with its motion; see `export_scene`."""
    camera = export_camera(engine, depsgraph, frame, notes)
    shutter = read_shutter(depsgraph.scene_eval, depsgraph.view_layer_eval)
    if shutter is None:
        return camera
    return _move_camera(camera, shutter, {}, engine, depsgraph, frame, should_stop)


def _move_camera(
    camera: Camera,
    shutter: Shutter,
    tracks: dict[Key, Track],
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    frame: Frame,
    should_stop: Callable[[], bool],
) -> Camera:
    """Return the camera with its motion, and fill `tracks` on the way."""
    original = engine.camera_override or depsgraph.scene_eval.camera
    wish = read_wish(original.evaluated_get(depsgraph), None, shutter.blurs)

    def look() -> Camera:
        return export_camera(engine, depsgraph, frame, [])

    return move_camera(
        camera, export_motion(engine, depsgraph, shutter, tracks, look, wish, should_stop)
    )


def _moved(
    still: Scene,
    content: "_Content",
    shutter: Shutter,
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    frame: Frame,
    should_stop: Callable[[], bool],
) -> Scene:
    """Return the scene with all that moves while the shutter is open."""
    keys = *content.instance_keys, *content.lamp_keys, *content.star_keys
    tracks = {key: content.tracks[key] for key in keys}
    way = engine, depsgraph, frame, should_stop
    camera = _move_camera(still.camera, shutter, tracks, *way)
    notes = list(still.notes)
    moved = Moved(shutter, notes)
    instances = zip(still.instances, content.instance_keys, strict=True)
    lamps = zip(still.lamps, content.lamp_keys, strict=True)
    stars = zip(still.stars, content.star_keys, strict=True)
    return replace(
        still,
        camera=camera,
        spans_frames=not shutter.blurs,
        instances=tuple(moved.instance(each, tracks[key]) for each, key in instances),
        lamps=tuple(moved.lamp(each, tracks[key]) for each, key in lamps),
        stars=tuple(moved.instance(each, tracks[key]) for each, key in stars),
        notes=tuple(dict.fromkeys(notes)),
    )


class _Shown(NamedTuple):
    """What the instances of one object have in common; wish and source: see `motion`."""

    name: str
    mesh: Mesh
    materials: tuple[Material, ...]
    flags: dict[str, Any]
    wish: Wish | None
    source: Exported | None


class _Starry(NamedTuple):
    """The same of an object of stars, which are not in the world yet."""

    stars: Stars
    wish: Wish | None
    source: Exported | None


class _Content:
    """Gathers instances and lamps; reads each mesh and material once.

    Instances cannot be kept beyond their turn in the iterator, so all that is remembered is
    keyed by addresses, which stay put during one export.
    """

    def __init__(
        self,
        depsgraph: bpy.types.Depsgraph,
        notes: list[Note],
        known: Known,
        view: Viewport,
        layer: Layer,
        shutter: Shutter | None,
    ) -> None:
        view_layer = self.view_layer = depsgraph.view_layer_eval
        self.links = read_links(depsgraph)
        self.instances: list[Instance] = []
        self.lamps: list[Lamp] = []
        self.surfaces = view_layer.use_solid
        self.override = view_layer.material_override
        self.notes = notes
        self.scene = depsgraph.scene_eval
        self.images = Images(notes, self.scene, known, view.space is not None)
        self.known, self.view = known, view
        self.meshes: dict[tuple[int, frozenset[str]], Exported] = {}
        self.moves = shutter is not None
        self.blurs = shutter is not None and shutter.blurs
        self.seen: Counter[Key] = Counter()
        self.tracks: dict[Key, Track] = {}
        self.instance_keys: list[Key] = []
        self.lamp_keys: list[Key] = []
        self.stars: list[Stars] = []
        self.points: dict[tuple[int, int, int], _Starry | None] = {}
        self.star_keys: list[Key] = []
        self.materials: dict[int, Material] = {}
        self.shown: dict[tuple[int, int, int], _Shown | None] = {}
        self.lights: dict[tuple[int, int], Light | None] = {}
        self.noted: set[int] = set()
        self.aovs = frozenset(name for name, _ in layer.aovs)
        self.shared_attributes = frozenset({ACTIVE_UV} if "UV" in layer.passes else ())

    def add(self, item: bpy.types.DepsgraphObjectInstance) -> None:
        """Take one item of the depsgraph: a mesh, a light, or something to note."""
        object = item.object
        kind = object.type
        known_by = key_of(item, self.seen) if self.moves else ()
        source, parent = object, None
        if item.is_instance:
            source, parent = item.instance_object or object, item.parent
        address, made_by = source.as_pointer(), parent.as_pointer() if parent else 0
        if not self.view.shows(parent or source):
            return
        if address not in self.noted:
            self.noted.add(address)
            self.notes.extend(_object_notes(source))
        if kind in ("MESH", "POINTCLOUD") and object.penumbra.use_stars:
            if item.show_self and self.surfaces:
                key = address, object.data.as_pointer(), made_by
                if key not in self.points:
                    self.points[key] = self.read_stars(object, parent)
                self.add_stars(self.points[key], _affine(item.matrix_world), known_by)
        elif kind in _NOT_RENDERED:
            self.notes.append(Note(f"Object '{object.name}'", _NOT_RENDERED[kind]))
        elif kind == "LIGHT" and item.show_self and self.view.has_lights:
            if (address, made_by) not in self.lights:
                self.lights[address, made_by] = self.read_light(object, parent)
            light = self.lights[address, made_by]
            place = _affine(item.matrix_world), read_label(item)
            lamp = light and place_lamp(light, *place)
            if lamp is not None:
                self.lamps.append(lamp)
                if self.moves:
                    self.tracks[known_by] = Track(read_lamp_wish(object, self.blurs))
                    self.lamp_keys.append(known_by)
        elif kind == "MESH" and self.surfaces and item.show_self:
            key = address, object.data.as_pointer(), made_by
            if key not in self.shown:
                self.shown[key] = self.read(object, parent)
            shown = self.shown[key]
            if shown is not None:
                name, mesh, materials, flags, wish, exported = shown
                matrix = _affine(item.matrix_world)
                label = read_label(item, self.scene.frame_current_final)
                self.instances.append(Instance(name, mesh, matrix, materials, label=label, **flags))
                if wish is not None:
                    self.tracks[known_by] = Track(wish, exported)
                    self.instance_keys.append(known_by)

    def read_stars(
        self, object: bpy.types.Object, parent: bpy.types.Object | None
    ) -> _Starry | None:
        """Return what all instances of an object of stars have in common.

        None if the camera sees none.
        """
        flags = read_flags(object, parent, self.view_layer, self.links)
        if not flags["seen_by"].camera or flags["is_holdout"]:
            return None
        exported, light = export_points(object, self.notes)
        if not len(light):
            return None
        stars = Stars(object.name, exported.mesh, np.eye(3, 4), light, flags["light_group"])
        if not self.moves:
            return _Starry(stars, None, None)
        wish = read_wish(object, parent)
        source = exported if may_deform(object) and wish.velocity is None else None
        return _Starry(stars, wish, source)

    def add_stars(
        self, shown: _Starry | None, to_world: NDArray[np.float64], known_by: Key
    ) -> None:
        """Take an instance of an object of stars."""
        if shown is None:
            return
        self.stars.append(replace(shown.stars, to_world=to_world))
        if shown.wish is not None:
            self.tracks[known_by] = Track(shown.wish, shown.source)
            self.star_keys.append(known_by)

    def read_light(self, object: bpy.types.Object, parent: bpy.types.Object | None) -> Light | None:
        """Return what all instances have in common that `parent` makes of a light object."""
        light = self.known.shader(
            object.data,
            self.notes,
            lambda notes: read_light(object, notes, self.images.noting(notes)),
        )
        if light is None:
            return None
        flags = read_light_flags(object, parent, self.view_layer, self.links)
        return light._replace(lamp=replace(light.lamp, name=object.name, **flags))

    def read(self, object: bpy.types.Object, parent: bpy.types.Object | None) -> _Shown | None:
        """Return what all instances of an object that `parent` makes have in common.

        None if there is nothing to see.
        """
        data = object.data
        flags = read_flags(object, parent, self.view_layer, self.links)
        if not flags["seen_by"].mask:
            return None
        slots = [self.override or slot.material for slot in object.material_slots]
        materials = [self.material(slot) for slot in slots or [self.override]]
        names = self.shared_attributes.union(*map(attributes_wanted, materials))
        key = data.as_pointer(), names
        exported = self.meshes.get(key)
        if exported is None:
            is_displaced = any(material.moves for material in materials)
            exported = self.known.mesh(
                object, parent, names, lambda: _read_mesh(object, names, self.moves, is_displaced)
            )
            self.meshes[key] = exported
        mesh = exported.mesh
        if len(mesh.triangles) == 0:
            return None
        wish = source = None
        if self.moves:
            wish = read_wish(object, parent, self.blurs)
            source = exported if may_deform(object) and wish.velocity is None else None
        flags["attributes"] = export_properties(names, object, parent, self.view_layer, self.scene)

        # A face whose slot does not exist shows the last one
        highest = 0 if mesh.slots is None else int(mesh.slots.max())
        materials += materials[-1:] * (highest + 1 - len(materials))
        return _Shown(object.name, mesh, tuple(materials), flags, wish, source)

    def material(self, material: bpy.types.Material | None) -> Material:
        key = 0 if material is None else material.as_pointer()
        if key not in self.materials:
            self.materials[key] = self.known.shader(
                material,
                self.notes,
                lambda notes: export_material(
                    material, notes, self.images.noting(notes), self.aovs
                ),
            )
        return self.materials[key]

    def world(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> World | None:
        """Return the surroundings: those of the viewport, or of the scene."""
        if not self.view.has_world:
            return self.view.world
        if not view_layer.use_sky:
            return None
        world = layer_world(scene, view_layer)
        return self.known.shader(
            world, self.notes, lambda notes: export_world(world, notes, self.images.noting(notes))
        )


def _read_mesh(
    object: bpy.types.Object, names: frozenset[str], moves: bool, is_displaced: bool
) -> Exported:
    """Return the mesh of an object; one in edit mode keeps its faces out of `data`."""
    if moves:
        read = export_mesh_with_corners
    else:

        def read(mesh: bpy.types.Mesh, names: Collection[str]) -> Exported:
            return Exported(export_mesh(mesh, names), NO_CORNERS)

    # Before Blender 5.1 Cycles cuts meshes along sharp edges: displaced, they come apart
    is_cut = is_displaced and bpy.app.version < (5, 1) and object.data.normals_domain == "CORNER"
    if not object.data.is_editmode and not is_cut:
        return read(object.data, names)
    try:
        mesh = object.to_mesh()
        if is_cut:
            mesh.split_faces()
        return read(mesh, names)
    finally:
        object.to_mesh_clear()


def _affine(matrix: object) -> NDArray[np.float64]:
    """Return the upper three rows of a Blender matrix as (3, 4)."""
    return np.array((*matrix[0], *matrix[1], *matrix[2])).reshape(3, 4)


def _object_notes(object: bpy.types.Object) -> Iterator[Note]:
    """Yield what an object asks for and does not get."""
    owner = f"Object '{object.name}'"
    for system in object.particle_systems:
        settings = system.settings
        if settings.type == "HAIR" and settings.render_type == "PATH":
            yield Note(owner, f"hair of particle system '{system.name}' is not rendered")
