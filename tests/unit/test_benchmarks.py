"""ratios, scenes -> verdicts and keys.  What the benchmark says, without rendering."""

from dataclasses import replace

import pytest

from penumbra.benchmarks import built, costs, reference
from penumbra.benchmarks.__main__ import reached
from penumbra.benchmarks.errors import Curve, ratio_at_equal_error
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
    print_summary([{"name": "x", "target": target, "reached": verdict, "ratio": ratio}])
    assert capsys.readouterr().out.rstrip().endswith(words)


def test_a_curve_that_is_four_times_as_fast_has_the_ratio_four():
    seconds, errors = [1.0, 2.0, 4.0, 8.0], [0.8, 0.4, 0.2, 0.1]
    ratio = ratio_at_equal_error(Curve(seconds, errors), Curve([s / 4 for s in seconds], errors))
    assert ratio["method"] == "interpolated"
    assert ratio["ratio"] == pytest.approx(4)


def test_the_cost_of_a_feature_is_the_median_ratio_to_the_same_scene_without_it():
    seconds = {"plain": [1.0, 2.0, 4.0], "unused": [1.1, 2.2, 9.0]}
    seconds |= {"bare": [2.0, 2.0, 2.0], "on": [5.0, 3.0, 4.0]}
    assert costs.ratios(seconds) == {"unused": pytest.approx(1.1), "on": pytest.approx(2.0)}
    always = {"bare": [1.0], "on": [3.0]}
    assert costs.ratios(always) == {"unused": None, "on": 3.0}


def test_a_feature_is_turned_on_and_used_where_its_state_says():
    done = []
    feature = costs.Feature("x", lambda _: done.append("on"), lambda _: done.append("used"))
    found = {}
    for state in feature.states():
        feature.apply(state, None)
        found[state], done[:] = list(done), []
    assert found == {"plain": [], "unused": ["on"], "bare": ["used"], "on": ["used", "on"]}
    assert costs.Feature("x", done.append).states() == ("bare", "on")
    assert len(costs.BY_NAME) == len(costs.FEATURES)


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
    assert [samples for samples, _ in scenes["cornell_gi"].points()] == [8, 16, 32, 64, 128]
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
