"""bpy lights and worlds -> core.scene.Lamp and World, in radiometric units.

Blender's light power is defined by Cycles; the numbers below are its (scene/light.cpp and the
light kernels of Cycles 5.2), and golden values measured with it are in the tests.

P is `energy 2^exposure` times the colour, M the object's matrix with its scale.

* POINT, SPOT with `normalize`: P watts over the whole sphere, so radiant intensity P / (4 pi).
  Neither the radius nor the cone changes it.  (Cycles: radiance P / (pi 4 pi r^2) over the
  disk pi r^2 that faces the point.)  Without: radiance P / pi over the disk, I = P r^2; a
  radius of 0 counts as 4 square metres of sphere less its normalisation, so I = P / pi.
* SUN: `energy` is the irradiance, whatever the angle.  Without `normalize` it is the radiance
  of a disk of the half angle a/2 on the unit sphere: E = P pi sin(a/2)^2; P itself for a = 0.
* AREA: a Lambertian emitter of P watts, radiance P / (pi A) with the area A in the world, that
  is after the object's scale; an ellipse has pi/4 of its rectangle.  Without: radiance P / pi.
"""

import math
from dataclasses import replace
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.scene import Colour, Label, Lamp, Node, Note, RayKinds, World
from ..properties import read_max_bounces
from .images import Images
from .materials import active_tree, export_tree
from .stars import export_field

_WHITE = (1.0, 1.0, 1.0)

# Until Blender 4.5 lamps were no objects for Cycles: shaders know but a random number of them
_ARE_OBJECTS = bpy.app.version >= (4, 5)


class Light(NamedTuple):
    """A light that is not in the world yet: a lamp whose strength is its power [W or W/m2]."""

    lamp: Lamp
    normalize: bool


def read_light(
    object: bpy.types.Object, notes: list[Note], images: Images | None = None
) -> Light | None:
    """Return what all instances of a light object have in common; None for a portal.

    Who sees it and what it lights depends on what makes the instances, see `visibility`.
    """
    light = object.data
    owner = f"Light '{light.name}'"
    cycles = getattr(light, "cycles", None)
    if cycles is not None and light.type == "AREA" and cycles.is_portal:
        return None
    colour, surface = _shader(light, owner, notes, images)
    lamp = Lamp(
        name=object.name,
        kind=light.type,
        to_world=np.eye(3, 4),
        strength=_power(light, colour),
        max_bounces=read_max_bounces(light),
        casts_shadow=getattr(light, "use_shadow", True),
        sampled=getattr(cycles, "use_multiple_importance_sampling", True),
        surface=surface,
        is_object=_ARE_OBJECTS,
        **_extent(light),
    )
    return Light(lamp, getattr(light, "normalize", True))


def place_lamp(light: Light, to_world: NDArray[np.float64], label: Label) -> Lamp | None:
    """Return a light in the world (3, 4), labelled; None for an area of no size: it is black."""
    factor = _factor(light, to_world)
    if factor == 0.0:
        return None
    red, green, blue = light.lamp.strength
    strength = (factor * red, factor * green, factor * blue)
    if not light.lamp.is_object:
        label = Label((0.0, 0.0, 0.0), 0.0, random=label.random)
    return replace(light.lamp, to_world=to_world, strength=strength, label=label)


def _extent(light: bpy.types.Light) -> dict[str, Any]:
    """Return the fields of a lamp for the extent and the cone of the light."""
    if light.type == "SUN":
        return {"angle": light.angle}
    if light.type == "AREA":
        square = light.shape in ("SQUARE", "DISK")
        return {
            "size": (light.size, light.size if square else light.size_y),
            "ellipse": light.shape in ("DISK", "ELLIPSE"),
            "spread": light.spread,
        }
    ball = {"radius": light.shadow_soft_size, "soft_falloff": light.use_soft_falloff}
    if light.type == "POINT":
        return ball
    return {**ball, "spot_angle": light.spot_size, "spot_blend": light.spot_blend}


def _factor(light: Light, to_world: NDArray[np.float64]) -> float:
    """Return strength per unit of power, see the top of this file; 0 if it has no area."""
    lamp, normalize = light
    if lamp.kind == "SUN":
        disk = math.pi * math.sin(0.5 * lamp.angle) ** 2
        return 1.0 if normalize or lamp.angle == 0.0 else disk
    if lamp.kind == "AREA":
        scale_x, scale_y = np.linalg.norm(to_world[:, :2], axis=0)
        area = scale_x * lamp.size[0] * scale_y * lamp.size[1]
        area *= math.pi / 4.0 if lamp.ellipse else 1.0
        if area == 0.0:
            return 0.0
        return float(1.0 / (math.pi * area)) if normalize else 1.0 / math.pi
    if normalize:
        return 1.0 / (4.0 * math.pi)
    return lamp.radius**2 if lamp.radius > 0.0 else 1.0 / math.pi


def _power(light: bpy.types.Light, shader: Colour) -> Colour:
    """Return the light's power by channel: energy, exposure, colour, temperature, shader."""
    power = light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    warmth = light.temperature_color if getattr(light, "use_temperature", False) else _WHITE
    red, green, blue = (
        power * c * w * s for c, w, s in zip(light.color, warmth, shader, strict=True)
    )
    return red, green, blue


def _shader(
    light: bpy.types.Light, owner: str, notes: list[Note], images: Images | None
) -> tuple[Colour, Node | None]:
    """Return what the light's own nodes multiply it with: a constant, and a shader if it varies."""
    tree = active_tree(light)
    if tree is None:
        return _WHITE, None
    node = export_tree(light, owner, notes, images)
    if node is None:
        return (0.0, 0.0, 0.0), None
    colour, strength = node.inputs.get("Color"), node.inputs.get("Strength")
    if node.kind == "Emission" and isinstance(colour, tuple) and isinstance(strength, float):
        red, green, blue = (strength * c for c in colour)
        return (red, green, blue), None
    return _WHITE, node


def export_world(
    world: bpy.types.World | None, notes: list[Note], images: Images | None = None
) -> World | None:
    """Return the surroundings; None if the scene has no world, which is black."""
    if world is None:
        return None
    tree = active_tree(world)
    surface: Node | None
    if tree is None:
        inputs = {"Color": tuple(world.color), "Strength": 1.0}
        surface = Node("Background", inputs=inputs)
    else:
        surface = export_tree(world, f"World '{world.name}'", notes, images)
    kinds = getattr(world, "cycles_visibility", None)  # there while the Cycles add-on is enabled
    seen_by = (
        RayKinds(kinds.camera, kinds.diffuse, kinds.glossy, kinds.transmission)
        if kinds is not None
        else RayKinds()
    )
    cycles = getattr(world, "cycles", None)
    return World(
        world.name,
        surface,
        seen_by,
        sampled=getattr(cycles, "sampling_method", "AUTOMATIC") != "NONE",
        max_bounces=read_max_bounces(world),
        casts_shadow=getattr(cycles, "use_shadows", True),
        occlusion_distance=world.light_settings.distance,
        light_group=world.lightgroup,
        stars=export_field(world),
    )
