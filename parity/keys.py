"""names and values over time -> keyframes in bpy.  The part of the stage that moves.

Keys are at frames 0 and 2, and frame 1 is rendered, so that a shutter of one frame shows the
middle half in time of what they do.
"""

from collections.abc import Sequence
from typing import Any

import bpy

FRAMES = (0, 2)


def blur(shutter: float = 1.0, position: str = "CENTER", curve: Sequence[float] = ()) -> None:
    """Open the shutter for so many frames; `curve` are heights of its curve at equal steps."""
    scene = bpy.context.scene
    render = scene.render
    render.use_motion_blur = True
    render.motion_blur_shutter = shutter
    render.motion_blur_position = position
    if curve:
        mapping = render.motion_blur_shutter_curve
        points = mapping.curves[0].points
        while len(points) > 2:
            points.remove(points[1])
        for _ in curve[2:]:
            points.new(0.5, 0.5)
        for number, height in enumerate(curve):
            points[number].location = (number / (len(curve) - 1), height)
            points[number].handle_type = "VECTOR"
        mapping.update()
    scene.frame_set(1)


def keyed(owner: Any, name: str, *values: Any) -> Any:
    """Set a property to a first and a last value; return its owner."""
    for frame, value in zip(FRAMES, values, strict=True):
        setattr(owner, name, value)
        owner.keyframe_insert(name, frame=frame)
    return owner


def child(thing: Any, parent: Any) -> Any:
    """Parent an object, in the parent's coordinates; return it."""
    thing.parent = parent
    return thing


def empty(name: str = "Empty") -> Any:
    """Put an object that shows nothing."""
    thing = bpy.data.objects.new(name, None)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def instancer(*members: Any) -> Any:
    """Move objects to a collection that is shown where the object that is returned is."""
    group = bpy.data.collections.new("Shown")
    for thing in members:
        bpy.context.scene.collection.objects.unlink(thing)
        group.objects.link(thing)
    maker = empty("Maker")
    maker.instance_type, maker.instance_collection = "COLLECTION", group
    return maker


def bent_by_bones(thing: Any, height: float) -> Any:
    """Bind a mesh from z = 0 to `height` to two bones; return the upper one, to be turned."""
    armature = bpy.data.objects.new("Bones", bpy.data.armatures.new("Bones"))
    bpy.context.scene.collection.objects.link(armature)
    armature.matrix_world = thing.matrix_world
    armature.location = thing.location
    bpy.context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for number in range(2):
        bone = armature.data.edit_bones.new(f"Bone {number}")
        bone.head, bone.tail = (0, 0, number * height / 2), (0, 0, (number + 1) * height / 2)
        bone.parent = armature.data.edit_bones[0] if number else None
    bpy.ops.object.mode_set(mode="OBJECT")
    groups = [thing.vertex_groups.new(name=f"Bone {number}") for number in range(2)]
    for vertex in thing.data.vertices:
        share = min(max(2 * vertex.co.z / height - 0.5, 0.0), 1.0)
        groups[0].add([vertex.index], 1 - share, "REPLACE")
        groups[1].add([vertex.index], share, "REPLACE")
    thing.modifiers.new("Bones", "ARMATURE").object = armature
    upper = armature.pose.bones["Bone 1"]
    upper.rotation_mode = "XYZ"
    return upper


def shape(thing: Any, z: float) -> Any:
    """Give a mesh a shape in which what is above its origin is `z` times as high; return it."""
    thing.shape_key_add(name="Basis")
    key = thing.shape_key_add(name="Tall")
    for point in key.data:
        if point.co.z > 0:
            point.co.z *= z
    return key
