"""Passes of scenes whose answers are known: what adds up, what is seen, and what costs nothing."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Instance, Lamp, Link, Material, Node, World, compile_plan, render
from penumbra.core.film.passes import PASSES
from penumbra.core.layer import MATTES, Layer, Mist
from penumbra.core.optics import Aperture, Panorama
from penumbra.core.scene import ACTIVE_UV, Attribute, Label
from tests.support.passes import every_kind_of_surface, from_above, half_clear, rendered, shown
from tests.support.scenes import (
    DEFAULTS,
    Camera,
    affine,
    diffuse,
    emission,
    glass,
    look_at,
    mirror,
    node,
    orthographic,
    point,
    put,
    quad,
    scene,
    world,
)

LIGHT = tuple(
    name
    for name in (each.name for each in PASSES)
    if name.split()[0] in ("Diffuse", "Glossy", "Transmission", "Emission", "Environment")
)


def added_up(found):
    total = found["Emission"] + found["Environment"]
    for lobe in ("Diffuse", "Glossy", "Transmission"):
        light = found[f"{lobe} Direct"] + found[f"{lobe} Indirect"]
        total = total + light * found[f"{lobe} Color"]
    return total


@pytest.mark.parametrize("splitting", [True, False])
@pytest.mark.parametrize("limit", [0.0, 0.5])
def test_the_light_passes_add_up_to_the_picture(splitting, limit):
    settings = {
        "samples": 8,
        "splitting": splitting,
        "sample_clamp_direct": limit,
        "sample_clamp_indirect": limit,
        "film_exposure": 1.7,
    }
    found = shown(Layer(passes=LIGHT), *every_kind_of_surface(), **settings)
    assert all(found[name].any() for name in LIGHT if name != "Transmission Direct")
    np.testing.assert_allclose(added_up(found), found["Combined"][..., :3], rtol=2e-6, atol=2e-6)


def test_light_is_not_sorted_by_what_no_surface_or_lamp_has():
    view, lamp = orthographic((0, 0, 5)), point((0, 0, 3))
    layer = Layer(passes=("Glossy Direct", "Transmission Indirect"), light_groups=("A",))

    def ledger(material, lamp):
        floor = put(quad((9, 0, 0), (0, 9, 0)), material)
        return compile_plan(scene(view, floor, lamp, layer=layer), DEFAULTS).ledger

    for material, lobes in ((diffuse(), 0), (mirror(), 1), (glass(), 2)):
        found = ledger(material, lamp)
        assert found.sorts_light == (lobes > 0)
        assert len(np.unique(found.lobes)) == 1 + lobes
        assert found.light_groups is None
    grouped = replace(lamp, light_group="A")
    found = ledger(diffuse(), grouped)
    assert found.sorts_light and found.light_groups is not None
    seen = shown(layer, *from_above(put(quad((9, 0, 0), (0, 9, 0)), diffuse()), grouped))
    assert not seen["Glossy Direct"].any() and seen["Combined_A"].any()


def test_passes_do_not_change_the_picture():
    everything = Layer(
        passes=tuple(each.name for each in PASSES if each.name != "UV"),
        mattes=MATTES,
        light_groups=("A",),
    )
    with_passes = shown(everything, *every_kind_of_surface(), samples=4)
    alone = shown(Layer(), *every_kind_of_surface(), samples=4)
    assert set(alone) == {"Combined"}
    np.testing.assert_allclose(with_passes["Combined"], alone["Combined"], rtol=2e-6, atol=1e-6)


def test_a_layer_that_asks_for_nothing_keeps_no_book():
    view, *things = every_kind_of_surface()
    plan = compile_plan(scene(view, *things), DEFAULTS)
    assert plan.ledger is None
    assert plan.passes == ("combined",)
    assert not plan.surfaces.shown
    picture = render(plan, threads=1)
    assert picture.film.middles is None
    assert picture.film.parts is None


def test_only_the_rows_that_wanted_passes_read_are_summed():
    view, *things = every_kind_of_surface()
    layer = Layer(passes=("Diffuse Direct", "Mist"))
    plan = compile_plan(scene(view, *things, layer=layer), DEFAULTS)
    assert plan.passes == ("combined", "diffuse_direct", "diffuse", "mist")
    assert plan.surfaces.shown == ("diffuse",)


def test_a_matte_plane_shows_its_colour_and_the_light_without_it():
    colour = (0.25, 0.5, 0.0)
    floor = put(quad((9, 0, 0), (0, 9, 0)), diffuse(colour))
    found = shown(Layer(passes=LIGHT), *from_above(floor, world(2.0)), samples=16, max_bounces=0)
    np.testing.assert_allclose(found["Diffuse Color"][..., :3], [[colour] * 8] * 8, rtol=1e-6)
    np.testing.assert_allclose(found["Diffuse Direct"][..., :2], 2.0, rtol=1e-5)
    np.testing.assert_allclose(found["Diffuse Direct"][..., 2], 2.0, rtol=1e-5)  # grey stays grey
    assert not found["Glossy Direct"].any()


# --- Data ----------------------------------------------------------------------------------------

DATA = ("Depth", "Position", "Normal", "Object Index", "Material Index", "Mist", "UV")


def labelled(index, material_index):
    shape = quad((0.5, 0, 0), (0, 9, 0), (0.5, 0, 1))
    corners = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], np.float32)
    shape = replace(shape, attributes={ACTIVE_UV: Attribute("CORNER", corners)})
    surface = replace(diffuse(), index=material_index)
    return replace(put(shape, surface, name="Right"), label=Label(index=index))


def test_data_passes_show_the_first_surface_unfiltered_or_filtered_and_nothing_where_it_is_not():
    layer = Layer(passes=DATA, mist=Mist(7.0, 4.0, 2.0))
    settings = {"samples": 16, "pixel_filter_type": "BLACKMAN_HARRIS"}
    found = shown(layer, *from_above(labelled(3, 5)), **settings)
    right, left = found["Depth"][:, 4:, 0], found["Depth"][:, :4, 0]
    np.testing.assert_allclose(right, 9.0, rtol=1e-6)
    np.testing.assert_array_equal(left, np.float32(1e10))
    assert (found["Object Index"][:, 4:] == 3).all()
    assert (found["Material Index"][:, 4:] == 5).all()
    assert not found["Object Index"][:, :4].any()
    middles = (np.arange(8) + 0.5) / 4 - 1
    np.testing.assert_allclose(found["Position"][2, 4:, 0], middles[4:], atol=1e-3)
    np.testing.assert_allclose(found["Position"][:, 5, 1], middles, atol=1e-3)
    np.testing.assert_allclose(found["Position"][:, 4:, 2], 1.0, atol=1e-5)

    # The others are blurred by the pixel filter, and of nothing where there is nothing.
    np.testing.assert_allclose(found["Normal"][:, 6], [[0, 0, 1]] * 8, atol=1e-6)
    np.testing.assert_allclose(found["Mist"][:, 6, 0], ((9 - 7) / 4) ** 2, rtol=1e-5)
    assert (found["Mist"][:, 1] == 1).all()
    assert 0 < found["Normal"][4, 4, 2] < 1
    np.testing.assert_allclose(found["UV"][:, 6, 0], (6 + 0.5) / 4 - 1, atol=0.05)
    np.testing.assert_allclose(found["UV"][:, 6, 2], 1.0, rtol=1e-6)
    assert not found["UV"][:, 1].any()


def test_data_of_the_middle_of_a_pixel_do_not_depend_on_samples_seed_and_threads():
    layer = Layer(passes=("Depth", "Position", "Object Index"))
    things = every_kind_of_surface()
    first = shown(layer, *things, samples=1)
    other = shown(
        layer, *things, samples=9, seed=4, threads=2, use_sample_subset=True, sample_offset=3
    )
    for name in layer.passes:
        np.testing.assert_array_equal(first[name], other[name])


@pytest.mark.parametrize(("threshold", "depth"), [(0.2, 6.0), (0.8, 8.0)])
def test_surfaces_below_the_threshold_are_looked_through(threshold, depth):
    veil = put(quad((9, 0, 0), (0, 9, 0), (0, 0, 4)), half_clear(), name="Veil")
    floor = put(quad((9, 0, 0), (0, 9, 0), (0, 0, 2)), diffuse(0.5), name="Floor")
    layer = Layer(passes=("Depth", "Normal", "Diffuse Color"), alpha_threshold=threshold)
    found = shown(layer, *from_above(veil, floor))
    np.testing.assert_allclose(found["Depth"], depth, rtol=1e-6)
    np.testing.assert_allclose(found["Normal"][..., 2], 1.0, rtol=1e-6)
    expected = 0.5 * np.array((0.2, 0.4, 0.6)) + 0.5 * 0.5  # colours of both add up
    np.testing.assert_allclose(found["Diffuse Color"], [[expected] * 8] * 8, rtol=1e-5)


def test_a_normal_pass_shows_the_normals_that_shaders_have():
    tilted = node("CombineXYZ", X=1.0, Y=0.0, Z=1.0)
    matte = node("BsdfDiffuse", Color=(0.5, 0.5, 0.5))
    inputs = {**matte.inputs, "Normal": Link(tilted, "Vector", (0, 0, 1))}
    matte = Node("BsdfDiffuse", "", inputs)
    floor = put(quad((9, 0, 0), (0, 9, 0)), Material("Bent", matte))
    found = shown(Layer(passes=("Normal",)), *from_above(floor))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(found["Normal"], [[(half, 0, half)] * 8] * 8, atol=1e-6)


@pytest.mark.parametrize(("surface", "notes"), [(glass(), 1), (diffuse(), 0)])
def test_guides_that_mirrors_and_glass_hide_are_noted(surface, notes):
    floor = put(quad((9, 0, 0), (0, 9, 0)), surface)
    view, thing = from_above(floor)
    asked = Layer(passes=("Denoising Albedo", "Denoising Normal", "Denoising Depth"))
    plans = [compile_plan(scene(view, thing, layer=each), DEFAULTS) for each in (asked, Layer())]
    assert ["not what is seen in them" in note.what for note in plans[0].notes] == [True] * notes
    assert not plans[1].notes


def test_guides_of_the_denoiser_mix_what_is_seen_behind_each_other():
    veil = put(quad((9, 0, 0), (0, 9, 0), (0, 0, 4)), half_clear(), name="Veil")
    floor = put(quad((9, 0, 0), (0, 9, 0), (0, 0, 2)), emission((0.5, 0.25, 3.0)), name="Floor")
    layer = Layer(passes=("Denoising Albedo", "Denoising Normal", "Denoising Depth"))
    view, *things = from_above(veil, floor)
    found = shown(layer, replace(view, clip_start=1.0), *things)
    light = np.array((0.5, 0.25, 1.0))  # no more than 1
    expected = 0.5 * np.array((0.2, 0.4, 0.6)) + 0.5 * light
    np.testing.assert_allclose(found["Denoising Albedo"], [[expected] * 8] * 8, rtol=1e-5)
    np.testing.assert_allclose(found["Denoising Normal"], [[(0, 0, -1)] * 8] * 8, atol=1e-6)
    np.testing.assert_allclose(found["Denoising Depth"], 0.5 * 6 + 0.5 * 8 - 1, rtol=1e-6)


# --- Occlusion, time, counts ---------------------------------------------------------------------


def test_occlusion_is_half_at_a_wall_and_ends_at_its_distance():
    floor = put(quad((9, 0, 0), (0, 9, 0)), diffuse(0.1), name="Floor")
    wall = put(quad((0, 90, 0), (0, 0, 90), (0, 0, 90)), diffuse(0.1), name="Wall")
    view = orthographic((0.05, 0, 10), (0.05, 0, 0), size=4, scale=0.05)
    layer = Layer(passes=("Ambient Occlusion",), occlusion_distance=1e30)
    found = shown(layer, view, floor, wall, samples=256)["Ambient Occlusion"]
    np.testing.assert_allclose(found.mean(), 0.5, atol=0.02)
    near = replace(layer, occlusion_distance=0.01)
    assert (shown(near, view, floor, wall, samples=16)["Ambient Occlusion"] == 1).all()


def test_occlusion_sees_light_through_transparent_surfaces():
    floor = put(quad((9, 0, 0), (0, 9, 0)), diffuse(0.1), name="Floor")
    veil = put(quad((90, 0, 0), (0, 90, 0), (0, 0, 0.5)), half_clear(0.25), name="Veil")
    view = orthographic((0, 0, 0.4), size=4, scale=0.5)
    layer = Layer(passes=("Ambient Occlusion",), occlusion_distance=1e30)
    found = shown(layer, view, floor, veil, samples=64)["Ambient Occlusion"]
    np.testing.assert_allclose(found, 0.25, rtol=1e-5)


def test_time_of_pixels_adds_up_to_that_of_the_threads():
    layer = Layer(passes=("Render Time", "Debug Sample Count"))
    found = rendered(layer, *every_kind_of_surface(), samples=32)
    passes = {each.name: pixels for each, pixels in found.passes()}
    total = passes["Render Time"].sum() / 1e3
    assert total > 0  # waiting for other threads does not count
    assert total <= 1.05 * found.statistics["thread_seconds"]
    assert (passes["Debug Sample Count"] == 1).all()


# --- The user's own ------------------------------------------------------------------------------


def writing(material, **nodes):
    return replace(material, aovs=nodes)


def test_values_that_shaders_write_may_come_from_nodes_that_trace():
    occlusion = Link(node("AmbientOcclusion", Distance=2.0), "AO")
    written = node("OutputAOV", Color=(0.0, 0.0, 0.0), Value=occlusion)
    floor = put(quad((9, 0, 0), (0, 9, 0)), writing(diffuse(), Number=written))
    roof = put(quad((9, 0, 0), (0, 9, 0), (0, 0, 20)), diffuse(), name="Roof")
    wall = put(quad((0, 9, 0), (0, 0, 9), (0, 0, 9)), diffuse(), name="Wall")
    layer = Layer(aovs=(("Number", False),))
    found = shown(layer, *from_above(floor, roof, wall), samples=64)["Number"][..., 0]
    # A wall hides half of the sky of the floor at its foot, and nothing far away from it
    np.testing.assert_allclose(found[:, 3:5].mean(), 0.5, atol=0.06)
    assert found[:, 0].mean() > found[:, 3].mean() + 0.05


def test_values_that_shaders_write_are_means_and_colours_have_the_alpha_of_who_writes():
    aov = node("OutputAOV", Color=(0.1, 0.2, 0.3), Value=0.75)
    floor = put(quad((9, 0, 0), (0, 9, 0)), writing(diffuse(), Mine=aov, Number=aov))
    other = put(quad((0.5, 0, 0), (0, 9, 0), (0.5, 0, 1)), diffuse(0.3), name="Other")
    layer = Layer(aovs=(("Mine", True), ("Number", False), ("Nobody's", True)))
    found = shown(layer, *from_above(floor, other))
    np.testing.assert_allclose(found["Mine"][:, :4], [[(0.1, 0.2, 0.3, 1)] * 4] * 8, rtol=1e-6)
    np.testing.assert_allclose(found["Number"][:, :4], 0.75, rtol=1e-6)
    assert not found["Mine"][:, 4:].any()
    assert not found["Number"][:, 4:].any()
    assert not found["Nobody's"].any()


def grouped(thing, group):
    return replace(thing, light_group=group)


def test_light_groups_share_out_the_light_of_lamps_meshes_and_the_world():
    names = {Lamp: "lamp", Instance: "mesh", World: "world"}
    view, *things = every_kind_of_surface()
    things = [grouped(thing, names[type(thing)]) for thing in things]
    layer = Layer(light_groups=("lamp", "mesh", "world", "empty"))
    found = shown(layer, view, *things, samples=8, sample_clamp_indirect=1.0)
    parts = [found[f"Combined_{name}"] for name in ("lamp", "mesh", "world")]
    assert all(part.any() for part in parts)
    np.testing.assert_allclose(sum(parts), found["Combined"][..., :3], rtol=2e-6, atol=2e-6)
    assert not found["Combined_empty"].any()


def test_light_groups_tell_many_lamps_apart_whether_sampled_or_met():
    floor = put(
        quad((9, 0, 0), (0, 9, 0)), Material("Gloss", node("BsdfAnisotropic", Roughness=0.3))
    )
    lamps = [
        replace(point((x, y, 1.5), 1.0 + x, radius=0.2), light_group="left" if x < 0 else "right")
        for x in (-0.6, -0.2, 0.2, 0.6)
        for y in (-0.8, -0.4, 0, 0.4, 0.8)
    ]
    view = from_above(floor, *lamps)
    layer = Layer(light_groups=("left", "right"))
    both = shown(layer, *view, samples=64)
    total = both["Combined_left"] + both["Combined_right"]
    np.testing.assert_allclose(total, both["Combined"][..., :3], rtol=2e-6, atol=2e-6)
    lit = [lamp for lamp in lamps if lamp.light_group == "left"]
    alone = shown(Layer(), *from_above(floor, *lit), samples=64)["Combined"][..., :3]
    np.testing.assert_allclose(both["Combined_left"].mean(), alone.mean(), rtol=0.02)


# --- Shadow catchers -----------------------------------------------------------------------------


def test_a_catcher_pass_takes_the_shadow_out_of_the_picture():
    floor = replace(put(quad((9, 0, 0), (0, 9, 0)), diffuse(0.8)), is_shadow_catcher=True)
    roof = put(quad((0.5, 0, 0), (0, 9, 0), (0.5, 0, 3)), diffuse(0.0), name="Roof")
    hidden = replace(roof, seen_by=replace(roof.seen_by, camera=False))
    sun = Lamp("Sun", "SUN", affine(1, (0, 0, 5)), (1.0, 1.0, 1.0))
    view = from_above(floor, hidden, sun)
    layer = Layer(passes=("Shadow Catcher",))
    found = shown(layer, *view, film_transparent=True, max_bounces=0)
    np.testing.assert_allclose(found["Shadow Catcher"][:, 5:], 0.0, atol=1e-6)
    np.testing.assert_allclose(found["Shadow Catcher"][:, :3], 1.0, rtol=1e-6)
    assert not found["Combined"].any()
    alone = shown(Layer(), *view, film_transparent=True, max_bounces=0)["Combined"]
    np.testing.assert_allclose(alone[:, 5:, 3], 1.0, rtol=1e-6)


# --- Motion --------------------------------------------------------------------------------------

PLACES = Layer(passes=("Depth", "Position", "Object Index"))


def raised(matrix, *ways):
    """Return a matrix (3, 4) at steps of time, moved on in the world."""
    keys = np.repeat(matrix[None], len(ways), axis=0)
    keys[:, :, 3] += ways
    return keys


def test_places_are_those_when_half_of_the_light_has_come_through_the_shutter():
    view, floor = from_above(put(quad((9, 0, 0), (0, 9, 0)), diffuse()))
    aside = raised(view.to_world, (0, 0, 0), (1, 0, 0))
    view = replace(view, motion=tuple(replace(view, to_world=key) for key in aside))
    floor = replace(floor, motion=raised(floor.to_world, (0, 0, 0), (0, 0, 2)))
    described = scene(view, floor, layer=PLACES, shutter=np.linspace(0.0, 1.0, 256))
    found = {e.name: p for e, p in render(compile_plan(described, DEFAULTS), threads=1).passes()}
    half = 0.5**0.5  # of a shutter that opens evenly
    np.testing.assert_allclose(found["Depth"], 10 - 2 * half, atol=2e-3)
    across = (np.arange(8) + 0.5) / 4 - 1 + half
    np.testing.assert_allclose(found["Position"][3, :, 0], across, atol=2e-3)
    np.testing.assert_allclose(found["Position"][..., 2], 2 * half, atol=2e-3)


def test_places_in_a_round_picture_that_moves_are_those_at_the_middle_of_the_time():
    lens = {"projection": "PANO", "panorama": Panorama("FISHEYE_EQUIDISTANT", fov=2.0)}
    lens["aperture"] = Aperture(0.2, 3.0)
    view = Camera(look_at((0, -3, 2), (0, 0, 0)), (0.0, 1.0, 0.0, 1.0), 16, 16, **lens)
    things = (
        put(quad((9, 0, 0), (0, 9, 0)), diffuse(), name="Floor"),
        put(quad((1, 0, 0), (0, 0, 1), (0, 0, 1)), half_clear(0.9), name="Veil"),
    )
    ways = (-0.3, 0.1, -0.2), (0, 0, 0), (0.3, -0.1, 0.2)
    keys = raised(view.to_world, *ways)
    moving = replace(view, motion=tuple(replace(view, to_world=key) for key in keys))
    others = [replace(each, motion=raised(each.to_world, *ways)) for each in things]
    still, moved = shown(PLACES, view, *things), shown(PLACES, moving, *others)
    assert np.ptp(still["Position"][..., 1]) > 3
    for name in PLACES.passes:
        np.testing.assert_allclose(moved[name], still[name], rtol=1e-5, atol=1e-5)


def test_the_light_passes_of_what_moves_add_up_to_the_picture():
    view, *things = every_kind_of_surface()
    ways = (0, 0, 0), (0.4, 0.2, 0.1)
    keys = raised(view.to_world, *ways)
    view = replace(view, motion=tuple(replace(view, to_world=key) for key in keys))
    things = [
        replace(each, motion=raised(each.to_world, *ways)) if isinstance(each, Instance) else each
        for each in things
    ]
    found = shown(Layer(passes=LIGHT, mattes=MATTES), view, *things, samples=8)
    np.testing.assert_allclose(added_up(found), found["Combined"][..., :3], rtol=2e-6, atol=2e-6)
    still = shown(Layer(), view, *things, samples=8)
    np.testing.assert_allclose(found["Combined"], still["Combined"], rtol=2e-6, atol=1e-6)
