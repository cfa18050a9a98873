"""a made-up JSON -> the page.  That it is well-formed, whole, and says what the numbers say."""

import json
import re
from html import unescape
from xml.etree import ElementTree

import pytest

from penumbra.benchmarks.__main__ import main
from penumbra.benchmarks.curves import Axis, Series, bar, number, plot
from penumbra.benchmarks.page import counted, geometric_mean, html, merged


def ratio(value, method="interpolated"):
    found = {"ratio": value, "smallest": value / 2, "largest": 2 * value, "method": method}
    return {"equal_samples": value / 3, "relmse": found, "relmse_trimmed": found}


def point(samples, seconds, error, reliable=True):
    return {
        "samples": samples,
        "seconds": seconds,
        "parts": {"export": 0.1, "build": 0.1, "sampling": seconds, "rest": 0.0},
        "error": {"relmse": error, "relmse_trimmed": error / 2, "rmse": error, "flip": error**0.5},
        "limited_by_reference": not reliable,
        "mean_difference": 0.001,
    }


def scene(name, title, value, *others):
    names = ["CYCLES", "PENUMBRA", *others]
    counts = (4, 8, 16, 32, 64, 128)
    engines = {n: [point(c, 0.01 * c, 0.1 / c, c < 100) for c in counts] for n in names}
    return {
        "name": name,
        "title": title,
        "size": [320, 240],
        "settings": {},
        "target": None,
        "reached": None,
        "start_up": {"CYCLES": {"open": 0.5, "warm_up": 0.25}},
        "absent": {"MITSUBA": "a <thing> is not exported"},
        "reference": {"samples": 512, "seconds": 9.0, "squared_error": {}, "flip": 0.01},
        "engines": engines,
        "ratio": ratio(value),
        "ratios": {n: ratio(value if n == "PENUMBRA" else 1.0, "extrapolated") for n in names[1:]},
    }


def document(*scenes, **more):
    base = {"schema": 1, "penumbra": "0.1.0", "blender": "5.2.3 LTS", "quick": False}
    base |= {"processor": "Abacus <7>", "system": "linux", "cores": 2, "memory": 8.0, "load": 0.5}
    base |= {"load_after": 1.5, "python": "3.13.0", "day": "2026-11-23", "threads": 2, "repeats": 3}
    return base | {"latency": {}, "start_up": {"CYCLES": 2.0}, "scenes": list(scenes)} | more


FULL = document(
    scene("a", "First & foremost", 8.0, "PENUMBRA regular"),
    scene("b", "Second", 2.0),
    scene("c_adaptive", "", 100.0),
    costs=[{"name": "lens", "unused": 1.012, "on": None, "gain": 2.5, "cpu_seconds": {}}],
    latency={"default scene": {"first picture": 0.048}},
)


def parsed(text):
    """Return the page as a tree; raises if its tags do not match."""
    body = text.removeprefix("<!doctype html>\n")
    assert body != text
    return ElementTree.fromstring(body.replace("&nbsp;", " "))


def rows(tree, heading):
    """Return the cells of the table that follows a heading."""
    body = tree.find("body")
    place = next(
        k for k, e in enumerate(body) if e.tag == "h2" and heading in "".join(e.itertext())
    )
    for element in body[place:]:
        table = element.find(".//table")
        if table is not None:
            return [["".join(c.itertext()) for c in row] for row in table.iter("tr")]
    raise AssertionError(f"no table after {heading}")


def test_the_page_is_well_formed_and_loads_nothing():
    text = html(FULL)
    tree = parsed(text)
    assert not re.search(r"(src|href)\s*=|url\(|@import|<script", text)
    assert {each.tag for each in tree.iter()} >= {"style", "svg", "table", "details"}
    assert "<thing>" in unescape(text), "what is foreign is escaped, and shown"


def test_the_headline_is_the_geometric_mean_of_the_scenes_that_count():
    assert counted(FULL["scenes"]) == {"First & foremost": 8.0, "Second": 2.0}
    assert geometric_mean([8.0, 2.0]) == pytest.approx(4.0)
    shown = [
        "".join(each.itertext())
        for each in parsed(html(FULL)).iterfind(".//div[@class='figures']/div")
    ]
    assert shown[0].startswith("4.0\u00d7")
    assert shown[1] == "2.0\u00d7worst: Second"
    assert shown[2] == "8.0\u00d7best: First & foremost"


def test_the_summary_has_a_row_for_each_scene_and_the_mean():
    found = rows(parsed(html(FULL)), "Penumbra\u2019s")
    by_name = {row[0]: row[1:] for row in found[1:]}
    assert list(by_name) == ["First & foremost", "Second", "c adaptive", "Geometric mean"]
    assert by_name["Second"][:3] == ["320 \u00d7 240", "~2.00", "1.00 \u2013 4.00"]
    assert by_name["Geometric mean"][1] == "4.00"


def test_other_settings_have_a_column_each():
    head, *found = rows(parsed(html(FULL)), "Other settings")
    assert head == ["scene", "Penumbra", "Penumbra regular"]
    assert found == [["First & foremost", "~8.00", "~1.00"], ["Geometric mean", "4.00", "1.00"]]
    plain = html(document(scene("b", "Second", 2.0)))
    assert "Other settings" not in plain


