"""bpy objects -> who sees them: kinds of rays, holdout, shadow catcher, light linking.

An instance inherits from the object that makes it, its parent, in Cycles' way: rays see what both
show; holdout and indirect-only are the parent's, with its collections in the view layer; either
may be a shadow catcher; the parent's light linking set goes before the object's own.
"""

from typing import Any, NamedTuple

import bpy

from ...core.scene import RayKinds
from .linking import Linking

_RAYS = ("camera", "diffuse", "glossy", "transmission", "shadow")


class Links(NamedTuple):
    """The light linking of a scene."""

    receivers: Linking
    blockers: Linking


def read_links(depsgraph: bpy.types.Depsgraph) -> Links:
    """Return the light linking of all objects that the frame knows."""
    objects = [item.original for item in depsgraph.ids if isinstance(item, bpy.types.Object)]
    return Links(Linking(objects, "receiver"), Linking(objects, "blocker"))


def read_flags(
    object: bpy.types.Object,
    parent: bpy.types.Object | None,
    view_layer: bpy.types.ViewLayer,
    links: Links,
) -> dict[str, Any]:
    """Return the fields of `core.scene.Instance` that say who sees an object.

    `parent` is what makes instances of it, None if it stands for itself.
    """
    maker = parent or object
    return {
        "seen_by": _kinds(object, parent, view_layer),
        "is_holdout": maker.holdout_get(view_layer=view_layer),
        "is_shadow_catcher": object.is_shadow_catcher or maker.is_shadow_catcher,
        "light_group": _light_group(object, parent),
        "asset": _asset(object),
        "receiver_set": links.receivers.set_of(object, parent),
        "blocker_set": links.blockers.set_of(object, parent),
        **_terminator(object),
        **_masks(object, links),
    }


def _terminator(object: bpy.types.Object) -> dict[str, float]:
    """Return the shadow terminator of an object, which Blender >= 5 took over from Cycles."""
    if hasattr(object, "shadow_terminator_shading_offset"):
        return {
            "terminator_geometry": object.shadow_terminator_geometry_offset,
            "terminator_shading": object.shadow_terminator_shading_offset,
        }
    if not hasattr(object, "cycles"):  # only there while the Cycles add-on is enabled
        return {}
    return {
        "terminator_geometry": object.cycles.shadow_terminator_geometry_offset,
        "terminator_shading": object.cycles.shadow_terminator_offset,
    }


def read_light_flags(
    object: bpy.types.Object,
    parent: bpy.types.Object | None,
    view_layer: bpy.types.ViewLayer,
    links: Links,
) -> dict[str, Any]:
    """Return the fields of `core.scene.Lamp` that say who sees a light and what it lights."""
    return {
        "seen_by": _kinds(object, parent, view_layer),
        "lights_catchers": object.is_shadow_catcher or (parent or object).is_shadow_catcher,
        "light_group": _light_group(object, parent),
        **_masks(object, links),
    }


def _light_group(object: bpy.types.Object, parent: bpy.types.Object | None) -> str:
    """Return the light group of an object, or else of what makes instances of it."""
    return object.lightgroup or (parent.lightgroup if parent else "")


def _asset(object: bpy.types.Object) -> str:
    """Return the name of what an object is a part of: the first of its ancestors."""
    while object.parent is not None:
        object = object.parent
    return object.name


def _masks(object: bpy.types.Object, links: Links) -> dict[str, int]:
    """Return the sets that an object lights and those that cast shadows of its light."""
    return {
        "receivers": links.receivers.mask_of(object),
        "blockers": links.blockers.mask_of(object),
    }


def _kinds(
    object: bpy.types.Object, parent: bpy.types.Object | None, view_layer: bpy.types.ViewLayer
) -> RayKinds:
    """Return which rays see an object, or an instance of it that `parent` makes."""
    kinds = {name: getattr(object, f"visible_{name}") for name in _RAYS}
    if parent:
        kinds = {name: seen and getattr(parent, f"visible_{name}") for name, seen in kinds.items()}
    maker = parent or object
    hidden = maker.indirect_only_get(view_layer=view_layer)
    if hidden and not maker.holdout_get(view_layer=view_layer):
        kinds["camera"] = False
    return RayKinds(**kinds)
