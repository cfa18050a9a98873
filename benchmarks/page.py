"""the JSON -> an HTML page.  Curves, ratios, costs, method and machine in one file, of its own.

Nothing is rendered and nothing is loaded: who has the JSON has the page.
"""

import math
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from .curves import Series, bar, label, legend, plot
from .growth import memory_section, scaling_section, stages_section
from .markup import row as _row
from .markup import table as _table

STYLE = Path(__file__).with_suffix(".css")
ERRORS = {"relmse": "relMSE", "relmse_trimmed": "relMSE, trimmed", "flip": "HDR-FLIP"}
PARTS = ("export", "compile", "build", "sampling", "rest")
APART = ("costs", "latency", "scaling", "stages", "footprints")  # measured by themselves
METHOD = (
    "All engines open the same file with the same settings, each in a process of its own: same "
    "filter, same bounces, no clamps, no denoiser, no adaptive sampling unless the name says so.",
    "A time is the wall time of a whole render, with reading the scene and building. Engines take "
    "turns; times are medians, errors means over the repeats, each with a seed of its own.",
    "Errors are against pictures that Cycles converged with other seeds, in two halves, whose "
    "difference tells their own noise; it is subtracted from relMSE. Hollow points are below it.",
    "relMSE is the mean of (x - r)\u00b2 / (r\u00b2 + 0.01); trimmed leaves out the worst 0.1 % of "
    "the pixels. HDR-FLIP is what a viewer sees of a difference, over exposures; the reference's "
    "noise is in it.",
    "A ratio at equal error is the geometric mean of Cycles' time over the other's, between the "
    "points of both curves, over the errors that both reach. Where they share none, straight "
    "lines are fitted; such ratios are marked with ~.",
    "Other renderers draw the same file through an exporter, and take part if the means of their "
    "picture's channels are within 1 % of Cycles'.",
)


def write_page(folder: Path, document: dict[str, Any]) -> None:
    """Write index.html into the folder."""
    (folder / "index.html").write_text(html(document), encoding="utf-8")


