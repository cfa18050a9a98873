"""text of an IES file -> Profile; directions -> strength.  How lamps shine into each direction.

Angles are turned to those of photometric type C: horizontal ones 0 to 360 degrees about the axis,
vertical ones 0 to 180 degrees from straight down.  What a file leaves out by symmetry is filled in.
Source: IES LM-63-02, "Standard File Format for the Electronic Transfer of Photometric Data".
"""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Scalar, Vec

Table = NDArray[np.float64]

# Candela to the watts of a lamp that shines alike everywhere: 4 pi over the luminous efficacy of
# D65, 177.83 lm/W
WATTS = 0.0706650768394
TYPE_C, TYPE_B, TYPE_A = 1, 2, 3
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)")
_INTEGER = re.compile(r"\s*([+-]?\d+)")


@dataclass(frozen=True, eq=False)
class Profile:
    """Strengths (H, V) at horizontal (H,) and vertical (V,) angles [rad], ascending."""

    around: NDArray[np.float32]
    down: NDArray[np.float32]
    strength: NDArray[np.float32]

    def at(self, direction: Vec) -> Scalar:
        """Return the strength (N,) in unit directions (3, N), 0 beyond the angles of the file.

        Cubic (Catmull-Rom) in both angles.  At the seam of the circle the tangents are one-sided:
        Cycles means them to go on there, but its float32 circle does not close.
        """
        x, y, z = direction
        down = np.arccos(np.clip(-z, F32(-1), F32(1)))
        around = np.arctan2(x, y) + F32(np.pi)
        inside = (down >= self.down[0]) & (down < self.down[-1])
        inside &= (around >= self.around[0]) & (around < self.around[-1])
        row, across = _between(self.around, around)
        column, along = _between(self.down, down)
        last = len(self.around) - 1
        rows = np.maximum(row - 1, 0), row, row + 1, np.where(row + 2 <= last, row + 2, row)
        a, b, c, d = (self._along(each, column, along) for each in rows)
        found = _cubic(a, b, c, d, across)
        return np.where(inside, np.maximum(found, F32(0)), F32(0))

    def _along(self, row: NDArray[np.intp], column: NDArray[np.intp], share: Scalar) -> Scalar:
        """Return strengths (N,) in rows, between columns; the axis is a mirror."""
        last = len(self.down) - 1
        before = np.where(column > 0, column - 1, 1 if self.down[0] < 1e-7 else column)
        end = last - 1 if self.down[-1] > np.pi - 1e-7 else last
        columns = before, column, column + 1, np.where(column + 2 <= last, column + 2, end)
        a, b, c, d = (self.strength[row, each] for each in columns)
        return _cubic(a, b, c, d, share)


def _between(angles: NDArray[np.float32], angle: Scalar) -> tuple[NDArray[np.intp], Scalar]:
    """Return which interval each angle lies in, and how far along."""
    place = np.searchsorted(angles, angle, "left") - 1
    place = np.clip(place, 0, len(angles) - 2)
    low, high = angles.take(place), angles.take(place + 1)
    width = np.where(high > low, high - low, F32(1)).astype(F32)
    share: Scalar = (angle - low) / width
    return place, share


def _cubic(a: Scalar, b: Scalar, c: Scalar, d: Scalar, x: Scalar) -> Scalar:
    three, half = F32(3), F32(0.5)
    cubic: Scalar = (d + three * (b - c) - a) * x
    cubic += F32(2) * a - F32(5) * b + F32(4) * c - d
    cubic = cubic * x + (c - a)
    return half * cubic * x + b


def read_profile(text: str) -> Profile | None:
    """Return what the text of an IES file says, None if it says nothing that makes sense."""
    try:
        kind, around, down, strength = _parse(text.replace(",", " "))
    except (ValueError, OverflowError):
        return None
    if not len(around) or not len(down) or kind not in _TURNS:
        return None
    around, down, strength = _TURNS[kind](around, down, strength)
    if len(around) < 2 or len(down) < 2:
        return None
    return Profile(np.radians(around).astype(F32), np.radians(down).astype(F32), strength)


