"""core.interactive -> pictures that get better, of what was asked for last."""

import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

from penumbra.core import Link, Node
from penumbra.core import compile as plans
from penumbra.core.compile import materials
from penumbra.core.images import ImageSource, store
from penumbra.core.interactive import Asked, Renderer, coarser
from penumbra.core.kept import KEEP_NOTHING, Kept
from tests.support import scenes

SETTINGS = scenes.Settings(samples=4, use_adaptive_sampling=False, use_denoising=False)


def lit(material=None, size=32, eye=(0, 0, 4)):
    """A lit square before a grey world."""
    square = scenes.put(scenes.quad(), material or scenes.diffuse(0.5))
    return scenes.scene(scenes.camera(eye, size=size), square, scenes.world(0.3))


class Watched:
    """A renderer whose pictures are kept, and waited for."""

    def __init__(self):
        self.pictures = []
        self.came = threading.Condition()
        self.renderer = Renderer(self.take)

    def take(self, shown):
        with self.came:
            self.pictures.append(shown)
            self.came.notify_all()

    def wait(self, wanted):
        with self.came:
            assert self.came.wait_for(lambda: any(map(wanted, self.pictures)), 60)
            return next(shown for shown in self.pictures if wanted(shown))

    def last(self, scene, settings=SETTINGS, **more):
        number = self.renderer.ask(Asked(scene, settings, threads=2, **more))
        return self.wait(lambda s: s.number == number and (s.complete or s.error))


@pytest.fixture
def watched():
    made = Watched()
    yield made
    made.renderer.close()
    assert made.renderer.join(30)


def test_the_last_picture_is_the_one_that_a_render_gives(watched):
    scene = lit()
    shown = watched.last(scene)
    expected = scenes.render(scenes.compile_plan(scene, SETTINGS), threads=1)
    assert (shown.samples, shown.of, shown.size, shown.error) == (4, 4, 1, "")
    assert shown.rectangle == (0, 0, 32, 32)
    assert shown.frame == (32, 32)
    np.testing.assert_array_equal(shown.pixels, expected.combined())
    assert not watched.renderer.is_busy


def test_a_slow_scene_is_first_seen_in_coarse_blocks_in_their_places(watched):
    # A bright half and a dark one: blocks of 16 pixels tell where they lie.
    bright = scenes.put(scenes.quad((1, 0, 0), (0, 4, 0), (1, 0, 0)), scenes.emission(1.0))
    dark = scenes.put(scenes.quad((1, 0, 0), (0, 4, 0), (-1, 0, 0)), scenes.emission(0.25))
    scene = scenes.scene(scenes.orthographic((0, 0, 4), size=72, scale=2.0), bright, dark)
    settings = replace(SETTINGS, pixel_filter_type="BOX")
    watched.renderer._speed = 1.0
    watched.last(scene, settings)
    sizes = [shown.size for shown in watched.pictures]
    assert sizes[:5] == [16, 8, 4, 2, 1]
    first = watched.pictures[0]
    assert first.pixels.shape == (5, 5, 4)
    assert first.frame == (72, 72)
    assert not first.complete and first.samples == 0
    columns = first.pixels[..., 0].mean(axis=0)
    np.testing.assert_allclose(columns[[0, 1, 3, 4]], [0.25, 0.25, 1, 1])
    assert columns[2] in (0.25, 1.0) or 0.25 < columns[2] < 1.0  # the edge is at 36 of 32..48
    second = watched.pictures[1].pixels[..., 0].mean(axis=0)
    np.testing.assert_allclose(second[[0, 3, 5, 8]], [0.25, 0.25, 1, 1])


@pytest.mark.parametrize("size", [2, 3, 16])
def test_coarse_pixels_cover_the_fine_ones(size):
    fine = replace(scenes.camera((0, 0, 1), size=33, width=70), border=(5, 6, 60, 31))
    coarse = coarser(fine, size)
    step = (fine.window[1] - fine.window[0]) / fine.width
    assert coarse.window[0] == fine.window[0]
    assert (coarse.window[1] - coarse.window[0]) / coarse.width == pytest.approx(size * step)
    assert (coarse.window[3] - coarse.window[2]) / coarse.height == pytest.approx(size * step)
    x0, y0, x1, y1 = (size * edge for edge in coarse.rectangle())
    assert 5 - size < x0 <= 5 and 60 <= x1 < 60 + size
    assert 6 - size < y0 <= 6 and 31 <= y1 < 31 + size
    assert coarser(fine, 1) is fine


