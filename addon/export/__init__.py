"""depsgraph -> core.scene.Scene.  The only way from Blender's data into the renderer.

Everything is read from the evaluated depsgraph, so modifiers, drivers and visibility for
rendering are Blender's business.  Its list of instances is the whole scene: an object that
makes geometry other than a mesh (text, curve, surface, metaball) comes twice, as itself and as
the mesh it makes; only meshes are taken, so each counts once.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.scene import Cancelled, Instance, Lamp, Material, Mesh, Note, Scene
from .geometry import export_mesh
from .lights import Light, export_world, place_lamp, read_light
from .materials import export_material
from .view import Frame, export_camera, read_frame

__all__ = ["Frame", "export_camera", "export_scene", "read_frame"]

_POLLED = 256  # instances between two looks at the Escape key
_NOT_RENDERED = {
    "CURVES": "hair curves are not rendered",
    "POINTCLOUD": "point clouds are not rendered",
    "VOLUME": "volumes are not rendered",
}
_RAYS = ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow")


def export_scene(
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    frame: Frame,
    should_stop: Callable[[], bool] = lambda: False,
) -> Scene:
    """Return all that is rendered in one frame, view layer and view.

    Raises: SceneError that names the culprit; Cancelled if `should_stop` says so.
    """
    notes: list[Note] = []
    camera = export_camera(engine, depsgraph, frame, notes)
    scene, view_layer = depsgraph.scene_eval, depsgraph.view_layer_eval
    notes.extend(_view_layer_notes(view_layer))
    if scene.render.use_motion_blur and view_layer.use_motion_blur:
        notes.append(Note("Render settings", "motion blur is not honoured: everything is still"))
    content = _Content(view_layer, notes)
    for count, item in enumerate(depsgraph.object_instances):
        if count % _POLLED == 0 and should_stop():
            raise Cancelled
        content.add(item)
    world = view_layer.world_override or scene.world
    return Scene(
        camera=camera,
        instances=tuple(content.instances),
        lamps=tuple(content.lamps),
        world=export_world(world, notes) if view_layer.use_sky else None,
        film_transparent=scene.render.film_transparent,
        frame=scene.frame_current,
        notes=tuple(dict.fromkeys(notes)),
    )


class _Shown(NamedTuple):
    """What the instances of one object have in common."""

    name: str
    mesh: Mesh
    materials: tuple[Material, ...]


class _Content:
    """Gathers instances and lamps; reads each mesh and material once.

    Instances cannot be kept beyond their turn in the iterator, so all that is remembered is
    keyed by addresses, which stay put during one export.
    """

    def __init__(self, view_layer: bpy.types.ViewLayer, notes: list[Note]) -> None:
        self.instances: list[Instance] = []
        self.lamps: list[Lamp] = []
        self.surfaces = view_layer.use_solid
        self.override = view_layer.material_override
        self.notes = notes
        self.meshes: dict[int, Mesh] = {}
        self.materials: dict[int, Material] = {}
        self.shown: dict[tuple[int, int], _Shown | None] = {}
        self.lights: dict[int, Light | None] = {}
        self.noted: set[int] = set()

    def add(self, item: bpy.types.DepsgraphObjectInstance) -> None:
        """Take one item of the depsgraph: a mesh, a light, or something to note."""
        object = item.object
        kind = object.type
        source = (item.instance_object or object) if item.is_instance else object
        address = source.as_pointer()
        if address not in self.noted:
            self.noted.add(address)
            self.notes.extend(_object_notes(source))
        if kind in _NOT_RENDERED:
            self.notes.append(Note(f"Object '{object.name}'", _NOT_RENDERED[kind]))
        elif kind == "LIGHT" and item.show_self:
            if address not in self.lights:
                self.lights[address] = read_light(object, self.notes)
            light = self.lights[address]
            lamp = light and place_lamp(light, _affine(item.matrix_world))
            if lamp is not None:
                self.lamps.append(lamp)
        elif kind == "MESH" and self.surfaces and item.show_self:
            key = address, object.data.as_pointer()
            if key not in self.shown:
                self.shown[key] = self.read(object)
            shown = self.shown[key]
            if shown is not None:
                matrix = _affine(item.matrix_world)
                instance = Instance(shown.name, shown.mesh, matrix, shown.materials)
                self.instances.append(instance)

    def read(self, object: bpy.types.Object) -> _Shown | None:
        """Return the mesh and the materials of an object; None if there is nothing to see."""
        data = object.data
        if not any(getattr(object, f"visible_{rays}") for rays in _RAYS):
            return None
        mesh = self.meshes.get(data.as_pointer())
        if mesh is None:
            mesh = self.meshes[data.as_pointer()] = _read_mesh(object)
        if len(mesh.triangles) == 0:
            return None
        slots = [self.override or slot.material for slot in object.material_slots]
        materials = [self.material(slot) for slot in slots or [self.override]]

        # A face whose slot does not exist shows the last one
        highest = 0 if mesh.slots is None else int(mesh.slots.max())
        materials += materials[-1:] * (highest + 1 - len(materials))
        return _Shown(object.name, mesh, tuple(materials))

    def material(self, material: bpy.types.Material | None) -> Material:
        key = 0 if material is None else material.as_pointer()
        if key not in self.materials:
            self.materials[key] = export_material(material, self.notes)
        return self.materials[key]


def _read_mesh(object: bpy.types.Object) -> Mesh:
    """Return the mesh of an object; one in edit mode keeps its faces out of `data`."""
    if not object.data.is_editmode:
        return export_mesh(object.data)
    try:
        return export_mesh(object.to_mesh())
    finally:
        object.to_mesh_clear()


def _affine(matrix: object) -> NDArray[np.float64]:
    """Return the upper three rows of a Blender matrix as (3, 4)."""
    return np.array((*matrix[0], *matrix[1], *matrix[2])).reshape(3, 4)


def _object_notes(object: bpy.types.Object) -> Iterator[Note]:
    """Yield what an object asks for and does not get."""
    owner = f"Object '{object.name}'"
    lamp = object.type == "LIGHT"
    hidden = [rays for rays in _RAYS if not getattr(object, f"visible_{rays}")]
    if lamp:
        hidden = [rays for rays in hidden if rays in ("volume_scatter", "shadow")]
    if hidden and len(hidden) < len(_RAYS):
        rays = ", ".join(hidden).replace("_", " ")
        yield Note(owner, f"it stays visible to rays that it is hidden from ({rays})")
    if object.is_holdout:
        yield Note(owner, "holdout is not honoured")
    if object.is_shadow_catcher and not lamp:
        yield Note(owner, "shadow catcher is not honoured")
    linking = object.light_linking
    if linking.receiver_collection or linking.blocker_collection:
        yield Note(owner, "light linking is not honoured")
    for system in object.particle_systems:
        settings = system.settings
        if settings.type == "HAIR" and settings.render_type == "PATH":
            yield Note(owner, f"hair of particle system '{system.name}' is not rendered")


def _view_layer_notes(view_layer: bpy.types.ViewLayer) -> Iterator[Note]:
    """Yield what a view layer asks for and does not get."""
    owner = f"View layer '{view_layer.name}'"
    for prop in view_layer.bl_rna.properties:
        name = prop.identifier
        wanted = name.startswith("use_pass_") and getattr(view_layer, name)
        if wanted and name not in (
            "use_pass_combined",
            "use_pass_cryptomatte_accurate",
        ):
            yield Note(owner, f"pass {prop.name} is not rendered")
    for pass_ in view_layer.aovs:
        yield Note(owner, f"shader pass '{pass_.name}' is not rendered")
    for group in view_layer.lightgroups:
        yield Note(owner, f"light group '{group.name}' is not rendered")
    yield from _collection_notes(view_layer.layer_collection)


def _collection_notes(collection: bpy.types.LayerCollection) -> Iterator[Note]:
    owner = f"Collection '{collection.name}'"
    if collection.exclude:
        return
    if collection.holdout:
        yield Note(owner, "holdout is not honoured")
    if collection.indirect_only:
        yield Note(owner, "indirect only is not honoured: the camera sees it")
    for child in collection.children:
        yield from _collection_notes(child)
