"""sources -> verdict.  Who imports whom: core never Blender, and only what stands below it."""

import ast
import re
import subprocess
import sys
import tomllib

import pytest

from penumbra.tools.environment import ENVIRONMENTS, ROOT

# From the ground up: a part of core imports what stands before it, and within itself.
LAYERS = (
    "arrays",
    "pages",
    "layer",
    "optics",
    "scene",
    "images",
    "statistics",
    "settings",
    "sampling",
    "tiles",
    "geometry",
    "bsdf",
    "shading",
    "lights",
    "camera",
    "camera_motion",
    "shutter",
    "film",
    "stars",
    "kept",
    "plan",
    "compile",
    "transport",
    "batches",
    "splits",
    "worker",
    "handover",
    "fresh",
    "workers",
    "render",
    "interactive",
    "__init__",
)
CORE = ROOT / "core"
MODULES = sorted(CORE.rglob("*.py"))
BLENDER = {"bpy", "bmesh", "mathutils", "gpu", "bl_ui", "addon"}


def imports(path):
    """Yield (level, dotted name) of all that a file imports, wherever it does so."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((0, name.name) for name in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.level, node.module
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.level, name.name) for name in node.names)


def layer(path):
    """Return the part of core that a file belongs to."""
    return path.relative_to(CORE).with_suffix("").parts[0]


def name_of(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_a_part_of_core_imports_only_what_stands_below_it(path):
    depth = len(path.relative_to(CORE).parts)
    for level, name in imports(path):
        assert level <= depth, f"{name} is outside of core"
        if level == depth:
            found = name.split(".")[0]
            assert LAYERS.index(found) < LAYERS.index(layer(path)), f"{found} is not below"


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_core_imports_itself_relatively_and_blender_never(path):
    outside = {name.split(".")[0] for level, name in imports(path) if level == 0}
    assert not outside & {"penumbra", "core", *BLENDER}


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_only_one_file_imports_embreex(path):
    found = any(name.split(".")[0] == "embreex" for _, name in imports(path))
    assert found == (name_of(path) == "core/geometry/accel.py")


def test_modules_of_a_part_do_not_import_each_other_in_a_circle():
    graph = {}
    for path in MODULES:
        part = path.parent
        named = {name for level, name in imports(path) if level == 1 and part != CORE}
        graph[path] = {part / f"{name.split('.')[0]}.py" for name in named}

    def follow(path, trail):
        assert path not in trail, f"circle: {[name_of(each) for each in (*trail, path)]}"
        for each in graph.get(path, ()):
            follow(each, (*trail, path))

    for path in graph:
        follow(path, ())


def test_core_is_imported_where_there_is_no_blender():
    code = (
        "import sys\n"
        f"for name in {sorted(BLENDER - {'addon'})}: sys.modules[name] = None\n"
        "import pkgutil, importlib, penumbra.core as core\n"
        "for each in pkgutil.walk_packages(core.__path__, 'penumbra.core.'):\n"
        "    importlib.import_module(each.name)\n"
        "found = [name for name in sys.modules if name.startswith('penumbra.')]\n"
        "assert 'penumbra.core.geometry.accel' in found\n"
        "assert not [name for name in found if not name.startswith('penumbra.core')], found\n"
    )
    subprocess.run([sys.executable, "-I", "-c", code], check=True, timeout=120)


def test_penumbra_is_this_checkout():
    import penumbra

    assert ROOT.samefile(penumbra.__path__[0])


def test_every_folder_of_modules_is_in_the_list_of_packages():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    tops = ("core", "addon", "tools")
    folders = {path.parent for top in tops for path in (ROOT / top).rglob("*.py")}
    names = {".".join(("penumbra", *path.relative_to(ROOT).parts)) for path in folders}
    assert set(listed["tool"]["setuptools"]["packages"]) == {"penumbra", *names}


def test_the_version_is_written_alike_in_both_its_places():
    import penumbra

    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text("utf-8"))
    assert manifest["version"] == penumbra.__version__


def test_this_environment_has_exactly_its_pins():
    """What is installed is what is pinned, so nothing was resolved by chance."""
    from importlib.metadata import distributions

    def plain(name):
        return re.sub(r"[-_.]+", "-", name).lower()

    found = {plain(each.name): each.version for each in distributions()}
    wanted = next((e for e in ENVIRONMENTS if sys.prefix == str(e.folder / "venv")), None)
    if wanted is None:
        pytest.skip("this is not an environment of dev.py")
    for pin in wanted.pins:
        name, _, version = pin.partition("==")
        assert found[plain(name)] == version
    subprocess.run([sys.executable, "-I", "-m", "pip", "check"], check=True, timeout=120)
