"""user's machine -> limits.  What holds for all files: threads and memory.

Without an installed extension (the bpy module) there are no preferences, and no limits.
"""

from typing import Any, ClassVar

import bpy

from ..core.settings import Settings, replace
from .switch import switch

PACKAGE = __package__.rpartition(".")[0]
LIMITS = ("instance_memory", "texture_memory")  # of settings, by their names
LEAST = 0.01  # gigabytes


def _limit(name: str) -> Any:
    return bpy.props.FloatProperty(
        name=name,
        description=f"Gigabytes that no scene's {name} counts for more than; no limit if 0",
        default=0.0,
        min=0.0,
        max=4096.0,
        precision=3,
    )


class PenumbraPreferences(bpy.types.AddonPreferences):
    """What Blender shows below the extension."""

    bl_idname = PACKAGE

    threads: bpy.props.IntProperty(
        name="Threads",
        description="Threads of a render whose scene says Auto-Detect; all of the machine if 0",
        default=0,
        min=0,
        max=1024,
    )
    instance_memory: _limit("Instance Memory")
    texture_memory: _limit("Texture Memory")
    shown: ClassVar = ("threads", *LIMITS)

    def draw(self, _context: bpy.types.Context) -> None:
        """Show them all."""
        self.layout.use_property_split = True
        for name in self.shown:
            self.layout.prop(self, name)
        self.layout.operator("penumbra.system_check")


def read_preferences() -> bpy.types.AddonPreferences | None:
    """Return the user's preferences; None where the add-on was not installed but imported."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon and addon.preferences


def limit_memory(settings: Settings) -> Settings:
    """Return settings that keep the user's limits of memory."""
    wished = read_preferences()
    if wished is None:
        return settings
    limits = {name: max(getattr(wished, name), LEAST) for name in LIMITS if getattr(wished, name)}
    lower = {name: min(limit, getattr(settings, name)) for name, limit in limits.items()}
    return replace(settings, **lower)


def thread_count(render: bpy.types.RenderSettings) -> int:
    """Return how many threads to render with; 0 is as many as there are."""
    if render.threads_mode == "FIXED":
        return render.threads
    wished = read_preferences()
    return 0 if wished is None else wished.threads


# Blender keeps the values of preferences that are taken away
register, unregister = switch(PenumbraPreferences)
