"""Blender's switch -> the engine Penumbra registered, or gone without a trace.

The folder of this file is the root of the Blender extension and the Python package `penumbra`.
Nothing here imports bpy before `register()`, so `import penumbra.core` works in any Python.
"""

__version__ = "0.1.0"


def register() -> None:
    """Make the engine, its settings and its panels known to Blender; harmless if done twice."""
    from . import addon

    addon.register()


def unregister() -> None:
    """Take back all that `register` did; harmless if there is nothing to take back."""
    from . import addon

    addon.unregister()
