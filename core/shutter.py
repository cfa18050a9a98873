"""u -> time.  When a ray is shot, while the shutter is open.

Times are sampled by the shutter's curve, so that all samples of a pixel weigh the same, and cover
all of the time.  Cycles leaves out the first 0.2 % of it and the last 0.6 %: its table of 256
entries does (util/math_cdf.cpp), so what is somewhere in the end only is a little fainter there.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, ONE_BELOW, Scalar
from .sampling.tables import InverseTable, compile_inverse, lookup
from .settings import Settings

ENTRIES = 1 << 13


@dataclass(frozen=True, eq=False)
class CompiledShutter:
    """times: the inverse of the curve's distribution, None if it is even.

    rolling: the share of the time for which a row is exposed, None for all rows at once; height:
    of the whole picture [pixels].
    """

    times: InverseTable | None
    rolling: np.float32 | None
    height: np.float32

    def open(self, u: Scalar, y: Scalar) -> Scalar:
        """Return times (N,) in [0, 1] for u (N,) in [0, 1); y (N,) are rows, from below."""
        time = u if self.times is None else lookup(self.times, u)
        if self.rolling is None:
            return np.minimum(time, ONE_BELOW)
        # Rows start one after the other, from the top (Cycles, kernel/camera/camera.h).
        row = F32(1) - y / self.height
        half = F32(0.5)
        return (time - half) * self.rolling + (row - half) * (F32(1) - self.rolling) + half


def compile_shutter(
    curve: NDArray[np.float64] | None, settings: Settings, height: int
) -> CompiledShutter:
    """Return the shutter with a `curve` (n,), None is even, of a picture `height` pixels high."""
    times = None
    if curve is not None and (curve != curve[0]).any():
        times = compile_inverse(curve, 0.0, 1.0, ENTRIES)
    is_rolling = settings.rolling_shutter_type != "NONE"
    rolling = F32(settings.rolling_shutter_duration) if is_rolling else None
    return CompiledShutter(times, rolling, F32(height))
