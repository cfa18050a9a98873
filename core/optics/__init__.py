"""numbers -> descriptions.  What lies between a camera's film and the world, as plain data.

An aperture blurs what is out of focus; a panorama maps the film to directions all around; an eye
is one of two that look apart.  `camera` makes rays of them, `geometry.view` finds points on the
film again.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

PANORAMAS = (
    "EQUIRECTANGULAR",
    "EQUIANGULAR_CUBEMAP_FACE",
    "MIRRORBALL",
    "FISHEYE_EQUIDISTANT",
    "FISHEYE_EQUISOLID",
    "FISHEYE_LENS_POLYNOMIAL",
    "CENTRAL_CYLINDRICAL",
)

Range = tuple[float, float]


@dataclass(frozen=True)
class Aperture:
    """The opening of a thin lens: what is `focus` [m] away is sharp.

    radius [m]; blades, its corners: a disk if there are fewer than 3; rotation [rad] of the
    corners about the view, counter-clockwise; ratio: height by width.
    """

    radius: float
    focus: float
    blades: int = 0
    rotation: float = 0.0
    ratio: float = 1.0

    @property
    def half(self) -> tuple[float, float]:
        """Half of its width and of its height [m]."""
        return self.radius / self.ratio, self.radius

    def faults(self) -> Iterator[str]:
        """Yield what is wrong."""
        for name in ("radius", "focus", "ratio"):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                yield f"the {name} of its aperture is {value}, not a positive number"
        if not math.isfinite(self.rotation):
            yield f"the rotation of its aperture is {self.rotation}"


@dataclass(frozen=True)
class Panorama:
    """How a picture maps to directions, by Blender's names; each kind reads what it needs.

    longitude, latitude [rad] of an equirectangular picture; fov [rad], the full angle of a fisheye;
    lens and sensor [mm]: focal length, width and height; polynomial: the angle from the axis,
    negative [rad], by powers 0 to 4 of the distance on the sensor [mm]; around [rad] and height
    [1]: the part of a cylinder of radius 1.
    """

    kind: str
    longitude: Range = (-math.pi, math.pi)
    latitude: Range = (-math.pi / 2, math.pi / 2)
    fov: float = math.pi
    lens: float = 10.5
    sensor: tuple[float, float] = (36.0, 24.0)
    polynomial: tuple[float, ...] = (0.0,) * 5
    around: Range = (-math.pi, math.pi)
    height: Range = (-1.0, 1.0)

    def faults(self) -> Iterator[str]:
        """Yield what is wrong."""
        if self.kind not in PANORAMAS:
            yield f"panorama {self.kind!r} is not one of {', '.join(PANORAMAS)}"
        if not (self.lens > 0 and min(self.sensor) > 0):
            yield f"lens {self.lens} and sensor {self.sensor} of its panorama must be above 0"
        numbers = (self.fov, self.lens, *self.sensor, *self.polynomial)
        ranges = (*self.longitude, *self.latitude, *self.around, *self.height)
        if not all(map(math.isfinite, (*numbers, *ranges))):
            yield "a number of its panorama is not finite"


@dataclass(frozen=True)
class Eye:
    """One of two eyes that look apart wherever they look (spherical stereo).

    offset [m]: to the right of the middle, negative to the left; convergence [m]: where both look
    at the same point, infinite if they look in parallel; poles [rad]: between these heights above
    the horizon the eyes come together, None if they do not.
    """

    offset: float
    convergence: float = math.inf
    poles: Range | None = None

    def faults(self) -> Iterator[str]:
        """Yield what is wrong."""
        if not math.isfinite(self.offset) or not self.convergence > 0:
            yield f"an eye at {self.offset} m that looks at {self.convergence} m is not usable"
        if self.poles is not None and not all(map(math.isfinite, self.poles)):
            yield f"eyes that come together at {self.poles} are not usable"
