"""depsgraph at other times -> what moves while the shutter is open, or from frame to frame.

The scene is read once in its own frame, as without motion blur.  Then Blender evaluates it at
other times, and matrices, deformed meshes and the camera are read again; what is the same at all of
them rests.  Times are those of Cycles: 2^n + 1 equal steps over the shutter's time, where n is the
object's own number of steps or, if that is larger, the one of what makes instances of it.  Objects
that are not blurred stand where they are at the middle of the shutter's time.

For the Vector pass, without motion blur, the same is read of the frames before, at and after this
one, of all objects, whether they are to be blurred or not (Cycles).
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeVar

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.scene import Camera, Cancelled, Deformation, Instance, Lamp, Mesh, Note, Stars
from ..properties import read_own
from .geometry import Exported, export_shape

T = TypeVar("T", Instance, Stars)

Key = tuple[Any, ...]
Step = int  # a time: so many of FINEST steps after the shutter opens

FINEST = 128  # steps, of an object with the most
MIDDLE = FINEST // 2
_POLLED = 256  # instances between two looks at the Escape key
_CURVE = 256  # places at which Cycles reads the shutter's curve


class Wish(NamedTuple):
    """What is asked for an object: so many steps, 0 for none, and whether its vertices count.

    velocity (V, 3) [m/s]: of vertices, which then need no other times; None is unknown.
    """

    steps: int
    deforms: bool
    velocity: NDArray[np.float32] | None = None


class Track:
    """One instance or lamp over time: its matrices, and positions and normals of its mesh."""

    def __init__(self, wish: Wish, source: Exported | None = None) -> None:
        self.wish, self.source = wish, source
        self.matrices: dict[Step, NDArray[np.float64]] = {}
        self.shapes: dict[Step, tuple[NDArray[np.float32], Any] | None] = {}

    @property
    def times(self) -> range:
        """The times at which it is looked at."""
        return range(0, FINEST + 1, FINEST // self.wish.steps) if self.wish.steps else range(0)

    def reads_at(self, step: Step) -> bool:
        """Tell whether its place matters then."""
        return step in self.times or step == MIDDLE

    def motion(self) -> NDArray[np.float64] | None:
        """Return its matrices (K, 3, 4), None if it rests or was not there all the time."""
        found = [self.matrices.get(step) for step in self.times]
        if len(found) < 2 or any(matrix is None for matrix in found):
            return None
        keys = np.array(found)
        return keys if (keys != keys[0]).any() else None


class Shutter(NamedTuple):
    """When the shutter is open: from `start` after the frame on for `length` [frames].

    rate: frames per second; blurs: whether what moves is blurred, or only its speed is shown.
    """

    frame: float
    start: float
    length: float
    rate: float
    blurs: bool = True

    def time(self, step: Step) -> tuple[int, float]:
        """Return the frame and the part of one at a step."""
        time = self.frame + self.start + self.length * step / FINEST
        frame = int(np.floor(time))
        return frame, time - frame


def read_shutter(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Shutter | None:
    """Return when the shutter is open, None if nobody asks for what moves."""
    render = scene.render
    frame = scene.frame_current + scene.frame_subframe
    rate = render.fps / render.fps_base
    if not has_motion_blur(scene, view_layer):
        # From the frame before to the one after
        asks = view_layer.use_pass_vector
        return Shutter(frame, -1.0, 2.0, rate, blurs=False) if asks else None
    length = float(render.motion_blur_shutter)
    if length <= 0:
        return None
    early = {"START": 0.0, "CENTER": 0.5, "END": 1.0}[render.motion_blur_position]
    return Shutter(frame, -early * length, length, rate)


def has_motion_blur(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> bool:
    """Tell whether a view layer is rendered with motion blur."""
    return bool(scene.render.use_motion_blur and view_layer.use_motion_blur)


def read_curve(scene: bpy.types.Scene, notes: list[Note]) -> NDArray[np.float64] | None:
    """Return how much light the shutter lets in over its time (n,), None if always the same."""
    mapping = scene.render.motion_blur_shutter_curve
    mapping.initialize()
    places = np.linspace(0.0, 1.0, _CURVE)
    values = np.array([mapping.evaluate(mapping.curves[0], float(x)) for x in places])
    values = np.maximum(values, 0.0)
    if (values == values[0]).all():
        if values[0] == 0:
            notes.append(Note("Render settings", "the shutter curve is 0: it is taken for even"))
        return None
    return values


def key_of(item: bpy.types.DepsgraphObjectInstance, seen: Counter[Key]) -> Key:
    """Return what an item of the depsgraph is known by at any time; `seen` counts them."""
    object, parent = item.object, item.parent if item.is_instance else None
    source = (item.instance_object or object) if item.is_instance else object
    key: Key = (
        source.original.as_pointer(),
        parent.original.as_pointer() if parent else 0,
        tuple(item.persistent_id) if item.is_instance else (),
        object.type,
    )
    seen[key] += 1
    return (*key, seen[key])


def read_wish(
    object: bpy.types.Object, parent: bpy.types.Object | None, blurs: bool = True
) -> Wish:
    """Return what is asked for an object, or an instance of it that `parent` makes.

    blurs: see `Shutter`.
    """
    if not blurs:
        return Wish(2, may_deform(object), _velocity(object, True))
    makers = [object] if parent is None or parent == object else [object, parent]
    if not all(read_own(maker, "use_motion_blur") for maker in makers):
        return Wish(0, False)
    steps = max(int(read_own(maker, "motion_steps")) for maker in makers)
    deforms = all(read_own(maker, "use_deform_motion") for maker in makers)
    return Wish(2**steps, deforms and may_deform(object), _velocity(object, deforms))


def read_lamp_wish(object: bpy.types.Object, blurs: bool = True) -> Wish:
    """Return what is asked for a lamp; lamps are still in Cycles, so only ours counts.

    blurs: see `Shutter`.
    """
    blurs = blurs and object.data.penumbra.use_motion_blur
    return Wish(2 ** max(int(read_own(object, "motion_steps")), 1) if blurs else 0, False)


def may_deform(object: bpy.types.Object) -> bool:
    """Tell whether the mesh of an object can change with time."""
    if object.type != "MESH" or object.original.type != "MESH":
        return True
    original = object.original.data
    if object.data.name != original.name or original.shape_keys is not None:
        return True
    return len(object.modifiers) > 0 or original.animation_data is not None


def _velocity(object: bpy.types.Object, deforms: bool) -> NDArray[np.float32] | None:
    """Return the attribute of this name, of simulations whose vertices are others each frame."""
    if not deforms or object.type not in ("MESH", "POINTCLOUD"):
        return None
    found = object.data.attributes.get("velocity")
    if found is None or found.domain != "POINT" or found.data_type != "FLOAT_VECTOR":
        return None
    values = np.empty(3 * len(found.data), np.float32)
    found.data.foreach_get("vector", values)
    return values.reshape(-1, 3)


class Times:
    """Evaluates the scene at other times, and puts it back at the end."""

    def __init__(
        self, engine: bpy.types.RenderEngine, depsgraph: bpy.types.Depsgraph, shutter: Shutter
    ) -> None:
        self.engine, self.shutter = engine, shutter
        scene = depsgraph.scene_eval
        self.own = scene.frame_current, scene.frame_subframe

    def __enter__(self) -> "Times":
        return self

    def go(self, step: Step) -> None:
        """Evaluate the scene at a time."""
        self.engine.frame_set(*self.shutter.time(step))

    def __exit__(self, *_: object) -> None:
        self.engine.frame_set(*self.own)


def export_motion(
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    shutter: Shutter,
    tracks: dict[Key, Track],
    export_camera: Callable[[], Camera],
    camera_wish: Wish,
    should_stop: Callable[[], bool],
) -> list[Camera]:
    """Fill tracks with what is read at all their times; return the camera at its own.

    Raises: Cancelled; the scene is back in its frame in any case.
    """
    steps = {MIDDLE}.union(*(track.times for track in tracks.values()))
    camera_times = Track(camera_wish).times
    cameras = []
    with Times(engine, depsgraph, shutter) as times:
        for step in sorted(steps.union(camera_times)):
            times.go(step)
            if step in camera_times or (step == MIDDLE and not camera_times):
                cameras.append(export_camera())
            seen: Counter[Key] = Counter()
            meshes: dict[tuple[int, int], Any] = {}
            for count, item in enumerate(depsgraph.object_instances):
                if count % _POLLED == 0 and should_stop():
                    raise Cancelled
                track = tracks.get(key_of(item, seen))
                if track is not None and track.reads_at(step):
                    _read(item, track, step, meshes)
    return cameras


def _read(
    item: bpy.types.DepsgraphObjectInstance,
    track: Track,
    step: Step,
    meshes: dict[tuple[int, int], Any],
) -> None:
    """Read one instance at one time; each mesh once."""
    matrix = item.matrix_world
    track.matrices[step] = np.array((*matrix[0], *matrix[1], *matrix[2])).reshape(3, 4)
    source = track.source
    if source is None:
        return
    data = item.object.data
    key = data.as_pointer(), id(source)
    if key not in meshes:
        is_edited = getattr(data, "is_editmode", False)
        meshes[key] = None if is_edited else export_shape(data, source)
    track.shapes[step] = meshes[key]


class Moved:
    """Puts what was read into instances and lamps; instances that share a mesh go on to do so."""

    def __init__(self, shutter: Shutter, notes: list[Note]) -> None:
        self.notes, self.shutter = notes, shutter
        self._meshes: dict[Any, Mesh] = {}

    def instance(self, instance: T, track: Track) -> T:
        """Return an instance or stars in motion; what is not blurred, at the middle of the time."""
        motion = track.motion()
        to_world = instance.to_world
        if motion is None:
            to_world = track.matrices.get(MIDDLE, to_world)
        return replace(instance, mesh=self._mesh(instance, track), to_world=to_world, motion=motion)

    def lamp(self, lamp: Lamp, track: Track) -> Lamp:
        """Return a lamp with its motion."""
        motion = track.motion()
        if motion is None:
            return replace(lamp, to_world=track.matrices.get(MIDDLE, lamp.to_world))
        if lamp.surface is not None:
            text = "its shader stays where it is in the frame while the lamp moves"
            self.notes.append(Note(f"Light '{lamp.name}'", text))
        return replace(lamp, motion=motion)

    def _mesh(self, instance: Instance | Stars, track: Track) -> Mesh:
        mesh, wish = instance.mesh, track.wish
        if wish.velocity is not None and len(wish.velocity) == len(mesh.positions):
            key: Any = id(mesh), "velocity"
            if key not in self._meshes:
                self._meshes[key] = self._flying(mesh, wish.velocity)
            return self._meshes[key]
        if track.source is None:
            return mesh
        times = list(track.times) if wish.deforms else []
        shapes = [track.shapes.get(step) for step in times or [MIDDLE]]
        if not times and shapes[0] is None:
            return mesh
        if any(shape is None for shape in shapes):
            text = "its faces change while the shutter is open: their deformation is not blurred"
            if not self.shutter.blurs:
                text = "its faces change from frame to frame: Vector does not show its deformation"
            self.notes.append(Note(f"Object '{instance.name}'", text))
            return mesh
        key = id(mesh), *(id(shape[0]) for shape in shapes if shape)
        if key not in self._meshes:
            self._meshes[key] = _deformed(mesh, [shape for shape in shapes if shape])
        return self._meshes[key]

    def _flying(self, mesh: Mesh, velocity: NDArray[np.float32]) -> Mesh:
        """Return a mesh whose vertices fly on straight, as fast as `velocity` [m/s] says."""
        if not velocity.any() or not np.isfinite(velocity).all():
            return mesh
        shutter = self.shutter
        times = (shutter.start / shutter.rate, (shutter.start + shutter.length) / shutter.rate)
        keys = np.stack([mesh.positions + velocity * np.float32(time) for time in times])
        return replace(mesh, deformation=Deformation(keys))


def _deformed(mesh: Mesh, shapes: Sequence[tuple[NDArray[np.float32], Any]]) -> Mesh:
    """Return a mesh with its shapes over time; with one, in that shape."""
    positions = np.stack([shape[0] for shape in shapes])
    normals = [shape[1] for shape in shapes]
    has_normals = mesh.normals is not None and all(each is not None for each in normals)
    stacked = np.stack(normals) if has_normals else None
    if not np.isfinite(positions).all():
        return mesh
    if len(shapes) == 1 or (positions == positions[0]).all():
        if np.array_equal(positions[0], mesh.positions):
            return mesh
        return replace(
            mesh, positions=positions[0], normals=mesh.normals if stacked is None else stacked[0]
        )
    return replace(mesh, deformation=Deformation(positions, stacked))


def move_camera(camera: Camera, cameras: Sequence[Camera]) -> Camera:
    """Return a camera with its motion; if it is not blurred, at the middle of the time."""
    first = cameras[0]
    same = all(
        np.array_equal(each.to_world, first.to_world)
        and (each.window, each.aperture) == (first.window, first.aperture)
        for each in cameras
    )
    if not same:
        return replace(camera, motion=tuple(cameras))
    where = {"to_world": first.to_world, "window": first.window}
    return replace(camera, **where, aperture=first.aperture)