def merged(documents: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return one document of several: the first, with what later ones add or measured again."""
    result = dict(documents[0])
    for other in documents[1:]:
        scenes = {scene["name"]: scene for scene in result.get("scenes", ())}
        scenes |= {scene["name"]: scene for scene in other.get("scenes", ())}
        more = {key: other[key] for key in APART if other.get(key)}
        result = {**other, **result, **more, "scenes": list(scenes.values())}
        result["quick"] = any(each["quick"] for each in (result, other))
    return result


def html(document: dict[str, Any]) -> str:
    """Return the page."""
    scenes = document.get("scenes", [])
    parts = [
        "<h1>Penumbra beside Cycles, at equal error</h1>",
        f'<p class="soft">{escape(_versions(document))}</p>',
    ]
    if document["quick"]:
        parts.append(
            '<p class="warning">A quick run: small pictures, few samples. It shows that the '
            "benchmark works, and says nothing about speed.</p>"
        )
    if scenes:
        parts += [_figures(scenes), _summary(scenes), _variants(scenes), _curves(scenes)]
        parts += [_times(document, scenes)]
    parts += [scaling_section(document.get("scaling")), stages_section(document.get("stages", []))]
    parts += [_costs(document.get("costs", [])), memory_section(document.get("footprints"))]
    parts += [_latency(document.get("latency") or {})]
    parts += [_method(document)]
    style = STYLE.read_text("utf-8")
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"/>'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>'
        f"<title>Penumbra beside Cycles</title><style>\n{style}</style></head>\n<body>\n"
        + "\n".join(part for part in parts if part)
        + "\n</body></html>\n"
    )


def _versions(document: dict[str, Any]) -> str:
    blender = document["blender"].removesuffix(" LTS")
    day = f", {document['day']}" if "day" in document else ""
    return f"Penumbra {document['penumbra']}, Blender {blender}{day}"


# ---- ratios


def counted(scenes: Iterable[dict[str, Any]], name: str = "PENUMBRA") -> dict[str, float]:
    """Return Cycles' time over a contender's at equal relMSE, by the scenes' titles."""
    return {
        scene["title"]: ratio["relmse"]["ratio"]
        for scene in scenes
        if scene.get("title") and "relmse" in (ratio := _ratios(scene).get(name, {}))
    }


def geometric_mean(values: Iterable[float]) -> float:
    """Return the geometric mean."""
    logs = [math.log(value) for value in values]
    return math.exp(math.fsum(logs) / len(logs))


def _ratios(scene: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return scene.get("ratios") or {"PENUMBRA": scene["ratio"]}


def _title(scene: dict[str, Any]) -> str:
    return scene.get("title") or scene["name"].replace("_", " ")


def _figures(scenes: Sequence[dict[str, Any]]) -> str:
    found = counted(scenes)
    if not found:
        return ""
    worst, best = min(found, key=found.__getitem__), max(found, key=found.__getitem__)
    cells = (
        (geometric_mean(found.values()), f"geometric mean of {len(found)} scenes"),
        (found[worst], f"worst: {worst}"),
        (found[best], f"best: {best}"),
    )
    return (
        "<p>How many times longer Cycles takes to the same error (relMSE):</p>"
        '<div class="figures">'
        + "".join(f"<div><b>{v:.1f}\u00d7</b><span>{escape(t)}</span></div>" for v, t in cells)
        + "</div>"
    )


def _at(ratio: dict[str, Any], metric: str) -> str:
    if metric not in ratio:
        return ""
    found = ratio[metric]
    if metric == "equal_samples":
        return f"{found:.2f}"
    return f"{'~' if found['method'] == 'extrapolated' else ''}{found['ratio']:.2f}"


def _summary(scenes: Sequence[dict[str, Any]]) -> str:
    found = counted(scenes)
    shown = [_ratios(scene)["PENUMBRA"].get("relmse") for scene in scenes]
    most = max((each["largest"] for each in shown if each), default=1.0)
    rows = []
    for scene in sorted(scenes, key=lambda scene: not scene.get("title")):
        ratio = _ratios(scene)["PENUMBRA"]
        r = ratio.get("relmse")
        width, height = scene["size"]
        cells = [
            escape(_title(scene)),
            f"{width} \u00d7 {height}",
            f"<b>{_at(ratio, 'relmse')}</b>",
            f"{r['smallest']:.2f} \u2013 {r['largest']:.2f}" if r else "",
            bar(r["ratio"], r["smallest"], r["largest"], most) if r else "",
            *(_at(ratio, metric) for metric in ("relmse_trimmed", "flip", "equal_samples")),
        ]
        rows.append(_row(cells, "" if scene.get("title") else "apart"))
    if found:
        mean = geometric_mean(found.values())
        rows.append(_row(["Geometric mean", "", f"{mean:.2f}", *[""] * 5], "sum"))
    head = ("scene", "pixels", "equal relMSE", "range", "", "trimmed", "FLIP", "equal samples")
    return (
        "<h2>Cycles\u2019 time over Penumbra\u2019s</h2>"
        '<p class="soft">Above 1 Penumbra is faster. Grey rows are variations of other scenes, '
        "and not in the mean; rows without an error are of pictures without noise.</p>"
        + _table(head, rows)
    )


def _variants(scenes: Sequence[dict[str, Any]]) -> str:
    """Return the table of all contenders, if there are more than two."""
    names = list(dict.fromkeys(name for scene in scenes for name in _ratios(scene)))
    if len(names) < 2:
        return ""
    rows = []
    for scene in scenes:
        cells = [_at(_ratios(scene).get(name, {}), "relmse") for name in names]
        if len(_ratios(scene)) > 1 and any(cells):
            rows.append(
                _row([escape(_title(scene)), *cells], "" if scene.get("title") else "apart")
            )
    means = [counted(scenes, name) for name in names]
    cells = [f"{geometric_mean(each.values()):.2f}" if each else "" for each in means]
    rows.append(_row(["Geometric mean", *cells], "sum"))
    missing = [
        f"{label(name)} in {_title(scene)}: {why}"
        for scene in scenes
        for name, why in scene.get("absent", {}).items()
    ]
    notes = "".join(f"<li>{escape(line)}</li>" for line in missing)
    return (
        "<h2>Other settings, other renderers</h2>"
        '<p class="soft">Cycles\u2019 time over theirs, at equal relMSE; Cycles always as it '
        "comes. Means are over the scenes that each took part in.</p>"
        + _table(("scene", *map(label, names)), rows)
        + (f"<details><summary>Who is missing</summary><ul>{notes}</ul></details>" if notes else "")
    )


# ---- curves and times


def _curves(scenes: Sequence[dict[str, Any]]) -> str:
    cards = []
    for scene in scenes:
        plots = [plot(_series(scene, metric), name) for metric, name in ERRORS.items()]
        if any(plots):
            drawn = "".join(f"<div>{each}</div>" for each in plots if each)
            width, height = scene["size"]
            note = f"{width} \u00d7 {height}, reference of {scene['reference']['samples']} samples"
            cards.append(
                f'<div class="scene"><h3>{escape(_title(scene))}</h3>'
                f'<span class="soft">{note}</span>{legend(list(scene["engines"]))}'
                f'<div class="plots">{drawn}</div>'
                f"{_points(scene)}</div>"
            )
    return "<h2>Error against time</h2>" + "\n".join(cards) if cards else ""


def _series(scene: dict[str, Any], metric: str) -> list[Series]:
    return [
        Series(name, [_point(name, point, metric) for point in points if "error" in point])
        for name, points in scene["engines"].items()
    ]


def _point(name: str, point: dict[str, Any], metric: str) -> tuple[float, float, bool, str]:
    error = point["error"].get(metric, 0.0)
    what = f"{label(name)}, {_count(point)}: {point['seconds']:.3g} s, {error:.3g}"
    return point["seconds"], error, not point["limited_by_reference"], what


def _count(point: dict[str, Any]) -> str:
    if "threshold" in point:
        return f"threshold {point['threshold']:g}"
    return f"{point['samples']} samples"


def _points(scene: dict[str, Any]) -> str:
    rows = [
        _row([
            escape(label(name)), _count(point), f"{point['seconds']:.3f}",
            *(f"{point['error'][m]:.3g}" if m in point["error"] else "" for m in ERRORS),
            f"{100 * point['mean_difference']:+.2f} %",
        ])
        for name, points in scene["engines"].items()
        for point in points
        if "error" in point
    ]  # fmt: skip
    head = ("", "", "seconds", *ERRORS.values(), "mean, less Cycles\u2019")
    return f"<details><summary>All points</summary>{_table(head, rows)}</details>"


def _times(document: dict[str, Any], scenes: Sequence[dict[str, Any]]) -> str:
    """Return where the seconds of the largest sample count of each scene go."""
    rows = []
    for scene in scenes:
        for name, points in scene["engines"].items():
            parts = points[-1].get("parts")
            if parts and " " not in name:
                start = scene.get("start_up", {}).get(name, {})
                cells = [f"{start[key]:.2f}" if key in start else "" for key in ("open", "warm_up")]
                cells += [f"{parts[part]:.3f}" if part in parts else "" for part in PARTS]
                first = [escape(_title(scene)), escape(label(name)), str(points[-1]["samples"])]
                rows.append(_row([*first, *cells, f"{points[-1]['seconds']:.2f}"]))
    if not rows:
        return ""
    starts = ", ".join(f"{label(e)} {s:.1f} s" for e, s in document.get("start_up", {}).items())
    head = ("scene", "", "samples", "open", "first render", *PARTS, "whole")
    return (
        "<h2>Where the time goes</h2>"
        '<p class="soft">Seconds. Opening the file and the first render of one sample are not '
        "part of the times above; reading the scene from Blender (export), compiling, building "
        "and sampling are. The rest is Blender\u2019s."
        + (f" Until a process is there: {escape(starts)}." if starts else "")
        + "</p><details><summary>Show the table</summary>"
        + _table(head, rows)
        + "</details>"
    )


# ---- what features cost, what users wait for


def _costs(costs: Sequence[dict[str, Any]]) -> str:
    if not costs:
        return ""
    rows = [
        _row([escape(each["name"]), *(_factor(each.get(key)) for key in ("unused", "on", "gain"))])
        for each in costs
    ]
    head = ("feature", "on, unused", "on", "skipping gains")
    return (
        "<h2>What a scene does not use, and what it costs</h2>"
        '<p class="soft">CPU time against that of the same picture without the feature: where '
        "the scene does not use it, and where it does; and how many times longer it would take "
        "if what can be skipped were not.</p>" + _table(head, rows)
    )


def _factor(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def _latency(latency: dict[str, dict[str, float]]) -> str:
    if not latency:
        return ""
    whats = list(next(iter(latency.values())))
    rows = [
        _row([escape(scene), *(f"{1e3 * found[what]:.0f}" for what in whats)])
        for scene, found in latency.items()
    ]
    return (
        '<h2>In the viewport</h2><p class="soft">Milliseconds until something is seen.</p>'
        + _table(("scene", *whats), rows)
    )


def _method(document: dict[str, Any]) -> str:
    memory = f", {document['memory']:g} GiB" if document.get("memory") else ""
    machine = f"{document.get('processor', '')}, {document.get('cores', '?')} cores{memory}, "
    machine += f"{document.get('system', '')}, Python {document.get('python', '?')}"
    if "repeats" in document:
        machine += f"; {document['threads']} threads, {document['repeats']} repeats"
    loads = [document.get(key) for key in ("load", "load_after")]
    if None not in loads:
        machine += f"; load {loads[0]:g} before, {loads[1]:g} after"
    items = "".join(f"<li>{escape(line)}</li>" for line in METHOD)
    return f"<h2>Method</h2><ul>{items}</ul><h2>Machine</h2><p>{escape(machine)}.</p>"
