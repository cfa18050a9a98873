"""pixels -> tiles: who shares paths with whom."""

import numpy as np
import pytest

from penumbra.core.tiles import HEIGHT, SHIFTS, SIZE, WIDTH, Tiling

ACROSS, DOWN = 13, 7


def block(pixels=None):
    """Raster positions of pixels."""
    y, x = np.divmod(np.arange(ACROSS * DOWN) if pixels is None else np.asarray(pixels), ACROSS)
    return x.astype(np.float32), y.astype(np.float32)


def tiles_of(some, sample):
    """The tiles of one sample, as sets of (x, y)."""
    members = Tiling(*some).tiles(sample, 1).members
    return [{(some[0][m], some[1][m]) for m in column if m >= 0} for column in members.T]


@pytest.mark.parametrize("sample", range(len(SHIFTS)))
def test_tiles_hold_neighbours_and_every_pixel_once(sample):
    tiles = tiles_of(block(), sample)
    seen = [pixel for tile in tiles for pixel in tile]
    assert len(seen) == len(set(seen))
    for tile in tiles:
        x, y = np.array(sorted(tile)).T
        assert 1 < len(tile) <= SIZE
        assert np.ptp(x) < WIDTH and np.ptp(y) < HEIGHT
    alone = ACROSS * DOWN - len(seen)
    assert alone <= 2  # in a corner


def test_tiles_lie_elsewhere_from_sample_to_sample():
    together = [
        {frozenset(tile) for tile in tiles_of(block(), s) if len(tile) == SIZE}
        for s in range(len(SHIFTS))
    ]
    assert all(not a & b for k, a in enumerate(together) for b in together[:k])
    steady = Tiling(*block(), shifts=False)
    assert np.array_equal(steady.tiles(0, 1).members, steady.tiles(1, 1).members)


def test_samples_in_flight_together_share_within_themselves():
    some = block()
    tiles = Tiling(*some).tiles(3, 2)
    pixels = some[0].size
    sample = np.where(tiles.members >= 0, tiles.members // pixels, -1)
    assert all(len(set(column) - {-1}) == 1 for column in sample.T)
    one, two = (Tiling(*some).tiles(s, 1).members for s in (3, 4))
    both = np.concatenate([one, np.where(two >= 0, two + pixels, -1)], axis=1)
    assert np.array_equal(tiles.members, both)


def test_place_tells_where_a_slot_stands():
    some = block([0, 1, 2, 3, 14, 40, 41, 90])
    tiles = Tiling(*some).tiles(0, 2)
    flat = tiles.members.ravel()
    for slot, place in enumerate(tiles.place):
        assert (flat[place] == slot) if place >= 0 else slot not in flat
    assert tiles.place[7] == tiles.place[15] == -1  # the last pixel has no neighbours


def test_pixels_without_neighbours_have_no_tiles():
    tiles = Tiling(*block([0, 30, 60])).tiles(0, 1)
    assert tiles.count == 0 and (tiles.place == -1).all()
