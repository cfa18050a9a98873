"""The denoiser that Blender brings along: what it takes away, keeps, and needs."""

import numpy as np
import pytest


def pictures_of_a_room():
    """Return a noisy picture, denoised ones by guides, the true one, passes and notes."""
    import os

    import bpy  # noqa: F401  (loads the library)

    from penumbra.core import Link, Material, Settings, compile_plan, render
    from penumbra.core.film.denoise import VARIABLE
    from penumbra.core.layer import Layer
    from penumbra.tests.support.passes import every_kind_of_surface
    from penumbra.tests.support.scenes import node, put, quad, scene

    del os.environ[VARIABLE]
    view, _, *things = every_kind_of_surface(size=96)
    place = Link(node("TexCoord"), "Object")
    colour = Link(node("TexChecker", Vector=place, Scale=2.5), "Color")
    things.append(put(quad((4, 0, 0), (0, 4, 0)), Material("F", node("BsdfDiffuse", Color=colour))))
    settings = {"use_adaptive_sampling": False, "max_bounces": 3, "samples": 8}
    layer = Layer(passes=("Denoising Albedo", "Denoising Normal", "Noisy Image"))

    def shot(layer=layer, **more):
        described = scene(view, *things, layer=layer)
        plan = compile_plan(described, Settings(**{**settings, **more}))
        picture = render(plan)
        passes = {each.name: pixels for each, pixels in picture.passes()}
        return picture.combined(), passes, [note.what for note in (*plan.notes, *picture.notes)]

    return {
        "noisy": shot(use_denoising=False),
        "true": shot(use_denoising=False, samples=256, seed=9),
        "RGB": shot(denoising_input_passes="RGB"),
        "RGB_ALBEDO": shot(denoising_input_passes="RGB_ALBEDO", denoising_quality="FAST"),
        "RGB_ALBEDO_NORMAL": shot(film_exposure=2.0),
        "prefilter none": shot(denoising_prefilter="NONE"),
        "prefilter fast": shot(denoising_prefilter="FAST"),
        "subset": shot(use_sample_subset=True, sample_subset_length=4),
        "layer": shot(Layer(is_denoised=False)),
        "plain": shot(Layer()),
    }


@pytest.fixture(scope="module")
def found(blender):
    return blender(pictures_of_a_room)


def error(found, name, exposure=1.0):
    truth = found["true"][0][..., :3]
    return np.sqrt(np.mean((found[name][0][..., :3] / exposure - truth) ** 2))


@pytest.mark.parametrize(
    "name", ["RGB", "RGB_ALBEDO", "RGB_ALBEDO_NORMAL", "prefilter none", "prefilter fast"]
)
def test_a_denoised_picture_is_nearer_to_the_truth(found, name):
    exposure = 2.0 if name == "RGB_ALBEDO_NORMAL" else 1.0
    assert error(found, name, exposure) < 0.6 * error(found, "noisy")
    assert (found[name][0][..., 3] == found["noisy"][0][..., 3]).all()
    assert not any("Use Denoising" in what for what in found[name][2])


def guided():
    """Return errors of a faint pattern in strong noise, denoised with and without guides."""
    import os

    import bpy  # noqa: F401  (loads the library)

    from penumbra.core.film.denoise import VARIABLE, Denoising, denoise

    del os.environ[VARIABLE]
    y, x = np.mgrid[:96, :96] // 4 % 2
    pattern = np.float32(0.4) + np.float32(0.1) * (x ^ y)[..., None] * np.ones(3, np.float32)
    noisy = pattern * np.random.default_rng(0).gamma(1.0, 1.0, (96, 96, 1)).astype(np.float32)
    flat = np.full_like(pattern, 0.5)
    normal = np.where((x ^ y)[..., None], (0, 0, -1), (0.6, 0, -0.8)).astype(np.float32)

    def error(albedo, normal, prefilter):
        how = Denoising(albedo is not None, normal is not None, prefilter, "HIGH")
        return float(np.sqrt(np.mean((denoise(noisy, albedo, normal, how) - pattern) ** 2)))

    return {
        prefilter: [
            error(*guides, prefilter) for guides in ((None, None), (pattern, None), (flat, normal))
        ]
        for prefilter in ("NONE", "FAST", "ACCURATE")
    }