def test_costs_and_latency_are_shown_where_measured():
    tree = parsed(html(FULL))
    assert rows(tree, "does not use")[1] == ["lens", "1.01", "", "2.50"]
    assert rows(tree, "viewport")[1] == ["default scene", "48"]
    bare = html(document(scene("b", "Second", 2.0)))
    assert "In the viewport" not in bare
    assert "does not use" not in bare


def test_a_quick_run_says_that_it_is_one():
    assert "quick run" in html(FULL | {"quick": True})
    assert "quick run" not in html(FULL)


def test_pages_without_errors_or_scenes_are_pages():
    timed = scene("empty", "Empty", 2.0)
    del timed["reference"]
    timed["ratios"] = {"PENUMBRA": {"equal_samples": 3.0}}
    for each in (p for points in timed["engines"].values() for p in points):
        del each["error"], each["limited_by_reference"], each["mean_difference"]
    tree = parsed(html(document(timed)))
    assert rows(tree, "Penumbra\u2019s")[1][-1] == "3.00"
    parsed(html(document(costs=FULL["costs"])))


def test_documents_are_joined_and_later_scenes_win():
    again = document(scene("b", "Second", 6.0), scene("d", "Fourth", 3.0), quick=True)
    found = merged([FULL, again, document(costs=[{"name": "x"}])])
    assert counted(found["scenes"]) == {"First & foremost": 8.0, "Second": 6.0, "Fourth": 3.0}
    assert found["quick"], "one of them was"
    assert found["costs"] == [{"name": "x"}]
    assert found["latency"] == FULL["latency"]
    assert counted(FULL["scenes"])["Second"] == 2.0, "it was not changed"


def test_a_plot_has_all_points_where_they_belong():
    good = [(1.0, 0.1, True, "one"), (10.0, 0.01, True, "ten"), (100.0, 0.001, False, "hundred")]
    tree = ElementTree.fromstring(plot([Series("CYCLES", [*good, (1.0, 0.0, True, "none")])], "E"))
    points = [e for e in tree.iter("path") if "point" in e.get("class")]
    assert [e.find("title").text for e in points] == ["one", "ten", "hundred"]
    assert ["hollow" in e.get("class") for e in points] == [False, False, True]
    places = [
        tuple(map(float, re.match(r"M([\d.]+) ([\d.]+)", e.get("d")).groups())) for e in points
    ]
    (x0, y0), (x1, y1), (x2, y2) = places
    assert x1 - x0 == pytest.approx(x2 - x1, abs=0.2), "time is logarithmic"
    assert y1 - y0 == pytest.approx(y2 - y1, abs=0.2)
    assert x0 < x1
    assert y0 < y1, "small errors are below"
    assert plot([Series("CYCLES", [(1.0, 0.0, True, "none")])], "E") == ""


@pytest.mark.parametrize(
    ("low", "high"), [(1, 1), (0.9, 1.3), (0.01, 30), (1e-9, 1e4), (2e-5, 3e-3)]
)
def test_an_axis_has_some_round_ticks_on_it(low, high):
    axis = Axis.over([low, high], 0, 100)
    ticks = axis.ticks()
    assert 2 <= len(ticks) <= 7
    assert all(0 <= axis.at(each) <= 100 for each in ticks)
    assert 0 < axis.at(low) <= axis.at(high) < 100


def test_bars_go_left_of_one_for_what_is_slower():
    for value, slower in ((3.0, False), (0.6, True)):
        tree = ElementTree.fromstring(bar(value, value * 0.9, value * 1.1, 5.0))
        fill = next(e for e in tree.iter("path") if "fill" in e.get("class"))
        start, end = map(float, re.match(r"M([\d.]+) 3H([\d.]+)", fill.get("d")).groups())
        assert ("slower" in fill.get("class")) == (end < start) == slower


@pytest.mark.parametrize(
    ("value", "text"), [(0.02, "0.02"), (30.0, "30"), (2e-4, "2e-4"), (1e-3, "1e-3"), (5e4, "5e4")]
)
def test_numbers_on_axes_are_short(value, text):
    assert number(value) == text


def test_a_page_is_made_of_files_alone(tmp_path, monkeypatch):
    monkeypatch.setattr("penumbra.benchmarks.__main__.Worker", None)  # nothing is rendered
    for name, what in (("a", FULL), ("b", document(scene("d", "Fourth", 3.0)))):
        (tmp_path / f"{name}.json").write_text(json.dumps(what), "utf-8")
    files = [str(tmp_path / name) for name in ("a.json", "b.json")]
    assert main(["--page", str(tmp_path), "--from", *files]) == 0
    assert "Fourth" in (tmp_path / "index.html").read_text("utf-8")


@pytest.mark.parametrize(
    "arguments",
    [
        ["--from", "{file}"],
        ["--from", "none.json"],
        ["--page", ".", "--from", "none.json"],
        ["--page", "nowhere"],
        ["--variants", "none"],
    ],
)
def test_bad_arguments_are_refused_before_anything_is_started(arguments, tmp_path, monkeypatch):
    file = tmp_path / "full.json"
    file.write_text(json.dumps(FULL), "utf-8")
    arguments = [each.format(file=file) for each in arguments]
    monkeypatch.setattr("penumbra.benchmarks.__main__.Worker", None)
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
