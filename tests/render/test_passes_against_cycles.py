"""A scene with everything -> the same passes in both engines, by the names of this Blender.

Both render in one process, several seeds each, into multilayer EXR files.  Noisy passes are
compared block by block by Student's t (significance 1e-4 for a pass, corrected by Sidak), light
after it is multiplied with its colour, as a quotient has no mean to speak of; passes of single
surfaces number by number, where both show nothing but one object.
"""

import json

import numpy as np
import pytest

SEEDS, SAMPLES, BLOCK, SIGNIFICANCE = 6, 16, 8, 1e-4
ENGINES = ("PENUMBRA", "CYCLES")
LOBES = ("Diffuse", "Glossy", "Transmission")
NOISY = (
    "Combined",
    "Emission",
    "Environment",
    "Ambient Occlusion",
    "Mist",
    *(f"{lobe} {kind}" for lobe in LOBES for kind in ("Direct", "Indirect", "Color")),
    *(f"Combined_{name}" for name in ("mesh", "lamp", "world")),
)
# Largest differences; the middle of a pixel is a thousandth of it away in Cycles, by its filter's
# table, which is up to 0.3 mm here.
OF_ONE_SURFACE = {
    "Depth": 3e-4,
    "Position": 3e-4,
    "Object Index": 0,
    "Material Index": 0,
    "Number": 1e-6,
}
GUIDES = ("Denoising Albedo", "Denoising Normal", "Denoising Depth")
NOT_DRAWN = {"Denoising Roughness", "Denoising Specular Albedo"}  # new in Cycles 5.2
OLD = {
    "Diffuse": "Diff",
    "Glossy": "Gloss",
    "Transmission": "Trans",
    "Direct": "Dir",
    "Indirect": "Ind",
    "Color": "Col",
}


def render_both(folder):
    """Return Blender's version, {engine: [passes of each seed]}, and their metadata."""
    import bpy
    import pass_stage

    scene = pass_stage.build()
    pass_stage.ask(scene)
    found, metadata = {}, {}
    for engine in ENGINES:
        shots = []
        for seed in range(SEEDS):
            path = folder / f"{engine}{seed}.exr"
            passes, metadata[engine] = pass_stage.shot(scene, engine, SAMPLES, seed, path)
            shots.append(passes)
        found[engine] = {name: np.stack([shot[name] for shot in shots]) for name in shots[0]}
    return bpy.app.version, found, metadata


@pytest.fixture(scope="module")
def both(blender, tmp_path_factory):
    version, found, metadata = blender(render_both, tmp_path_factory.mktemp("passes"))
    assert set(found["PENUMBRA"]) == set(found["CYCLES"]) - NOT_DRAWN
    if version < (5, 0):
        for name in list(NOISY) + list(OF_ONE_SURFACE):
            for passes in found.values():
                if old_name(name) in passes:
                    passes[name] = passes.pop(old_name(name))
    return found, metadata


def old_name(name):
    """Return what Blender < 5 calls a pass."""
    special = {
        "Emission": "Emit",
        "Environment": "Env",
        "Ambient Occlusion": "AO",
        "Object Index": "IndexOB",
        "Material Index": "IndexMA",
    }
    if name in special:
        return special[name]
    first, _, last = name.partition(" ")
    return OLD[first] + OLD[last] if first in OLD else name


def light_of(passes, name):
    """Return a pass (S, H, W, C), light of a sort of closures with its colour."""
    pixels = passes[name][..., :3]
    sort, _, kind = name.partition(" ")
    if sort in LOBES and kind != "Color":
        pixels = pixels * passes[f"{sort} Color"]
    return pixels


def blocks(images):
    """Return the means (S, blocks) of square blocks of images (S, H, W, C)."""
    count, height, width, _ = images.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = images.mean(axis=-1, dtype=np.float64)
    return cut.reshape(count, rows, BLOCK, columns, BLOCK).mean(axis=(2, 4)).reshape(count, -1)


@pytest.mark.parametrize("name", NOISY)
def test_every_block_of_a_pass_is_that_of_cycles(both, name):
    from tests.support.statistics import sidak, t_probability

    found, _ = both
    ours, theirs = (blocks(light_of(found[engine], name)) for engine in ENGINES)
    spread = ours.var(axis=0, ddof=1) / SEEDS + theirs.var(axis=0, ddof=1) / SEEDS
    gap = np.abs(ours.mean(axis=0) - theirs.mean(axis=0))
    t = np.maximum(gap - 2e-4 * np.abs(theirs.mean(axis=0)), 0) / np.sqrt(spread + 1e-14)
    worst = int(np.argmax(t))
    assert theirs.mean() > 0 or name == "Transmission Direct"
    assert t_probability(t[worst], SEEDS - 1) > sidak(SIGNIFICANCE, t.size), (
        f"block {worst}: {ours.mean(0)[worst]:.6f}, Cycles {theirs.mean(0)[worst]:.6f}, "
        f"t = {t[worst]:.1f}"
    )


