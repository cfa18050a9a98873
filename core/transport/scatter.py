"""points, closures -> paths.  The next segment of each path: sampled, split, limited, thinned.

Bounce limits are Blender's: a path that has used up its bounces, in all or of one kind, is still
followed to the next surface, of which only the emission counts.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, check, dot, frame
from ..bsdf import DIFFUSE, TRANSMISSION
from ..geometry.silhouette import bend_normals
from ..geometry.surface import Points
from ..plan import Plan
from ..sampling.dimensions import CHOICE, ROULETTE, SCATTER, dimension
from ..sampling.draws import Draws
from ..shading import Closures, Group, choose_lobe
from ..statistics import Tally
from .radiance import Radiance
from .state import Paths, Rays, join

# A path whose throughput falls below this goes on with the probability throughput / FAINT; where
# the eye sees a surface, directly or in mirrors and glass, paths may become fainter.  Measured on
# the examples: variance x time is least around here.
FAINT, FAINT_IN_VIEW = F32(0.25), F32(0.1)

# Splitting: so many times glass in view sends both of its rays, and a surface all of its lobes.
SPLIT_SPECULAR, SPLIT_LOBES = 3, 1

Axes = tuple[Vec, Vec, Vec]  # of a local frame: two tangents and the shading normal

NO_RAYS = Rays(np.zeros((3, 0), F32), np.zeros((3, 0), F32))


@dataclass(frozen=True, eq=False)
class Branch:
    """Scattered directions of a group: world-space (3, n), and their throughput, weight (3, n).

    through (n,) tells which pass the surface, None is none; the first branch keeps its slot.
    """

    points: Points
    paths: Paths
    direction: Vec
    through: NDArray[np.bool_] | None
    weight: Vec
    module: ModuleType
    is_first: bool


def scatter(
    plan: Plan,
    paths: Paths,
    points: Points,
    closures: Closures,
    draws: Draws,
    bounce: int,
    radiance: Radiance,
    tally: Tally,
) -> tuple[Rays, Paths, Draws]:
    """Return the rays and paths that go on from `points`, and the draws they use.

    Unbiased but for the bounce limits, which only darken.
    """
    if not closures.single and not (plan.splitting and bounce < SPLIT_LOBES):
        u, _ = draws.pair(dimension(CHOICE, bounce), paths.slot)
        closures = choose_lobe(closures, paths.size, u)
    pieces: list[tuple[Rays, Paths]] = []
    for group in closures.groups:
        if bounce >= plan.max_bounces and not _can_meet_light(plan, group.module):
            continue
        for branch in _branches(plan, paths, points, group, draws, bounce):
            piece = _segment(plan, branch, draws, bounce, tally)
            if piece is None:
                continue
            rays, onward = piece
            if not branch.is_first:
                # A slot of its own for the branch, and numbers of its own.
                assert onward.slot is not None
                draws = draws.branch(onward.slot, len(pieces) + 1)
                onward = replace(onward, slot=radiance.branch(onward.slot))
            pieces.append((rays, onward))
    if not pieces:
        return NO_RAYS, Paths(0), draws
    return *join(pieces), draws


def _can_meet_light(plan: Plan, module: ModuleType) -> bool:
    kinds = module.RAY_KIND | TRANSMISSION if module.IS_DELTA else module.RAY_KIND
    return bool(plan.kinds_that_meet_light & kinds)


def _branches(
    plan: Plan, paths: Paths, points: Points, group: Group, draws: Draws, bounce: int
) -> Iterator[Branch]:
    index = group.index
    if group.module.IS_DELTA and plan.splitting and bounce < SPLIT_SPECULAR:
        in_view = _in_view(paths, index)
        if in_view.all():
            yield from _split(paths, points, group)
            return
        if in_view.any():
            yield from _split(paths, points, group.take(np.flatnonzero(in_view)))
            group = group.take(np.flatnonzero(~in_view))

    # One direction for each point.
    paths, points = _of_group(paths, points, group)
    module = group.module
    u, v = draws.pair(dimension(SCATTER, bounce), paths.slot)
    through = None
    if hasattr(module, "sample_about"):
        direction, weight, _ = module.sample_about(group.parameters, points.normal, u, v)
    else:
        axes = *frame(points.normal), points.normal
        wi, weight, _ = module.sample(group.parameters, _local(axes, points.wo), points.back, u, v)
        direction, through = _world(axes, wi), wi[2] < 0 if module.TRANSMITS else None
    weight = group.weight if weight is None else group.weight * weight
    yield Branch(points, paths, direction, through, weight, module, group.lobe == 0)


def _split(paths: Paths, points: Points, group: Group) -> Iterator[Branch]:
    """Yield all directions of a delta closure, as branches of their own."""
    module = group.module
    paths, points = _of_group(paths, points, group)
    axes = *frame(points.normal), points.normal
    directions = module.branches(group.parameters, _local(axes, points.wo), points.back)
    for number, (wi, weight) in enumerate(directions):
        is_first = group.lobe == 0 and number == 0
        through = wi[2] < 0 if module.TRANSMITS else None
        direction, weight = _world(axes, wi), group.weight * weight
        yield Branch(points, paths, direction, through, weight, module, is_first)


def _of_group(paths: Paths, points: Points, group: Group) -> tuple[Paths, Points]:
    if group.index is not None:
        paths, points = paths.take(group.index), points.take(group.index)
    if group.module.IS_DELTA and not points.is_flat:
        points = bend_normals(points)
    return paths, points


def _local(axes: Axes, direction: Vec) -> Vec:
    return np.stack([dot(axis, direction) for axis in axes])


def _world(axes: Axes, local: Vec) -> Vec:
    direction = axes[0] * local[0]
    direction += axes[1] * local[1]
    direction += axes[2] * local[2]
    return direction


def _in_view(paths: Paths, index: Index | None) -> NDArray[np.bool_]:
    """Tell which paths the eye sees directly or in mirrors and glass: none was diffuse so far."""
    if paths.count is None:
        return np.full(paths.size if index is None else index.size, paths.kind is None)
    diffuse = paths.count[0] if index is None else paths.count[0].take(index)
    return diffuse == 0


def _segment(
    plan: Plan, branch: Branch, draws: Draws, bounce: int, tally: Tally
) -> tuple[Rays, Paths] | None:
    points, paths, module = branch.points, branch.paths, branch.module
    throughput = branch.weight

    # Directions that the true surface does not allow carry nothing.
    direction, through = branch.direction, branch.through
    strength = np.maximum(np.maximum(throughput[0], throughput[1]), throughput[2])
    if not points.is_flat:
        below = dot(points.geometric, direction) < 0
        strength *= ~below if through is None else below == through

    # Count the bounce; who can meet no more light ends here, and so do black branches.
    kind, count, last = _account(plan, paths, module, through, strength.size, bounce)
    if last is not None:
        strength *= ~last | ((kind & plan.kinds_that_meet_light) != 0)

    # Leave the surface on the side the ray goes to.
    origin = points.above
    if through is not None:
        origin = points.geometric * np.where(through, -points.offset, points.offset)
        origin += points.position
    rays = Rays(origin, direction, None, points.triangle)
    slot = np.arange(kind.size) if paths.slot is None else paths.slot
    onward = Paths(kind.size, throughput, slot, kind, count, last)

    # Faint branches go on at random.
    faint: Scalar | np.float32 = FAINT
    if module.IS_DELTA:
        faint = np.where(_in_view(paths, None), FAINT_IN_VIEW, FAINT)
    survival = np.minimum(strength / faint, F32(1))
    if survival.size and survival.min() < 1:
        chance, _ = draws.pair(dimension(ROULETTE, bounce), slot)
        alive = np.flatnonzero(chance < survival)
        if not alive.size:
            return None
        rays, onward = rays.take(alive), onward.take(alive)
        assert onward.throughput is not None
        onward = replace(onward, throughput=onward.throughput / survival.take(alive))
    check("scatter", direction=rays.direction, throughput=onward.throughput)
    _tally(module, onward, tally)
    return rays, onward


def _account(
    plan: Plan,
    paths: Paths,
    module: ModuleType,
    through: NDArray[np.bool_] | None,
    size: int,
    bounce: int,
) -> tuple[NDArray[np.uint8], NDArray[np.int16] | None, NDArray[np.bool_] | None]:
    """Return the ray kind, the bounces so far by kind, and which paths see emission only."""
    kind = np.full(size, module.RAY_KIND, np.uint8)
    if through is not None:
        kind |= through.view(np.uint8) * np.uint8(TRANSMISSION)
    done = bounce >= plan.max_bounces
    if plan.kind_limits is None:
        return kind, None, np.ones(size, bool) if done else None
    count = np.zeros((3, size), np.int16) if paths.count is None else paths.count.copy()
    row = 0 if module.RAY_KIND == DIFFUSE else 1
    if through is None:
        count[row] += 1
        last = count[row] > plan.kind_limits[row]
    else:
        count[row] += ~through
        count[2] += through
        last = np.where(through, count[2] > plan.kind_limits[2], count[row] > plan.kind_limits[row])
    return kind, count, np.ones(size, bool) if done else last


def _tally(module: ModuleType, paths: Paths, tally: Tally) -> None:
    assert paths.kind is not None
    behind = int(np.count_nonzero(paths.kind & TRANSMISSION)) if module.TRANSMITS else 0
    tally.rays_transmission += behind
    if module.RAY_KIND == DIFFUSE:
        tally.rays_diffuse += paths.size - behind
    else:
        tally.rays_reflection += paths.size - behind
