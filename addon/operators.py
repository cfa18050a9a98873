"""buttons -> what they do.  Copy from Cycles, system check, from the report to a culprit."""

import re
from typing import ClassVar

import bpy

from . import report
from .properties import adopt_cycles
from .switch import switch
from .system import check

# The report's owner -> where bpy.data keeps it, the tab of the properties editor that shows it
_KINDS = {
    "Object": ("objects", "OBJECT"),
    "Mesh": ("meshes", "DATA"),
    "Light": ("lights", "DATA"),
    "Camera": ("cameras", "DATA"),
    "Material": ("materials", "MATERIAL"),
    "World": ("worlds", "WORLD"),
}


class PENUMBRA_OT_adopt_cycles(bpy.types.Operator):
    """Take over the scene's settings for Cycles."""

    bl_idname = "penumbra.adopt_cycles"
    bl_label = "Copy from Cycles"
    bl_description = "Copy the scene's settings for Cycles over this engine's"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Are there settings to read?"""
        return hasattr(context.scene, "cycles")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy, and say how many."""
        names = adopt_cycles(context.scene, again=True)
        self.report({"INFO"}, f"{len(names)} settings copied from Cycles")
        return {"FINISHED"}


class PENUMBRA_OT_system_check(bpy.types.Operator):
    """Tell what a bug report should say."""

    bl_idname = "penumbra.system_check"
    bl_label = "System Check"
    bl_description = "Show versions and the processor, render a test, and copy it to the clipboard"

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Check, and show what was found."""
        self.rows = check()
        context.window_manager.clipboard = _text(self.rows)
        return context.window_manager.invoke_popup(self, width=500)

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Check, and report what was found."""
        self.rows = check()
        self.report({"INFO"}, _text(self.rows))
        return {"FINISHED"}

    def draw(self, context: bpy.types.Context) -> None:
        """Show what was found."""
        self.layout.label(text="System Check (copied to the clipboard)")
        for name, value in self.rows:
            split = self.layout.split(factor=0.25)
            split.label(text=name)
            split.label(text=value, icon="ERROR" if value.startswith("FAILED") else "NONE")


class PENUMBRA_OT_copy_report(bpy.types.Operator):
    """Copy the report to the clipboard."""

    bl_idname = "penumbra.copy_report"
    bl_label = "Copy Report"
    bl_description = "Copy what the last pictures do not honour to the clipboard"

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Copy."""
        lines = [f"{row['owner']}: {row['what']}" for row in report.latest_rows()]
        context.window_manager.clipboard = "\n".join([*report.errors[-1:], *lines])
        return {"FINISHED"}


class PENUMBRA_OT_select_owner(bpy.types.Operator):
    """Show what the report speaks of."""

    bl_idname = "penumbra.select_owner"
    bl_label = "Select"
    bl_description = "Select the objects that this is about, and show its settings"
    bl_options: ClassVar = {"REGISTER", "UNDO"}

    owner: bpy.props.StringProperty(name="Owner", description="As the report names it")

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Select the objects that use it; the properties editor changes to its tab."""
        datablock, tab = find_owner(self.owner)
        if datablock is None:
            self.report({"WARNING"}, f"{self.owner} is not there any more")
            return {"CANCELLED"}
        users = [each for each in context.view_layer.objects if _uses(each, datablock)]
        if users:
            for each in context.view_layer.objects:
                each.select_set(each in users)
            active = users[0]
            context.view_layer.objects.active = active
            if tab == "MATERIAL":
                slots = [slot.material for slot in active.material_slots]
                active.active_material_index = slots.index(datablock)
        space = context.space_data
        if space is not None and space.type == "PROPERTIES" and (users or tab == "WORLD"):
            space.context = tab
        return {"FINISHED"}


def find_owner(owner: str) -> tuple[bpy.types.ID | None, str]:
    """Return the datablock that the report names so, and its tab; None if there is no such."""
    words = re.fullmatch(r"(\w+) '(.*)'", owner)
    if words is None or words[1] not in _KINDS:
        return None, ""
    collection, tab = _KINDS[words[1]]
    return getattr(bpy.data, collection).get(words[2]), tab


def _uses(object: bpy.types.Object, datablock: bpy.types.ID) -> bool:
    return datablock in (object, object.data) or any(
        slot.material == datablock for slot in object.material_slots
    )


def _text(rows: list[tuple[str, str]]) -> str:
    return "\n".join(f"{name}: {value}" for name, value in rows)


register, unregister = switch(
    PENUMBRA_OT_adopt_cycles,
    PENUMBRA_OT_system_check,
    PENUMBRA_OT_copy_report,
    PENUMBRA_OT_select_owner,
)