def whole(found):
    """Return the pixels (H, W) that show one object and nothing else, in all pictures."""
    is_whole = True
    for passes in found.values():
        crypto = passes["CryptoObject00"]
        is_whole &= (crypto[..., 1] > 0.9999).all(axis=0) & (np.ptp(crypto[..., 0], axis=0) == 0)
    return is_whole


@pytest.mark.parametrize("name", OF_ONE_SURFACE)
def test_a_pass_of_one_surface_shows_the_numbers_of_cycles(both, name):
    found, _ = both
    some = whole(found)
    assert some.sum() > 0.4 * some.size
    ours, theirs = (found[engine][name][:, some] for engine in ENGINES)
    assert np.ptp(theirs) > 0
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=OF_ONE_SURFACE[name])


@pytest.mark.parametrize("name", ["Normal", "UV", "Place", *GUIDES])
def test_a_filtered_pass_of_one_surface_has_the_mean_of_cycles(both, name):
    found, _ = both
    some = whole(found)
    if name in GUIDES:  # Cycles follows glass, ours show its surface; and Cycles < 5 no light
        for other in ("Transmission Color", "Emission"):
            some = some & ~found["CYCLES"][other].any(axis=(0, 3))
        assert some.sum() > 0.3 * some.size
    ours, theirs = (found[engine][name][:, some].astype(float) for engine in ENGINES)
    assert np.ptp(theirs) > 0
    spread = np.sqrt((ours.var(axis=0, ddof=1) + theirs.var(axis=0, ddof=1)) / SEEDS)
    gap = np.abs(ours.mean(axis=0) - theirs.mean(axis=0))
    assert (gap <= 12 * spread + 2e-4).mean() > 0.999  # t of 10 degrees: 12 is below 1e-6
    assert (gap.mean(axis=0) <= 0.01).all()


def parts_of(passes, kind, seed, y, x):
    pairs = np.concatenate([passes[f"{kind}{i:02}"][seed, y, x].reshape(2, 2) for i in range(3)])
    return {float(key): float(weight) for key, weight in pairs if weight > 0}


@pytest.mark.parametrize("kind", ["CryptoObject", "CryptoMaterial", "CryptoAsset"])
def test_cryptomattes_have_the_names_and_weights_of_cycles(both, kind):
    found, _ = both
    size = found["CYCLES"]["Combined"].shape[1]
    keys = set()
    for y in range(0, size, 3):
        for x in range(0, size, 3):
            ours, theirs = (
                [parts_of(found[engine], kind, seed, y, x) for seed in range(SEEDS)]
                for engine in ENGINES
            )
            for key in set().union(*ours, *theirs):
                a, b = ([each.get(key, 0.0) for each in parts] for parts in (ours, theirs))
                spread = np.sqrt((np.var(a, ddof=1) + np.var(b, ddof=1)) / SEEDS)
                assert abs(np.mean(a) - np.mean(b)) <= 12 * spread + 0.02
                keys.add(key)
    assert len(keys) >= 5


def test_cryptomattes_of_whole_pixels_are_the_same_numbers(both):
    found, _ = both
    some = whole(found)
    for kind in ("CryptoObject00", "CryptoMaterial00", "CryptoAsset00"):
        ours, theirs = (found[engine][kind][:, some] for engine in ENGINES)
        np.testing.assert_array_equal(ours[..., 0], theirs[..., 0])
        np.testing.assert_allclose(ours[..., 1], theirs[..., 1], atol=1e-5)


def test_cryptomattes_say_the_same_of_themselves(both):
    _, metadata = both
    ours, theirs = (metadata[engine] for engine in ENGINES)
    keys = {key for key in theirs if key.startswith("cryptomatte/")}
    assert len(keys) == 12
    assert {key for key in ours if key.startswith("cryptomatte/")} == keys
    for key in keys:
        if not key.endswith("manifest"):
            assert ours[key] == theirs[key]
            continue

        # Cycles also lists lights and shaders of its own, which no pixel shows.
        mine, all_names = json.loads(ours[key]), json.loads(theirs[key])
        assert mine.items() <= all_names.items()
        hidden = set(all_names) - set(mine)
        assert hidden <= {"Lamp", "Sun", "World", "object", "shader"} | {
            name for name in hidden if name.startswith("default_")
        }


def test_sample_counts_are_those_of_cycles(both):
    found, _ = both
    for passes in found.values():
        assert (passes["Debug Sample Count"] == 1).all()


def test_light_passes_add_up_in_the_file(both):
    passes = both[0]["PENUMBRA"]
    total = passes["Emission"] + passes["Environment"]
    for lobe in LOBES:
        light = passes[f"{lobe} Direct"] + passes[f"{lobe} Indirect"]
        total = total + light * passes[f"{lobe} Color"]
    np.testing.assert_allclose(total, passes["Combined"][..., :3], rtol=1e-5, atol=1e-5)
    groups = sum(passes[f"Combined_{name}"] for name in ("mesh", "lamp", "world"))
    np.testing.assert_allclose(groups, passes["Combined"][..., :3], rtol=1e-5, atol=1e-5)
