"""rows -> scenes: few facets made to look round, where light grazes them."""

from typing import Any

from ..nodes import Node, diffuse, glossy, principled
from .scene import LEAN, QUICK, Scene


def _grazed(
    s: Any, shader: Node, segments: int = 12, angle: float = 0.02, **terminator: float
) -> None:
    """Light a round ball of few facets from aside."""
    s.room((0.05, 0.06, 0.07))
    ball = s.ball(shader, segments=segments)
    for name, value in terminator.items():
        s.terminator(ball, name, value)
    s.lamp("SUN", 3.0, (4, -1.5, 2.2), (0, 0, 1), angle=angle)


def _row(name: str, shows: str, shader: Node, tags: tuple[str, ...] = (), **more: Any) -> Scene:
    return Scene(f"smooth_{name}", shows, lambda s: _grazed(s, shader, **more), LEAN, tags)


def _inside(s: Any) -> None:
    """Turn the faces of a ball inside out: the shading normals point away from the camera."""
    _grazed(s, principled(Roughness=0.3))
    s.bpy.context.scene.objects["Ball"].data.flip_normals()


ROWS = (
    _row("few_facets", "Twelve facets around, matte, with the usual geometry offset.", diffuse(),
         QUICK),
    _row("no_offset", "The same without geometry offset.", diffuse(), geometry_offset=0.0),
    _row("shading_offset", "The same with a shading offset.", diffuse(), geometry_offset=0.0,
         shading_offset=0.5),
    _row("eight_facets", "Eight facets around.", diffuse(), segments=8),
    _row("glossy", "Twelve facets, glossy: reflected rays that would go inside.", glossy(0.2)),
    _row("mirror", "Twelve facets, a mirror, and a wide sun.", glossy(0.0), angle=0.3),
    _row("principled", "Twelve facets, Principled.", principled(Roughness=0.2)),
    Scene("smooth_inside", "A round bowl of few facets, seen from behind its normals.",
          _inside, LEAN),
)  # fmt: skip
