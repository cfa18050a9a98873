"""rows -> scenes: surfaces that rays pass straight through, in numbers and to their limit."""

from typing import Any

from ..nodes import Node, clear, diffuse, glass, mix, principled
from .scene import LEAN, Scene


def _leaves(s: Any, shader: Node, count: int) -> None:
    """Hang `count` sheets one behind the other, between lamp, ball and camera."""
    s.standard(diffuse())
    for k in range(count):
        at, turn = (-0.7 + 0.06 * k, -1.3 - 0.12 * k, 1.0 + 0.05 * k), (80, 0, 8.0 * k)
        s.plane(shader, at, turn, 1.5, f"Leaf {k}")


def _limited(name: str, shows: str, limit: int, shader: Node, count: int = 4) -> Scene:
    settings = {"transparent_max_bounces": limit}
    return Scene(name, shows, lambda s: _leaves(s, shader, count), settings)


ROWS = (
    Scene("leaves", "Ten leaves of alpha 0.5, one behind the other.",
          lambda s: _leaves(s, principled(Alpha=0.5, Base_Color=(0.2, 0.6, 0.1)), 10),
          {"transparent_max_bounces": 32}),
    _limited("leaves_over_the_limit", "Ten such leaves with the usual limit of eight.", 8,
             principled(Alpha=0.5, Base_Color=(0.2, 0.6, 0.1)), 10),
    Scene("coloured_shadows", "Red, green and blue panes throw coloured shadows.",
          lambda s: (s.standard(diffuse()), [
              s.plane(clear(*colour), (-1.6 + k, -1.6, 1.4 + 0.2 * k), (60, 0, -30), 1.0)
              for k, colour in enumerate([(1, 0.1, 0.1), (0.1, 1, 0.1), (0.1, 0.2, 1)])])),
    _limited("transparent_limit_0", "No transparent surface may be passed.", 0,
             clear(0.9, 0.8, 0.7)),
    _limited("transparent_limit_2", "Two transparent surfaces may be passed.", 2,
             clear(0.9, 0.8, 0.7)),
    _limited("transparent_limit_3", "Three layers of half transparent matter.", 3,
             mix(0.5, diffuse(0.6, 0.2, 0.2), clear())),
    Scene("transparent_before_glass", "A coloured pane before a ball of glass.",
          lambda s: (s.standard(glass()),
                     s.plane(clear(0.6, 0.9, 0.3), (0.3, -1.6, 1.0), (90, 0, 0), 1.6)), LEAN),
    Scene("transparent_in_mirror", "A half transparent ball on a mirror.",
          lambda s: (s.room(floor_of=principled(Metallic=1.0, Roughness=0.0)), s.key(),
                     s.ball(mix(0.5, diffuse(0.2, 0.5, 0.8), clear()))), LEAN),
    Scene("transparent_film_alpha", "Half transparent surfaces before a transparent film.",
          lambda s: (s.transparent_film(), s.world(), s.key(), s.camera(),
                     s.ball(mix(0.6, diffuse(0.2, 0.5, 0.8), clear())))),
)  # fmt: skip
