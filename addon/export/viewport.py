"""bpy 3D viewport -> Camera, and what of the scene it shows.

The camera is taken from the matrices by which Blender draws the viewport itself, so that overlays
lie on the picture whatever the view is: perspective, orthographic, or through a camera with its
zoom, offset and shift.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import bpy
import numpy as np

from ...core.images import ImageSource
from ...core.scene import Camera, Colour, Link, Node, Note, World
from .images import configuration, working_space
from .view import Frame, export_camera, frame_window

Window = tuple[float, float, float, float]


@dataclass(frozen=True)
class Viewport:
    """What a viewport shows: `space` hides objects (local view, types); its own `world`, or lights.

    space is None where everything is shown.
    """

    space: Any = None
    has_lights: bool = True
    has_world: bool = True
    world: World | None = None

    def shows(self, object: bpy.types.Object) -> bool:
        """Is an object shown, and so what it makes?"""
        return self.space is None or object.visible_in_viewport_get(self.space)


EVERYTHING = Viewport()


def read_viewport(space: bpy.types.SpaceView3D, world: bpy.types.World | None) -> Viewport:
    """Return what a viewport shows of the scene; `world` is the scene's."""
    shading = space.shading
    if shading.use_scene_world_render:
        return Viewport(space, shading.use_scene_lights_render)
    colour = (0.0, 0.0, 0.0) if world is None else tuple(world.color)
    return Viewport(space, shading.use_scene_lights_render, False, _studio(shading, colour))


def viewport_key(space: bpy.types.SpaceView3D) -> tuple[Any, ...]:
    """Return what of `read_viewport` the user may change without Blender telling."""
    shading = space.shading
    types = [
        getattr(space, name)
        for name in space.bl_rna.properties.keys()  # noqa: SIM118  (no mapping)
        if name.startswith("show_object_viewport_")
    ]
    return (
        space.local_view is not None,
        space.use_local_collections,
        *types,
        shading.use_scene_lights_render,
        shading.use_scene_world_render,
        shading.use_scene_world_render or _studio_key(shading),
    )


def _studio_key(shading: bpy.types.View3DShading) -> tuple[Any, ...]:
    return (
        shading.studio_light,
        shading.studiolight_rotate_z,
        shading.studiolight_intensity,
        shading.studiolight_background_alpha,
    )


def _studio(shading: bpy.types.View3DShading, colour: Colour) -> World | None:
    """Return the surroundings that the viewport shows instead of the world, as in Cycles.

    They light the scene; the camera sees them mixed with the world's viewport colour.
    """
    light = shading.selected_studio_light
    if light is None or light.type != "WORLD":
        return None
    source = ImageSource(
        name=f"Studio light '{light.name}'",
        path=light.path,
        colorspace="Linear Rec.709",
        working_space=working_space(),
        config=configuration(),
    )
    coordinate = Node("TexCoord", "Texture Coordinate")
    turned = Node(
        "Mapping",
        "Mapping",
        {
            "Vector": Link(coordinate, "Generated"),
            "Location": (0.0, 0.0, 0.0),
            "Rotation": (0.0, 0.0, shading.studiolight_rotate_z),
            "Scale": (1.0, 1.0, 1.0),
        },
        {"vector_type": "POINT"},
    )
    picture = Node(
        "TexEnvironment",
        "Environment Texture",
        {"Vector": Link(turned, "Vector")},
        {"image": source, "projection": "EQUIRECTANGULAR", "interpolation": "Linear"},
    )
    strength = shading.studiolight_intensity
    lit = Node("Background", "Light", {"Color": Link(picture, "Color"), "Strength": strength})
    plain = Node("Background", "Plain", {"Color": tuple(colour), "Strength": 1.0})
    seen = Node(
        "MixShader",
        "Seen",
        {
            "Fac": shading.studiolight_background_alpha,
            "Shader": Link(plain, "Background"),
            "Shader_001": Link(lit, "Background"),
        },
    )
    way = Node("LightPath", "Light Path")
    mixed = Node(
        "MixShader",
        "Mix Shader",
        {
            "Fac": Link(way, "Is Camera Ray"),
            "Shader": Link(lit, "Background"),
            "Shader_001": Link(seen, "Shader"),
        },
    )
    return World("Studio light", mixed)


