"""settings -> panels.  Our own panels are made by looping over `PANELS`; the rest is Blender's.

Options that the engine does not honour yet (`Option.awaits`) are not shown.  Built-in panels
are opted in through COMPAT_ENGINES: those that Blender marks as good for any engine (the
marker is still BLENDER_RENDER), less `DECLINED`, plus the ones of `BORROWED` that show only
what we honour.
"""

from collections.abc import Iterator

import bpy

from ..core.film.passes import PASSES
from ..core.settings import OPTIONS
from . import presets
from .engine import ENGINE
from .panels import Ours

# Label, options in the order they are shown; "render:" marks Blender's own render settings
PANELS: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "Sampling",
        (
            "samples",
            "preview_samples",
            "time_limit",
            "pattern",
            "light_samples",
            "scatter_samples",
            "path_reuse",
            "splitting",
            "seed",
            "use_animated_seed",
            "use_sample_subset",
            "sample_offset",
            "sample_subset_length",
            "use_adaptive_sampling",
            "adaptive_threshold",
            "adaptive_min_samples",
            "use_light_tree",
            "light_sampling_threshold",
            "use_denoising",
            "denoising_input_passes",
            "denoising_prefilter",
            "denoising_quality",
            "use_preview_denoising",
        ),
    ),
    (
        "Light Paths",
        (
            "max_bounces",
            "diffuse_bounces",
            "glossy_bounces",
            "transmission_bounces",
            "volume_bounces",
            "transparent_max_bounces",
            "sample_clamp_direct",
            "sample_clamp_indirect",
            "blur_glossy",
            "caustics_reflective",
            "caustics_refractive",
        ),
    ),
    (
        "Film",
        (
            "film_exposure",
            "pixel_filter_type",
            "filter_width",
            "render:film_transparent",
            "film_transparent_glass",
            "film_transparent_roughness",
        ),
    ),
    (
        "Motion Blur",
        (
            "render:use_motion_blur",
            "render:motion_blur_position",
            "render:motion_blur_shutter",
            "rolling_shutter_type",
            "rolling_shutter_duration",
        ),
    ),
    (
        "Performance",
        (
            "render:threads_mode",
            "render:threads",
            "workers",
            "texture_filter",
            "instance_memory",
            "texture_memory",
            "render:preview_pixel_size",
        ),
    ),
)

# option -> is it of any use with these settings?
ACTIVE = {
    "adaptive_threshold": lambda settings, render: settings.use_adaptive_sampling,
    "adaptive_min_samples": lambda settings, render: settings.use_adaptive_sampling,
    "sample_offset": lambda settings, render: settings.use_sample_subset,
    "sample_subset_length": lambda settings, render: settings.use_sample_subset,
    **dict.fromkeys(
        ("denoising_input_passes", "denoising_prefilter", "denoising_quality"),
        lambda settings, render: settings.use_denoising,
    ),
    "filter_width": lambda settings, render: settings.pixel_filter_type != "BOX",
    "film_transparent_glass": lambda settings, render: render.film_transparent,
    "film_transparent_roughness": lambda settings, render: (
        render.film_transparent and settings.film_transparent_glass
    ),
    "threads": lambda settings, render: render.threads_mode == "FIXED",
    "motion_blur_position": lambda settings, render: render.use_motion_blur,
    "motion_blur_shutter": lambda settings, render: render.use_motion_blur,
    "rolling_shutter_type": lambda settings, render: render.use_motion_blur,
    "rolling_shutter_duration": lambda settings, render: (
        render.use_motion_blur and settings.rolling_shutter_type != "NONE"
    ),
}

DECLINED = {
    "DATA_PT_light",  # DATA_PT_EEVEE_light shows the same and more
    "DATA_PT_curves_surface",
    "DATA_PT_volume_render",
    "EEVEE_MATERIAL_PT_viewport_settings",
    "NODE_DATA_PT_light",
}
BORROWED = {
    "MATERIAL_PT_preview",
    "DATA_PT_EEVEE_light",
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_displacement",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_mist",
    "EEVEE_WORLD_PT_surface",
    "NODE_DATA_PT_EEVEE_light",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
    "VIEWLAYER_PT_layer_passes_aov",
    "VIEWLAYER_PT_layer_passes_cryptomatte",
    "VIEWLAYER_PT_layer_passes_lightgroups",
    "VIEWLAYER_PT_override",
    "CYCLES_VIEW3D_PT_shading_lighting",  # of the Cycles add-on; the set of engines is its own
}

# Panorama -> its settings, which Blender shows for Cycles only
PANORAMAS: dict[str, tuple[str, ...]] = {
    "EQUIRECTANGULAR": ("latitude_min", "latitude_max", "longitude_min", "longitude_max"),
    "FISHEYE_EQUIDISTANT": ("fisheye_fov",),
    "FISHEYE_EQUISOLID": ("fisheye_lens", "fisheye_fov"),
    "FISHEYE_LENS_POLYNOMIAL": (
        "fisheye_fov",
        *(f"fisheye_polynomial_k{power}" for power in range(5)),
    ),
    "CENTRAL_CYLINDRICAL": (
        *(f"central_cylindrical_range_{side}" for side in ("v_min", "v_max", "u_min", "u_max")),
        "central_cylindrical_radius",
    ),
}

