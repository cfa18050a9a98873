"""file made for Cycles -> our settings.  When they are copied without being asked for.

A render falls back to Cycles' value wherever ours was never set (`properties.read_settings`).  So
that panels show what is rendered, the values are copied as soon as a scene shows our engine: when a
file is opened and when the engine is chosen.  From then on the two engines' settings are apart.
"""

from typing import Any

import bpy

from .engine import ENGINE
from .properties import adopt_cycles

_owner = object()  # of the subscription


def adopt() -> None:
    """Let every scene that renders with our engine have Cycles' values where ours are not set."""
    for scene in bpy.data.scenes:
        if scene.render.engine == ENGINE:
            adopt_cycles(scene)


@bpy.app.handlers.persistent
def _loaded(*_: Any) -> None:
    _subscribe()  # Blender forgets subscriptions when it opens a file
    adopt()


def _subscribe() -> None:
    bpy.msgbus.clear_by_owner(_owner)
    key = (bpy.types.RenderSettings, "engine")
    bpy.msgbus.subscribe_rna(key=key, owner=_owner, args=(), notify=adopt)


def register() -> None:
    """Listen for files that are opened and engines that are chosen."""
    bpy.app.handlers.load_post.append(_loaded)
    _subscribe()


def unregister() -> None:
    """Listen no longer."""
    bpy.msgbus.clear_by_owner(_owner)
    if _loaded in bpy.app.handlers.load_post:
        bpy.app.handlers.load_post.remove(_loaded)