class _Numbers:
    """Numbers in a text, one after the other, however they are spread over lines."""

    def __init__(self, text: str, start: int) -> None:
        self._text, self._place = text, start

    def next(self, pattern: re.Pattern[str] = _NUMBER) -> float:
        """Return the next number.  Raises: ValueError."""
        found = pattern.match(self._text, self._place)
        if found is None:
            raise ValueError("not a number")
        self._place = found.end()
        return float(found[1])

    def count(self) -> int:
        """Return the next number, an integer."""
        return int(self.next(_INTEGER))

    def several(self, count: int) -> Table:
        """Return so many numbers."""
        return np.array([self.next() for _ in range(count)])


def _parse(text: str) -> tuple[int, Table, Table, NDArray[np.float32]]:
    """Return the photometric type, the angles [degrees] and the strengths of a file."""
    start = text.index("\nTILT=")
    if text.startswith("\nTILT=INCLUDE", start):
        numbers = _Numbers(text, start + 13)
        numbers.next()
        numbers.several(2 * numbers.count())
    else:
        numbers = _Numbers(text, text.index("\n", start + 1))
    numbers.count()  # of lamps
    numbers.next()  # lumens of each
    factor = numbers.next()
    rows, columns = numbers.count(), numbers.count()
    kind = numbers.count()
    numbers.count()  # unit of the size
    numbers.several(3)
    factor *= numbers.next() * numbers.next() * WATTS
    numbers.next()  # input power
    down, around = numbers.several(rows), numbers.several(columns)
    strength = numbers.several(rows * columns) * factor
    return kind, around, down, strength.reshape(columns, rows).astype(F32)


Angles = tuple[Table, Table, NDArray[np.float32]]


def _is(angle: float, wanted: float) -> bool:
    return abs(angle - wanted) < 1e-4


def _turn_c(around: Table, down: Table, strength: NDArray[np.float32]) -> Angles:
    """Fill the circle: one row is all around, a quadrant or a half is mirrored."""
    if _is(around[0], 90):
        around = around - 90
    if len(around) == 1:
        return np.array([0.0, 360.0]), down, np.repeat(strength, 2, axis=0)
    for edge in (90.0, 180.0):
        if _is(around[-1], edge):
            around = np.append(around, 2 * edge - around[-2::-1])
            strength = np.concatenate([strength, strength[-2::-1]])
    if _is(around[0], 0) and not _is(around[-1], 360):
        # Some files leave the last row out, which is the first one.
        gap = 360 - around[-1]
        if _is(around[-1] - around[-2], gap) or _is(around[1] - around[0], gap):
            around = np.append(around, 360)
            strength = np.concatenate([strength, strength[:1]])
    return around, down, strength


def _turn_b(around: Table, down: Table, strength: NDArray[np.float32]) -> Angles:
    """Lay the axis, which is horizontal in this type, upright: the angles change places."""
    around, down, strength = down, around, strength.T
    if _is(around[0], 0):
        strength = np.concatenate([strength[:0:-1], strength])
        around = np.append(-around[:0:-1], around)
    if _is(down[0], 0):
        strength = np.concatenate([strength[:, :0:-1], strength], axis=1)
        down = np.append(-down[:0:-1], down)
    return around + 90, down + 90, np.ascontiguousarray(strength)


def _turn_a(around: Table, down: Table, strength: NDArray[np.float32]) -> Angles:
    """Turn right to left, and what starts in the middle is mirrored there."""
    is_half = _is(around[0], 0)
    turned, rows = 180 - around[::-1], strength[::-1]
    if is_half:
        turned = np.append(turned, 180 + around[1:])
        rows = np.concatenate([rows, strength[1:]])
    return turned, down + 90, np.ascontiguousarray(rows)


_TURNS = {TYPE_A: _turn_a, TYPE_B: _turn_b, TYPE_C: _turn_c}
