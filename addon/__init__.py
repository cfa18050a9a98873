"""Blender's switch -> classes, properties and panels registered, in order, and taken back.

`MODULES` is the one list: each has a `register` and an `unregister` of its own.
"""

from . import (
    adoption,
    engine,
    operators,
    panels,
    preferences,
    presets,
    properties,
    ui,
    viewport,
)

MODULES = (
    preferences,
    properties,
    viewport,
    engine,
    operators,
    presets,
    ui,
    panels,
    adoption,
)


def register() -> None:
    """Register every module; what is registered already is first taken back."""
    unregister()
    for module in MODULES:
        module.register()


def unregister() -> None:
    """Unregister every module, the last one first; each tolerates that it is not registered."""
    for module in reversed(MODULES):
        module.unregister()
