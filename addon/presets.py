"""button beside Sampling -> settings.  Presets: those that come along, and the user's own."""

from typing import Any, ClassVar

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from ..core.settings import OPTIONS
from .switch import switch

_DEFAULTS = {option.name: option.default for option in OPTIONS}
_QUICK = {"denoising_prefilter": "FAST", "denoising_quality": "FAST"}

# Preset -> what it changes of the defaults; settings that no preset names are left alone
PRESETS: dict[str, dict[str, Any]] = {
    "Draft": {"samples": 32, "adaptive_threshold": 0.1, **_QUICK},
    "Preview": {"samples": 256, "adaptive_threshold": 0.05, **_QUICK},
    "Final": {},
}

# What presets hold, those of the user as well
NAMES = (
    "samples",
    "time_limit",
    "light_samples",
    "scatter_samples",
    "path_reuse",
    "splitting",
    "use_adaptive_sampling",
    "adaptive_threshold",
    "adaptive_min_samples",
    "use_denoising",
    "denoising_input_passes",
    "denoising_prefilter",
    "denoising_quality",
)


class PENUMBRA_OT_sampling_preset(bpy.types.Operator):
    """Set what a preset holds."""

    bl_idname = "penumbra.sampling_preset"
    bl_label = "Sampling Preset"
    bl_description = "Set samples, noise threshold and denoising"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    preset: bpy.props.EnumProperty(items=[(name, name, "") for name in PRESETS], name="Preset")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Set the values."""
        values = {name: _DEFAULTS[name] for name in NAMES} | PRESETS[self.preset]
        for name, value in values.items():
            setattr(context.scene.penumbra, name, value)
        return {"FINISHED"}


class PENUMBRA_OT_sampling_preset_add(AddPresetBase, bpy.types.Operator):
    """Keep the settings in a file of the user, or remove one."""

    bl_idname = "penumbra.sampling_preset_add"
    bl_label = "Add Sampling Preset"
    preset_menu = "RENDER_PT_penumbra_presets"
    preset_subdir = "penumbra/sampling"
    preset_defines: ClassVar = ["settings = bpy.context.scene.penumbra"]
    preset_values: ClassVar = [f"settings.{name}" for name in NAMES]


class RENDER_PT_penumbra_presets(PresetPanel, bpy.types.Panel):
    """The list behind the button."""

    bl_label = "Sampling Presets"
    preset_subdir = "penumbra/sampling"
    preset_operator = "script.execute_preset"
    preset_add_operator = "penumbra.sampling_preset_add"

    def draw(self, context: bpy.types.Context) -> None:
        """Show ours, then the user's."""
        column = self.layout.column()
        column.emboss = "PULLDOWN_MENU"
        for name in PRESETS:
            column.operator("penumbra.sampling_preset", text=name).preset = name
        super().draw(context)


def draw_button(panel: bpy.types.Panel, _context: bpy.types.Context) -> None:
    """Show the button in the header of a panel."""
    RENDER_PT_penumbra_presets.draw_panel_header(panel.layout)


register, unregister = switch(
    PENUMBRA_OT_sampling_preset,
    PENUMBRA_OT_sampling_preset_add,
    RENDER_PT_penumbra_presets,
)
