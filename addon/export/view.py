"""bpy camera, render size and border -> core.scene.Camera.

Blender projects with a sensor of `sensor_width` (or height) millimetres behind a lens of
`lens` millimetres.  The sensor is fitted to one side of the frame; AUTO takes the longer one,
counted in pixels times pixel aspect.  The frame is that side long, the other follows from the
pixels; a shift moves it by fractions of the fitted side.
"""

import math
from typing import NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.optics import Aperture, Eye, Panorama
from ...core.scene import Camera, Note, SceneError

_LEAST = 1e-5  # f-stop and focus distance [m] (Cycles)


class Frame(NamedTuple):
    """The size of the whole picture and the rectangle that is rendered, in pixels."""

    width: int
    height: int
    border: tuple[int, int, int, int]


def read_frame(engine: bpy.types.RenderEngine, render: bpy.types.RenderSettings) -> Frame:
    """Return the picture's size and what of it Blender made room for in the result."""
    result = engine.get_result()
    width, height = engine.resolution_x, engine.resolution_y
    x0 = y0 = 0
    if render.use_border:
        # Blender multiplies in float32 and cuts off the fraction
        x0 = int(np.float32(render.border_min_x) * np.float32(width))
        y0 = int(np.float32(render.border_min_y) * np.float32(height))
    return Frame(width, height, (x0, y0, x0 + result.resolution_x, y0 + result.resolution_y))


def export_camera(
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    frame: Frame,
    notes: list[Note],
) -> Camera:
    """Return the camera of the engine's active view.

    Raises: SceneError if there is none.
    """
    scene = depsgraph.scene_eval
    original = engine.camera_override or scene.camera
    if original is None:
        raise SceneError(f"Scene '{depsgraph.scene.name}' has no camera")
    object, render = original.evaluated_get(depsgraph), scene.render
    if object.type != "CAMERA":
        return _look_from(object, render, frame)
    camera = object.data
    is_round = camera.type == "PANO"
    if camera.type == "CUSTOM":
        what = "custom (OSL) cameras are not supported: it is drawn as a perspective one"
        notes.append(Note(f"Camera '{original.name}'", what))

    # With spherical stereo the eyes part in the core; else Blender moves and shifts the camera
    is_spherical = engine.use_spherical_stereo(object)
    shift_x = engine.camera_shift_x(object, use_spherical_stereo=is_spherical)
    to_world = engine.camera_model_matrix(object, use_spherical_stereo=is_spherical)
    to_world = np.array(to_world, np.float64)[:3]
    if is_round:
        window = (shift_x, 1 + shift_x, camera.shift_y, 1 + camera.shift_y)
    else:
        window = frame_window(camera, render, frame.width, frame.height, shift_x)
    return Camera(
        to_world=to_world,
        window=window,
        width=frame.width,
        height=frame.height,
        projection=camera.type if camera.type in ("ORTHO", "PANO") else "PERSP",
        clip_start=camera.clip_start,
        clip_end=camera.clip_end,
        border=frame.border,
        aperture=_aperture(camera, to_world) if camera.dof.use_dof else None,
        panorama=_panorama(camera, _fitted(camera, render, frame)) if is_round else None,
        eye=_eye(camera, engine.active_view_get()) if is_spherical else None,
    )


def _look_from(object: bpy.types.Object, render: bpy.types.RenderSettings, frame: Frame) -> Camera:
    """Return the view from an object that is no camera: Blender's default one.

    That of a lamp is as wide as its spot.  Lamps of other kinds have a spot's size in Cycles, too,
    but hide it: it is taken to be what it is in a new one.
    """
    lens = 50.0
    if object.type == "LIGHT":
        spot = object.data.spot_size if object.data.type == "SPOT" else math.radians(45)
        lens = 16.0 / math.tan(0.5 * spot)
        lens = lens if lens > 0 else 50.0
    plain = _Plain(object.name, lens)
    return Camera(
        to_world=np.array(object.matrix_world.normalized(), np.float64)[:3],
        window=frame_window(plain, render, frame.width, frame.height, 0.0),
        width=frame.width,
        height=frame.height,
        clip_start=1e-5,
        clip_end=1e5,
        border=frame.border,
    )


class _Plain(NamedTuple):
    """What is read of a camera, for an object that is none."""

    name: str
    lens: float
    type: str = "PERSP"
    sensor_fit: str = "AUTO"
    sensor_width: float = 36.0
    sensor_height: float = 24.0
    shift_y: float = 0.0


