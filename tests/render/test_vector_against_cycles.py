"""What moves from frame to frame -> the Vector pass of both engines, pixel by pixel.

Both render in one process, several seeds each.  Where a pixel shows one object alone, the means are
compared by Student's t: 12 deviations of 10 degrees of freedom are less likely than 1e-6.  Cycles
4.2 knows no zooms here, no surroundings, and has the x of panoramas mirrored; in perspective
pictures 5.2 lacks the division by the depth for the surroundings, where ours is tested by itself.
"""

import numpy as np
import pytest

SEEDS, SAMPLES = 6, 16
ENGINES = ("PENUMBRA", "CYCLES")


def render_both(folder, kind):
    """Return {engine: [passes of each seed]}."""
    import bpy
    import pass_stage
    import vector_stage

    scene = vector_stage.build(kind, zooms=bpy.app.version >= (5, 0))
    found = {}
    for engine in ENGINES:
        shots = []
        for seed in range(SEEDS):
            path = folder / f"{kind}{engine}{seed}.exr"
            shots.append(pass_stage.shot(scene, engine, SAMPLES, seed, path)[0])
        found[engine] = {name: np.stack([shot[name] for shot in shots]) for name in shots[0]}
    return bpy.app.version, found


@pytest.fixture(scope="module", params=["PERSP", "ORTHO", "PANO"])
def both(request, blender, tmp_path_factory):
    version, found = blender(render_both, tmp_path_factory.mktemp("vectors"), request.param)
    if request.param == "PANO" and version < (5, 0):
        pytest.skip("Cycles mirrored it")
    return request.param, version, found


def agree(found, some):
    """Tell whether the vectors of pixels (H, W) are the same in both engines; return Cycles'."""
    ours, theirs = (found[engine]["Vector"][:, some].astype(float) for engine in ENGINES)
    assert (gap_of(ours, theirs) <= 0).mean() > 0.999
    assert (gap_of(ours.mean(axis=1), theirs.mean(axis=1)) <= 0).all()
    return theirs.mean(axis=0)


def gap_of(ours, theirs):
    """Return by how much [pixels] means of seeds differ beyond what chance explains."""
    spread = np.sqrt((ours.var(axis=0, ddof=1) + theirs.var(axis=0, ddof=1)) / SEEDS)
    return np.abs(ours.mean(axis=0) - theirs.mean(axis=0)) - 12 * spread - 5e-4


def coverage(found):
    """Return what is seen first, and how much of each pixel it covers, in all pictures."""
    mattes = np.concatenate([found[engine]["CryptoObject00"] for engine in ENGINES])
    return mattes[..., 0], mattes[..., 1]


def test_whole_objects_have_the_vectors_of_cycles(both):
    kind, _, found = both
    key, weight = coverage(found)
    is_whole = (weight > 0.9999).all(axis=0) & (key == key[0]).all(axis=0)
    keys = np.unique(key[0][is_whole])
    assert len(keys) == 3
    for each in keys:
        vectors = agree(found, is_whole & (key[0] == each))
        assert (np.abs(vectors).max(axis=0) > 0.1).all(), (kind, each)


def test_the_surroundings_have_the_vectors_of_cycles(both):
    kind, version, found = both
    if kind == "PERSP" or version < (5, 0):
        pytest.skip("Cycles has not the right ones")
    _, weight = coverage(found)
    is_far = (weight == 0).all(axis=0)
    # At the edge of a round picture some pixels have too few samples to tell
    counts = [(found[engine]["Vector"] != 0).any(axis=-1) for engine in ENGINES]
    same = np.concatenate(counts)
    is_far &= same.all(axis=0) | ~same.any(axis=0)
    assert is_far.sum() > 500
    agree(found, is_far)


def blurred(folder):
    import pass_stage
    import vector_stage

    from penumbra.addon import report

    scene = vector_stage.build()
    scene.render.use_motion_blur = True
    report.clear()
    found = {}
    for engine in ENGINES:
        found[engine] = pass_stage.shot(scene, engine, 2, 0, folder / f"{engine}.exr")[0]["Vector"]
    return found, report.frames[-1]["not_honoured"]


def test_with_motion_blur_it_is_blank_as_in_cycles_and_named(blender, tmp_path):
    found, notes = blender(blurred, tmp_path)
    assert not found["CYCLES"].any()
    assert not found["PENUMBRA"].any()
    assert [note["what"] for note in notes] == ["pass Vector is blank with motion blur"]