def export_region_camera(
    engine: bpy.types.RenderEngine,
    depsgraph: bpy.types.Depsgraph,
    region: bpy.types.Region,
    space: bpy.types.SpaceView3D,
    view: bpy.types.RegionView3D,
    notes: list[Note],
) -> Camera:
    """Return the camera of a viewport; what the scene's camera has beside its view is kept."""
    width, height = region.width, region.height
    matrix = np.array(view.window_matrix, np.float64)
    is_perspective = view.is_perspective
    to_world = np.linalg.inv(np.array(view.view_matrix, np.float64))[:3]
    camera = Camera(
        to_world=to_world,
        window=_window(matrix, is_perspective),
        width=width,
        height=height,
        projection="PERSP" if is_perspective else "ORTHO",
        clip_start=space.clip_start if is_perspective else -space.clip_end,
        clip_end=space.clip_end,
    )
    through = _seen_through(space, view, depsgraph)
    if through is None:
        return replace(camera, border=_border(space, (0.0, 0.0, width, height), width, height))
    render = depsgraph.scene_eval.render
    across, up = _picture_size(render)
    own = export_camera(engine, depsgraph, Frame(across, up, (0, 0, across, up)), notes)
    inside = _frame_in_region(camera, through, render)
    border = _border(render, inside, width, height)
    window = camera.window
    if through.data.type == "PANO":
        # It fills the camera's frame, and nothing is around it.
        window = _outside(own.window, inside, width, height)
        border = border or _pixels(inside, width, height)
    return replace(own, to_world=to_world, window=window, width=width, height=height, border=border)


def _seen_through(
    space: bpy.types.SpaceView3D, view: bpy.types.RegionView3D, depsgraph: bpy.types.Depsgraph
) -> bpy.types.Object | None:
    """Return the evaluated camera that the viewport looks through, if it does."""
    if view.view_perspective != "CAMERA":
        return None
    camera = space.camera if space.use_local_camera else depsgraph.scene_eval.camera
    if camera is None or camera.type != "CAMERA":
        return None
    return camera.evaluated_get(depsgraph)


def _window(matrix: np.ndarray, is_perspective: bool) -> Window:
    """Return (left, right, bottom, top) at distance 1, or anywhere for a parallel projection.

    A point (x, y, -1) in front of the eye is drawn at (m00 x - m02, m11 y - m12); without
    perspective at (m00 x + m03, m11 y + m13).  The edges of the window are drawn at -1 and 1.
    """
    column = 2 if is_perspective else 3
    sign = 1.0 if is_perspective else -1.0
    x, y = sign * matrix[0, column], sign * matrix[1, column]
    wide, high = matrix[0, 0], matrix[1, 1]
    return (x - 1) / wide, (x + 1) / wide, (y - 1) / high, (y + 1) / high


def _picture_size(render: bpy.types.RenderSettings) -> tuple[int, int]:
    percentage = render.resolution_percentage / 100
    size = render.resolution_x * percentage, render.resolution_y * percentage
    return max(1, int(size[0])), max(1, int(size[1]))


def _frame_in_region(
    camera: Camera, through: bpy.types.Object, render: bpy.types.RenderSettings
) -> Window:
    """Return the rectangle of the region [pixels] in which the scene's camera has its frame."""
    data = through.data
    frame = frame_window(data, render, *_picture_size(render), data.shift_x)
    left, right, bottom, top = camera.window
    across, up = camera.width / (right - left), camera.height / (top - bottom)
    return (
        (frame[0] - left) * across,
        (frame[2] - bottom) * up,
        (frame[1] - left) * across,
        (frame[3] - bottom) * up,
    )


def _outside(window: Window, inside: Window, width: int, height: int) -> Window:
    """Return what is at the region's edges, where `window` is at those of a rectangle of it."""
    left, right, bottom, top = window
    x0, y0, x1, y1 = inside
    wide, high = (right - left) / (x1 - x0), (top - bottom) / (y1 - y0)
    return (
        left - x0 * wide,
        left + (width - x0) * wide,
        bottom - y0 * high,
        bottom + (height - y0) * high,
    )


def _border(
    owner: Any, inside: Window, width: int, height: int
) -> tuple[int, int, int, int] | None:
    """Return the pixels of the region that a border in a rectangle of it leaves, None for all."""
    name = "use_border" if hasattr(owner, "use_border") else "use_render_border"
    if not getattr(owner, name):
        return None
    prefix = "border_" if name == "use_border" else "render_border_"
    low_x, low_y, high_x, high_y = inside

    def place(side: str, axis: str, low: float, high: float) -> float:
        return low + getattr(owner, f"{prefix}{side}_{axis}") * (high - low)

    low = place("min", "x", low_x, high_x), place("min", "y", low_y, high_y)
    high = place("max", "x", low_x, high_x), place("max", "y", low_y, high_y)
    return _pixels((*low, *high), width, height)


def _pixels(inside: Window, width: int, height: int) -> tuple[int, int, int, int]:
    """Return the pixels of the region that a rectangle touches."""
    x0, y0 = max(0, math.floor(inside[0])), max(0, math.floor(inside[1]))
    x1, y1 = min(width, math.ceil(inside[2])), min(height, math.ceil(inside[3]))
    # A border outside of the region leaves a pixel of it: no camera has an empty picture.
    x0, y0 = min(x0, width - 1), min(y0, height - 1)
    return x0, y0, max(x1, x0 + 1), max(y1, y0 + 1)