def test_what_is_asked_for_last_wins_and_the_rest_is_dropped(watched):
    endless = replace(SETTINGS, samples=1 << 20)
    for _ in range(3):
        watched.renderer.ask(Asked(lit(size=64), endless, threads=2))
        watched.wait(lambda s: s.number == watched.renderer.asked)
    shown = watched.last(lit(scenes.emission(0.5)))
    assert shown.number == watched.renderer.asked == 4
    assert shown.pixels[16, 16, 0] == pytest.approx(0.5)


def test_a_scene_that_cannot_be_rendered_is_an_error_and_the_next_one_is_a_picture(watched):
    bad = watched.last(lit(), replace(SETTINGS, use_sample_subset=True, pattern="POISSON"))
    assert "POISSON" in bad.error
    assert bad.pixels is None
    good = watched.last(lit())
    assert good.error == ""
    assert good.complete


def test_a_mistake_of_ours_is_an_error_too(watched, monkeypatch, caplog):
    def broken(*_, **__):
        raise KeyError("mistake")

    monkeypatch.setattr("penumbra.core.interactive.compile_plan", broken)
    assert "KeyError" in watched.last(lit()).error
    assert "Penumbra failed in the viewport" in caplog.text
    monkeypatch.undo()
    assert watched.last(lit()).complete


def test_a_renderer_that_is_closed_ends_its_thread_in_the_middle():
    watched = Watched()
    watched.renderer.ask(Asked(lit(size=256), replace(SETTINGS, samples=1 << 20), threads=2))
    watched.wait(lambda s: True)
    watched.renderer.close()
    assert watched.renderer.join(30)
    assert not watched.renderer.is_busy
    before = len(watched.pictures)
    watched.renderer.ask(Asked(lit(), SETTINGS))
    assert watched.renderer.join(1)
    assert len(watched.pictures) == before


def test_a_pause_keeps_the_picture_and_still_follows_what_changes(watched):
    watched.renderer.pause(True)
    endless = replace(SETTINGS, samples=1 << 20)
    first = watched.renderer.ask(Asked(lit(), endless, threads=2))
    watched.wait(lambda s: s.number == first and s.samples > 0)
    second = watched.renderer.ask(Asked(lit(scenes.emission(0.5)), endless, threads=2))
    shown = watched.wait(lambda s: s.number == second and s.samples > 0)
    assert shown.pixels[16, 16, 0] == pytest.approx(0.5)
    assert watched.renderer.is_busy
    watched.renderer.pause(False)
    watched.wait(lambda s: s.number == second and s.samples > shown.samples)


def test_pixels_of_the_size_asked_for_are_the_finest(watched):
    shown = watched.last(lit(), pixel_size=4)
    assert (shown.size, shown.pixels.shape) == (4, (8, 8, 4))
    assert all(each.size >= 4 for each in watched.pictures)


def test_only_the_last_picture_is_denoised(watched, monkeypatch):
    seen = []

    def denoise(how, film, threads):
        seen.append(int(film.counts.min()))
        film.denoised = np.full((32, 32, 3), 0.25, np.float32)
        return ()

    monkeypatch.setattr("penumbra.core.compile.picture.is_there", lambda: True)
    monkeypatch.setattr(sys.modules["penumbra.core.render"], "_denoise", denoise)
    watched.renderer._speed = 1e3  # so that coarse pictures come first
    settings = replace(SETTINGS, use_denoising=True)
    shown = watched.last(lit(), settings)
    assert seen == [4]
    assert (shown.pixels[..., :3] == 0.25).all()
    assert len(watched.pictures) > 1
    assert all((each.pixels[..., :3] != 0.25).any() for each in watched.pictures[:-1])


