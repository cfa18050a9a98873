"""stars, camera -> places on the picture.  The camera's rays, found from their other end.

A flat picture is inverted in closed form; panoramas and eyes that part, by Newton's steps on the
rays themselves.  Seen from a fixed point of the lens, a star of intensity I is in a pixel of the
film density f as bright as f I / A, where A is the area that a pixel covers at the star, at right
angles to the ray: the limit of a small sphere of radiance I / (pi r^2).  float64, since the
differences of near places count.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import cross, normalize
from ..camera import CompiledCamera, facing
from ..camera.aperture import opening
from ..geometry.part import FAR
from ..optics import panoramas

Array = NDArray[Any]  # float64, which the camera takes like the float32 of its rays

STEP = 1.0 / 64  # pixels, between rays whose difference counts
ROUNDS = 6  # of Newton's
CLOSE = 1e-3  # pixels, that it must come to

# Panoramas that close upon themselves, by what one turn is in their own terms
_TURNS = {"EQUIRECTANGULAR": "longitude", "CENTRAL_CYLINDRICAL": "around"}


class Seen(NamedTuple):
    """Where stars are on the picture: raster x and y (N,), what of their light a pixel has (N,).

    `density` [1/m2], or [1/sr] of distant ones, multiplies the light; origin and unit direction
    (3, N) are of the rays to them, far (N,) [m] as long as these are; is_there (N,).
    """

    x: Array
    y: Array
    density: Array
    origin: Array
    direction: Array
    far: Array
    is_there: NDArray[np.bool_]


def find(
    camera: CompiledCamera,
    target: Array,
    is_distant: bool,
    lens: NDArray[np.float32] | None,
    clip: tuple[float, float],
) -> Seen:
    """Return where stars at `target` (3, N), distant ones in those directions, are on the picture.

    lens (2, N) in [0, 1): the point of the aperture they are seen through; clip [m]: near and far.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        if camera.panorama is None and camera.eye is None:
            seen = _flat(camera, target, is_distant, lens, clip)
        else:
            seen = _bent(camera, target, is_distant, lens, clip)
    fine = np.isfinite(seen.density) & np.isfinite(seen.x) & np.isfinite(seen.y)
    return seen._replace(is_there=seen.is_there & fine)


def copies(camera: CompiledCamera) -> tuple[float, ...]:
    """Return by how many pixels aside a star is seen again, with 0: the seam of panoramas."""
    panorama = camera.panorama
    if panorama is None or panorama.kind not in _TURNS or camera.map is None:
        return (0.0,)
    low, high = getattr(panorama, _TURNS[panorama.kind])
    turn = 2 * np.pi / abs(high - low) / float(camera.map[0, 1]) if high != low else 0.0
    return (0.0, turn, -turn) if turn else (0.0,)


def _flat(
    camera: CompiledCamera,
    target: Array,
    is_distant: bool,
    lens: NDArray[np.float32] | None,
    clip: tuple[float, float],
) -> Seen:
    start, run = ([each.astype(np.float64) for each in v] for v in (camera.start, camera.run))
    near = float(camera.near)
    point, bend = np.zeros((3, 1)), np.zeros((3, 1))
    if camera.aperture is not None and lens is not None:
        right, up = opening(camera.aperture, camera.lens[0][:2], *lens).astype(np.float64)
        point = camera.sides[0] * right + camera.sides[1] * up
        bend = point / camera.lens[0][2]
    if camera.is_perspective:
        # to the star = depth x (run 0 - bend + x run 1 + y run 2)
        away = target if is_distant else target - start[0] - point
        axis = run[0] - bend
        depth, x, y, volume = _solve(away, axis, run[1], run[2])
        x, y = x / depth, y / depth
        direction = away / depth
        length = _length(direction)
        density = length**3 / volume
        if not is_distant:
            density = density / _length(away) ** 2
        origin = start[0] + point + direction * near
        is_there = depth > 0
        there = (clip[0] <= depth) & (depth <= clip[1])
    else:
        # star = start + x start 1 + y start 2 + depth (run 0 - bend) + point (1 - near / focus)
        direction = run[0] - bend
        depth = (run[0] * (target - start[0])).sum(axis=0)
        first = start[0] + point - bend * near
        _, x, y, volume = _solve(target - first - direction * depth, run[0], start[1], start[2])
        length = _length(direction)
        density = length / volume * np.ones_like(x)
        origin = first + start[1] * x + start[2] * y
        is_there = np.full(x.shape, not is_distant)
        there = (depth >= 0) & (depth + near <= clip[1])
    if is_distant:
        far = np.full(x.shape, float(FAR))
    else:
        is_there &= there
        far = (depth - (near if camera.is_perspective else 0.0)) * length
    if camera.far is not None:
        far = np.minimum(far, (float(camera.far) - near) * length)
    shape = target.shape
    origin, direction = np.broadcast_to(origin, shape), np.broadcast_to(direction / length, shape)
    return Seen(x, y, density, origin, direction, far, is_there)


