"""re-use of paths -> the same light with less noise, whatever neighbours see."""

import numpy as np
import pytest

from penumbra.core import Link, Material, compile_plan
from penumbra.core.tiles import SIZE
from tests.support import scenes as s
from tests.support.statistics import assert_same_mean

# The foot of a wall that is lit by what lies above alone, through slats; in few large pixels, so
# that neighbours see other surfaces, colours, distances and shadows, from other directions
VIEW = s.camera((0.3, -3.2, 1.1), (0, 0, 0.55), size=4, fov=50)
LAMP = s.sun((0, -1, -0.3), 9.0)
CEILING = s.quad((3, 0, 0), (0, 3, 0), (0, 0, 2.2))
SLATS = [
    s.put(
        s.quad((3, 0, 0), (0, 0.06, 0)), s.diffuse(0.06), to_world=s.affine(1.0, (0, y / 4, 0.15))
    )
    for y in range(-6, 5)
]
FLOOR = s.quad((3, 0, 0), (0, 3, 0))
WALL = s.quad((3, 0, 0), (0, 0, 3), (0, 1.0, 0))
BALL = s.sphere(0.5, levels=3)
WHITE = s.diffuse(0.9)


def material(kind, **inputs):
    return Material(kind, s.node(kind, **inputs))


def plastic(colour, **inputs):
    return material("BsdfPrincipled", Base_Color=colour, **inputs)


def mixed(first, second, fac=0.5):
    return Material("Mix", s.shader(first.surface, second.surface, "MixShader", fac))


def room(floor, wall, ball, *more, ceiling=WHITE):
    centre = s.affine(1.0, (0.1, 0.1, 0.5))
    things = s.put(FLOOR, floor), s.put(WALL, wall), s.put(BALL, ball, to_world=centre)
    return (*things, s.put(CEILING, ceiling), *SLATS, LAMP, *more)


GREY, RED, GREEN = s.diffuse(0.7), s.diffuse((0.8, 0.2, 0.1)), s.diffuse((0.1, 0.7, 0.3))
FACING = Material(
    "Facing",
    s.node(
        "BsdfDiffuse",
        Color=Link(s.node("LayerWeight", Blend=0.4), "Facing"),
    ),
)
INCOMING = Link(s.node("NewGeometry"), "Incoming")
SIDE = Material(
    "Side", s.node("BsdfDiffuse", Color=Link(s.node("SeparateXYZ", Vector=INCOMING), "X"))
)
SCENES = {
    "matte": room(GREY, RED, GREEN),
    "saturated": room(s.diffuse((0.9, 0.0, 0.0)), s.diffuse((0.01, 0.02, 0.9)), GREY),
    "plastic": room(
        plastic((0.8, 0.7, 0.6), Roughness=0.4),
        plastic((0.2, 0.6, 0.3), Roughness=0.2),
        plastic((0.8, 0.8, 0.8), Roughness=0.6),
    ),
    "coats": room(plastic((0.8, 0.7, 0.6), Coat_Weight=1.0, Coat_Tint=(0.9, 0.5, 0.3)), GREY, RED),
    "colours that depend on the viewer": room(FACING, FACING, FACING),
    "light that goes to one side": room(GREY, SIDE, GREY, ceiling=SIDE),
    "mirrors and glass": room(GREY, s.mirror(0.9), s.glass()),
    "half transparent": room(mixed(GREY, material("BsdfTransparent"), 0.4), RED, GREEN),
    "two matte closures": room(mixed(GREY, RED), GREEN, GREY),
    "glow": room(s.glowing(0.6, 0.2), RED, s.glowing(0.5, 2.0)),
    "a world": room(GREY, RED, GREEN, s.world(0.5)),
    "no neighbours' light": room(s.diffuse(0.0), GREY, s.diffuse(0.0)),
}
SETTINGS = {
    "plain": {},
    "several rays": {"scatter_samples": 2},
    "no splitting": {"splitting": False},
    "one bounce": {"max_bounces": 1},
    "clamped": {"sample_clamp_indirect": 100.0},
}
CASES = [(name, "plain") for name in SCENES] + [("plastic", name) for name in SETTINGS][1:]
DEEP = {"max_bounces": 6, "diffuse_bounces": 6, "glossy_bounces": 6, "samples": 64}


def shown(name, reuse, count=24, first=0, view=VIEW, **settings):
    """Pictures (seeds, pixels, 3) of a scene."""
    settings = {**DEEP, "light_samples": 1, "scatter_samples": 1, **settings}
    seeds = range(first, first + count)
    return np.stack(
        [s.pixels(view, *SCENES[name], seed=i, path_reuse=reuse, **settings) for i in seeds]
    )[..., :3]


def whole(pictures):
    return pictures.mean(axis=(1, 2, 3))


def across(pictures):
    half = pictures.shape[2] // 2
    return whole(pictures[:, :, :half]) - whole(pictures[:, :, half:])


def down(pictures):
    return across(pictures.swapaxes(1, 2))


@pytest.mark.parametrize(("name", "how"), CASES)
def test_light_is_the_same(name, how):
    own = shown(name, "OFF", **SETTINGS[how])
    shared = shown(name, "ON", first=1000, **SETTINGS[how])

    # The whole picture, and its halves against each other
    for part in (whole, across, down):
        assert_same_mean(part(own), part(shared), tests=3 * len(CASES))


def test_noise_is_less():
    fine = s.replace(VIEW, width=24, height=24)
    own, shared = (
        shown("matte", how, view=fine, count=8, samples=4).var(axis=0).mean()
        for how in ("OFF", "ON")
    )
    assert shared < own / 1.5


def test_plans_say_whether_paths_are_shared():
    def plan(*things, **settings):
        return compile_plan(s.scene(VIEW, *things), s.replace(s.DEFAULTS, **settings))

    things = SCENES["matte"]
    on = plan(*things, path_reuse="ON")
    assert on.path_reuse == SIZE and "path_reuse" not in on.measures
    assert "with re-use of paths" in on.describe() or ", re-use of paths" in on.describe()
    assert plan(*things, path_reuse="OFF").path_reuse == 1
    assert "path_reuse" in plan(*things).measures
    assert plan(*things, path_reuse="ON", max_bounces=0).path_reuse == 1
    mirrors = s.put(BALL, s.mirror(0.9)), LAMP
    assert "path_reuse" not in plan(*mirrors).measures