def test_too_bright_for_half_floats_is_cut(watched):
    shown = watched.last(lit(scenes.emission(1e9)), replace(SETTINGS, sample_clamp_indirect=0.0))
    assert 6e4 < shown.pixels.max() < 65504


# --- What is kept from one plan to the next -----------------------------------------------------


@pytest.fixture
def made(monkeypatch):
    """The names of the expensive steps, as they are taken."""
    steps = []

    def count(module, name):
        original = getattr(module, name)

        def wrapped(*arguments, **more):
            steps.append(name)
            return original(*arguments, **more)

        monkeypatch.setattr(module, name, wrapped)

    for name in ("displace", "compile_surface"):
        count(materials, name)
    for name in ("compile_triangles", "compile_accel", "compile_lights"):
        count(plans, name)
    return steps


def plan_of(scene, kept, origin=(0.0, 0.0, 0.0), **settings):
    chosen = replace(SETTINGS, **settings)
    return plans.compile_plan(scene, chosen, kept=kept, origin=np.array(origin))


def test_another_view_makes_nothing_again(made):
    kept, scene = Kept(), lit()
    plan_of(scene, kept)
    built = {"compile_triangles", "compile_accel", "compile_surface", "compile_lights"}
    assert set(made) == built | {"displace"}
    made.clear()
    moved = replace(scene, camera=scenes.camera((0.5, 0.2, 3), size=20))
    plan_of(moved, kept)
    assert made == []


def test_another_material_builds_no_tree_and_compiles_no_other_material(made):
    kept = Kept()
    first, second = scenes.put(scenes.quad(), scenes.diffuse(0.5)), scenes.put(scenes.box())
    scene = scenes.scene(scenes.camera((0, 0, 4)), first, second)
    plan_of(scene, kept)
    made.clear()
    changed = replace(first, materials=(scenes.diffuse(0.1),))
    plan_of(replace(scene, instances=(changed, second)), kept)
    assert made == ["compile_surface", "displace", "compile_lights"]


def test_another_view_of_a_displaced_mesh_makes_nothing_again(made):
    kept, item = Kept(), scenes.put(scenes.quad(), risen(0.5))
    scene = scenes.scene(scenes.camera((0, 0, 4)), item, scenes.world(0.3))
    plan_of(scene, kept)
    made.clear()
    plan_of(replace(scene, camera=scenes.camera((0.5, 0.2, 3))), kept)
    assert made == []


def risen(height):
    """A matte material that moves what it is on."""
    way = scenes.node("CombineXYZ", X=0.0, Y=0.0, Z=height)
    diffuse = scenes.diffuse(0.5).surface
    link = Link(way, "Vector")
    return scenes.Material("Risen", diffuse, displacement=link, displacement_method="DISPLACEMENT")


def shows(source):
    picture = Node("TexImage", "Picture", {}, {"image": source})
    glow = scenes.node("Emission", Color=Link(picture, "Color"), Strength=1.0)
    return scenes.Material("Picture", glow)


def test_an_image_is_read_once_again_if_it_changes_and_smaller_if_the_limit_says_so(monkeypatch):
    reads, load = [], store.load_image

    def counted(*arguments):
        reads.append(arguments[0].name)
        return load(*arguments)

    monkeypatch.setattr(store, "load_image", counted)
    red, blue = (np.full((512, 512, 4), rgba, np.float32) for rgba in ((1, 0, 0, 1), (0, 0, 1, 1)))

    kept, first = Kept(), ImageSource("First", pixels=red)
    item = scenes.put(scenes.quad(), shows(first))
    scene = scenes.scene(scenes.camera((0, 0, 2), size=4), item)
    plan_of(scene, kept)
    again = scenes.put(scenes.quad(), shows(first))  # another material, the same image
    plan_of(replace(scene, instances=(again,)), kept)
    assert reads == ["First"]
    changed = scenes.put(scenes.quad(), shows(ImageSource("Second", pixels=blue)))
    plan = plan_of(replace(scene, instances=(changed,)), kept)
    assert reads == ["First", "Second"]
    middle = scenes.render(plan, threads=1).combined()[1:3, 1:3, :3]
    np.testing.assert_allclose(middle, np.broadcast_to((0, 0, 1), (2, 2, 3)), atol=1e-5)
    plan = plan_of(replace(scene, instances=(changed,)), kept, texture_memory=0.001)
    assert reads == ["First", "Second", "Second"]
    assert any("Texture Memory" in note.what for note in plan.notes)


