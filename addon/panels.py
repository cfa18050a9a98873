"""objects, lights, materials, worlds, the report -> panels.  What Blender's own do not show.

Rows of `PANELS` name properties by their path from the datablock.  Several paths are places of one
setting; the one that is shown is the one that `addon/export` reads.  `cycles.` is there while the
Cycles add-on is enabled.
"""

import textwrap
from typing import Any, ClassVar

import bpy

from . import report, viewport
from .engine import ENGINE
from .operators import find_owner

_BOUNCES = ("penumbra.max_bounces", "cycles.max_bounces")

# Name, label, tab, the datablock in the context, rows of (label or "" for the property's, paths...)
PANELS: tuple[tuple[str, str, str, str, tuple[tuple[str, ...], ...]], ...] = (
    (
        "OBJECT_PT_penumbra_visibility",
        "Ray Visibility",
        "object",
        "object",
        (
            ("Camera", "visible_camera"),
            ("Diffuse", "visible_diffuse"),
            ("Glossy", "visible_glossy"),
            ("Transmission", "visible_transmission"),
            ("Shadow", "visible_shadow"),
            ("", "is_shadow_catcher"),
            ("", "is_holdout"),
        ),
    ),
    (
        "OBJECT_PT_penumbra_motion",
        "Motion Blur",
        "object",
        "object",
        (
            ("Motion Blur", "penumbra.use_motion_blur", "cycles.use_motion_blur"),
            ("Deformation", "penumbra.use_deform_motion", "cycles.use_deform_motion"),
            ("Steps", "penumbra.motion_steps", "cycles.motion_steps"),
        ),
    ),
    (
        "OBJECT_PT_penumbra_stars",
        "Stars",
        "object",
        "object",
        (
            ("", "penumbra.use_stars"),
            ("", "penumbra.star_strength"),
            ("", "penumbra.star_temperature"),
        ),
    ),
    (
        "OBJECT_PT_penumbra_terminator",
        "Shadow Terminator",
        "object",
        "object",
        (
            (
                "Geometry Offset",
                "shadow_terminator_geometry_offset",
                "cycles.shadow_terminator_geometry_offset",
            ),
            (
                "Shading Offset",
                "shadow_terminator_shading_offset",
                "cycles.shadow_terminator_offset",
            ),
        ),
    ),
    (
        "DATA_PT_penumbra_light",
        "Light Paths",
        "data",
        "light",
        (
            ("", "spread"),
            ("Cast Shadow", "use_shadow"),
            ("Multiple Importance", "cycles.use_multiple_importance_sampling"),
            ("", "cycles.is_portal"),
            ("", *_BOUNCES),
            ("", "penumbra.use_motion_blur"),
        ),
    ),
    (
        "MATERIAL_PT_penumbra_settings",
        "Settings",
        "material",
        "material",
        (
            ("", "pass_index"),
            ("", "displacement_method"),
            ("", "cycles.emission_sampling"),
            ("", "use_transparent_shadow"),
        ),
    ),
    (
        "WORLD_PT_penumbra_settings",
        "Settings",
        "world",
        "world",
        (
            ("Camera", "cycles_visibility.camera"),
            ("Diffuse", "cycles_visibility.diffuse"),
            ("Glossy", "cycles_visibility.glossy"),
            ("Transmission", "cycles_visibility.transmission"),
            ("Sampling", "cycles.sampling_method"),
            ("Cast Shadow", "cycles.use_shadows"),
            ("", *_BOUNCES),
        ),
    ),
    (
        "WORLD_PT_penumbra_stars",
        "Stars",
        "world",
        "world",
        (
            ("", "penumbra.use_stars"),
            ("", "penumbra.star_count"),
            ("", "penumbra.star_seed"),
            ("", "penumbra.star_strength"),
            ("", "penumbra.star_brightest"),
            ("", "penumbra.star_faintest"),
            ("", "penumbra.star_slope"),
            ("", "penumbra.star_temperature"),
            ("", "penumbra.star_temperature_spread"),
        ),
    ),
)

# What Blender shows for Cycles only: name, label, tab, the panel of the Cycles add-on that shows
# it.  Later Blenders have some of them for all engines, without the prefix.
THEIRS: tuple[tuple[str, str, str, str], ...] = (
    ("OBJECT_PT_penumbra_group", "Light Group", "object", "CYCLES_OBJECT_PT_lightgroup"),
    ("OBJECT_PT_penumbra_lit_by", "Light Linking", "object", "CYCLES_OBJECT_PT_light_linking"),
    ("OBJECT_PT_penumbra_shade", "Shadow Linking", "object", "CYCLES_OBJECT_PT_shadow_linking"),
    ("WORLD_PT_penumbra_group", "Light Group", "world", "CYCLES_WORLD_PT_settings_light_group"),
)


def _is_no_lamp(owner: bpy.types.ID) -> bool:
    """Is it not the object of a light?  Of lights, their own datablock tells whether they move."""
    return owner.type != "LIGHT"


