"""a name, a sentence, a builder -> one scene of the suite."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..nodes import Node


@dataclass(frozen=True)
class Scene:
    """One feature or extreme; `settings` are set in both engines, on top of the common ones.

    Tag "quick": rendered by the tests, with few samples.
    """

    name: str
    shows: str
    build: Callable[[Any], Any]
    settings: dict[str, Any] = field(default_factory=dict)
    tags: tuple[str, ...] = ()
    width: int = 64
    height: int = 64


QUICK = ("quick",)

# For scenes about the ball itself: matte surfaces show direct light only, so that no caustics,
# rare and bright, hide it in noise.  Each family has scenes with all bounces, too.
LEAN = {"diffuse_bounces": 0}


def ball_of(shader: Node, **options: Any) -> Callable[[Any], Any]:
    """Return a builder of the standard stage with a ball of this shader."""
    return lambda s: s.standard(shader, **options)
