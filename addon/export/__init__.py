"""depsgraph -> core.scene.Scene.  The only way from Blender's data into the renderer.

Everything is read from the evaluated depsgraph, so modifiers, drivers and visibility for
rendering are Blender's business.  Its list of instances is the whole scene: an object that
makes geometry other than a mesh (text, curve, surface, metaball) comes twice, as itself and as
the mesh it makes; only meshes are taken, so each counts once.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.layer import Layer
from ...core.scene import ACTIVE_UV, Cancelled, Instance, Lamp, Material, Mesh, Note, Scene
from ...core.shading.attributes import attributes_wanted
from .attributes import export_properties
from .geometry import export_mesh
from .images import Images
from .labels import read_label
from .layers import export_layer, layer_notes, layer_world
from .lights import Light, export_world, place_lamp, read_light
from .materials import export_material
from .view import Frame, export_camera, read_frame
from .visibility import read_flags, read_light_flags, read_links

__all__ = ["Frame", "export_camera", "export_scene", "read_frame"]

LIGHT_ONLY = Layer()
_POLLED = 256  # instances between two looks at the Escape key
_NOT_RENDERED = {
    "CURVES": "hair curves are not rendered",
    "POINTCLOUD": "point clouds are not rendered",
    "VOLUME": "volumes are not rendered",
}


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
    notes.extend(layer_notes(view_layer))
    if scene.render.use_motion_blur and view_layer.use_motion_blur:
        notes.append(Note("Render settings", "motion blur is not honoured: everything is still"))
    layer = export_layer(scene, view_layer)
    content = _Content(depsgraph, notes, layer)
    for count, item in enumerate(depsgraph.object_instances):
        if count % _POLLED == 0 and should_stop():
            raise Cancelled
        content.add(item)
    world = layer_world(scene, view_layer)
    return Scene(
        camera=camera,
        instances=tuple(content.instances),
        lamps=tuple(content.lamps),
        world=export_world(world, notes, content.images) if view_layer.use_sky else None,
        film_transparent=scene.render.film_transparent,
        frame=scene.frame_current,
        layer=layer,
        notes=tuple(dict.fromkeys(notes)),
    )


class _Shown(NamedTuple):
    """What the instances of one object have in common."""

    name: str
    mesh: Mesh
    materials: tuple[Material, ...]
    flags: dict[str, Any]


class _Content:
    """Gathers instances and lamps; reads each mesh and material once.

    Instances cannot be kept beyond their turn in the iterator, so all that is remembered is
    keyed by addresses, which stay put during one export.
    """

    def __init__(
        self, depsgraph: bpy.types.Depsgraph, notes: list[Note], layer: Layer = LIGHT_ONLY
    ) -> None:
        view_layer = self.view_layer = depsgraph.view_layer_eval
        self.links = read_links(depsgraph)
        self.instances: list[Instance] = []
        self.lamps: list[Lamp] = []
        self.surfaces = view_layer.use_solid
        self.override = view_layer.material_override
        self.notes = notes
        self.scene = depsgraph.scene_eval
        self.images = Images(notes, depsgraph.scene_eval)
        self.meshes: dict[tuple[int, frozenset[str]], Mesh] = {}
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
        source, parent = object, None
        if item.is_instance:
            source, parent = item.instance_object or object, item.parent
        address, made_by = source.as_pointer(), parent.as_pointer() if parent else 0
        if address not in self.noted:
            self.noted.add(address)
            self.notes.extend(_object_notes(source))
        if kind in _NOT_RENDERED:
            self.notes.append(Note(f"Object '{object.name}'", _NOT_RENDERED[kind]))
        elif kind == "LIGHT" and item.show_self:
            if (address, made_by) not in self.lights:
                self.lights[address, made_by] = self.read_light(object, parent)
            light = self.lights[address, made_by]
            lamp = light and place_lamp(light, _affine(item.matrix_world))
            if lamp is not None:
                self.lamps.append(lamp)
        elif kind == "MESH" and self.surfaces and item.show_self:
            key = address, object.data.as_pointer(), made_by
            if key not in self.shown:
                self.shown[key] = self.read(object, parent)
            shown = self.shown[key]
            if shown is not None:
                name, mesh, materials, flags = shown
                matrix = _affine(item.matrix_world)
                label = read_label(item)
                self.instances.append(Instance(name, mesh, matrix, materials, label=label, **flags))

    def read_light(self, object: bpy.types.Object, parent: bpy.types.Object | None) -> Light | None:
        """Return what all instances have in common that `parent` makes of a light object."""
        light = read_light(object, self.notes, self.images)
        if light is None:
            return None
        flags = read_light_flags(object, parent, self.view_layer, self.links)
        return light._replace(lamp=replace(light.lamp, **flags))

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
        mesh = self.meshes.get(key)
        if mesh is None:
            mesh = self.meshes[key] = _read_mesh(object, names)
        if len(mesh.triangles) == 0:
            return None
        flags["attributes"] = export_properties(names, object, parent, self.view_layer, self.scene)

        # A face whose slot does not exist shows the last one
        highest = 0 if mesh.slots is None else int(mesh.slots.max())
        materials += materials[-1:] * (highest + 1 - len(materials))
        return _Shown(object.name, mesh, tuple(materials), flags)

    def material(self, material: bpy.types.Material | None) -> Material:
        key = 0 if material is None else material.as_pointer()
        if key not in self.materials:
            self.materials[key] = export_material(material, self.notes, self.images, self.aovs)
        return self.materials[key]


def _read_mesh(object: bpy.types.Object, names: frozenset[str]) -> Mesh:
    """Return the mesh of an object; one in edit mode keeps its faces out of `data`."""
    if not object.data.is_editmode:
        return export_mesh(object.data, names)
    try:
        return export_mesh(object.to_mesh(), names)
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
