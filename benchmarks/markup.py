"""rows -> HTML.  The tables of the page."""

from collections.abc import Sequence
from html import escape


def table(head: Sequence[str], rows: Sequence[str]) -> str:
    """Return a table; its rows are made by `row`."""
    cells = "".join(f"<th>{escape(each)}</th>" for each in head)
    return (
        f'<div class="wide"><table><thead><tr>{cells}</tr></thead>'
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def row(cells: Sequence[str], kind: str = "") -> str:
    """Return a row of cells, which are HTML already; kind: of page.css."""
    name = f' class="{kind}"' if kind else ""
    return f"<tr{name}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
