"""program steps -> verdict.  Which of them read the objects that were hit."""

from .nodes.coordinates import (
    generated,
    instancer_fact,
    into_object,
    object_position,
    out_of_object,
)
from .nodes.hit import radial_tangent
from .nodes.objects import fact
from .nodes.triangle import parametric
from .tangents import around_z

READS_SPACES = frozenset(
    {
        around_z,
        fact,
        generated,
        instancer_fact,
        into_object,
        object_position,
        out_of_object,
        parametric,
        radial_tangent,
    }
)
