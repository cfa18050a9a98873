"""settings, statistics, examples, README -> verdict.  README's tables and the code say the same."""

import pytest

from penumbra.core.settings import OPTIONS
from penumbra.core.statistics import STATISTICS
from penumbra.tools.environment import ROOT

README = (ROOT / "README.md").read_text("utf-8")
EXAMPLES = sorted((ROOT / "examples").glob("*.blend"))


def _default(value):
    if isinstance(value, bool):
        return "on" if value else "off"
    return f"`{value}`" if isinstance(value, str) else f"{value:g}"


@pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
def test_the_readme_has_each_setting_its_default_and_whether_it_is_honoured(option):
    rows = [line for line in README.splitlines() if line.startswith(f"| `{option.name}` |")]
    assert len(rows) == 1
    assert rows[0].split("|")[2].strip() == _default(option.default)
    assert ("*(not yet)*" in rows[0]) == bool(option.awaits)
    for identifier, _, _ in option.choices:
        assert f"`{identifier}`" in rows[0]


@pytest.mark.parametrize("row", STATISTICS, ids=lambda row: row.key)
def test_the_readme_has_each_statistic(row):
    assert f"| `{row.key}` | {row.unit} | {row.meaning} |" in README


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_small_and_has_its_script_and_its_picture_in_the_readme(path):
    assert path.with_suffix(".py").exists()
    assert path.stat().st_size < 300_000
    picture = f"examples/pictures/{path.stem}.png"
    assert f"({picture})" in README
    assert (ROOT / picture).stat().st_size < 300_000
