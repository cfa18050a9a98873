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

from ...core.scene import Camera, Note, SceneError


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

    Raises: SceneError if there is none, or its projection is not supported.
    """
    scene = depsgraph.scene_eval
    original = engine.camera_override or scene.camera
    if original is None:
        raise SceneError(f"Scene '{depsgraph.scene.name}' has no camera")
    owner = f"Camera '{original.name}'"
    if original.type != "CAMERA":
        raise SceneError(f"Object '{original.name}' is the scene's camera but is not a camera")
    object = original.evaluated_get(depsgraph)
    camera = object.data
    if camera.type not in ("PERSP", "ORTHO"):
        kinds = {"PANO": "panoramic", "CUSTOM": "custom"}
        kind = kinds.get(camera.type, camera.type)
        raise SceneError(f"{owner}: {kind} cameras are not supported yet")
    if camera.dof.use_dof:
        notes.append(Note(owner, "depth of field is not honoured: everything is sharp"))
    return Camera(
        to_world=np.array(engine.camera_model_matrix(object), np.float64)[:3],
        window=frame_window(
            camera,
            scene.render,
            frame.width,
            frame.height,
            engine.camera_shift_x(object),
        ),
        width=frame.width,
        height=frame.height,
        projection=camera.type,
        clip_start=camera.clip_start,
        clip_end=camera.clip_end,
        border=frame.border,
    )


def frame_window(
    camera: bpy.types.Camera,
    render: bpy.types.RenderSettings,
    width: int,
    height: int,
    shift_x: float,
) -> tuple[float, float, float, float]:
    """Return (left, right, bottom, top) of the frame at distance 1, or anywhere for ORTHO."""
    across = width * render.pixel_aspect_x
    up = height * render.pixel_aspect_y

    # Find the side that the sensor is fitted to
    fit = camera.sensor_fit
    if fit == "AUTO":
        fit = "HORIZONTAL" if across >= up else "VERTICAL"
    fitted = across if fit == "HORIZONTAL" else up

    # Scale the frame so that this side has the sensor's size seen through the lens
    if camera.type == "ORTHO":
        side = camera.ortho_scale
    else:
        tall = camera.sensor_fit == "VERTICAL"
        side = (camera.sensor_height if tall else camera.sensor_width) / camera.lens
    half_x = 0.5 * side * across / fitted
    half_y = 0.5 * side * up / fitted
    x, y = shift_x * side, camera.shift_y * side
    window = (x - half_x, x + half_x, y - half_y, y + half_y)
    if not all(map(math.isfinite, window)):
        raise SceneError(f"Camera '{camera.name}': its lens or scale is not a usable number")
    return window
