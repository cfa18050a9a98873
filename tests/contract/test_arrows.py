"""modules, README -> verdict.  Every module says in its first line what goes in and comes out."""

import pytest

from penumbra.tools import stages
from penumbra.tools.environment import ROOT

FILES = [*stages.modules("core", "addon", "tools", "benchmarks", "parity"), *ROOT.glob("*.py")]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_the_first_line_of_a_module_is_an_arrow(path):
    stages.arrow(stages.first_line(path))


@pytest.mark.parametrize("line", ["", "a -> b", "a b.", " -> b.", "a -> .", "Renders. a -> b"])
def test_what_is_not_an_arrow_is_refused(line):
    with pytest.raises(ValueError, match="is not"):
        stages.arrow(line)


def test_an_arrow_is_parted_from_the_sentence_after_it():
    assert stages.arrow("a, b -> c.d.  The rest.") == ("a, b -> c.d", "The rest.")
    assert stages.arrow("a, b -> c.d.") == ("a, b -> c.d", "")


def test_the_table_in_the_readme_is_the_modules_first_lines():
    _, inside, _ = stages.split((ROOT / "README.md").read_text("utf-8"))
    assert inside == stages.table(), "run: python3 dev.py stages"
