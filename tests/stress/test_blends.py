"""The short form of fuzzed .blend content; what becomes of a Blender that ends.  See blends.py."""

import pytest

from tests.stress import blends

COUNT = 20


def test_content_that_nobody_meant_is_drawn_or_refused(blender):
    outcomes = dict(blends.outcomes(0, COUNT))
    assert list(outcomes) == list(range(COUNT))
    assert not [text for text in outcomes.values() if text.startswith("wrong")]
    assert sum(text == "drawn" for text in outcomes.values()) > COUNT / 2


@pytest.mark.parametrize("is_ours", (True, False))
def test_a_seed_that_ends_blender_is_told_and_the_others_follow(monkeypatch, is_ours):
    def run(engine, first, count):
        left = ["drawn"] * min(count, 12 - first) if first <= 12 else ["drawn"] * count
        if engine == "NOTHING":
            return [], "" if is_ours else "exit -6"
        return left, "" if len(left) == count else "exit -11: no memory"

    monkeypatch.setattr(blends, "_run", run)
    outcomes = dict(blends.outcomes(10, 5))
    assert list(outcomes) == [10, 11, 12, 13, 14]
    said = "wrong: exit -11" if is_ours else "refused: Blender itself"
    assert outcomes.pop(12).startswith(said)
    assert set(outcomes.values()) == {"drawn"}