def test_guides_show_the_denoiser_what_noise_hides(blender):
    for prefilter, (alone, by_albedo, by_normal) in blender(guided).items():
        assert alone > 0.03
        assert by_albedo < 0.5 * alone
        assert by_normal < (0.95 if prefilter == "FAST" else 0.6) * alone


def test_the_noisy_picture_is_kept_in_a_pass(found):
    np.testing.assert_allclose(
        found["RGB"][1]["Noisy Image"], found["noisy"][0], rtol=1e-5, atol=1e-6
    )


def test_guides_are_summed_for_the_denoiser_alone_too(found):
    picture, passes, _ = found["plain"]
    assert not passes
    assert np.abs(picture - found["noisy"][0]).max() > 0.05


def test_parts_of_the_samples_and_layers_that_say_so_keep_their_noise(found):
    for name, sentence in (("subset", "until it is merged"), ("layer", None)):
        whats = [what for what in found[name][2] if "Use Denoising" in what]
        assert len(whats) == (sentence is not None)
        assert sentence is None or sentence in whats[0]
    np.testing.assert_allclose(found["layer"][0], found["noisy"][0], rtol=1e-5, atol=1e-6)


def offered(path):
    """Return the passes of a file with denoising on, and those the compositor has on and off."""
    import os

    import bpy
    from inside import use_exr
    from pass_files import read_layers
    from test_passes import two_squares

    from penumbra.addon import report
    from penumbra.core.film.denoise import VARIABLE

    del os.environ[VARIABLE]
    scene = two_squares()
    scene.penumbra.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = 64
    layer = scene.view_layers[0]
    if bpy.app.version >= (5, 0):
        tree = bpy.data.node_groups.new("Compositor", "CompositorNodeTree")
    else:
        scene.use_nodes = True
        tree = scene.node_tree
    node = tree.nodes.new("CompositorNodeRLayers")

    def sockets():
        return {socket.name for socket in node.outputs if socket.enabled}

    layer.use_pass_z = False
    before = sockets()
    layer.penumbra.denoising_store_passes = scene.penumbra.use_denoising = True
    after = sockets() - before
    layer.penumbra.denoising_store_passes = False
    use_exr(scene, path, multilayer=True)
    bpy.ops.render.render(write_still=True)
    pictures = {name: pixels for (_, name), pixels in read_layers(path).items()}
    layer.penumbra.use_denoising = False
    return after, sockets() - before, pictures, report.frames[-1]["not_honoured"]


def test_blender_offers_the_noisy_picture_and_guides_where_they_are_wanted(blender, tmp_path):
    with_guides, without, pictures, notes = blender(offered, tmp_path / "denoised.exr")
    guides = {"Denoising Albedo", "Denoising Normal", "Denoising Depth"}
    assert with_guides == {"Noisy Image", *guides}
    assert not without
    assert set(pictures) == {"Combined", "Noisy Image"}
    assert notes == []
    assert pictures["Combined"].shape == (64, 64, 4)
    assert 0 < np.abs(pictures["Combined"] - pictures["Noisy Image"]).mean() < 0.02


def without_the_library():
    from inside import empty_scene, exported

    from penumbra.core import compile_plan
    from penumbra.core.film import denoise

    empty_scene()
    plan = compile_plan(*exported())
    with pytest.raises(denoise.DenoiseError, match="not there"):
        denoise.denoise(np.zeros((2, 2, 3), np.float32), None, None, denoise.Denoising(*"FFNH"))
    return [note.what for note in plan.notes], plan.denoising is None, plan.ledger is None


def test_without_the_library_the_picture_keeps_its_noise_and_says_so(blender):
    notes, is_off, keeps_no_book = blender(without_the_library)
    assert [what for what in notes if "Use Denoising" in what] == [
        "Use Denoising: OpenImageDenoise is not there: the picture keeps its noise"
    ]
    assert is_off
    assert keeps_no_book
