"""Sky Texture -> radiance of directions.  The skies of Blender 4.2 to 5.2.

Skies made of air are computed once, to a table of azimuth from the sun and elevation that has more
rows near the horizon, and looked up; the disc of the sun lies over it, darker to its rim.  The sky
of Preetham is a formula.  All values are those of Cycles' Sky Texture.
"""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import F32, Scalar, Vec
from ...images import Image, make_image
from ...images.files import REC709, convert_colours
from ...images.lookup import lookup
from . import multiple_scattering, nishita, single_scattering
from .disc import Disc
from .preetham import Preetham
from .spectrum import Array, rec709_of_xyz

__all__ = ["Disc", "Sky", "compile_sky"]

_HALF_PI = np.pi / 2
_DARK = 0.6  # how much darker the rim of the sun is
_MODELS = {
    "NISHITA": nishita,
    "SINGLE_SCATTERING": single_scattering,
    "MULTIPLE_SCATTERING": multiple_scattering,
}


@dataclass(frozen=True, eq=False)
class Sun:
    """The disc of the sun: its colours at the bottom and at the top, and where the earth ends."""

    disc: Disc
    bottom: Vec  # (3, 1) scene-linear radiance [W/(sr m2)]
    top: Vec
    foot: float  # elevation of the bottom
    height: float  # elevation of the top above it
    lowest: float  # elevation of the earth's edge
    covers: bool  # whether there is no sky in front of it

    def add_radiance(self, direction: Vec, radiance: Vec) -> None:
        """Add the sun to the radiance (3, N) of unit directions (3, N)."""
        chord = self.disc.chord(direction)
        where = np.flatnonzero(chord < self.disc.largest_chord)
        if not where.size:
            return
        seen = np.arcsin(np.clip(direction[2].take(where), F32(-1), F32(1)))
        half = F32(self.disc.half_angle)
        angle = F32(2) * np.arcsin(F32(0.5) * np.sqrt(chord.take(where))) / half
        rim = np.sqrt(np.maximum(F32(1) - angle * angle, F32(0)))
        shine = F32(1 - _DARK) + F32(_DARK) * rim
        shine *= seen > F32(self.lowest)
        along = (seen - F32(self.foot)) * F32(1 / self.height)
        glow = (self.bottom + (self.top - self.bottom) * along) * shine
        if self.covers:
            radiance[:, where] *= shine == 0
        radiance[:, where] += glow


@dataclass(frozen=True, eq=False)
class Sky:
    """A sky; `radiance` is all of it, `discs` is what must not be in an importance map."""

    model: Callable[[Vec], Vec]  # unit directions (3, N) -> scene-linear (3, N), without the sun
    sun: Sun | None = None

    @property
    def discs(self) -> tuple[Disc, ...]:
        """Return the sun, if it is seen."""
        return (self.sun.disc,) if self.sun else ()

    def radiance(self, direction: Vec, with_sun: bool = True) -> Vec:
        """Return radiance (3, N) [W/(sr m2)] of unit directions (3, N)."""
        radiance = self.model(direction)
        if self.sun and with_sun:
            self.sun.add_radiance(direction, radiance)
        return np.maximum(radiance, F32(0), out=radiance)


def compile_sky(properties: Mapping[str, Any]) -> Sky | None:
    """Return the sky of a Sky Texture's properties; None for a kind that is not honoured.

    Of `properties`, `working_space` and `config` (see `ImageSource`) may be missing.
    """
    rgb = rgb_of_xyz(properties.get("working_space", REC709), properties.get("config", ""))
    kind = properties["sky_type"]
    if kind == "PREETHAM":
        preetham = Preetham(np.array(properties["sun_direction"]), properties["turbidity"])
        matrix = rgb.astype(F32)
        return Sky(functools.partial(_in_working_space, matrix, preetham))
    if kind not in _MODELS:
        return None

    # Turn the sun so that it is not beyond the zenith
    elevation = math.remainder(properties["sun_elevation"], 2 * math.pi)
    rotation = properties["sun_rotation"]
    if abs(elevation) > _HALF_PI:
        elevation = math.copysign(math.pi, elevation) - elevation
        rotation += math.pi
    aerosol = properties.get("aerosol_density", properties.get("dust_density", 1.0))
    air = properties["air_density"], aerosol, properties["ozone_density"]
    altitude = properties["altitude"]
    table = _table(kind, elevation, altitude, air, rgb.tobytes())
    model = functools.partial(_look_up, table, F32(rotation), kind == "NISHITA")
    if not properties["sun_disc"]:
        return Sky(model)
    size, power = properties["sun_size"], properties["sun_intensity"]
    return Sky(model, _sun(kind, elevation, rotation, size, power, altitude, air, rgb))


