"""program steps -> verdict.  Which of them read the objects that were hit."""

from .attributes import along_u, framed, framed_at_rest, in_frame
from .nodes.coordinates import (
    generated,
    instancer_fact,
    into_object,
    object_position,
    out_of_object,
)
from .nodes.hit import radial_tangent
from .nodes.image import boxed
from .nodes.normals import displaced_in_object, mapped_in_object
from .nodes.objects import fact, particle
from .nodes.triangle import parametric
from .normals import bumped_in_object
from .tangents import around_z

READS_SPACES = frozenset(
    {
        along_u,
        around_z,
        boxed,
        bumped_in_object,
        displaced_in_object,
        fact,
        framed,
        framed_at_rest,
        generated,
        in_frame,
        instancer_fact,
        into_object,
        mapped_in_object,
        object_position,
        out_of_object,
        parametric,
        particle,
        radial_tangent,
    }
)
