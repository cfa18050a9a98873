"""classes -> register, unregister.  What all modules of classes do when the add-on is switched."""

from collections.abc import Callable

import bpy


def switch(*classes: type) -> tuple[Callable[[], None], Callable[[], None]]:
    """Return what makes Blender know classes, in order, and what takes away those it knows."""

    def register() -> None:
        for cls in classes:
            bpy.utils.register_class(cls)

    def unregister() -> None:
        for cls in classes:
            if cls.is_registered:
                bpy.utils.unregister_class(cls)

    return register, unregister