def _aperture(camera: bpy.types.Camera, to_world: NDArray[np.float64]) -> Aperture:
    """Return the aperture: half of focal length by f-stop, of 1 m for ORTHO, which has no lens.

    Millimetres are thousandths of Blender's unit, whatever the scene's unit scale (Cycles).
    """
    dof = camera.dof
    lens = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
    return Aperture(
        radius=lens / (2 * max(dof.aperture_fstop, _LEAST)),
        focus=max(_focus(dof, to_world), _LEAST),
        blades=dof.aperture_blades,
        rotation=dof.aperture_rotation,
        ratio=dof.aperture_ratio,
    )


def _focus(dof: bpy.types.CameraDOFSettings, to_world: NDArray[np.float64]) -> float:
    """Return the distance in focus [m]: of an object or bone, along the view."""
    target = dof.focus_object
    if target is None:
        return dof.focus_distance
    place = target.matrix_world
    if target.pose is not None and dof.focus_subtarget in target.pose.bones:
        place = place @ target.pose.bones[dof.focus_subtarget].matrix
    away = to_world[:, 3] - np.array(place.translation)
    return abs(float(to_world[:, 2] @ away))


def _panorama(camera: bpy.types.Camera, sensor: tuple[float, float]) -> Panorama:
    if camera.panorama_type == "CENTRAL_CYLINDRICAL":  # since Blender 5.0
        radius = camera.central_cylindrical_radius
        low, high = camera.central_cylindrical_range_v_min, camera.central_cylindrical_range_v_max
        around = camera.central_cylindrical_range_u_min, camera.central_cylindrical_range_u_max
        return Panorama("CENTRAL_CYLINDRICAL", around=around, height=(low / radius, high / radius))
    return Panorama(
        camera.panorama_type,
        longitude=(camera.longitude_min, camera.longitude_max),
        latitude=(camera.latitude_min, camera.latitude_max),
        fov=camera.fisheye_fov,
        lens=camera.fisheye_lens,
        sensor=sensor,
        polynomial=tuple(getattr(camera, f"fisheye_polynomial_k{power}") for power in range(5)),
    )


def _eye(camera: bpy.types.Camera, view: str) -> Eye | None:
    """Return the eye of a view, None if it is neither."""
    stereo = camera.stereo
    side = {"left": -0.5, "right": 0.5}.get(view, 0.0)
    if side * stereo.interocular_distance == 0:
        return None
    parallel = stereo.convergence_mode == "PARALLEL"
    poles = stereo.pole_merge_angle_from, stereo.pole_merge_angle_to
    return Eye(
        offset=side * stereo.interocular_distance,
        convergence=math.inf if parallel else stereo.convergence_distance,
        poles=poles if stereo.use_pole_merge else None,
    )


def _fitted(
    camera: bpy.types.Camera, render: bpy.types.RenderSettings, frame: Frame
) -> tuple[float, float]:
    """Return the size of the part of the sensor that is behind the frame [mm]."""
    across, up, fitted, side = _fit(camera, render, frame.width, frame.height)
    return side * across / fitted, side * up / fitted


def _fit(
    camera: bpy.types.Camera | _Plain, render: bpy.types.RenderSettings, width: int, height: int
) -> tuple[float, float, float, float]:
    """Return the frame's width and height, the fitted one of both, and its sensor size [mm]."""
    across = width * render.pixel_aspect_x
    up = height * render.pixel_aspect_y
    fit = camera.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if across >= up else "VERTICAL"
    tall = camera.sensor_fit == "VERTICAL"
    side = camera.sensor_height if tall else camera.sensor_width
    return across, up, across if fit == "HORIZONTAL" else up, side


def frame_window(
    camera: bpy.types.Camera | _Plain,
    render: bpy.types.RenderSettings,
    width: int,
    height: int,
    shift_x: float,
) -> tuple[float, float, float, float]:
    """Return (left, right, bottom, top) of the frame at distance 1, or anywhere for ORTHO."""
    # Scale the frame so that its fitted side has the sensor's size seen through the lens
    across, up, fitted, side = _fit(camera, render, width, height)
    side = camera.ortho_scale if camera.type == "ORTHO" else side / camera.lens
    half_x = 0.5 * side * across / fitted
    half_y = 0.5 * side * up / fitted
    x, y = shift_x * side, camera.shift_y * side
    window = (x - half_x, x + half_x, y - half_y, y + half_y)
    if not all(map(math.isfinite, window)):
        raise SceneError(f"Camera '{camera.name}': its lens or scale is not a usable number")
    return window