# Rows that only some kinds of datablocks have: path -> is it one?
_ONLY = {
    "spread": lambda light: light.type == "AREA",
    "cycles.is_portal": lambda light: light.type == "AREA",
    **{
        f"{group}.{name}": _is_no_lamp
        for group in ("penumbra", "cycles")
        for name in ("use_motion_blur", "use_deform_motion")
    },
}


def place(datablock: bpy.types.ID, paths: tuple[str, ...]) -> tuple[Any, str] | None:
    """Return the owner and the name of the property that is read for a setting; None if none is."""
    found = []
    for path in paths:
        group, _, name = path.rpartition(".")
        owner = getattr(datablock, group, None) if group else datablock
        there = owner is not None and name in owner.bl_rna.properties
        if there and (path not in _ONLY or _ONLY[path](datablock)):
            found.append((group, owner, name))

    # What is ours wins where it was set, or is alone.
    for group, owner, name in found:
        if group != "penumbra" or len(found) == 1 or owner.is_property_set(name):
            return owner, name
    return None


class Ours:
    """What all our panels of the properties editor have in common."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Is it our engine?"""
        return context.engine == ENGINE


class _Settings(Ours):
    """Shows the rows of a datablock."""

    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Is there a datablock, and is it our engine?"""
        return super().poll(context) and getattr(context, cls.datablock, None) is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the settings."""
        layout, datablock = self.layout, getattr(context, self.datablock)
        layout.use_property_split = True
        for label, *paths in self.rows:
            found = place(datablock, tuple(paths))
            if found is not None and label:
                layout.prop(*found, text=label)
            elif found is not None:
                layout.prop(*found)


class _Theirs(Ours):
    """Shows what a panel of the Cycles add-on does, while there is one."""

    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Is there a datablock, the panel, and is it our engine?"""
        has_datablock = getattr(context, cls.bl_context, None) is not None
        return super().poll(context) and has_datablock and hasattr(bpy.types, cls.theirs)

    def draw(self, context: bpy.types.Context) -> None:
        """Show the settings."""
        getattr(bpy.types, self.theirs).draw(self, context)


class WORLD_PT_penumbra_preview(Ours, bpy.types.Panel):
    """A picture of the world; Blender's own panel is Cycles'."""

    bl_label = "Preview"
    bl_context = "world"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Is there a world, and is it our engine?"""
        return super().poll(context) and context.world is not None

    def draw(self, context: bpy.types.Context) -> None:
        """Show the picture."""
        self.layout.template_preview(context.world)


class RENDER_PT_penumbra_report(Ours, bpy.types.Panel):
    """What the last pictures do not honour."""

    bl_label = "Report"
    bl_context = "render"
    bl_options: ClassVar = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Show the last frame, its error if it failed, and a line for each thing not honoured."""
        layout = self.layout
        width = max(context.region.width // 8, 24)  # letters in a line
        if report.frames:
            layout.label(text=_headline(report.frames[-1]))
        for message in report.errors[-1:]:
            _lines(layout.box(), message, width, "ERROR")
        rows = report.latest_rows() + viewport.latest_rows()
        rows = [row for n, row in enumerate(rows) if row not in rows[:n]]
        for row in rows:
            box = layout.box()
            head = box.row()
            head.label(text=row["owner"])
            if find_owner(row["owner"])[0] is not None:
                button = head.operator("penumbra.select_owner", text="", icon="RESTRICT_SELECT_OFF")
                button.owner = row["owner"]
            _lines(box.column(align=True), row["what"], width)
        if report.frames and not rows:
            layout.label(text="Everything in the scene is honoured", icon="CHECKMARK")
        buttons = layout.row()
        buttons.operator("penumbra.copy_report")
        buttons.operator("penumbra.system_check")


def _headline(entry: dict[str, Any]) -> str:
    seconds = entry["statistics"]["sampling_seconds"]
    rays = entry["statistics"]["rays_per_second"] / 1e6
    where = f"Frame {entry['frame']}, {entry['view_layer']}"
    return f"{where}: {entry['samples']} samples in {seconds:.1f} s, {rays:.1f} M rays/s"


def _lines(layout: bpy.types.UILayout, text: str, width: int, icon: str = "NONE") -> None:
    """Show a text in lines: Blender would cut it off."""
    for line in textwrap.wrap(text, width):
        layout.label(text=line, icon=icon)
        icon = "BLANK1" if icon != "NONE" else icon


_registered: list[type] = []


def register() -> None:
    """Register the panels."""
    for name, label, tab, datablock, rows in PANELS:
        body = {"bl_label": label, "bl_context": tab, "datablock": datablock, "rows": rows}
        _registered.append(type(name, (_Settings, bpy.types.Panel), body))
    for name, label, tab, theirs in THEIRS:
        if hasattr(bpy.types, theirs.removeprefix("CYCLES_")):
            continue
        body = {"bl_label": label, "bl_context": tab, "theirs": theirs}
        _registered.append(type(name, (_Theirs, bpy.types.Panel), body))
    _registered.extend((WORLD_PT_penumbra_preview, RENDER_PT_penumbra_report))
    for cls in _registered:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Remove them."""
    while _registered:
        bpy.utils.unregister_class(_registered.pop())
