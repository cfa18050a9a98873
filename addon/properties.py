"""core.settings.OPTIONS -> properties of Blender's datablocks, and back to Settings.

Every datablock type that has settings of ours carries one group named `penumbra`.  Identifiers
are Cycles' own wherever Cycles has the setting, so that scripts and habits carry over.
"""

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from ..core.settings import OPTIONS, UNLIMITED, Option, Settings, replace

listeners: list[Callable[[], None]] = []  # called when a setting of a scene is changed

PREVIEW_SAMPLES, PREVIEW_BOUNCES = 32, 8  # of icons

_INT_MAX = 2**31 - 1
_FLOAT_MAX = 3.402823e38


def _changed(group: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    """Tell those who show the datablock: Blender does not, as it does not know what it means."""
    owner = group.id_data
    if isinstance(owner, bpy.types.Scene):
        for listener in listeners:
            listener()
    else:
        owner.update_tag()


def _property(option: Option) -> Any:
    """Return the bpy.props definition of one option."""
    texts = {
        "name": option.label,
        "description": option.help,
        "update": _update_passes if option.name in _CHANGE_PASSES else _changed,
    }
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


def _update_passes(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    """Let the sockets of Render Layers nodes follow the passes of a changed view layer."""
    _changed(group, context)
    if context.view_layer is not None:
        context.view_layer.update_render_passes()


_LIGHT_BOUNCES = Option(
    "max_bounces",
    1024,
    "Max Bounces",
    "Paths with more bounces than this do not see the light",
    minimum=0,
    maximum=1024,
)

_OBJECT_MOTION = (
    Option("use_motion_blur", True, "Motion Blur", "The object moves while the shutter is open"),
    Option(
        "use_deform_motion",
        True,
        "Deformation",
        "Its vertices move by themselves, too: armatures, shape keys, simulations",
    ),
    Option(
        "motion_steps",
        1,
        "Steps",
        "How finely its motion is looked at: at two times more, and between each two of them",
        minimum=1,
        maximum=7,
    ),
)
_STARS = (
    Option(
        "use_stars",
        False,
        "Stars",
        "Its points are drawn as stars, smaller than any pixel, in place of its faces",
    ),
    Option(
        "star_strength",
        1.0,
        "Strength",
        "Power of a star in watts, as of a point light; the attribute star_strength of a point "
        "is a factor on it",
        minimum=0.0,
    ),
    Option(
        "star_temperature",
        0.0,
        "Temperature",
        "Colour of the stars as black bodies in kelvins, white if 0; a point's own one is its "
        "attribute star_temperature, and star_color tints it",
        minimum=0.0,
    ),
)
_STAR_FIELD = (
    Option("use_stars", False, "Stars", "The world has stars all around, which the camera sees"),
    Option("star_count", 9000, "Count", "Number of stars, all around", minimum=0, maximum=10**7),
    Option("star_seed", 0, "Seed", "Gives other stars", minimum=0),
    Option(
        "star_strength",
        1.0,
        "Strength",
        "Irradiance of a star of magnitude 0, in microwatts per square metre; 0.025 on Earth",
        minimum=0.0,
    ),
    Option("star_brightest", -1.5, "Brightest", "Magnitude of the brightest stars"),
    Option("star_faintest", 6.5, "Faintest", "Magnitude of the faintest stars"),
    Option(
        "star_slope",
        0.5,
        "Slope",
        "With each magnitude there are 10^slope times as many stars: 0.6 in an even universe",
        minimum=0.0,
        maximum=2.0,
    ),
    Option(
        "star_temperature",
        6500.0,
        "Temperature",
        "Middle of the stars' temperatures in kelvins",
        minimum=800.0,
        maximum=12000.0,
    ),
    Option(
        "star_temperature_spread",
        0.5,
        "Spread",
        "How far temperatures differ from the middle, as a share of it",
        minimum=0.0,
        maximum=1.0,
    ),
)
_LAMP_MOTION = Option(
    "use_motion_blur",
    False,
    "Motion Blur",
    "The light moves while the shutter is open; in Cycles lights are still",
)

# What the viewport does, beside the options of a render
VIEWPORT = (Option("preview_pause", False, "Pause", "Pause the refinement of rendered viewports"),)
_LAYER = (
    Option(
        "use_denoising",
        True,
        "Denoising",
        "Denoise this view layer, if the scene is denoised",
    ),
    Option(
        "denoising_store_passes",
        False,
        "Denoising Data",
        "Colours, normals and distances that guide a denoiser, in passes of their own",
    ),
    Option(
        "use_pass_shadow_catcher",
        False,
        "Shadow Catcher",
        "Shadows on shadow catchers in a pass to multiply a background with, not in the picture",
    ),
    Option(
        "pass_debug_sample_count",
        False,
        "Sample Count",
        "Number of samples of each pixel",
    ),
    Option(
        "pass_render_time",
        False,
        "Render Time",
        "Time that each pixel took in milliseconds",
    ),
)

# After a change of these, Blender's compositor has other passes to offer.
_CHANGE_PASSES = {option.name for option in _LAYER}

# (owner, name of the group's class, its options)
GROUPS: tuple[tuple[Any, str, tuple[Option, ...]], ...] = (
    (bpy.types.Scene, "PenumbraSceneSettings", OPTIONS + VIEWPORT),
    (bpy.types.Object, "PenumbraObjectSettings", _OBJECT_MOTION + _STARS),
    (bpy.types.Light, "PenumbraLightSettings", (_LIGHT_BOUNCES, _LAMP_MOTION)),
    (bpy.types.Material, "PenumbraMaterialSettings", ()),
    (bpy.types.World, "PenumbraWorldSettings", (_LIGHT_BOUNCES, *_STAR_FIELD)),
    (bpy.types.Camera, "PenumbraCameraSettings", ()),
    (bpy.types.ViewLayer, "PenumbraLayerSettings", _LAYER),
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
    """Return the settings of a scene: ours where they were set, else Cycles'.

    A view layer's own sample count wins, as in Cycles.
    """
    values = {option.name: _exact(read_option(scene, option.name)) for option in OPTIONS}
    if view_layer.samples > 0:
        values["samples"] = view_layer.samples
    return Settings(**values)


def read_viewport_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Settings:
    """Return the settings of a scene for the viewport: all samples, or what the preview has.

    Its denoiser is the quick one, by the same guides as that of a render.
    """
    settings = read_settings(scene, view_layer)
    return replace(
        settings,
        samples=settings.preview_samples or UNLIMITED,
        use_sample_subset=False,
        time_limit=0.0,
        use_adaptive_sampling=False,
        use_denoising=settings.use_preview_denoising,
        denoising_prefilter="FAST",
        denoising_quality="FAST",
    )


def read_preview_settings(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> Settings:
    """Return settings for the icon of a material, light or world, which is small and soon there."""
    del scene, view_layer  # Blender's own, which nobody can set
    return Settings(
        samples=PREVIEW_SAMPLES,
        max_bounces=PREVIEW_BOUNCES,
        use_adaptive_sampling=False,
        use_denoising=False,
    )


def read_max_bounces(datablock: bpy.types.ID) -> int:
    """Return the bounce limit of a light or world; Cycles' own one where ours was never set."""
    return read_own(datablock, "max_bounces")


def read_own(datablock: bpy.types.ID, name: str) -> Any:
    """Return a setting of a datablock; Cycles' own one where ours was never set."""
    cycles = getattr(datablock, "cycles", None)
    if datablock.penumbra.is_property_set(name) or not hasattr(cycles, name):
        return getattr(datablock.penumbra, name)
    return getattr(cycles, name)


def adopt_cycles(scene: bpy.types.Scene, again: bool = False) -> list[str]:
    """Copy the settings that Cycles has too, where ours were never set; return their names.

    With `again`, those that were set as well.  Nothing happens without the Cycles add-on, which is
    what keeps those values readable.
    """
    owners = [(scene, OPTIONS), *((layer, _LAYER) for layer in scene.view_layers)]
    names = []
    for owner, options in owners:
        cycles, ours = getattr(owner, "cycles", None), owner.penumbra
        for name in (option.name for option in options):
            if hasattr(cycles, name) and (again or not ours.is_property_set(name)):
                setattr(ours, name, getattr(cycles, name))
                names.append(name)
    return names


def read_option(owner: bpy.types.Scene | bpy.types.ViewLayer, name: str) -> Any:
    """Return a setting of ours; Cycles' own one where ours was never set."""
    cycles, ours = getattr(owner, "cycles", None), owner.penumbra
    follow = hasattr(cycles, name) and not ours.is_property_set(name)
    return getattr(cycles if follow else ours, name)


_WHOLE = 2.0**24  # float32 from here on are whole numbers


def _exact(value: Any) -> Any:
    """Return the shortest number that Blender's float32 stands for: 0.01, not 0.0099999998.

    Large ones are whole numbers, and as they are.
    """
    is_short = isinstance(value, float) and abs(value) < _WHOLE
    return float(str(np.float32(value))) if is_short else value