def _in_working_space(matrix: NDArray[np.float32], preetham: Preetham, direction: Vec) -> Vec:
    light: Vec = matrix @ preetham.xyz(direction)
    return light


def _sun(
    kind: str,
    elevation: float,
    rotation: float,
    size: float,
    power: float,
    altitude: float,
    air: tuple[float, float, float],
    rgb: Array,
) -> Sun | None:
    """Return the sun; None if it is below the horizon, or black."""
    half = size / 2
    solid_angle = 4 * np.pi * math.sin(half / 2) ** 2
    old = kind == "NISHITA"
    lowest = 0.0 if old else -math.acos(6371e3 / (6371e3 + altitude))
    sets_at = lowest if kind == "MULTIPLE_SCATTERING" else 0.0
    foot = max(elevation - half, 0.0) if old else elevation - half
    if solid_angle == 0 or elevation + half <= sets_at:
        return None
    bottom, top = (
        rgb @ _MODELS[kind].sun(elevation + side, altitude, *air) * (power / solid_angle)
        for side in (-half, half)
    )
    flat = math.cos(elevation)
    middle = 0.5 * (bottom + top) * (1 - _DARK / 3)
    disc = Disc(
        direction=(
            flat * math.sin(rotation),
            flat * math.cos(rotation),
            math.sin(elevation),
        ),
        half_angle=half,
        radiance=(float(middle[0]), float(middle[1]), float(middle[2])),
    )
    if disc.flux == 0:
        return None
    return Sun(
        disc,
        bottom.reshape(3, 1).astype(F32),
        top.reshape(3, 1).astype(F32),
        foot,
        elevation + half - foot,
        lowest,
        covers=old,
    )


@functools.lru_cache(maxsize=4)
def _table(
    kind: str, elevation: float, altitude: float, air: tuple[float, float, float], rgb: bytes
) -> Image:
    """Return the table of a sky as an image, its middle towards the sun."""
    xyz = _MODELS[kind].table(elevation, altitude, *air)
    pixels = np.ones((*xyz.shape[:2], 4), F32)
    pixels[:, :, :3] = xyz @ np.frombuffer(rgb).reshape(3, 3).T
    return make_image(pixels)


def _look_up(table: Image, rotation: np.float32, fades: bool, direction: Vec) -> Vec:
    """Return the colours (3, N) of the table at unit directions (3, N).

    With `fades`, the lowest row of the upper half goes on below the horizon and fades out.
    """
    x, y, z = direction
    u: Scalar = np.arctan2(y, x) + rotation
    u *= F32(-0.5 / np.pi)
    u -= F32(0.25)
    u -= np.floor(u)
    elevation = np.arctan2(z, np.sqrt(x * x + y * y))
    v = np.sqrt(np.abs(elevation) * F32(1 / _HALF_PI))
    v = np.copysign(v, elevation) * F32(0.5)
    v += F32(0.5)
    if not fades:
        return lookup(table, u, v, "Linear", "EXTEND")[:3]
    np.maximum(v, F32((table.height / 2 + 0.5) / table.height), out=v)
    colour = lookup(table, u, v, "Linear", "EXTEND")[:3]
    fade = np.clip(F32(1) + F32(2.5) * z, F32(0), F32(1))
    colour *= fade * fade * fade
    return colour


@functools.cache
def rgb_of_xyz(working_space: str, config: str) -> Array:
    """Return the matrix (3, 3) from XYZ (white D65) to the scene-linear space."""
    if working_space not in ("", REC709):
        axes = np.eye(3, dtype=F32)[None]
        converted = convert_colours(axes, config, "Linear CIE-XYZ D65", working_space)
        if converted is not None:
            return converted[0].T.astype(np.float64)
    return rec709_of_xyz()
