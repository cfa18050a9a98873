"""numbers -> a propeller that turns, a ball that flies and a toy that rolls past what stands still.

The shutter is open for half a frame; the propeller turns by 40 degrees from frame to frame.
"""

import math

import bpy

from ...examples._stage import ball, box, camera, cone, lamp, put
from .shapes import begin, metal, plastic, soft_box, suzanne


def build():
    """Make the things that move, and those that do not, in an empty file."""
    begin(336, 240, world=(0.10, 0.12, 0.15))
    red, white = plastic("Red", (0.6, 0.06, 0.04), 0.35), plastic("White", (0.7, 0.7, 0.68), 0.5)
    steel, blue = metal("Steel", (0.6, 0.62, 0.66), 0.3), plastic("Blue", (0.05, 0.16, 0.45), 0.3)
    put("Floor", box(14, 10, 0.2), white, at=(0, 1, -0.1))
    put("Wall", box(14, 0.2, 6), white, at=(0, 3.2, 2.9))
    for k in range(8):
        put(f"Post {k}", cone(0.06, 0.06, 1.4, 24, True), blue, at=(-3.1 + 0.9 * k, 2.4, 0))
    put("Stand", cone(0.12, 0.08, 1.5, 48, True), steel, at=(-1.4, 0.9, 0))
    hub = put("Hub", ball(0.14), steel, at=(-1.4, 0.7, 1.55))
    for k in range(3):
        blade = put(f"Blade {k}", soft_box(0.2, 0.04, 0.9, 0.015), red, turn=(0, 120 * k + 20, 0))
        angle = math.radians(120 * k + 20)
        blade.location = (0.5 * math.sin(angle), 0, 0.5 * math.cos(angle))
        blade.parent = hub
    flying = put("Ball", ball(0.22), red, at=(0.4, 0.3, 1.3))
    rolling = suzanne("Toy", blue, (1.3, -0.6, 0.62), (0, 0, 20), 0.55, levels=2)
    put("Cube", soft_box(0.7, 0.7, 0.7, 0.06), red, at=(0.1, -1.1, 0.36), turn=(0, 0, 35))

    _keys(hub, "rotation_euler", 1, math.radians(40))
    _keys(flying, "location", 0, 0.5)
    _keys(flying, "location", 2, -0.25)
    _keys(rolling, "location", 0, 0.35)
    render = bpy.context.scene.render
    render.use_motion_blur, render.motion_blur_shutter = True, 0.5
    bpy.context.scene.frame_set(1)
    lamp("Lamp", "AREA", 260, (-2.5, -3.0, 4.5), (0, 0.5, 0.6), size=1.4)
    camera(at=(0, -6.6, 2.2), to=(0, 0.4, 0.85), lens=45)


def _keys(thing, path, axis, step):
    """Make one number of an object grow by `step` from frame to frame, evenly."""
    start = getattr(thing, path)[axis]
    before = bpy.context.preferences.edit.keyframe_new_interpolation_type
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "LINEAR"
    for frame in (0, 2):
        getattr(thing, path)[axis] = start + step * (frame - 1)
        thing.keyframe_insert(path, index=axis, frame=frame)
    bpy.context.preferences.edit.keyframe_new_interpolation_type = before
    getattr(thing, path)[axis] = start