@pytest.mark.parametrize(
    "change",
    [
        lambda scene: replace(scene, lamps=(scenes.point((0, 0, 2), 5.0),)),
        lambda scene: replace(scene, world=scenes.world((0.9, 0.1, 0.1))),
        lambda scene: moved(scene, scenes.affine(1.0, (0.3, 0.0, 0.2))),
        lambda scene: altered(scene, materials=(scenes.diffuse((0.1, 0.5, 0.9)),)),
        lambda scene: altered(scene, materials=(scenes.emission(2.0),)),
        lambda scene: altered(scene, materials=(scenes.glass(),)),
        lambda scene: altered(scene, materials=(scenes.Material("Clear", CLEAR),)),
        lambda scene: altered(scene, materials=(risen(0.7),)),
        lambda scene: altered(scene, is_holdout=True),
        lambda scene: altered(scene, seen_by=scenes.Instance.seen_by.__class__(camera=False)),
        lambda scene: altered(scene, mesh=scenes.box(0.4)),
        lambda scene: replace(scene, instances=scene.instances * 2),
        lambda scene: replace(scene, instances=scene.instances[1:]),
        lambda scene: replace(scene, film_transparent=True),
        lambda scene: replace(scene, camera=scenes.orthographic((1, 1, 5), scale=3.0)),
    ],
)
def test_a_plan_from_what_was_kept_gives_the_same_picture(change):
    """Each change alone, and back again, against plans that keep nothing."""
    ground = scenes.put(scenes.quad((3, 0, 0), (0, 3, 0), (0, 0, -1)), scenes.diffuse(0.8))
    item = scenes.put(scenes.quad(), scenes.diffuse(0.5))
    camera, lamp = scenes.camera((0, -2, 4), size=12), scenes.point((1, 0, 3), 20.0)
    scene = scenes.scene(camera, item, ground, lamp, scenes.world(0.2))
    kept = Kept()
    for each in (scene, change(scene), scene, change(scene)):
        fresh = scenes.render(plan_of(each, KEEP_NOTHING), threads=1).combined()
        again = scenes.render(plan_of(each, kept), threads=1).combined()
        np.testing.assert_array_equal(again, fresh)


CLEAR = scenes.node("BsdfTransparent", Color=(0.5, 0.9, 0.5))


def altered(scene, **changes):
    return replace(scene, instances=(replace(scene.instances[0], **changes), *scene.instances[1:]))


def moved(scene, to_world):
    return altered(scene, to_world=to_world)


@pytest.mark.parametrize(
    "settings",
    [{"caustics_refractive": False}, {"blur_glossy": 0.0}, {"filter_width": 3.0}, {"seed": 4}],
)
def test_settings_are_not_mixed_up_with_what_was_kept(settings):
    scene, kept = lit(scenes.glass(), size=12), Kept()
    for each in ({}, settings, {}):
        fresh = scenes.render(plan_of(scene, KEEP_NOTHING, **each), threads=1).combined()
        again = scenes.render(plan_of(scene, kept, **each), threads=1).combined()
        np.testing.assert_array_equal(again, fresh)


def test_a_step_is_forgotten_when_its_input_changes():
    kept, calls = Kept(), []
    for key in (1, 1, 2, 1):
        kept.step("step", (key,), lambda key=key: calls.append(key))
    assert calls == [1, 2, 1]
    assert kept.each("items", ["a", "b"], str.upper) == ["A", "B"]
    made = kept.each("items", ["b", "c"], lambda key: calls.append(key) or key)
    assert made == ["B", "c"]
    assert calls[3:] == ["c"]
