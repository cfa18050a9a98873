"""examples -> the same light in both engines, block by block.

Both render in one process, several seeds each.  Student's t-test compares each block's means
over the seeds (significance 1e-4 for a whole picture, corrected by Sidak); the mean of a
picture must agree within 1 % or its own uncertainty.  The module is also imported by Blender's
process, where `tests` is no package: what only the tests need is imported by them.
"""

from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("cornell_box", "far_away", "glass", "lamps", "mirrors", "still_life")
SEEDS, SAMPLES, BLOCK, SIGNIFICANCE = 6, 8, 8, 1e-4


def render_both(folder):
    """Return {name: {engine: (SEEDS, H, W, 3)}} of all examples, small."""
    import bpy

    import penumbra

    penumbra.register()
    pictures = {}
    for name in NAMES:
        bpy.ops.wm.open_mainfile(filepath=str(EXAMPLES / f"{name}.blend"))
        scene = bpy.context.scene
        scene.render.resolution_percentage = 15
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_depth = "32"
        scene.cycles.device = "CPU"
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
        scene.cycles.blur_glossy = 0
        for settings in (scene.cycles, scene.penumbra):
            settings.samples = SAMPLES
            settings.sample_clamp_direct = settings.sample_clamp_indirect = 0
        pictures[name] = {
            engine: np.stack([shot(scene, engine, seed, folder) for seed in range(SEEDS)])
            for engine in ("CYCLES", "PENUMBRA")
        }
    return pictures


def shot(scene, engine, seed, folder):
    import bpy
    import OpenImageIO

    scene.render.engine = engine
    scene.cycles.seed = scene.penumbra.seed = seed
    scene.render.filepath = str(folder / f"{engine}-{seed}.exr")
    bpy.ops.render.render(write_still=True)
    return OpenImageIO.ImageBuf(scene.render.filepath).get_pixels()[..., :3]


@pytest.fixture(scope="module")
def pictures(blender, tmp_path_factory):
    return blender(render_both, tmp_path_factory.mktemp("engines"))


def blocks(images):
    """Return the means (S, blocks) of square blocks of images (S, H, W, 3)."""
    count, height, width, _ = images.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = images[:, : rows * BLOCK, : columns * BLOCK].mean(axis=-1, dtype=np.float64)
    return cut.reshape(count, rows, BLOCK, columns, BLOCK).mean(axis=(2, 4)).reshape(count, -1)


def welch(a, b):
    """Return the two-sided p-values of equal means over the first axis, and their t."""
    from tests.support.statistics import t_probability

    spread = a.var(axis=0, ddof=1) / len(a) + b.var(axis=0, ddof=1) / len(b)
    t = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt(spread + 1e-14)
    return np.array([t_probability(abs(value), len(a) - 1) for value in np.atleast_1d(t)]), t


@pytest.mark.parametrize("name", NAMES)
def test_every_block_of_an_example_has_the_light_of_cycles(pictures, name):
    from tests.support.statistics import sidak

    ours, theirs = (blocks(pictures[name][engine]) for engine in ("PENUMBRA", "CYCLES"))
    probability, t = welch(ours, theirs)
    worst = int(np.argmin(probability))
    assert probability[worst] > sidak(SIGNIFICANCE, probability.size), (
        f"block {worst}: {ours.mean(0)[worst]:.5f}, Cycles {theirs.mean(0)[worst]:.5f}, "
        f"t = {t[worst]:.1f}"
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_mean_of_an_example_is_that_of_cycles(pictures, name):
    ours, theirs = (
        pictures[name][engine].mean(axis=(1, 2), dtype=np.float64)
        for engine in ("PENUMBRA", "CYCLES")
    )
    spread = np.sqrt((ours.var(axis=0, ddof=1) + theirs.var(axis=0, ddof=1)) / SEEDS)
    difference = np.abs(ours.mean(axis=0) - theirs.mean(axis=0))
    assert (difference < 0.01 * theirs.mean(axis=0) + 4 * spread).all()
