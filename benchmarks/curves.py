"""points -> SVG.  Curves on logarithmic axes, and bars of ratios; colours are those of page.css.

A curve's colour, marker and dash follow its contender, whoever else is there; hollow points are
below the reference's own noise.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

WIDTH, HEIGHT = 340, 250
LEFT, RIGHT, TOP, BOTTOM = 54, 10, 12, 38
# Contender -> colour (of page.css), marker, dash
LOOKS = {
    "CYCLES": (1, "square", ""),
    "PENUMBRA": (0, "round", ""),
    "PENUMBRA poisson": (2, "round", "5 3"),
    "PENUMBRA jittered": (3, "round", "5 3"),
    "PENUMBRA regular": (4, "round", "5 3"),
    "PENUMBRA random": (5, "round", "5 3"),
    "CYCLES adaptive": (1, "square", "2 3"),
    "PENUMBRA adaptive": (0, "round", "2 3"),
    "PENUMBRA one ray": (6, "round", "7 3 2 3"),
    "PENUMBRA own paths": (5, "round", "7 3 2 3"),
    "PENUMBRA no splitting": (7, "round", "7 3 2 3"),
    "MITSUBA": (8, "diamond", ""),
    "MITSUBA LLVM": (8, "diamond", "5 3"),
}


@dataclass(frozen=True)
class Series:
    """The curve of a contender: (seconds, error, is it reliable, what it is) for each point.

    Or two other numbers that are above 0.
    """

    name: str
    points: Sequence[tuple[float, float, bool, str]]

    @property
    def look(self) -> tuple[int, str, str]:
        """Return colour, marker and dash."""
        return LOOKS.get(self.name, (9, "round", "1 3"))


@dataclass(frozen=True)
class Axis:
    """A logarithmic axis: a range of values along a range of pixels."""

    low: float
    high: float
    start: float
    end: float

    @classmethod
    def over(cls, values: Sequence[float], start: float, end: float) -> "Axis":
        """Return the axis that holds all values, with a little room; at least a factor of two."""
        low, high = min(values), max(values)
        room = max(1.12, math.sqrt(max(1.0, 2 * low / high)))
        return cls(low / room, high * room, start, end)

    def at(self, value: float) -> float:
        """Return the pixel of a value."""
        share = math.log(value / self.low) / math.log(self.high / self.low)
        return self.start + share * (self.end - self.start)

    def ticks(self) -> list[float]:
        """Return round numbers on the axis: decades, or 1, 2, 5 if there are few of them."""
        first, last = math.floor(math.log10(self.low)), math.ceil(math.log10(self.high))
        for steps in ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), tuple(map(float, range(1, 10)))):
            found = [s * 10.0**k for k in range(first, last + 1) for s in steps]
            found = [value for value in found if self.low <= value <= self.high]
            if len(found) >= 3:
                break
        return found[:: max(1, math.ceil(len(found) / 7))]


def plot(series: Sequence[Series], title: str, by: str = "seconds") -> str:
    """Return the SVG of `title` against `by`; '' without a point that has both."""
    drawn = [Series(s.name, [p for p in s.points if p[0] > 0 and p[1] > 0]) for s in series]
    points = [point for each in drawn for point in each.points]
    if not points:
        return ""
    x = Axis.over([p[0] for p in points], LEFT, WIDTH - RIGHT)
    y = Axis.over([p[1] for p in points], HEIGHT - BOTTOM, TOP)
    what = escape(f"{title} by {by}")
    lines = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{what}">',
        *_grid(x, y),
        f'<text class="name" x="{LEFT}" y="{HEIGHT - 5}">{what}</text>',
        *(line for each in reversed(drawn) for line in _curve(each, x, y)),
        "</svg>",
    ]
    return "\n".join(lines)


def _grid(x: Axis, y: Axis) -> list[str]:
    lines = []
    for value in x.ticks():
        at = f"{x.at(value):.1f}"
        lines.append(f'<path class="grid" d="M{at} {TOP}V{HEIGHT - BOTTOM}"/>')
        text = f'<text class="tick" x="{at}" y="{HEIGHT - BOTTOM + 13}" text-anchor="middle">'
        lines.append(f"{text}{number(value)}</text>")
    for value in y.ticks():
        at = y.at(value)
        lines.append(f'<path class="grid" d="M{LEFT} {at:.1f}H{WIDTH - RIGHT}"/>')
        text = f'<text class="tick" x="{LEFT - 6}" y="{at + 3.5:.1f}" text-anchor="end">'
        lines.append(f"{text}{number(value)}</text>")
    return lines


def _curve(series: Series, x: Axis, y: Axis) -> list[str]:
    colour, marker, dash = series.look
    places = [(x.at(seconds), y.at(error)) for seconds, error, _, _ in series.points]
    if not places:
        return []
    way = "L".join(f"{a:.1f} {b:.1f}" for a, b in places)
    dashes = f' stroke-dasharray="{dash}"' if dash else ""
    lines = [f'<path class="curve c{colour}" d="M{way}"{dashes}/>']
    for (a, b), (_, _, reliable, what) in zip(places, series.points, strict=True):
        hollow = "" if reliable else " hollow"
        lines.append(
            f'<path class="point c{colour}{hollow}" d="{_marker(marker, a, b)}">'
            f"<title>{escape(what)}</title></path>"
        )
    return lines


def _marker(kind: str, x: float, y: float) -> str:
    if kind == "square":
        return f"M{x - 3:.1f} {y - 3:.1f}h6v6h-6z"
    if kind == "diamond":
        return f"M{x:.1f} {y - 4.4:.1f}l4.4 4.4l-4.4 4.4l-4.4 -4.4z"
    return f"M{x - 3.4:.1f} {y:.1f}a3.4 3.4 0 1 0 6.8 0a3.4 3.4 0 1 0 -6.8 0z"


def legend(names: Sequence[str]) -> str:
    """Return the list of who is drawn how."""
    items = []
    for name in names:
        colour, marker, dash = Series(name, ()).look
        dashes = f' stroke-dasharray="{dash}"' if dash else ""
        items.append(
            '<li><svg class="key" viewBox="0 0 34 12" aria-hidden="true">'
            f'<path class="curve c{colour}" d="M1 6H33"{dashes}/>'
            f'<path class="point c{colour}" d="{_marker(marker, 17, 6)}"/></svg>'
            f"{escape(label(name))}</li>"
        )
    return f'<ul class="legend">{"".join(items)}</ul>'


def label(name: str) -> str:
    """Return a contender's name for readers."""
    engine, _, rest = name.partition(" ")
    return f"{engine.title()} {rest}".strip()


def bar(ratio: float, smallest: float, largest: float, most: float) -> str:
    """Return the SVG of a ratio on a logarithmic axis from 1/2 to `most`, with its range."""
    axis = Axis(0.5, max(2.0, most) * 1.05, 0, 160)
    one, end = axis.at(1.0), axis.at(max(ratio, 0.5))
    low, high = (min(max(axis.at(each), 0.0), 160.0) for each in (smallest, largest))
    slower = " slower" if ratio < 1 else ""
    return (
        f'<svg class="bar" viewBox="0 0 160 14" aria-hidden="true"><path class="one" '
        f'd="M{one:.1f} 0V14"/><path class="fill{slower}" '
        f'd="M{one:.1f} 3H{end:.1f}V11H{one:.1f}z"/>'
        f'<path class="range" d="M{low:.1f} 7H{high:.1f}"/></svg>'
    )


def number(value: float) -> str:
    """Return a value in few characters: 0.02, 30, 2e-4."""
    if 0.01 <= value < 10000:
        return f"{value:g}"
    mantissa, _, exponent = f"{value:.0e}".partition("e")
    return f"{mantissa}e{int(exponent)}"
