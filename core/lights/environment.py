"""radiance of all directions -> directions worth sampling.  The importance map of a world.

The sphere is cut into cells of an equirectangular grid; inside a cell all directions are alike.
A row is chosen by v, a cell of the row by u, both by inversion, so that well-spread u, v give
well-spread directions.  Inversion takes no search: probabilities are rounded to whole steps, and a
table names the cell of each step; the density is that of the rounded ones, so nothing is biased.

Cells darker than a share of the mean are left to the sampling of closures (MIS compensation:
Karlik et al. 2019, section 5).  A sun that is smaller than a cell is a disc of its own, sampled
as a cone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, ONE_BELOW, Scalar, Vec, frame
from ..images.projection import equirectangular, equirectangular_invert
from ..sampling.warp import uniform_cone
from ..shading.sky.disc import Disc

COMPENSATION = 1.0  # in units of the mean: 20 to 45 % less error on matte things than none
LARGEST = (2048, 1024)  # cells; finer pictures are averaged
_CHUNK = 1 << 16  # directions whose radiance is asked for at once
_STEPS = 4  # steps of probability per cell of a row
_ROW_STEPS = 16  # and per row
_TWO_PI = F32(2 * np.pi)

Radiance = Callable[[Vec], Vec]


@dataclass(frozen=True, eq=False)
class Inversion:
    """Rows of probabilities in whole steps: which entry a step belongs to, and its steps.

    owner (R S,), first (R M,) step of an entry in its row, and count (R M,) of steps.
    """

    steps: int  # S
    entries: int  # M
    owner: NDArray[np.uint16]
    first: NDArray[np.uint16]
    count: NDArray[np.uint16]

    def sample(self, u: Scalar, row: NDArray[np.int32] | None) -> tuple[NDArray[np.int32], Scalar]:
        """Return the place (N,) in `count` of what u chooses, and the rest of u in [0, 1)."""
        # Find the step, and whose it is
        place = u * F32(self.steps)
        step = place.astype(np.int32)
        if row is None:
            entry = self.owner.take(step).astype(np.int32)
        else:
            entry = self.owner.take(step + row * np.int32(self.steps)).astype(np.int32)
            entry += row * np.int32(self.entries)

        # Stretch the steps of one entry to the unit interval
        place -= self.first.take(entry)
        place /= self.count.take(entry)
        np.minimum(place, ONE_BELOW, out=place)
        return entry, place


@dataclass(frozen=True, eq=False)
class Environment:
    """Directions by importance; see `compile_environment`."""

    width: int
    height: int
    rows: Inversion
    columns: Inversion
    below: Scalar  # (height,): z of the lower edge of a row
    rise: Scalar  # (height,): what z gains across it
    density: Scalar  # (height,): pdf [1/sr] of a cell of one step
    map_share: float  # the probability of the map; the rest is shared by the discs
    discs: tuple[Disc, ...]
    disc_share: tuple[float, ...]
    mean: tuple[float, float, float]  # radiance over the whole sphere, discs included

    def sample(self, u: Scalar, v: Scalar) -> tuple[Vec, Scalar]:
        """Return unit directions (3, N) and their pdf (N,) [1/sr], for u, v (N,) in [0, 1)."""
        if not self.discs:
            return self._sample_map(u, v)

        # Give each disc its part of the unit interval of u, and the map the last
        direction, pdf = np.empty((3, u.size), F32), np.empty(u.size, F32)
        bounds = np.cumsum([0.0, *self.disc_share, self.map_share])
        bounds[-1] = 1.0
        for number, (low, high) in enumerate(zip(bounds[:-1], bounds[1:], strict=True)):
            where = np.flatnonzero((u >= F32(low)) & (u < F32(high)))
            if not where.size:
                continue
            rest = (u.take(where) - F32(low)) * F32(1 / (high - low))
            np.minimum(rest, ONE_BELOW, out=rest)
            if number < len(self.discs):
                chosen = _sample_disc(self.discs[number], rest, v.take(where))
                others = self._map_pdf(chosen) * F32(self.map_share)
            else:
                chosen, others = self._sample_map(rest, v.take(where))
                others *= F32(self.map_share)
            for each, disc in enumerate(self.discs):
                cone = F32(self.disc_share[each] * _cone_pdf(disc))
                others += cone if each == number else _inside(disc, chosen) * cone
            direction[:, where] = chosen
            pdf[where] = others
        return direction, pdf

    def pdf(self, direction: Vec) -> Scalar:
        """Return the density (N,) [1/sr] with which `sample` finds directions (3, N)."""
        pdf = self._map_pdf(direction)
        if self.discs:
            pdf *= F32(self.map_share)
            for disc, share in zip(self.discs, self.disc_share, strict=True):
                pdf += _inside(disc, direction) * F32(share * _cone_pdf(disc))
        return pdf

    def _sample_map(self, u: Scalar, v: Scalar) -> tuple[Vec, Scalar]:
        # Choose a row, a cell in it, and a point of equal area in that
        row, along = self.rows.sample(v, None)
        cell, across = self.columns.sample(u, row)
        pdf = self.density.take(row)
        pdf *= self.columns.count.take(cell)
        across += cell - row * np.int32(self.width)
        z = self.rise.take(row)
        z *= along
        z += self.below.take(row)

        # Turn it into a direction
        azimuth = F32(np.pi) - across * F32(2 * np.pi / self.width)
        flat = F32(1) - z * z
        np.maximum(flat, F32(0), out=flat)
        np.sqrt(flat, out=flat)
        direction = np.empty((3, u.size), F32)
        np.cos(azimuth, out=direction[0])
        np.sin(azimuth, out=direction[1])
        direction[:2] *= flat
        direction[2] = z
        return direction, pdf

    def _map_pdf(self, direction: Vec) -> Scalar:
        u, v = equirectangular(direction)
        row = (v * F32(self.height)).astype(np.int32)
        np.minimum(row, np.int32(self.height - 1), out=row)
        column = (u * F32(self.width)).astype(np.int32)
        np.minimum(column, np.int32(self.width - 1), out=column)
        pdf = self.density.take(row)
        pdf *= self.columns.count.take(column + row * np.int32(self.width))
        return pdf


def compile_environment(
    radiance: Radiance,
    resolution: tuple[int, int] = (1024, 512),
    discs: Sequence[Disc] = (),
    compensation: float = COMPENSATION,
) -> Environment | None:
    """Tabulate where the light of a world comes from; None if all directions are alike.

    `radiance` returns (3, N) or (3, 1) [W/(sr m2)] for unit directions (3, N), without the discs;
    `resolution` is the width and height of its finest picture.  Cells below `compensation` times
    the mean get no samples, and the more the others: only with MIS is that unbiased.
    Raises: ValueError if the radiance is not finite somewhere.
    """
    discs = tuple(disc for disc in discs if disc.flux > 0)
    width, height = min(resolution[0], LARGEST[0]), min(resolution[1], LARGEST[1])
    value, mean = _average(radiance, resolution, width, height)
    edges = np.sin(np.linspace(-np.pi / 2, np.pi / 2, height + 1))
    area = np.diff(edges)
    flux = float((value.mean(axis=1) * area).sum()) * 2 * np.pi
    if not discs and np.ptp(value) <= 1e-5 * value.max():
        return None

    # Take the mean off, round rows and cells to whole steps
    importance = np.maximum(value - compensation * flux / (4 * np.pi), 0.0)
    if not importance.any():
        importance = np.ones_like(value)
    importance *= area[:, None]
    columns = _invert(importance, _STEPS * width)
    rows = _invert(importance.sum(axis=1)[None], _ROW_STEPS * height)

    # Share the samples by flux and evenly, half and half (Owen & Zhou 2000)
    fluxes = np.array([*(disc.flux for disc in discs), flux])
    shares = 0.5 * fluxes / fluxes.sum() + 0.5 * (fluxes > 0) / (fluxes > 0).sum()
    for disc in discs:
        mean = mean + np.array(disc.radiance) * disc.one_minus_cos / 2
    density = rows.count / (rows.steps * columns.steps * area * 2 * np.pi / width)
    return Environment(
        width=width,
        height=height,
        rows=rows,
        columns=columns,
        below=edges[:-1].astype(F32),
        rise=area.astype(F32),
        density=density.astype(F32),
        map_share=float(shares[-1]),
        discs=discs,
        disc_share=tuple(float(share) for share in shares[:-1]),
        mean=(float(mean[0]), float(mean[1]), float(mean[2])),
    )


def _average(
    radiance: Radiance, resolution: tuple[int, int], width: int, height: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return |radiance| of cells (height, width), the channels averaged, and its mean (3,)."""
    # Look at as many points of a cell as the picture has
    fine = -(-resolution[0] // width), -(-resolution[1] // height)
    across, down = width * fine[0], height * fine[1]
    u = (np.arange(across) + 0.5) / across
    value = np.empty((height, width))
    mean = np.zeros(3)
    area = np.diff(np.sin(np.linspace(-np.pi / 2, np.pi / 2, height + 1))) / 2
    at_once = max(_CHUNK // (across * fine[1]), 1)
    for first in range(0, height, at_once):
        some = min(at_once, height - first)
        v = (np.arange(first * fine[1], (first + some) * fine[1]) + 0.5) / down
        grid = np.meshgrid(u.astype(F32), v.astype(F32))
        seen = radiance(equirectangular_invert(grid[0].ravel(), grid[1].ravel()))
        if not np.isfinite(seen).all():
            raise ValueError("the radiance of the world is not a finite number everywhere")
        seen = np.broadcast_to(np.abs(seen), (3, grid[0].size))
        cells = seen.reshape(3, some, fine[1], width, fine[0]).mean(axis=(2, 4), dtype=np.float64)
        value[first : first + some] = cells.mean(axis=0)
        mean += (cells.mean(axis=2) * area[first : first + some]).sum(axis=1)

    # Texels shine half a texel into the next cell: without that share, neighbours of a bright one
    # would be sampled too rarely.  The weights are those of linear interpolation in one texel
    for axis, factor in enumerate(reversed(fine)):
        side = 1 / (8 * factor)
        around = np.roll(value, 1, axis) + np.roll(value, -1, axis)
        value = (1 - 2 * side) * value + side * around
    return value, mean


def _invert(weights: NDArray[np.float64], steps: int) -> Inversion:
    """Round each row of weights (R, M) to `steps` steps, at least one where it is not 0."""
    entries = weights.shape[1]
    some = (weights > 0).astype(np.int64)
    total = weights.sum(axis=1, keepdims=True)
    weights = np.where(total > 0, weights, 1.0)  # a row that is never chosen
    share = weights.cumsum(axis=1)
    share /= share[:, -1:]
    spare = steps - some.sum(axis=1, keepdims=True)
    whole = np.rint(share * spare).astype(np.int64)
    count: NDArray[np.int64] = np.diff(whole, axis=1, prepend=np.int64(0)) + some
    first = count.cumsum(axis=1) - count
    owner = np.repeat(np.tile(np.arange(entries), len(weights)), count.ravel())
    return Inversion(
        steps,
        entries,
        owner.astype(np.uint16),
        first.ravel().astype(np.uint16),
        count.ravel().astype(np.uint16),
    )


# --- Discs --------------------------------------------------------------------------------------


def _sample_disc(disc: Disc, u: Scalar, v: Scalar) -> Vec:
    """Return directions (3, N), uniform in solid angle."""
    axis = np.array(disc.direction, F32).reshape(3, 1)
    tangent, bitangent = frame(axis)
    x, y, z = uniform_cone(u, v, F32(disc.one_minus_cos))
    direction = tangent * x
    direction += bitangent * y
    direction += axis * z
    return direction


def _cone_pdf(disc: Disc) -> float:
    return 1 / (2 * np.pi * disc.one_minus_cos)


def _inside(disc: Disc, direction: Vec) -> NDArray[np.bool_]:
    inside: NDArray[np.bool_] = disc.chord(direction) < disc.largest_chord
    return inside
