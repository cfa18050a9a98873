"""points, closures -> paths.  The next segment of each path: sampled, split, limited, thinned.

Bounce limits are Blender's: a path that has used up its bounces, in all or of one kind, is still
followed to the next surface, of which only the emission counts, and what is seen through it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Index, Scalar, Vec, check, dot, take
from ..bsdf import (
    CAMERA,
    CLEAR,
    DIFFUSE,
    GLOSSY,
    MATTE,
    SINGULAR,
    STRAIGHT,
    TRANSMISSION,
    diffuse,
    sent_as,
    shown_as,
    transparent,
)
from ..film import ledger
from ..geometry.surface import Points
from ..geometry.terminator import bump_shadow, shift
from ..plan import Plan
from ..sampling.dimensions import CHOICE, ROULETTE, SCATTER, dimension
from ..sampling.draws import Draws
from ..shading import Arrival, LobeAt, Shaded, choose, columns
from ..statistics import Tally
from .labels import Label, Senders
from .lazy import Lazy
from .radiance import Radiance
from .reuse import Reuse
from .roulette import FAINT, FAINT_IN_VIEW
from .state import Paths, Rays, join

# Splitting: so many times glass in view sends both of its rays, and a surface all of its lobes.
SPLIT_SPECULAR, SPLIT_LOBES = 3, 1

Piece = tuple[Rays, Paths]
NO_RAYS = Rays(np.zeros((3, 0), F32), np.zeros((3, 0), F32))


@dataclass(frozen=True, eq=False)
class Branch:
    """Scattered directions of a closure: world-space (3, n), and their throughput, weight (3, n).

    through (n,) tells which pass the surface, None is none; is_clear: to the film, they then pass
    nothing but transparency; pdf (n,) of the directions, None is infinite; the first branch keeps
    its slot.  label: as what the rays count, None is as the closure's kind.  part: which of how
    many rays of the closure it is.
    """

    points: Lazy
    paths: Lazy
    direction: Vec
    through: NDArray[np.bool_] | None
    weight: Vec
    pdf: Scalar | None
    module: Any
    is_first: bool
    is_clear: bool | NDArray[np.bool_] = False
    label: Label | None = None
    part: tuple[int, int] = (0, 1)

    def take(self, index: Index, survival: Scalar) -> "Branch":
        """Return the branch at `index`, its weight divided by the probability to survive."""
        return Branch(
            self.points.take(index),
            self.paths.take(index),
            self.direction.take(index, axis=1),
            take(self.through, index),
            columns(self.weight, index) / survival,
            take(self.pdf, index),
            self.module,
            self.is_first,
            clear if isinstance(clear := self.is_clear, bool) else columns(clear, index),
            None if self.label is None else self.label.take(index),
            self.part,
        )


def splits_lobes(plan: Plan, depth: int) -> bool:
    """Tell whether surfaces at this depth send rays from each of their closures."""
    return plan.splitting and depth < SPLIT_LOBES


def copies_at(plan: Plan, depth: int) -> int:
    """Return how many rays each closure at this depth sends, unless all would be the same."""
    return plan.scatter_samples if depth == 0 else 1


def scatter(
    plan: Plan,
    paths: Paths,
    points: Points,
    shaded: Sequence[Shaded],
    pieces: list[Piece],
    draws: Draws,
    depth: int,
    radiance: Radiance,
    tally: Tally,
    reuse: Reuse | None = None,
) -> tuple[Rays, Paths, Draws]:
    """Return the rays and paths that go on from `points`, and the draws they use.

    `pieces` are others that go on as well.  Unbiased but for the bounce limits, which only darken.
    """
    arriving = draws  # which has the slots that branches come from, and no others
    for branch in _all_branches(plan, paths, points, shaded, arriving, depth):
        piece = _segment(plan, branch, arriving, depth, tally)
        if piece is None:
            continue
        rays, onward = piece
        root = onward.slot
        if not branch.is_first:
            # A slot of its own for the branch, and numbers of its own.
            assert onward.slot is not None
            draws = draws.branch(onward.slot, len(pieces) + 1)
            onward = replace(onward, slot=radiance.branch(onward.slot))
        if reuse is not None and depth == 0 and branch.module is diffuse:
            assert root is not None and onward.slot is not None
            reuse.send(root, onward.slot, branch.part[0])
        pieces.append((rays, onward))
    if not pieces:
        return NO_RAYS, Paths(0), draws
    return *join(pieces), draws


def _all_branches(
    plan: Plan,
    paths: Paths,
    points: Points,
    shaded: Sequence[Shaded],
    draws: Draws,
    depth: int,
) -> Iterator[Branch]:
    is_split = splits_lobes(plan, depth)
    pick: Scalar | None = None
    if not is_split and any(len(each.lobes) > 1 for each in shaded):
        pick, _ = draws.pair(dimension(CHOICE, depth), paths.slot)
    for each in shaded:
        chosen: Iterator[tuple[Index | None, LobeAt]]
        if is_split or len(each.lobes) == 1:
            chosen = ((lobe.live, lobe.there) for lobe in each.lobes if lobe.is_alive)
        else:
            assert pick is not None
            chosen = choose(each, pick if each.index is None else pick.take(each.index))
        for number, (some, lobe) in enumerate(chosen):
            if depth >= plan.max_bounces and not _can_meet_light(plan, lobe.module):
                continue
            index = some
            if each.index is not None:
                index = each.index if some is None else each.index.take(some)
            way = Lazy(paths, index), Lazy(points, index), lobe
            senders = Senders(each, lobe, some) if plan.mixes_kinds else None
            is_first = not is_split or number == 0
            copies = 1 if lobe.module.IS_DELTA else copies_at(plan, depth)
            for item in range(copies):
                first = is_first and item == 0
                yield from _branches(plan, *way, senders, draws, (item, copies), depth, first)


def _can_meet_light(plan: Plan, module: Any) -> bool:
    if module.RAY_KIND == STRAIGHT or plan.has_transparent:
        return True
    kinds = module.RAY_KIND | TRANSMISSION | CLEAR if module.TRANSMITS else module.RAY_KIND
    return bool(plan.kinds_that_meet_light & kinds)


def _branches(
    plan: Plan,
    paths: Lazy,
    points: Lazy,
    lobe: LobeAt,
    senders: Senders | None,
    draws: Draws,
    part: tuple[int, int],
    depth: int,
    is_first: bool,
) -> Iterator[Branch]:
    module = lobe.module
    if module.IS_DELTA and plan.splitting and depth < SPLIT_SPECULAR:
        in_view = _in_view(paths)
        if in_view.all():
            yield from _split(plan, paths, points, lobe, is_first)
            return
        if in_view.any():
            index = np.flatnonzero(in_view)
            some = paths.take(index), points.take(index), lobe.take(index)
            yield from _split(plan, *some, is_first)
            index = np.flatnonzero(~in_view)
            paths, points, lobe = paths.take(index), points.take(index), lobe.take(index)

    # One direction for each point.
    u, v = draws.pair(dimension(SCATTER, depth), paths.slot, *part)
    w = None
    if module.DRAWS > 2:
        _, w = draws.pair(dimension(CHOICE, depth), paths.slot, *part)
    frame, through = lobe.frame, None
    if hasattr(module, "sample_about"):
        direction, weight, pdf = module.sample_about(lobe.parameters, frame.normal, u, v)
        if module.TRANSMITS or plan.needs_pdf:
            z = dot(frame.normal, direction)
            through = z < 0 if module.TRANSMITS else None
            pdf = module.evaluate(lobe.parameters, None, (None, None, z))[1]
    else:
        wi, weight, pdf = module.sample(lobe.parameters, frame.wo, u, v, w)
        direction, through = frame.world(wi), wi[2] < 0 if module.TRANSMITS else None
    label = None if senders is None else senders.label(direction, pdf, draws, depth, paths.slot)
    if lobe.share is not None:
        # The closure was chosen with this probability.
        share = np.maximum(lobe.share, F32(1e-30))
        weight = np.reciprocal(share) if weight is None else weight / share
        pdf = None if pdf is None else pdf * lobe.share
    if lobe.smooth is not None and module.RAY_KIND == DIFFUSE:
        kept = bump_shadow(lobe.smooth, lobe.frame.normal, direction, lobe.softening, True, True)
        kept = kept if through is None else np.where(through, F32(1), kept)
        weight = kept if weight is None else weight * kept
    weight = lobe.weight if weight is None else lobe.weight * weight
    weight = _shifted(plan, points, lobe, direction, through, weight)
    if part[1] > 1:
        weight = weight * F32(1 / part[1])
    pdf = None if module.IS_DELTA else pdf
    clear = _is_clear(plan, lobe)
    what = through, weight, pdf, module, is_first, clear, label, part
    yield Branch(points, paths, direction, *what)


def _is_clear(plan: Plan, lobe: LobeAt) -> bool | NDArray[np.bool_]:
    """Tell where what a closure lets through is background to the film, as glass may be."""
    module = lobe.module
    if plan.clear_alpha is None or not module.TRANSMITS or module.RAY_KIND != GLOSSY:
        return False
    if module.IS_DELTA:
        return True
    alpha = lobe.parameters[list(module.PARAMETERS).index("alpha")]
    is_clear: NDArray[np.bool_] = alpha <= plan.clear_alpha
    return is_clear


def _split(plan: Plan, paths: Lazy, points: Lazy, lobe: LobeAt, is_first: bool) -> Iterator[Branch]:
    """Yield all directions of a delta closure, as branches of their own."""
    module = lobe.module
    for number, (wi, weight) in enumerate(module.branches(lobe.parameters, lobe.frame.wo)):
        through = wi[2] < 0 if module.TRANSMITS else None
        weight = lobe.weight if weight is None else lobe.weight * weight
        if lobe.share is not None:
            weight = weight / np.maximum(lobe.share, F32(1e-30))
        direction = lobe.frame.world(wi)
        weight = _shifted(plan, points, lobe, direction, through, weight)
        first, clear = is_first and number == 0, _is_clear(plan, lobe)
        yield Branch(points, paths, direction, through, weight, None, module, first, clear)


def _shifted(
    plan: Plan,
    points: Lazy,
    lobe: LobeAt,
    direction: Vec,
    through: NDArray[np.bool_] | None,
    weight: Vec,
) -> Vec:
    """Return weights as objects with a shading offset dim what is not sent through them."""
    if not plan.shifts_terminators or lobe.module.RAY_KIND == STRAIGHT:
        return weight
    assert plan.triangles is not None
    factor = shift(plan.triangles, points.instance, lobe.frame.normal, direction)
    if factor is None:
        return weight
    return weight * (factor if through is None else np.where(through, F32(1), factor))


def _in_view(paths: Lazy) -> NDArray[np.bool_]:
    """Tell which paths the eye sees directly or in mirrors and glass: none was diffuse so far."""
    if paths.count is None:
        return np.full(paths.size, paths.kind is None)
    matte: NDArray[np.int16] = paths.count[0]
    return matte == 0


def _segment(plan: Plan, branch: Branch, draws: Draws, depth: int, tally: Tally) -> Piece | None:
    module, through = branch.module, branch.through
    size = branch.direction.shape[1]
    throughput = np.broadcast_to(branch.weight, (3, size))

    # Directions that the true surface does not allow carry nothing.
    strength = np.maximum(np.maximum(throughput[0], throughput[1]), throughput[2])
    is_straight = module.RAY_KIND == STRAIGHT
    bends = plan.surfaces.bends_normals or not branch.points.is_flat
    if bends and not is_straight:
        below = dot(branch.points.geometric, branch.direction) < 0
        strength *= ~below if through is None else below == through

    # Who has used up the bounces and can meet no light on the way ends here.
    if depth >= plan.least_limit and not plan.has_transparent:
        onward = _account(plan, branch, depth)
        assert onward.kind is not None and onward.last is not None
        kinds = onward.kind | sent_as(onward.kind) if plan.mixes_kinds else onward.kind
        strength *= ~onward.last | ((kinds & plan.kinds_that_meet_light) != 0)

    # Faint branches go on at random, and black ones end; of several rays each is as much fainter.
    share = F32(1 / plan.scatter_samples)
    faint: Scalar | np.float32 = FAINT * share
    if module.IS_DELTA:
        faint = np.where(_in_view(branch.paths), FAINT_IN_VIEW * share, faint)
    survival = np.minimum(strength / faint, F32(1))
    if survival.size and survival.min() < 1:
        chance, _ = draws.pair(dimension(ROULETTE, depth), branch.paths.slot, *branch.part)
        alive = np.flatnonzero(chance < survival)
        if not alive.size:
            return None
        branch = branch.take(alive, survival.take(alive))

    # Count the bounce, and leave the surface on the side the ray goes to.
    onward = _straight(plan, branch, depth) if is_straight else _account(plan, branch, depth)
    points, direction, through = branch.points, branch.direction, branch.through
    if is_straight:
        direction = points.arriving
        origin = points.position - points.geometric * points.offset
    elif through is not None:
        origin = points.geometric * np.where(through, -points.offset, points.offset)
        origin += points.position
    else:
        origin = points.above
    rays = Rays(origin, direction, None, points.triangle)
    check("scatter", direction=rays.direction, throughput=onward.throughput)
    _tally(module, onward, tally)
    return rays, onward


def pass_straight(
    plan: Plan,
    paths: Paths,
    points: Points,
    arrival: Arrival,
    draws: Draws,
    depth: int,
    tally: Tally,
) -> Piece | None:
    """Return paths that may only go straight on, behind transparent surfaces; None if none can."""
    weight = plan.surfaces.transparency(points, arrival)
    if paths.throughput is not None:
        weight *= paths.throughput
    branch = Branch(
        Lazy(points, None),
        Lazy(paths, None),
        points.arriving,
        None,
        weight,
        None,
        transparent,
        True,
    )
    return _segment(plan, branch, draws, depth, tally)


def _account(plan: Plan, branch: Branch, depth: int) -> Paths:
    """Return the paths after the bounce: kinds, bounces so far, and who sees emission only."""
    paths, points = branch.paths, branch.points
    module, through = branch.module, branch.through
    size = branch.direction.shape[1]
    label = branch.label
    kind = np.full(size, module.RAY_KIND, np.uint8) if label is None else label.kind.copy()
    if plan.mixes_kinds and module.RAY_KIND == DIFFUSE:
        kind |= np.uint8(MATTE)
    if module.IS_DELTA:
        kind |= np.uint8(SINGULAR)
    if through is not None:
        kind |= through.view(np.uint8) * np.uint8(TRANSMISSION)
        if branch.is_clear is not False:
            clear = through & branch.is_clear & paths.is_straight
            kind |= clear.view(np.uint8) * np.uint8(CLEAR)

    # All bounces: the depth, unless surfaces were passed that are no bounce.
    total, done = None, np.full(size, depth >= plan.max_bounces)
    if plan.has_transparent:
        total = np.full(size, depth, np.int16) if paths.total is None else paths.total
        total = total + np.int16(1)
        done = total > plan.max_bounces
    is_counted = depth >= plan.max_bounces or plan.has_transparent
    last: NDArray[np.bool_] | None = done if is_counted else None

    # Bounces of each kind.
    count = None
    if plan.kind_limits is not None:
        count = np.zeros((3, size), np.int16) if paths.count is None else paths.count.copy()
        row = 0 if module.RAY_KIND == DIFFUSE else 1
        if label is not None:
            last = done | _count(count, label.is_matte, through, plan.kind_limits)
        elif through is None:
            count[row] += 1
            last = done | (count[row] > plan.kind_limits[row])
        else:
            count[row] += ~through
            count[2] += through
            reached = count > np.array(plan.kind_limits)[:, None]
            last = done | np.where(through, reached[2], reached[row])

    # What filter glossy and the lights that were sampled need to know.
    pdf = least = None
    if plan.needs_pdf:
        pdf = np.full(size, np.inf, F32) if branch.pdf is None else branch.pdf
    if plan.weighs_paths:
        assert pdf is not None
        least = pdf if label is None else label.pdf
        least = least if paths.least_pdf is None else np.minimum(paths.least_pdf, least)
    if pdf is not None and branch.part[1] > 1:
        pdf = pdf * F32(branch.part[1])
    slot = np.arange(size) if paths.slot is None else paths.slot
    if paths.matte_slot is not None and module is diffuse:
        slot = paths.matte_slot
    throughput = np.broadcast_to(branch.weight, (3, size))
    passed = travelled = None
    if plan.has_transparent:
        passed = np.zeros(size, np.int16) if paths.passed is None else paths.passed
        travelled = np.zeros(size, F32)
    return Paths(
        size,
        throughput,
        slot,
        kind,
        count,
        last,
        pdf,
        least,
        points.place if plan.needs_place else None,
        _receiver(plan, points),
        total,
        passed,
        travelled,
        _shown(plan, paths),
        _lobe(plan, branch),
        paths.time,
    )


def _shown(plan: Plan, paths: Lazy) -> NDArray[np.bool_] | None:
    """Return which paths have shown passes a surface, None where that never matters."""
    if plan.ledger is None or not plan.has_transparent or not plan.ledger.looks_once:
        return None
    return np.zeros(paths.size, bool) if paths.shown is None else paths.shown


def _lobe(plan: Plan, branch: Branch) -> NDArray[np.uint8] | None:
    """Return what scattered paths first (N,), None where nobody asks."""
    if plan.ledger is None or not plan.ledger.sorts_light:
        return None
    own = np.full(branch.direction.shape[1], ledger.lobe_of(shown_as(branch.module)), np.uint8)
    if branch.through is not None and shown_as(branch.module) == GLOSSY:
        own[np.flatnonzero(branch.through)] = ledger.TRANSMISSION
    before = branch.paths.lobe
    return own if before is None else np.where(before == ledger.UNSCATTERED, own, before)


def _count(
    count: NDArray[np.int16],
    is_matte: NDArray[np.bool_],
    through: NDArray[np.bool_] | None,
    limits: tuple[int, int, int],
) -> NDArray[np.bool_]:
    """Add rays of several kinds to the bounces (3, n); tell which have more than they may."""
    behind = np.zeros(is_matte.size, bool) if through is None else through
    each = np.stack([is_matte & ~behind, ~is_matte & ~behind, behind])
    count += each
    over: NDArray[np.bool_] = (each & (count > np.array(limits)[:, None])).any(axis=0)
    return over


def _receiver(plan: Plan, points: Lazy) -> NDArray[np.uint8] | None:
    """Return the light linking sets of points (N,), None if nothing is linked."""
    if not plan.links_lights:
        return None
    assert plan.triangles is not None and plan.triangles.objects is not None
    assert points.instance is not None
    return plan.triangles.objects.receiver_set.take(points.instance)


def _straight(plan: Plan, branch: Branch, depth: int) -> Paths:
    """Return the paths behind a transparent surface: they are what they were, one surface on."""
    paths, points = branch.paths, branch.points
    size = points.size

    def kept(array: Any, start: Any) -> Any:
        return start if array is None else array

    passed = kept(paths.passed, np.zeros(size, np.int16)) + np.int16(1)
    return Paths(
        size,
        np.broadcast_to(branch.weight, (3, size)),
        kept(paths.slot, np.arange(size)),
        kept(paths.kind, np.full(size, CAMERA, np.uint8)),
        None if plan.kind_limits is None else kept(paths.count, np.zeros((3, size), np.int16)),
        kept(paths.last, np.zeros(size, bool)),
        kept(paths.pdf, np.full(size, np.inf, F32)) if plan.needs_pdf else None,
        kept(paths.least_pdf, np.full(size, np.inf, F32)) if plan.weighs_paths else None,
        kept(paths.place, np.zeros(size, np.int32)) if plan.needs_place else None,
        kept(paths.receiver, np.zeros(size, np.uint8)) if plan.links_lights else None,
        kept(paths.total, np.zeros(size, np.int16)),
        passed,
        kept(paths.travelled, np.zeros(size, F32)) + points.distance,
        _shown(plan, paths),
        kept(paths.lobe, np.zeros(size, np.uint8))
        if plan.ledger is not None and plan.ledger.sorts_light
        else None,
        paths.time,
    )


def _tally(module: Any, paths: Paths, tally: Tally) -> None:
    assert paths.kind is not None
    behind = int(np.count_nonzero(paths.kind & TRANSMISSION)) if module.TRANSMITS else 0
    tally.rays_transmission += behind
    if module.RAY_KIND == DIFFUSE:
        tally.rays_diffuse += paths.size - behind
    elif module.RAY_KIND == STRAIGHT:
        tally.rays_transmission += paths.size - behind
    else:
        tally.rays_reflection += paths.size - behind
