"""bpy view layers -> core.layer.Layer.  The passes that a view layer asks for."""

from collections.abc import Iterator

import bpy

from ...core.film.passes import CATCHER, IS_DENOISED, PASSES, STORES, Pass
from ...core.layer import MATTES, Layer, Mist
from ...core.scene import Note
from ..properties import read_option
from .motion import has_motion_blur

# Blender's falloffs of mist, and the power by which it grows
_FALLOFFS = {"QUADRATIC": 2.0, "LINEAR": 1.0, "INVERSE_QUADRATIC": 0.5}

# Flags that say nothing of what this engine draws
_OTHERS = {"use_pass_combined", "use_pass_cryptomatte_accurate", "use_pass_grease_pencil"}


def export_layer(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Layer:
    """Return what a view layer asks of the picture besides Combined."""
    mattes = tuple(
        kind
        for kind in MATTES
        if getattr(layer, f"use_pass_cryptomatte_{kind.removeprefix('Crypto').lower()}")
    )
    world = layer_world(scene, layer)
    return Layer(
        passes=tuple(each.name for each in PASSES if is_wanted(each, scene, layer)),
        aovs=tuple((aov.name, aov.type == "COLOR") for aov in layer.aovs if aov.is_valid),
        light_groups=tuple(group.name for group in layer.lightgroups),
        mattes=mattes,
        levels=layer.pass_cryptomatte_depth,
        alpha_threshold=layer.pass_alpha_threshold,
        mist=Mist() if world is None else _mist(world),
        is_denoised=read_option(layer, "use_denoising"),
        occlusion_distance=1e30 if world is None else world.light_settings.distance,
    )


def layer_world(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bpy.types.World | None:
    """Return the surroundings of a view layer."""
    return getattr(layer, "world_override", None) or scene.world


def is_wanted(pass_: Pass, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bool:
    """Tell whether a view layer asks for a pass."""
    return all(_is_on(flag, scene, layer) for flag in (pass_.flag, pass_.besides) if flag)


def _is_on(flag: str, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> bool:
    """Tell whether a view layer has a property set, after "own." one of the engine's."""
    if flag == IS_DENOISED and not read_option(scene, "use_denoising"):
        return False
    owner, _, name = flag.rpartition(".")
    return bool(read_option(layer, name) if owner else getattr(layer, name))


def _mist(world: bpy.types.World) -> Mist:
    settings = world.mist_settings
    return Mist(settings.start, settings.depth, _FALLOFFS[settings.falloff])


def blender_passes(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Iterator[tuple[str, str]]:
    """Yield the names and channels of all passes of a view layer, as this Blender calls them."""
    asked = export_layer(scene, layer)
    yield "Combined", "RGBA"
    for each in PASSES:
        if each.name in asked.passes:
            yield blender_name(each), each.channels
    for kind in asked.mattes:
        for place in range(asked.pairs):
            # Lower case makes OpenEXR compress without loss
            yield f"{kind}{place:02}", "rgba"
    for name, is_colour in asked.aovs:
        yield name, "RGBA" if is_colour else "X"
    for name in asked.light_groups:
        yield f"Combined_{name}", "RGB"


def blender_name(pass_: Pass) -> str:
    """Return what this Blender calls a pass."""
    if bpy.app.version < (5, 0) and pass_.before_5:
        return pass_.before_5
    return pass_.name


def channel_type(channels: str) -> str:
    """Return what sort of numbers channels hold, in Blender's terms."""
    if len(channels) == 1:
        return "VALUE"
    return "COLOR" if channels.lower().startswith("rgb") else "VECTOR"


def layer_notes(scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> Iterator[Note]:
    """Yield what a view layer asks for and does not get."""
    owner = f"View layer '{layer.name}'"
    if layer.use_pass_vector and has_motion_blur(scene, layer):
        yield Note(owner, "pass Vector is blank with motion blur")
    flags = {each.flag for each in PASSES} | _OTHERS
    for asking in (layer, getattr(layer, "cycles", None)):
        for prop in () if asking is None else asking.bl_rna.properties:
            name = prop.identifier
            if name.startswith("use_pass_cryptomatte") or {name, f"own.{name}"} & flags:
                continue
            if name.startswith("use_pass_") and getattr(asking, name):
                yield Note(owner, f"pass {prop.name} is not drawn")
    if _is_on(STORES, scene, layer) and bpy.app.version >= (5, 2):
        for name in ("Roughness", "Specular Albedo"):
            yield Note(owner, f"pass Denoising {name} is not drawn")
    if _is_on(CATCHER, scene, layer) and _is_on(IS_DENOISED, scene, layer):
        yield Note(owner, "pass Shadow Catcher is not denoised")
