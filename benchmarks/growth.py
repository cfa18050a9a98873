"""scaling, stages, memory -> HTML.  The page's sections of what more of something costs."""

from collections.abc import Sequence
from html import escape
from typing import Any

from .curves import Series, label, legend, plot
from .markup import row, table


def scaling_section(scaling: dict[str, Any] | None) -> str:
    """Return curves of processor time over each axis, with slopes; '' if not measured."""
    if not scaling:
        return ""
    names = list(dict.fromkeys(name for axis in scaling["axes"] for name in axis["engines"]))
    plots = [plot(_curves(axis), "seconds", axis["name"]) for axis in scaling["axes"]]
    drawn = "".join(f"<div>{each}</div>" for each in plots if each)
    rows = [
        row([
            escape(axis["name"]), escape(label(name)),
            f"{points[0]['value']:,} to {points[-1]['value']:,}",
            f"{points[0]['sampling']:.3g} to {points[-1]['sampling']:.3g}",
            f"{axis['slopes'][name]:.2f}", f"{axis['last_slopes'][name]:.2f}",
            _parts(points[-1]),
        ])
        for axis in scaling["axes"]
        for name, points in axis["engines"].items()
    ]  # fmt: skip
    head = ("", "", "from, to", "seconds of sampling", "slope", "at the end", "and before, at most")
    return (
        "<h2>What more of it costs</h2>"
        '<p class="soft">Processor time of sampling on one thread. The slope is that of a line '
        "through the logarithms: 1 is in proportion, 0 is free. At the end: of the last three "
        "points. Before: reading the scene, compiling it, and building Embree\u2019s tree, for the "
        "largest value.</p>"
        f'<div class="scene">{legend(names)}<div class="plots">{drawn}</div></div>'
        + table(head, rows)
        + _workers(scaling["workers"])
    )


def _curves(axis: dict[str, Any]) -> list[Series]:
    return [
        Series(
            name,
            [
                (
                    point["value"] + axis["offset"],
                    point["sampling"],
                    True,
                    f"{label(name)}, {point['value']:,} {axis['name']}: {point['sampling']:.3g} s",
                )
                for point in points
            ],
        )
        for name, points in axis["engines"].items()
    ]


def _parts(point: dict[str, Any]) -> str:
    return ", ".join(f"{name} {seconds:.2f}" for name, seconds in point["parts"].items())


def _workers(rows: Sequence[dict[str, Any]]) -> str:
    """Return how often the interpreter is taken, and what that predicts."""
    counts = list(dict.fromkeys(count for each in rows for count in each["processes"]))
    counts = counts or list(dict.fromkeys(count for each in rows for count in each["threads"]))
    lines = []
    for each in rows:
        for kind, share in (("threads", each["taken"]), ("processes", each["handed"])):
            if share is not None:
                cells = [f"{each[kind][count]:.1f}" for count in counts]
                lines.append(row([escape(each["name"]), kind, f"{100 * share:.1f} %", *cells]))
    if not lines:
        return ""
    head = ("", "", "of the interpreter", *(f"{count} cores" for count in counts))
    return (
        "<h3>What more cores would gain</h3>"
        '<p class="soft">One interpreter serves one thread at a time. A thread takes it for this '
        "share of its time (looked at from outside, while it samples); where processes work, "
        "Blender\u2019s own is needed for this share of theirs, to hand out and to add up. So many "
        "times as fast as one worker are more of them, by queueing theory.</p>" + table(head, lines)
    )


def stages_section(scenes: Sequence[dict[str, Any]]) -> str:
    """Return what stages take beside what they could take; '' if not measured."""
    if not scenes:
        return ""
    rows = []
    for scene in scenes:
        rows.append(
            row([escape(scene["name"]), "Embree", f"{scene['embree']:.0f}", *[""] * 4], "apart")
        )
        for name, of in scene["stages"].items():
            cells = [f"{of['ns']:.1f}", f"{of['bytes']:.0f}", f"{of['bound']:.1f}"]
            cells += [f"{of['ns'] / of['bound']:.0f}", f"{of['passes']:.0f}"]
            rows.append(row(["", name, *cells]))
    head = ("", "stage", "ns", "bytes", "at best, ns", "times that", "as additions")
    return (
        "<h2>How far the stages are from ideal</h2>"
        '<p class="soft">Nanoseconds of one thread for each path vertex. The bytes are those of '
        "the arrays that a stage is handed and that it returns; at best it takes as long as "
        "copying them, and for surfaces as taking a row at random from a table of as many "
        "triangles. As additions: how many times two arrays of the batch could be added "
        "meanwhile.</p>" + table(head, rows)
    )


def memory_section(footprints: dict[str, Any] | None) -> str:
    """Return the tables of what takes how many bytes; '' if not measured."""
    if not footprints:
        return ""
    units = [
        row([escape(each["name"]), escape(step), f"{of['kept']:,.0f}", f"{of['peak']:,.0f}"])
        for each in footprints["units"]
        for step, of in each["steps"].items()
    ]
    large = [
        row([
            f"{each['units']:,} triangles", escape(each["name"].partition(": ")[2]),
            f"{max(each['peaks'].values()) / 2**30:.2f}",
        ])
        for each in footprints["large"]
    ]  # fmt: skip
    return (
        "<h2>What takes how many bytes</h2>"
        '<p class="soft">Bytes of each triangle, pixel, texel and worker process: what stays, and '
        "the most meanwhile. Slopes over three sizes, each in a process of its own; of what "
        "processes have in common nothing is counted.</p>"
        + table(("of each", "step", "kept", "at most"), units)
        + '<p class="soft">The whole process of a large scene, with all that it holds.</p>'
        + table(("", "", "GiB at most"), large)
    )
