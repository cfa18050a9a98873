"""bpy points and worlds -> core.scene.Stars and StarField.  What shines and has no size.

A star of P watts has the radiant intensity P / (4 pi), like a point light whose radius goes to
nothing.  Points may have attributes of their own: `star_strength` (FLOAT) is a factor on the
object's strength, `star_temperature` [K] (FLOAT) replaces its temperature, 0 is white, and
`star_color` (any colour or vector) tints it.
"""

import math
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...core.scene import Colour, Mesh, Note, StarField
from ...core.shading.black_body import seen_black_body
from ...core.shading.sky import rgb_of_xyz
from .attributes import export_attributes, read_items
from .geometry import NO_CORNERS, Exported
from .images import configuration, working_space

STRENGTH, TEMPERATURE, COLOR = "star_strength", "star_temperature", "star_color"

MICRO = 1e-6  # of the world's strength [uW/m2]


class Points(NamedTuple):
    """Points without faces, and their radiant intensity (V, 3) [W/sr], scene-linear."""

    exported: Exported
    intensity: NDArray[np.float32]


def export_points(object: bpy.types.Object, notes: list[Note]) -> Points:
    """Return the points of an evaluated mesh or point cloud, as stars."""
    if not getattr(object.data, "is_editmode", False):
        return _read(object, object.data, notes)
    try:
        return _read(object, object.to_mesh(), notes)
    finally:
        object.to_mesh_clear()


def _read(
    object: bpy.types.Object, data: bpy.types.Mesh | bpy.types.PointCloud, notes: list[Note]
) -> Points:
    attribute = data.attributes.get("position")
    positions = np.empty((0, 3), np.float32)
    if attribute is not None and len(attribute.data):
        positions = read_items(attribute.data, "vector", np.float32, 3)

    # What each has of its own
    found = export_attributes(data, (STRENGTH, TEMPERATURE, COLOR), None, None)
    own = {name: each.values for name, each in found.items() if each.domain == "POINT"}
    for name in sorted(found.keys() - own.keys()):
        what = f"its attribute '{name}' is not one of points, and does not count"
        notes.append(Note(f"Object '{object.name}'", what))

    # Power, all around, in the colours of what glows
    strength = np.full(len(positions), object.penumbra.star_strength / (4 * math.pi))
    temperature = np.full(len(positions), object.penumbra.star_temperature)
    if STRENGTH in own:
        strength = strength * own[STRENGTH][:, 0]
    if TEMPERATURE in own:
        temperature = own[TEMPERATURE][:, 0].astype(np.float64)
    colour = _black_body(temperature)
    if COLOR in own:
        tint = own[COLOR][:, :3]
        colour = colour * (tint.T if tint.shape[1] == 3 else tint[:, 0])
    intensity = np.ascontiguousarray((colour * strength).T, np.float32)
    return Points(Exported(Mesh(data.name, positions, NO_CORNERS), NO_CORNERS), intensity)


def _black_body(temperature: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the colours (3, V) of black bodies of luminance 1, white where it is 0 K."""
    rgb = np.ones((3, temperature.size))
    warm = np.flatnonzero(temperature > 0)
    if warm.size:
        matrix = rgb_of_xyz(working_space(), configuration())
        seen = matrix @ seen_black_body(temperature[warm].astype(np.float32))
        rgb[:, warm] = np.maximum(seen, 0)
    return rgb


def export_field(world: bpy.types.World) -> StarField | None:
    """Return the stars of a world, None if it has none."""
    own: Any = world.penumbra
    if not own.use_stars:
        return None
    red, green, blue = (tuple(row) for row in rgb_of_xyz(working_space(), configuration()).tolist())
    matrix: tuple[Colour, Colour, Colour] = red, green, blue
    return StarField(
        count=own.star_count,
        irradiance=own.star_strength * MICRO,
        seed=own.star_seed,
        brightest=own.star_brightest,
        faintest=own.star_faintest,
        slope=own.star_slope,
        temperature=own.star_temperature,
        spread=own.star_temperature_spread,
        rgb_of_xyz=matrix,
    )
