"""results -> an HTML page.  A row for each scene, with its pictures in it; no other files."""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from .results import VERDICTS, Result, summary
from .statistics import BLOCK_MARGIN, PICTURE_MARGIN, RATIO_ERROR, K

STYLE = """
body { font: 14px/1.4 sans-serif; margin: 2em; background: #fff; color: #222 }
table { border-collapse: collapse } td, th { padding: 4px 10px; vertical-align: top }
tr { border-top: 1px solid #ccc } th { text-align: left; position: sticky; top: 0;
background: #eee } img { width: 128px; image-rendering: pixelated; display: block }
figure { margin: 0 6px 0 0; display: inline-block; font-size: 11px; color: #666 }
.same { color: #070 } .known, .absent, .reference { color: #666 }
.differs, .noisy, .failed { color: #b00; font-weight: bold } small { color: #666 }
"""


def write_page(path: Path, document: dict[str, Any], results: Sequence[Result]) -> None:
    """Write the page: the summary, then what fails, then the rest in the order of the suite."""
    ordered = sorted(results, key=lambda result: not result.fails)
    head = f"Blender {document['blender']}, Penumbra {document['penumbra']}"
    rule = (
        f"A scene is the same if |deviation| - {K:g} se is at most {BLOCK_MARGIN:.1%} in every "
        f"block of 16 x 16 pixels and {PICTURE_MARGIN:.1%} over the picture, in luminance, alpha "
        f"and each colour, with se at most {RATIO_ERROR:.1%} in every block. Red: Penumbra is "
        "brighter; blue: Cycles is."
    )
    columns = "<tr><th>scene<th>verdict<th>pictures<th>worst block, picture<th>renders</tr>"
    rows = "\n".join(_row(result) for result in ordered)
    meanings = ", ".join(f"{name}: {meaning}" for name, (_, meaning) in VERDICTS.items())
    path.write_text(
        f"<!doctype html><meta charset=utf-8><title>Parity</title><style>{STYLE}</style>"
        f"<h1>Penumbra and Cycles</h1><p>{escape(head)}</p><p><b>{len(results)} scenes: "
        f"{escape(summary(results))}</b></p><p>{escape(rule)}</p><p><small>{escape(meanings)}"
        f"</small></p><table>{columns}{rows}</table>\n",
        encoding="utf-8",
    )


def _row(result: Result) -> str:
    figures = "".join(
        f"<figure><img src='data:image/png;base64,{data}'>{escape(name)}</figure>"
        for name, data in result.pictures.items()
    )
    numbers = ""
    if result.comparison:
        c = result.comparison
        numbers = f"{c.block}<br>{c.picture}<br>{c.failed_blocks} of {c.number_of_blocks} blocks"
        numbers += f"<br>largest se {c.error:.2%}"
        numbers += f"<br>FLIP {result.flip:.4f}" if result.flip is not None else ""
    engines = "<br>".join(
        f"{name}: {e['seeds']:.0f} x {e['samples']:.0f} samples, {e['seconds']:.1f} s"
        for name, e in result.engines.items()
    )
    notes = "".join(f"<br><small>not honoured: {escape(note)}</small>" for note in result.notes)
    return (
        f"<tr><td><b>{escape(result.name)}</b><br>{escape(result.shows)}{notes}"
        f"<td class={result.verdict}>{result.verdict}<br><small>{escape(result.reason)}</small>"
        f"<td style='white-space: nowrap'>{figures}<td>{numbers}<td>{engines}</tr>"
    )