_AWAITED = {option.name for option in OPTIONS if option.awaits}
_registered: list[type] = []


def _draw(self: bpy.types.Panel, context: bpy.types.Context) -> None:
    settings, render = context.scene.penumbra, context.scene.render
    layout = self.layout
    layout.use_property_split = True
    layout.use_property_decorate = False
    for name in self.options:
        owner, _, name = name.rpartition(":")
        if name not in _AWAITED:
            row = layout.row()
            row.active = ACTIVE.get(name, lambda *_: True)(settings, render)
            row.prop(render if owner == "render" else settings, name)
    if self.options[0] == "render:use_motion_blur":
        layout.template_curve_mapping(render, "motion_blur_shutter_curve")
    if self.options[0] == "samples":
        layout.operator("penumbra.adopt_cycles")


def _panel(label: str, options: tuple[str, ...]) -> type:
    """Return the class of one panel in the render tab."""
    name = f"RENDER_PT_penumbra_{label.lower().replace(' ', '_')}"
    body = {
        "bl_label": label,
        "bl_context": "render",
        "bl_order": -1,
        "options": options,
        "draw": _draw,
    }
    if label == "Sampling":
        body["draw_header_preset"] = presets.draw_button
    return type(name, (Ours, bpy.types.Panel), body)


def _draw_pause(self: bpy.types.Header, context: bpy.types.Context) -> None:
    """Show the button that pauses, in the header of a rendered viewport, as with Cycles."""
    if context.engine == ENGINE and context.space_data.shading.type == "RENDERED":
        settings = context.scene.penumbra
        icon = "PLAY" if settings.preview_pause else "PAUSE"
        self.layout.prop(settings, "preview_pause", icon=icon, text="")


class VIEWLAYER_PT_penumbra_passes(Ours, bpy.types.Panel):
    """The passes that a view layer may ask for, from the table of passes."""

    bl_label = "Light and Data"
    bl_context = "view_layer"
    bl_parent_id = "VIEWLAYER_PT_layer_passes"

    def draw(self, context: bpy.types.Context) -> None:
        """Show a switch for each pass that is drawn."""
        layer, layout = context.view_layer, self.layout
        column = layout.grid_flow(columns=2, even_columns=True)
        for flag, name in {each.flag: each.name for each in PASSES}.items():
            owner, _, flag = flag.rpartition(".")
            if owner:
                column.prop(layer.penumbra, flag)
            else:
                column.prop(layer, flag, text=name)
        layout.prop(layer, "pass_alpha_threshold")


class DATA_PT_penumbra_panorama(Ours, bpy.types.Panel):
    """What Blender's lens panel leaves out of a panoramic camera."""

    bl_label = "Panorama"
    bl_context = "data"
    bl_parent_id = "DATA_PT_lens"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Is it a panoramic camera, and our engine?"""
        camera = context.camera
        return super().poll(context) and camera is not None and camera.type == "PANO"

    def draw(self, context: bpy.types.Context) -> None:
        """Show the settings."""
        layout, camera = self.layout, context.camera
        layout.use_property_split = True
        layout.prop(camera, "panorama_type")
        for name in PANORAMAS.get(camera.panorama_type, ()):
            layout.prop(camera, name)


def _subclasses(base: type) -> Iterator[type]:
    for child in base.__subclasses__():
        yield child
        yield from _subclasses(child)


def _welcome(panel: type) -> bool:
    """Is a built-in panel of use with our engine?"""
    engines = getattr(panel, "COMPAT_ENGINES", ())
    generic = "BLENDER_RENDER" in engines and panel.__name__ not in DECLINED
    return bool(engines) and (generic or panel.__name__ in BORROWED)


def register() -> None:
    """Register our panels and opt in to Blender's."""
    panels = [_panel(*row) for row in PANELS]
    own = DATA_PT_penumbra_panorama, VIEWLAYER_PT_penumbra_passes
    for cls in (*panels, *own):
        bpy.utils.register_class(cls)
        _registered.append(cls)
    for panel in _subclasses(bpy.types.Panel):
        if _welcome(panel):
            panel.COMPAT_ENGINES.add(ENGINE)
    bpy.types.VIEW3D_HT_header.append(_draw_pause)


def unregister() -> None:
    """Remove our panels, and our name from Blender's."""
    bpy.types.VIEW3D_HT_header.remove(_draw_pause)
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
    for panel in _subclasses(bpy.types.Panel):
        if ENGINE in getattr(panel, "COMPAT_ENGINES", ()):
            panel.COMPAT_ENGINES.discard(ENGINE)
