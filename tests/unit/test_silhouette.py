"""core.geometry.silhouette -> normals that mirror the ray to the outside, else untouched."""

import numpy as np

from penumbra.core.geometry.silhouette import RISE, SHARE, bent_normals

F32 = np.float32


def unit(vectors):
    return (vectors / np.linalg.norm(vectors, axis=0)).astype(F32)


def bend(wo, normal):
    """Bend normals of the plane z = 0, seen from above."""
    return bent_normals(np.broadcast_to(F32([[0], [0], [1]]), wo.shape), normal, wo)


def scattered(count=5000):
    rng = np.random.default_rng(2)
    wo = rng.normal(size=(3, count))
    wo[2] = np.abs(wo[2]) * 10.0 ** rng.uniform(-4, 0, count)
    return unit(wo), unit(rng.normal(size=(3, count)) * [[1], [1], [0.3]] + [[0], [0], [0.5]])


def mirrored(wo, normal):
    return 2 * (wo * normal).sum(axis=0) * normal - wo


def test_no_mirrored_ray_runs_into_the_surface():
    wo, normal = scattered()
    bent = bend(wo, normal)
    assert bent.dtype == F32
    np.testing.assert_allclose((bent**2).sum(axis=0), 1, atol=2e-6)
    rise = np.minimum(SHARE * wo[2], RISE)
    before, after = mirrored(wo, normal)[2], mirrored(wo, bent)[2]
    low = before < rise - 1e-5
    assert 500 < low.sum() < 4500
    np.testing.assert_allclose(after[low], rise[low], atol=2e-6)
    assert ((bent * wo).sum(axis=0)[low] > 0).all()
    fine = before > rise + 1e-5
    np.testing.assert_array_equal(bent[:, fine], normal[:, fine])


def test_normals_are_bent_towards_the_true_one_and_in_its_plane():
    wo, normal = scattered()
    bent = bend(wo, normal)
    assert (bent[2] >= normal[2] - 1e-6).all()
    side = normal[0] * bent[1] - normal[1] * bent[0]
    np.testing.assert_allclose(side, 0, atol=1e-6)
    assert ((normal[:2] * bent[:2]).sum(axis=0) > -1e-6).all()


def test_points_that_need_nothing_are_passed_on():
    wo, normal = unit(np.array([[0.3], [0.1], [1.0]])), unit(np.array([[0.1], [0.0], [1.0]]))
    assert bend(wo, normal) is normal


def test_no_argument_is_changed():
    wo, normal = scattered()
    before = wo.copy(), normal.copy()
    bend(wo, normal)
    np.testing.assert_array_equal((wo, normal), before)


def test_rays_along_the_surface_give_no_nan():
    wo = unit(np.array([[1.0, 0, 1, 1e-20], [0, 1, 0, 0], [0, 0, 1e-12, 1]]))
    normal = unit(np.array([[1.0, 1, -1, 0], [0, 0, 0, 0], [0.1, 0.1, 0.1, -1]]))
    assert np.isfinite(bend(wo, normal)).all()
