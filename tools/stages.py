"""modules' first lines -> README's table of stages.  `dev.py stages` writes it, a test compares.

The first line of a module's docstring is its arrow, `inputs -> outputs.`, and may go on with
a sentence.  The rows follow the way of a picture through the folders.
"""

from __future__ import annotations

import ast
from pathlib import Path

from .environment import ROOT

ORDER = (
    "addon/export/",
    "core/scene.py",
    "core/settings.py",
    "core/plan.py",
    "core/compile",
    "core/render.py",
    "core/camera/",
    "core/optics/",
    "core/sampling/",
    "core/geometry/",
    "core/shading/",
    "core/bsdf/",
    "core/lights/",
    "core/transport/",
    "core/film/",
    "core/stars/",
    "core/",
    "addon/",
)
START, END = "<!-- stages -->\n", "<!-- /stages -->"


def modules(*folders: str) -> list[Path]:
    """Return the Python files of these folders, in the order of the table."""
    found = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    return sorted(found, key=_place)


def _place(path: Path) -> tuple[int, str]:
    name = path.relative_to(ROOT).as_posix()
    index = next((i for i, start in enumerate(ORDER) if name.startswith(start)), len(ORDER))
    return index, name.replace("__init__.py", "")


def first_line(path: Path) -> str:
    """Return the first line of a module's docstring; '' if it has none."""
    return (ast.get_docstring(ast.parse(path.read_text("utf-8"))) or "").partition("\n")[0]


def arrow(line: str) -> tuple[str, str]:
    """Split a first line into its arrow and the sentence after it.  Raises ValueError."""
    head, stop, rest = line.partition(".  ") if ".  " in line else (line[:-1], line[-1:], "")
    before, sign, after = head.partition(" -> ")
    if not (before.strip() and sign and after.strip() and stop):
        raise ValueError(f"{line!r} is not `inputs -> outputs.`")
    return head, rest


def table() -> str:
    """Return the rows of README's table of stages.  Raises ValueError."""
    rows = ["| file | what goes in and comes out | |", "| --- | --- | --- |"]
    for path in modules("core", "addon"):
        name = path.relative_to(ROOT).as_posix().replace("__init__.py", "")
        try:
            head, rest = arrow(first_line(path))
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        cells = (cell.replace("|", "\\|") for cell in (head, rest))
        rows.append("| `{}` | {} | {} |".format(name, *cells))
    return "\n".join(rows) + "\n"


def split(text: str) -> tuple[str, str, str]:
    """Return a README before, in and after its table of stages.  Raises ValueError."""
    before, start, rest = text.partition(START)
    inside, end, after = rest.partition(END)
    if not (start and end):
        raise ValueError(f"README.md has no {START.strip()} or {END}")
    return before + start, inside, end + after


def write() -> None:
    """Write the table into README.md.  Raises ValueError."""
    readme = ROOT / "README.md"
    before, _, after = split(readme.read_text("utf-8"))
    readme.write_text(before + table() + after, "utf-8")
