"""core.settings.OPTIONS -> properties of Blender's datablocks, and back to Settings.

Every datablock type that has settings of ours carries one group named `penumbra`.  Identifiers
are Cycles' own wherever Cycles has the setting, so that scripts and habits carry over.
"""

from typing import Any

import bpy
import numpy as np

from ..core.settings import OPTIONS, Option, Settings

_INT_MAX = 2**31 - 1
_FLOAT_MAX = 3.402823e38


def _property(option: Option) -> Any:
    """Return the bpy.props definition of one option."""
    texts = {"name": option.label, "description": option.help}
    if option.choices:
        return bpy.props.EnumProperty(items=option.choices, default=option.default, **texts)
    if isinstance(option.default, bool):
        return bpy.props.BoolProperty(default=option.default, **texts)
    integer = isinstance(option.default, int)
    largest = _INT_MAX if integer else _FLOAT_MAX
    limits = {
        "default": option.default,
        "min": -largest if option.minimum is None else option.minimum,
        "max": largest if option.maximum is None else min(option.maximum, largest),
    }
    if integer:
        return bpy.props.IntProperty(**limits, **texts)
    return bpy.props.FloatProperty(**limits, precision=3, **texts)


_LIGHT_BOUNCES = Option(
    "max_bounces",
    1024,
    "Max Bounces",
    "Paths with more bounces than this do not see the light",
    minimum=0,
    maximum=1024,
)

# (owner, name of the group's class, its options)
GROUPS: tuple[tuple[Any, str, tuple[Option, ...]], ...] = (
    (bpy.types.Scene, "PenumbraSceneSettings", OPTIONS),
    (bpy.types.Object, "PenumbraObjectSettings", ()),
    (bpy.types.Light, "PenumbraLightSettings", (_LIGHT_BOUNCES,)),
    (bpy.types.Material, "PenumbraMaterialSettings", ()),
    (bpy.types.World, "PenumbraWorldSettings", (_LIGHT_BOUNCES,)),
    (bpy.types.Camera, "PenumbraCameraSettings", ()),
)

_registered: list[tuple[Any, type]] = []


def register() -> None:
    """Add the group `penumbra` to every datablock type of `GROUPS`."""
    for owner, name, options in GROUPS:
        annotations = {option.name: _property(option) for option in options}
        group = type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations})
        bpy.utils.register_class(group)
        owner.penumbra = bpy.props.PointerProperty(type=group, name="Penumbra")
        _registered.append((owner, group))


def unregister() -> None:
    """Remove the groups; values stay in the file until it is saved without them."""
    while _registered:
        owner, group = _registered.pop()
        del owner.penumbra
        bpy.utils.unregister_class(group)


def read_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Settings:
    """Return the settings of a scene; a view layer's own sample count wins, as in Cycles."""
    group = scene.penumbra
    values = {option.name: _exact(getattr(group, option.name)) for option in OPTIONS}
    if view_layer.samples > 0:
        values["samples"] = view_layer.samples
    return Settings(**values)


def read_max_bounces(datablock: bpy.types.ID) -> int:
    """Return the bounce limit of a light or world; Cycles' own one where ours was never set."""
    cycles = getattr(datablock, "cycles", None)
    if datablock.penumbra.is_property_set("max_bounces") or cycles is None:
        return datablock.penumbra.max_bounces
    return cycles.max_bounces


def adopt_cycles(scene: bpy.types.Scene) -> list[str]:
    """Copy the settings that Cycles has too, where ours were never set; return their names.

    Nothing happens without the Cycles add-on, which is what keeps those values readable.
    """
    cycles, ours = getattr(scene, "cycles", None), scene.penumbra
    names = [
        option.name
        for option in OPTIONS
        if hasattr(cycles, option.name) and not ours.is_property_set(option.name)
    ]
    for name in names:
        setattr(ours, name, getattr(cycles, name))
    return names


def _exact(value: Any) -> Any:
    """Return the shortest number that Blender's float32 stands for: 0.01, not 0.0099999998."""
    return float(str(np.float32(value))) if isinstance(value, float) else value
