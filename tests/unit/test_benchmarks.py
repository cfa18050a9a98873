"""ratios, scenes -> verdicts and keys.  What the benchmark says, without rendering."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from penumbra.benchmarks import built, contenders, costs, reference, skips
from penumbra.benchmarks.curves import LOOKS
from penumbra.benchmarks.errors import Curve, ratio_at_equal_error
from penumbra.benchmarks.process import WorkerError
from penumbra.benchmarks.run import check, parts, ratios, reached, summarise
from penumbra.benchmarks.scenes import SCENES, THRESHOLDS
from penumbra.benchmarks.table import print_summary

MEASURED = {"ratio": 3.2, "smallest": 2.9, "largest": 3.5, "method": "interpolated"}


@pytest.mark.parametrize(
    ("target", "ratio", "verdict"),
    [
        (3.0, {"relmse": MEASURED}, True),
        (3.2, {"relmse": MEASURED}, True),
        (4.0, {"relmse": MEASURED}, False),
        (None, {"relmse": MEASURED}, None),
        (3.0, {"equal_samples": 9.0, "rmse": MEASURED}, None),
    ],
)
def test_a_target_is_reached_by_the_ratio_at_equal_relmse(target, ratio, verdict):
    assert reached(target, ratio) is verdict


@pytest.mark.parametrize(
    ("target", "verdict", "words"),
    [(3.0, True, "3.0 reached"), (4.0, False, "4.0 not reached"), (3.0, None, "3.0 not measured")],
)
def test_the_summary_says_whether_a_target_is_reached(target, verdict, words, capsys):
    ratio = {"equal_samples": 3.0} | ({} if verdict is None else {"relmse": MEASURED})
    scene = {"name": "x", "target": target, "reached": verdict, "ratio": ratio}
    print_summary([scene | {"ratios": {"PENUMBRA": ratio}}])
    assert capsys.readouterr().out.rstrip().endswith(words)


def test_a_curve_that_is_four_times_as_fast_has_the_ratio_four():
    seconds, errors = [1.0, 2.0, 4.0, 8.0], [0.8, 0.4, 0.2, 0.1]
    ratio = ratio_at_equal_error(Curve(seconds, errors), Curve([s / 4 for s in seconds], errors))
    assert ratio["method"] == "interpolated"
    assert ratio["ratio"] == pytest.approx(4)


def test_the_cost_of_a_feature_is_the_median_ratio_to_the_same_scene_without_it():
    seconds = {"plain": [1.0, 2.0, 4.0], "unused": [1.1, 2.2, 9.0]}
    seconds |= {"bare": [2.0, 2.0, 2.0], "on": [5.0, 3.0, 4.0]}
    found = {"unused": pytest.approx(1.1), "on": pytest.approx(2.0), "gain": None}
    assert costs.ratios(seconds) == found
    always = {"bare": [1.0], "on": [3.0]}
    assert costs.ratios(always) == {"unused": None, "on": 3.0, "gain": None}
    left_out = {"plain": [1.0, 1.0], "unused": [1.0, 2.0], "kept": [3.0, 6.0]}
    assert costs.ratios(left_out) == {"unused": 1.5, "on": None, "gain": 3.0}


def test_what_is_skipped_is_rendered_plain_unused_and_kept():
    done = []
    skip = skips.Skip("x", lambda _: done.append("unused"), lambda _: done.append("kept"))
    found = {}
    for state in skip.states():
        skip.apply(state, None)
        found[state], done[:] = list(done), []
    assert found == {"plain": [], "unused": ["unused"], "kept": ["kept"]}
    assert skips.Skip("x", done.append).states() == ("plain", "unused")


def test_a_feature_is_turned_on_and_used_where_its_state_says():
    done = []
    feature = costs.Feature("x", lambda _: done.append("on"), lambda _: done.append("used"))
    found = {}
    for state in feature.states():
        feature.apply(state, None)
        found[state], done[:] = list(done), []
    assert found == {"plain": [], "unused": ["on"], "bare": ["used"], "on": ["used", "on"]}
    assert costs.Feature("x", done.append).states() == ("bare", "on")
    assert len(costs.BY_NAME) == len(costs.ALL)


@pytest.mark.parametrize("scene", [s for s in SCENES if s.reference], ids=lambda s: s.name)
def test_a_reference_is_kept_until_the_picture_changes(scene):
    key = reference.key(scene, "5.2")
    assert reference.key(replace(scene, samples=(1, 2), target=9.0), "5.2") == key
    changed = [
        reference.key(scene, "4.2"),
        reference.key(replace(scene, settings={"max_bounces": 1}), "5.2"),
        reference.key(scene.quick(), "5.2"),
        reference.key(replace(scene, reference=2), "5.2"),
    ]
    assert len({key, *changed}) == 5


def test_adaptive_scenes_go_by_thresholds_and_the_others_by_samples():
    scenes = {scene.name: scene for scene in SCENES}
    assert [samples for samples, _ in scenes["cornell_gi"].points()] == [4, 8, 16, 32, 64, 128]
    assert all(settings == {} for _, settings in scenes["cornell_gi"].points())
    points = scenes["lamps_adaptive"].points()
    assert {samples for samples, _ in points} == {512}
    assert {settings["use_adaptive_sampling"] for _, settings in points} == {True}
    assert [settings["adaptive_threshold"] for _, settings in points] == list(THRESHOLDS)
    assert len(scenes["lamps_adaptive"].quick().points()) == len(points)


def test_the_keys_of_all_scenes_differ():
    scenes = [s for s in SCENES if s.reference]
    assert len({reference.key(s, "5.2") for s in scenes}) == len(scenes)


def test_a_scene_is_known_by_its_code_without_comments_and_docstrings(tmp_path, monkeypatch):
    monkeypatch.setattr(built, "FOLDER", tmp_path)
    monkeypatch.setattr(built, "SHARED", ())
    texts = [
        '"""a -> b."""\n\ndef build():\n    """Make it."""\n    return 1\n',
        '"""c -> d."""\n\ndef build():  # as before\n    return   1\n',
        '"""a -> b."""\n\ndef build():\n    """Make it."""\n    return 2\n',
    ]
    prints = []
    for text in texts:
        (tmp_path / "x.py").write_text(text, "utf-8")
        prints.append(built.fingerprint("x"))
    assert prints[0] == prints[1] != prints[2]


# What was measured, of one picture or several


def run(seconds, **more):
    row = {"seconds": seconds, "statistics": {}, "parts": {}, "mean": 0.0, "flip": None}
    return row | {"squared": dict.fromkeys(("relmse", "relmse_trimmed", "rmse"), 0.04)} | more


def test_the_noise_of_the_reference_is_subtracted_from_all_errors_but_flip():
    noise = dict.fromkeys(("relmse", "relmse_trimmed", "rmse"), 0.03)
    point = summarise(
        (4, {}), [run(1.0, flip=0.2), run(5.0, flip=0.4), run(2.0, flip=0.3)], 8, noise
    )
    assert point["seconds"] == 2.0
    assert point["samples_per_second"] == 16.0
    expected = {"relmse": 0.01, "relmse_trimmed": 0.01, "rmse": 0.1, "flip": 0.3}
    assert point["error"] == pytest.approx(expected)
    assert point["limited_by_reference"], "0.01 is less than 0.03"
    assert "flip" not in summarise((4, {}), [run(1.0)], 8, noise)["error"]


def test_the_rest_of_a_render_is_what_no_part_has():
    rows = [
        run(4.0, parts={"export": 1.0, "sampling": 2.5}),
        run(3.0, parts={"export": 1, "sampling": 1}),
    ]
    found = parts([rows[0], rows[0], rows[1]])
    assert found == pytest.approx({"export": 1.0, "sampling": 2.5, "rest": 0.5})
    assert parts([rows[0], run(3.0)]) == {}


def curve(seconds, errors, flip=None):
    points = []
    for k, (s, e) in enumerate(zip(seconds, errors, strict=True)):
        error = dict.fromkeys(("relmse", "relmse_trimmed", "rmse"), e)
        points.append({"samples": 2**k, "seconds": s, "error": error})
        if flip is not None:
            error["flip"] = flip * e
    return points


def test_a_contender_is_compared_at_equal_error_and_at_equal_samples():
    seconds, errors = [1.0, 2.0, 4.0, 8.0], [0.8, 0.4, 0.2, 0.1]
    engines = {"CYCLES": curve(seconds, errors, 1.0)}
    engines["PENUMBRA"] = curve([s / 4 for s in seconds], errors)
    engines["PENUMBRA adaptive"] = curve(seconds, errors, 0.5)
    engines["PENUMBRA adaptive"][-1]["threshold"] = 0.1
    found = ratios(engines, "PENUMBRA")
    assert found["equal_samples"] == 4
    assert found["relmse"]["ratio"] == pytest.approx(4)
    assert "flip" not in found, "Penumbra's was not measured"
    found = ratios(engines, "PENUMBRA adaptive")
    assert "equal_samples" not in found
    assert found["flip"]["ratio"] == pytest.approx(2)


def test_points_of_one_error_are_no_curve():
    engines = {"CYCLES": curve([1.0, 2.0, 4.0, 8.0], [0.8, 0.4, 0.2, 0.1])}
    engines["PENUMBRA"] = curve([1.0, 1.0, 1.1, 1.0], [0.2, 0.2, 0.2, 0.2])
    assert set(ratios(engines, "PENUMBRA")) == {"equal_samples"}


# Who takes part


def test_there_are_six_points_to_a_curve_and_a_title_for_each_kind_of_scene():
    for scene in SCENES:
        if scene.reference:
            assert len(scene.points()) >= 6, scene.name
            assert len(scene.quick().points()) >= 4, scene.name
    titles = [scene.title for scene in SCENES if scene.title]
    assert len(set(titles)) == len(titles) >= 15


def test_cycles_and_penumbra_always_take_part_and_others_if_asked():
    names = [each.name for each in contenders.chosen([])]
    assert names == ["CYCLES", "PENUMBRA"]
    everyone = contenders.chosen(["adaptive", "all", "mitsuba-llvm"])
    names = [each.name for each in everyone]
    assert names[:2] == ["CYCLES", "PENUMBRA"]
    assert len(names) == len(set(names)) == 13
    assert set(names) <= set(LOOKS), "each has a look on the page"


def test_contenders_differ_in_what_is_set_back_for_the_next_one():
    for each in contenders.chosen(["all"]):
        assert each.settings.keys() <= contenders.DEFAULTS.keys()
    by_name = {each.name: each for each in contenders.chosen(["all"])}
    assert by_name["PENUMBRA regular"].settings == {"pattern": "REGULAR"}
    own = {"light_samples": 1, "scatter_samples": 1, "path_reuse": "OFF"}
    assert by_name["PENUMBRA one ray"].settings == own


def test_who_does_not_fit_a_scene_does_not_take_part():
    scenes = {scene.name: scene for scene in SCENES}
    everyone = contenders.chosen(["all"])
    fits = {name: {e.name for e in everyone if e.competes(scenes[name])} for name in scenes}
    assert fits["cornell_gi"] == {each.name for each in everyone}
    assert "CYCLES adaptive" not in fits["empty_world"] | fits["lamps_adaptive"]
    assert fits["lamps_adaptive"].isdisjoint({"PENUMBRA poisson", "MITSUBA"})
    adaptive = next(each for each in everyone if each.name == "PENUMBRA adaptive")
    points = adaptive.points(scenes["cornell_gi"])
    assert {samples for samples, _ in points} == {256}
    assert len({settings["adaptive_threshold"] for _, settings in points}) == len(points) == 6


@pytest.mark.parametrize(("factor", "fits"), [(1.0, True), (1.009, True), (0.98, False)])
def test_another_renderer_takes_part_if_its_means_are_those_of_cycles(factor, fits):
    truth = np.random.default_rng(1).random((8, 9, 3), np.float32)
    worker = SimpleNamespace(render=lambda *_: ({}, truth * np.float32([1, 1, factor])))
    scene, known = SCENES[0], reference.Reference(truth, {}, 0.0)
    if fits:
        check("MITSUBA", scene, worker, 1, known)
    else:
        with pytest.raises(WorkerError, match=r"-\d\.\d\d %"):
            check("MITSUBA", scene, worker, 1, known)
