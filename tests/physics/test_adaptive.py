"""adaptive sampling -> pictures whose mean is that of uniform sampling, everywhere."""

import numpy as np
import pytest

from tests.support import scenes as s

# A lamp whose light comes back from a wall as a caustic: few paths find it, and they are bright.
LAMP = s.put(s.quad((0, 0.3, 0), (0, 0, 0.3), (-1.2, 0, 0.6)), s.emission(10.0))
FLOOR = s.put(s.quad((2, 0, 0), (0, 2, 0)), s.diffuse(0.8))
WALL = s.put(s.quad((0, 9, 0), (0, 0, 9), (0.5, 0, 0)), s.mirror(0.8))
CAUSTIC = (FLOOR, LAMP, WALL)
# The hard shadow of a small lamp under a sky
SHADOW = (
    FLOOR,
    s.put(s.box(0.3), s.diffuse(0.5), to_world=s.affine(1.0, (-0.5, 0, 0.3))),
    s.area((0.5, -0.5, 2), radiance=30.0, size=(0.3, 0.3)),
    s.world(0.3),
)
VIEW = s.orthographic((-0.5, 0, 1.5), (-0.5, 0, 0), size=16, scale=1.5)
SEEDS, MOST, PATCH = 10, 1024, 4


@pytest.mark.parametrize(
    ("things", "threshold"), ((CAUSTIC, 0.03), (SHADOW, 0.005)), ids=("caustic", "shadow")
)
def test_stopping_changes_the_mean_by_less_than_half_a_percent(things, threshold):
    # Held against the picture that the same samples give if nobody stops: few seeds tell much.
    differences, means, counts = [], [], []
    for seed in range(SEEDS):
        settings = {
            "samples": MOST,
            "seed": seed,
            "adaptive_threshold": threshold,
            "max_bounces": 2,
        }
        whole = s.picture(VIEW, *things, **settings)
        some = s.picture(VIEW, *things, use_adaptive_sampling=True, **settings)
        differences.append(some.combined()[..., :3] - whole.combined()[..., :3])
        means.append(whole.combined()[..., :3].mean())
        counts.append(some.film.counts.mean())
    relative = np.array(differences).mean(axis=-1) / np.mean(means)
    assert 64 < np.mean(counts) < 0.8 * MOST

    # The whole picture, and each patch of it, by the bound and 4 standard errors
    bias = relative.mean(axis=(1, 2))
    assert abs(bias.mean()) + 4 * _error(bias) < 0.005
    side = VIEW.width // PATCH
    patches = relative.reshape(SEEDS, side, PATCH, side, PATCH).mean(axis=(2, 4))
    assert (np.abs(patches.mean(axis=0)) < 0.005 + 4 * _error(patches)).all()


def _error(values):
    return values.std(axis=0, ddof=1) / np.sqrt(len(values))
