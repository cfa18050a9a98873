"""points, lights -> Receiver, Sample.  What is lit, and light on its way there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..arrays import Ids, Index, Scalar, Vec, unit
from ..geometry.surface import Points
from ..scene import EVERY_SET
from ..shading import Arrival, LobeAt, Shaded


@dataclass(frozen=True, eq=False)
class Receiver:
    """N points that lights may shine on: their closures, slots (N,) or None, bounces before them.

    shaded counts its points within these.  arrival: how lamps see rays to them, None where no lamp
    asks; passed (N,): transparent surfaces on the way to the points, None is 0.  is_sorted: light
    is wanted by lobe, of paths that were first scattered_by (N,), None is nothing yet.  copies:
    how many rays go on from each closure; matte_slot (N,): where light of matte closures goes, None
    is the same slot.
    """

    points: Points
    shaded: tuple[Shaded, ...]
    slot: Index | None
    total: NDArray[np.int16] | None
    arrival: Arrival | None = None
    passed: NDArray[np.int16] | None = None
    is_sorted: bool = False
    scattered_by: NDArray[np.uint8] | None = None
    copies: int = 1
    matte_slot: Index | None = None

    @property
    def only(self) -> LobeAt | None:
        """The closure of all points, if it is one; of light that is sorted it is among several."""
        if self.is_sorted:
            return None
        if len(self.shaded) == 1 and len(self.shaded[0].lobes) == 1:
            return self.shaded[0].lobes[0] if self.shaded[0].index is None else None
        return None


@dataclass(frozen=True, eq=False)
class Sample:
    """Light on its way to N points.

    to_light (3, N) of the length distance (N,) leads to the light, or is a unit vector if that is
    distant; light (3, N) or (3, 1) times gain (N,) is radiance / pdf.  pdf (N,) [1/sr] is that of
    the choice, 0 or None where scattered rays cannot meet this light; matte_pdf is the same for
    rays from matte closures.  far: how many times to_light a shadow ray goes.  The rest is of the
    lights, one for all or (N,): seen_by, bits of the ray kinds; receivers and blockers, masks of
    light linking sets; casts_shadow.  item and part: which of the bounce's lights, and which of
    how many of its samples this is; light_number: which of all lights, -1 is the world.
    """

    to_light: Vec
    distance: Scalar
    light: Vec
    gain: Scalar
    pdf: Scalar | None
    matte_pdf: Scalar | None
    far: np.float32 | Scalar
    seen_by: int | Ids
    receivers: int | NDArray[np.uint64] = EVERY_SET
    blockers: int | NDArray[np.uint64] = EVERY_SET
    casts_shadow: bool | NDArray[np.bool_] = True
    item: int = 0
    part: tuple[int, int] = (0, 1)
    light_number: int | Ids = -1

    @cached_property
    def wi(self) -> Vec:
        """The unit directions (3, N) to the light."""
        return unit(self.to_light, self.distance)
