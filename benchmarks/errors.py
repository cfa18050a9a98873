"""pictures -> errors, and error-time curves -> ratios at equal error.

Error measures after Rousselle et al. 2011 (relative squared error); the reference is itself noisy,
and two independent halves of it tell by how much (mean((a - b)^2) / 4 for the mean of a and b).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

EPSILON = 0.01
TRIM = 0.001
SPAN = 0.05  # of the logarithms of errors, that makes a curve of points
METRICS = ("relmse", "relmse_trimmed", "rmse")  # from which a known noise can be subtracted
SHOWN = (*METRICS, "flip")


def measure(difference: NDArray[np.float32], reference: NDArray[np.float32]) -> dict[str, float]:
    """Return the mean squared errors of a difference from a reference, both (H, W, 3).

    relmse is mean(d^2 / (r^2 + 0.01)); relmse_trimmed leaves the worst 0.1 % of the pixels out;
    rmse is given squared here, so that a known noise can be subtracted from all three.
    """
    square = difference.astype(np.float64) ** 2
    relative = (square / (reference.astype(np.float64) ** 2 + EPSILON)).mean(axis=-1).ravel()
    kept = np.sort(relative)[: max(1, round(relative.size * (1 - TRIM)))]
    return {
        "relmse": float(relative.mean()),
        "relmse_trimmed": float(kept.mean()),
        "rmse": float(square.mean()),
    }


class Curve:
    """Error against time of one engine, by rising sample counts, on logarithmic axes."""

    def __init__(self, seconds: Sequence[float], errors: Sequence[float]) -> None:
        good = [k for k, error in enumerate(errors) if error > 0]
        self.log_time = np.log([seconds[k] for k in good])
        self.log_error = np.log([errors[k] for k in good])

    def is_one(self, fewest: int) -> bool:
        """Tell whether there are so many points, and not all of one error."""
        return len(self.log_error) >= fewest and float(np.ptp(self.log_error)) > SPAN

    def time_at(self, log_error: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the logarithm of the time to this error, linear between the points."""
        order = np.argsort(self.log_error)
        return np.interp(log_error, self.log_error[order], self.log_time[order])

    def line(self) -> tuple[float, float]:
        """Return slope and intercept of the straight line nearest to the points."""
        slope, intercept = np.polyfit(self.log_error, self.log_time, 1)
        return float(slope), float(intercept)


def ratio_at_equal_error(slow: Curve, fast: Curve) -> dict[str, float | str]:
    """Return how many times longer `slow` takes than `fast` to the same error.

    The geometric mean over the errors that both curves reach, with its smallest and largest
    value; where they share none, both straight lines are read off half-way between the curves.
    """
    low = max(slow.log_error.min(), fast.log_error.min())
    high = min(slow.log_error.max(), fast.log_error.max())
    if low < high:
        at = np.linspace(low, high, 33)
        ratios, method = slow.time_at(at) - fast.time_at(at), "interpolated"
    else:
        at = np.array([(low + high) / 2])
        (a, b), (c, d) = slow.line(), fast.line()
        ratios, method = (a * at + b) - (c * at + d), "extrapolated"
    return {
        "ratio": float(np.exp(ratios.mean())),
        "smallest": float(np.exp(ratios.min())),
        "largest": float(np.exp(ratios.max())),
        "method": method,
    }
