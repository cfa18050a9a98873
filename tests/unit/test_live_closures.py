"""Closures are left out where they have no weight, and the picture stays the same to the bit."""

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.bsdf import REGISTRY
from penumbra.core.scene import Link, Node
from penumbra.core.shading import closures
from penumbra.core.shading.closures import Frame, LobeAt
from penumbra.tests.support import scenes as s


def lobe(weight):
    weight = np.asarray(weight, F32)
    up = np.repeat(np.array([[0], [0], [1]], F32), max(weight.shape[1], 4), axis=1)
    return LobeAt(REGISTRY["diffuse"], weight, (), Frame(up, None, up))


def test_points_are_live_where_any_channel_has_weight():
    some = lobe([[0, 0, 0, 1], [0, 0, -0.5, 1], [0, 0, 0, 1]])
    assert some.live.tolist() == [2, 3] and some.is_alive
    np.testing.assert_array_equal(some.there.weight, some.weight[:, 2:])
    none = lobe(np.zeros((3, 4)))
    assert none.live.size == 0 and not none.is_alive
    for whole in (lobe(np.ones((3, 4))), lobe([[0, 1, 0, 1], [1, 1, 1, 1], [0, 0, 0, 0]])):
        assert whole.live is None and whole.there is whole and whole.is_alive
    assert lobe(np.ones((3, 1))).live is None


def tiles(first, second):
    """Return a material of two shaders in squares: each has no weight on those of the other."""
    place = Link(Node("NewGeometry"), "Position")
    checker = Node("TexChecker", "", {"Vector": place, "Scale": 3.0})
    return s.shader(first, second, "MixShader", Link(checker, "Fac"))


@pytest.mark.parametrize("splitting", (True, False), ids=("splitting", "choosing"))
@pytest.mark.parametrize("kind", ("glossy", "glass", "matte"))
def test_leaving_closures_out_does_not_change_a_bit(splitting, kind, monkeypatch):
    other = {
        "glossy": s.node("BsdfGlossy", Roughness=0.3),
        "glass": s.node("BsdfGlass", Roughness=0.0),
        "matte": s.node("BsdfTranslucent"),
    }[kind]
    squares = tiles(s.node("BsdfDiffuse"), other)
    coated = s.shader(squares, s.node("BsdfGlossy", Roughness=0.5, Color=s.colour(0.2)))
    floor = s.Material("Tiles", s.shader(coated, squares))
    things = (
        s.put(s.quad((6, 0, 0), (0, 6, 0), (0.01, 0.01, 0)), floor),
        s.put(s.sphere(0.8), s.Material("Ball", s.node("BsdfDiffuse"))),
        s.area((0, 2, 4), radiance=9.0),
        s.point((2, -2, 3), 20.0),
        s.world(0.3),
    )
    pictures = []
    for most in (0.0, 0.9):
        monkeypatch.setattr(closures, "MOST_LIVE", most)
        view = s.camera((0, -5, 4), size=24)
        pictures.append(s.pixels(view, *things, samples=4, max_bounces=3, splitting=splitting))
    np.testing.assert_array_equal(*pictures)
