"""shaders of lamps -> their light, sampled on purpose or met, is what Cycles' nodes say."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Link, Node, RayKinds, Settings, World, compile_plan
from penumbra.core.scene import Label
from tests.support import scenes as s

ABOVE = s.camera((0, 0.0001, 9), size=4, fov=0.02)  # looks at one point of the floor
FLOOR = s.put(s.quad((5, 0, 0), (0, 5, 0)), s.diffuse(1.0))
DIRECT = {"max_bounces": 0, "samples": 1}


def glow(strength=1.0, colour=(1.0, 1.0, 1.0)):
    return Node("Emission", "", {"Color": colour, "Strength": strength})


def output(kind, name, **inputs):
    return Link(s.node(kind, **inputs), name)


def falloff(name, **inputs):
    return glow(output("LightFalloff", name, **{"Strength": 3.0, "Smooth": 0.0, **inputs}))


def lamp_at(height, surface, strength=1.0):
    return replace(s.point((0.0, 0.0, height), strength), surface=surface)


def below(height, surface):
    """The light below a lamp, as a multiple of what it gives without a shader."""
    plain = s.pixels(ABOVE, FLOOR, lamp_at(height, None), **DIRECT)[..., :3].mean()
    return s.pixels(ABOVE, FLOOR, lamp_at(height, surface), **DIRECT)[..., :3].mean() / plain


@pytest.mark.parametrize("height", (0.5, 2.0))
@pytest.mark.parametrize(
    ("surface", "expected"),
    [
        (glow(2.5), lambda d: 2.5),
        (falloff("Quadratic"), lambda d: 3),
        (falloff("Linear"), lambda d: 3 * d),
        (falloff("Constant"), lambda d: 3 * d * d),
        (falloff("Constant", Smooth=4.0), lambda d: 3 * d**4 / (4 + d * d)),
        (glow(output("LightPath", "Ray Length")), lambda d: d),
        (glow(output("LightPath", "Ray Depth")), lambda d: 1),
    ],
)
def test_light_falls_off_as_the_shader_says(height, surface, expected):
    assert below(height, surface) == pytest.approx(expected(height), rel=1e-4)


def test_lamps_do_not_tell_what_kind_of_ray_asks():
    for kind in ("Camera", "Shadow", "Diffuse", "Glossy", "Singular", "Transmission"):
        assert below(1.0, glow(output("LightPath", f"Is {kind} Ray"))) == 0


def test_distances_of_suns_do_not_count():
    sun = s.sun((0.0, 0.0, 1.0))
    plain = s.pixels(ABOVE, FLOOR, sun, **DIRECT)
    shaded = s.pixels(ABOVE, FLOOR, replace(sun, surface=falloff("Constant")), **DIRECT)
    np.testing.assert_allclose(shaded[..., :3], 3 * plain[..., :3], rtol=1e-5)


def test_a_constant_shader_is_folded_and_a_black_one_takes_the_lamp_away():
    plan = compile_plan(s.scene(ABOVE, FLOOR, lamp_at(1, glow(2.0)), lamp_at(2, glow(0.0))), DARK)
    assert plan.lights.count == 1
    assert plan.lights.shaders is None
    np.testing.assert_allclose(plan.lights.groups[0].colour, 2)


def test_lamps_with_the_same_nodes_share_a_program():
    lamps = [lamp_at(h, falloff("Linear", Strength=float(h))) for h in (1, 2, 3)]
    shaders = compile_plan(s.scene(ABOVE, FLOOR, *lamps, lamp_at(4, None)), DARK).lights.shaders
    assert len(shaders.glows) == 1
    assert shaders.program.tolist() == [0, 0, 0, -1]
    together = s.pixels(ABOVE, FLOOR, *lamps, lamp_at(4, None), **DIRECT)[..., :3].mean()
    single = sum(
        s.pixels(ABOVE, FLOOR, x, **DIRECT)[..., :3].mean() for x in (*lamps, lamp_at(4, None))
    )
    assert together == pytest.approx(single, rel=1e-5)


DARK = Settings()
PLACE = glow(1.0, output("NewGeometry", "Parametric"))


def test_the_camera_sees_the_shader_of_a_lamp():
    lamp = s.area((0, 0, 0), (0, 0, -1), size=(2.0, 2.0), seen_by=RayKinds())
    view = s.orthographic((0, 0, -5), (0, 0, 0), size=8, scale=2.0)
    image = s.pixels(view, replace(lamp, surface=PLACE), samples=16)
    ramp = (np.arange(8) + 0.5) / 8
    for channel in (image[..., 0], image[..., 1]):
        line = channel.mean(axis=0) if np.ptp(channel.mean(axis=0)) > 0.5 else channel.mean(axis=1)
        line = line if line[0] < line[-1] else line[::-1]
        np.testing.assert_allclose(line, ramp, atol=0.04)
    assert image[..., 2].max() == 0


def lit(surface, **lamp):
    """The colour (3,) of light straight below a lamp at (0.2, 0.3, 2), as multiples."""
    at = s.camera((0.2, 0.3001, 9), (0.2, 0.3, 0), size=4, fov=0.02)
    plain = s.point((0.2, 0.3, 2.0))
    shaded = replace(plain, surface=surface, **lamp)
    pictures = (s.pixels(at, FLOOR, x, **DIRECT)[..., :3].mean((0, 1)) for x in (shaded, plain))
    return np.divide(*pictures)


def test_shaders_read_the_label_of_their_lamp():
    label = Label((0.2, 0.4, 0.6), 0.7, 5, 0.3)
    for name, told in (
        ("Location", (0.2, 0.3, 2.0)),
        ("Color", (0.2, 0.4, 0.6)),
        ("Alpha", 0.7),
        ("Object Index", 5),
        ("Random", 0.3),
    ):
        surface = glow(1.0, output("ObjectInfo", name))
        np.testing.assert_allclose(lit(surface, label=label), told, rtol=1e-4)


def test_places_are_in_the_lamps_space_if_it_is_an_object_and_in_the_world_otherwise():
    for name in ("Object", "Generated"):
        surface = glow(1.0, output("TexCoord", name))
        np.testing.assert_allclose(lit(surface), 0, atol=1e-4)
        np.testing.assert_allclose(lit(surface, is_object=False), (0.2, 0.3, 2.0), rtol=1e-4)
    known = glow(1.0, output("ObjectInfo", "Location"))
    np.testing.assert_allclose(lit(known, is_object=False), 0, atol=1e-4)


def test_places_on_an_area_are_the_same_whether_it_is_an_object_or_not():
    lamp = s.area((3, 0, 0), (3, 0, -1), size=(2.0, 2.0), seen_by=RayKinds(), surface=PLACE)
    view = s.orthographic((3, 0, -5), (3, 0, 0), size=8, scale=2.0)
    old, new = (s.pixels(view, replace(lamp, is_object=x), samples=4) for x in (False, True))
    assert np.ptp(new[..., 0]) > 0.5
    np.testing.assert_array_equal(old, new)


def test_places_may_be_those_of_another_object():
    there = (1, 0, 0, -1.0, 0, 1, 0, -2.0, 0, 0, 2, 0.0)
    way = Link(Node("TexCoord", "", {}, {"object": there}), "Object")
    np.testing.assert_allclose(lit(glow(1.0, way)), (1.2, 2.3, 1.0), rtol=1e-4)


def test_a_texture_that_is_not_told_where_is_looked_up_in_the_lamps_space():
    told = {"Vector": output("TexCoord", "Object")}
    for kind, name in (("TexNoise", "Color"), ("TexVoronoi", "Distance"), ("TexGradient", "Color")):
        plain, linked = (glow(1.0, output(kind, name, **inputs)) for inputs in ({}, told))
        expected = lit(linked, is_object=False)
        np.testing.assert_array_equal(lit(plain, is_object=False), expected)
        assert (expected != lit(linked)).any()


@pytest.mark.parametrize(
    ("kind", "name", "choices"),
    [
        ("CameraData", "View Distance", {}),
        ("TexCoord", "Camera", {}),
        ("NewGeometry", "Tangent", {}),
        ("Tangent", "Tangent", {}),
        ("ParticleInfo", "Age", {}),
        ("VectorTransform", "Vector", {"convert_to": "CAMERA"}),
    ],
)
def test_what_lamps_have_none_of_is_noted(kind, name, choices):
    surface = glow(1.0, Link(Node(kind, "", {}, choices), name))
    plan = compile_plan(s.scene(ABOVE, FLOOR, lamp_at(1, surface)), DARK)
    assert any(kind in note.what for note in plan.notes)


def test_lamps_have_no_edges():
    assert below(1.0, glow(output("Wireframe", "Fac", Size=10.0))) == 0


@pytest.mark.parametrize(
    ("kind", "name", "inputs", "expected"),
    (("Wireframe", "Fac", {"Size": 10.0}, (0, 0, 0)), ("NewGeometry", "Parametric", {}, (1, 0, 0))),
)
def test_the_world_is_no_triangle(kind, name, inputs, expected):
    place = Node("Background", inputs={"Color": output(kind, name, **inputs), "Strength": 1.0})
    world = World("World", place)
    seen = s.pixels(s.camera((0, 0, 0), (0, 1, 0)), world)[..., :3]
    np.testing.assert_array_equal(seen, np.broadcast_to(np.float32(expected), seen.shape))


def test_mirrors_and_light_samples_see_the_same_shader():
    # A rough mirror gets its light by both ways, weighted: the sum must not depend on the share.
    lamp = replace(s.area((0, 0, 2), radiance=4.0, size=(2.0, 2.0)), surface=PLACE)
    view = s.camera((0, -3, 3), size=6, fov=30)
    values = {}
    for name, roughness in (("sharp", 0.02), ("rough", 0.5)):
        floor = s.put(
            s.quad((5, 0, 0), (0, 5, 0)),
            s.Material("M", s.node("BsdfAnisotropic", Color=(1.0, 1.0, 1.0), Roughness=roughness)),
        )
        both = s.means(view, floor, lamp, samples=256, max_bounces=1)
        unmet = s.means(view, floor, replace(lamp, sampled=False), samples=256, max_bounces=1)
        values[name] = both, unmet
    both, unmet = values["rough"]
    error = np.sqrt(both.var(ddof=1) / both.size + unmet.var(ddof=1) / unmet.size)
    assert abs(both.mean() - unmet.mean()) < 4 * error
    assert both.mean() > 20 * error


def test_negative_light_darkens():
    plain = s.pixels(ABOVE, FLOOR, lamp_at(1, None), **DIRECT)[..., :3].mean()
    strange = s.pixels(ABOVE, FLOOR, lamp_at(1, glow(-1.0)), lamp_at(1, None, 3.0), **DIRECT)
    assert strange[..., :3].mean() == pytest.approx(2 * plain, rel=1e-5)


def test_many_lamps_with_shaders_are_chosen_without_bias():
    places = [(x, y, 2.0) for x in range(-2, 3) for y in range(-2, 3)]
    lamps = [
        replace(s.point(at, 0.1), surface=falloff("Constant", Strength=0.1 + k))
        for k, at in enumerate(places)
    ]
    view = s.camera((0, 0.01, 9), size=4, fov=20)
    chosen = s.means(view, FLOOR, *lamps, samples=256, max_bounces=0)
    exact = sum(s.means(view, FLOOR, x, samples=4, count=1, max_bounces=0)[0] for x in lamps)
    error = chosen.std(ddof=1) / np.sqrt(chosen.size)
    assert abs(chosen.mean() - exact) < 4 * error + 2e-3 * exact
    assert error < 0.02 * exact


def test_faint_light_samples_are_left_out_without_bias():
    lamps = [s.point((x, 0.0, 1.0), 0.1) for x in (-4.0, 0.0, 4.0)]
    view = s.camera((0, 0.01, 9), size=8, fov=60)
    given = {"samples": 16, "max_bounces": 0, "light_sampling_threshold": 0.01}
    every = [s.picture(view, FLOOR, *lamps, **given, seed=k) for k in range(8)]
    some = [s.picture(view, FLOOR, *lamps, **given, seed=k, use_light_tree=False) for k in range(8)]
    rays = [sum(p.statistics["rays_shadow"] for p in pictures) for pictures in (every, some)]
    assert rays[1] < 0.6 * rays[0]
    a, b = (np.array([p.combined()[..., 1].mean() for p in x]) for x in (every, some))
    error = np.sqrt(a.var(ddof=1) / 8 + b.var(ddof=1) / 8)
    assert abs(a.mean() - b.mean()) < 4 * error
    assert error < 0.02 * a.mean()