def _solve(right: Array, a: Array, b: Array, c: Array) -> tuple[Array, Array, Array, Array]:
    """Return the factors (N,) of a, b and c (3, N) that make up `right`, and their volume."""
    normal = cross(b, c)
    volume = (a * normal).sum(axis=0)
    first = (right * normal).sum(axis=0) / volume
    second = (right * cross(c, a)).sum(axis=0) / volume
    third = (right * cross(a, b)).sum(axis=0) / volume
    return first, second, third, np.abs(volume)


def _length(vector: Array) -> Array:
    return np.sqrt((vector * vector).sum(axis=0))


def _bent(
    camera: CompiledCamera,
    target: Array,
    is_distant: bool,
    lens: NDArray[np.float32] | None,
    clip: tuple[float, float],
) -> Seen:
    x, y, depth, on_lens = _guess(camera, target, is_distant, lens)
    is_there = np.ones(x.shape, bool) if is_distant else (clip[0] <= depth) & (depth <= clip[1])

    def miss(x: Array, y: Array) -> tuple[Array, Array, Array]:
        """Return rays at places, and how far their directions are from those to the stars."""
        origin, direction = _rays(camera, x, y, lens, on_lens)
        to_star = target if is_distant else target - origin
        return direction - to_star / _length(to_star), origin, direction

    # Step to where the ray's direction is that of the star
    for _ in range(ROUNDS):
        here, _, _ = miss(x, y)
        by_x, by_y = miss(x + STEP, y)[0] - here, miss(x, y + STEP)[0] - here
        xx, xy, yy = ((a * b).sum(axis=0) for a, b in ((by_x, by_x), (by_x, by_y), (by_y, by_y)))
        along_x, along_y = (by_x * here).sum(axis=0), (by_y * here).sum(axis=0)
        volume = xx * yy - xy * xy
        x = x - STEP * (yy * along_x - xy * along_y) / volume
        y = y - STEP * (xx * along_y - xy * along_x) / volume
    here, origin, direction = miss(x, y)
    is_there &= _length(here) <= CLOSE / STEP * np.sqrt(np.minimum(xx, yy))

    # Measure what a pixel covers there
    far = np.zeros(x.shape) if is_distant else ((target - origin) * direction).sum(axis=0)
    sides = []
    for dx, dy in ((STEP, 0.0), (0.0, STEP)):
        (o1, d1), (o2, d2) = (_rays(camera, x + s * dx, y + s * dy, lens, on_lens) for s in (1, -1))
        sides.append((d1 - d2 if is_distant else o1 - o2 + (d1 - d2) * far) / (2 * STEP))
    density = 1 / np.abs((cross(*sides) * direction).sum(axis=0))
    if is_distant:
        far = np.full(x.shape, float(FAR))
    if camera.far is not None:
        far = np.minimum(far, float(camera.far - camera.near))
    return Seen(x, y, density, origin, direction, far, is_there)


def _guess(
    camera: CompiledCamera, target: Array, is_distant: bool, lens: NDArray[np.float32] | None
) -> tuple[Array, Array, Array, Array | None]:
    """Return raster places (N,) of stars seen from the middle of lens and eyes, and their depth.

    And, for panoramas, points (3, N) of an aperture that faces the star.  It faces where the ray
    goes, which differs by the width of the blur; but its sides turn fast about the axis, where no
    ray may pass a given point of it and the star.
    """
    run = [each.astype(np.float64) for each in camera.run]
    away = target if is_distant else target - camera.start[0]
    if camera.panorama is None:
        depth, x, y, _ = _solve(away, *run)
        return x / depth, y / depth, np.where(depth > 0, depth, np.nan), None
    assert camera.map is not None
    depth = _length(away)
    local: Array = np.stack([(axis * away).sum(axis=0) for axis in run]) / depth
    u, v = panoramas.place(camera.panorama, local)
    (low_x, step_x), (low_y, step_y) = camera.map.astype(np.float64)
    on_lens = None
    if camera.aperture is not None and lens is not None:
        on_lens = facing(local, opening(camera.aperture, camera.lens[0][:2], *lens))
    return (u - low_x) / step_x, (v - low_y) / step_y, depth, on_lens


def _rays(
    camera: CompiledCamera,
    x: Array,
    y: Array,
    lens: NDArray[np.float32] | None,
    origin: Array | None,
) -> tuple[Array, Array]:
    """Return origins and directions (3, N), the latter 0 outside of a round picture.

    origin (3, N): of panoramic rays, on the lens.
    """
    if camera.panorama is None or camera.map is None:
        way = (None, None) if lens is None or camera.aperture is None else lens
        found = camera.through(x.copy(), y.copy(), *way)
    else:
        (low_x, step_x), (low_y, step_y) = camera.map.astype(np.float64)
        place = low_x + x * step_x, low_y + y * step_y
        direction, inside = panoramas.direction(camera.panorama, *place)
        found = camera.leaving(normalize(direction), origin)
        if inside is not None:
            np.multiply(found.direction, inside, out=found.direction)
    return np.asarray(found.origin, np.float64), np.asarray(found.direction, np.float64)
