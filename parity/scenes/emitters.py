"""rows -> scenes: meshes that glow."""

import math as m
from typing import Any

from ..nodes import Node, diffuse, glass, glossy, glow, mix, node
from .scene import LEAN, Scene

DIM = (0.02, 0.022, 0.025)


def _lit(s: Any, floor_of: Node | None = None, ball_of: Node | None = None) -> None:
    s.room(DIM, **({"floor_of": floor_of} if floor_of else {}))
    s.ball(ball_of or diffuse())


def _panel(name: str, shows: str, size: float, strength: float, at: Any = (-1.8, -1.8, 3)) -> Scene:
    def build(s: Any) -> None:
        _lit(s, glossy(0.25, 0.6, 0.6, 0.6))
        s.plane(glow(strength, 1.0, 0.85, 0.6), at, (140, 0, -40), size, "Panel")

    return Scene(f"emitter_{name}", shows, build, {"max_bounces": 0})


def _triangles(s: Any) -> None:
    """Hang a wavy, glowing ribbon of 2,400 triangles over the ball."""
    _lit(s)
    count, points, faces = 600, [], []
    for k in range(count + 1):
        turn = 2 * m.pi * k / count
        high = 2.6 + 0.25 * m.sin(9 * turn)
        for reach in (1.5, 1.7, 1.9):
            points.append((reach * m.cos(turn), reach * m.sin(turn), high))
    for k in range(count):
        for side in (0, 1):
            a = 3 * k + side
            faces.append((a, a + 3, a + 4, a + 1))
    s.mesh("Ribbon", points, faces, glow(3.0, 0.6, 0.8, 1.0))


def _two_sided(s: Any) -> None:
    """Hang a panel that glows red on one side and blue on the other."""
    _lit(s)
    back = node("NewGeometry")["Backfacing"]
    shader = mix(back, glow(6, 1.0, 0.2, 0.1), glow(6, 0.1, 0.3, 1.0))
    s.plane(shader, (1.3, -0.6, 0.9), (0, 90, 20), 1.2, "Panel")


def _sampling(method: str) -> Any:
    def build(s: Any) -> None:
        _lit(s)
        panel = s.plane(glow(12.0), (-1.8, -1.8, 3), (140, 0, -40), 1.2, "Panel")
        panel.data.materials[0].cycles.emission_sampling = method

    return build


ROWS = (
    _panel("large", "A glowing panel of 2 m.", 2.0, 6.0),
    _panel("small", "A glowing panel of 10 cm.", 0.1, 1500.0),
    _panel("near", "A glowing panel that nearly touches the floor.", 1.0, 8.0, (1.3, -0.9, 0.7)),
    Scene("emitter_triangles", "A glowing ribbon of 2,400 triangles.", _triangles),
    Scene("emitter_ball", "A glowing ball as the only light.",
          lambda s: (s.room((0, 0, 0)), s.ball(glow(4.0, 1.0, 0.7, 0.4), (0, -0.4, 1.1), 0.6))),
    Scene("emitter_two_sided", "A panel that is red on one side and blue on the other.",
          _two_sided),
    Scene("emitter_front_only", "Emission sampling set to the front.", _sampling("FRONT")),
    Scene("emitter_unsampled", "Emission sampling switched off: found by chance, same light.",
          _sampling("NONE")),
    Scene("emitter_behind_glass", "A glowing box behind a pane of glass.",
          lambda s: (_lit(s), s.box(glow(5.0), (0.9, 0.9, 1.2), (0.8, 0.8, 1.6)),
                     s.box(glass(), (0.9, -0.3, 1.2), (2.0, 0.15, 2.0)))),
    Scene("emitter_in_mirror", "A glowing panel and a mirror ball.",
          lambda s: (_lit(s, ball_of=glossy(0.0)),
                     s.plane(glow(5.0), (-1.8, -1.8, 3), (140, 0, -40), 1.5)), LEAN),
    Scene("emitter_hidden_from_camera", "A glowing panel that the camera does not see.",
          lambda s: (_lit(s), setattr(s.plane(glow(8.0), (0.6, -1.5, 1.9), (90, 0, 0), 1.2),
                                      "visible_camera", False))),
    Scene("emitter_through_alpha", "A glowing panel that is half transparent.",
          lambda s: (_lit(s), s.plane(mix(0.5, glow(8.0), node("BsdfTransparent")),
                                      (-1.8, -1.8, 3), (140, 0, -40), 1.5), s.key())),
)  # fmt: skip
