"""dev.py -> verdict.  Arguments, the choice of an interpreter, environments, zips."""

import ast
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from penumbra.tools import arguments, environment, package, pythons
from penumbra.tools.environment import COMMON, ENVIRONMENTS, PURPOSES, ROOT
from penumbra.tools.pythons import Python

LINUX = ("linux-x64",)


def dev(*words):
    """Run dev.py to its end; return the exit code and the lines on stderr."""
    command = [sys.executable, str(ROOT / "dev.py"), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    return done.returncode, done.stderr.splitlines()


# ---- arguments


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "which command?"),
        (["paint"], "unknown command 'paint'"),
        (["test", "--env", "3.6"], "not one of 5.2, 5.0, 4.5, 4.2"),
        (["examples", "moon"], "no example 'moon'"),
        (["render"], "required: FILE.blend, -o/--output"),
        (["render", "a.blend"], "required: -o/--output"),
        (["render", "a.blend", "-o", "a.png"], "a.blend does not exist"),
        (["render", ".", "-o", "a.png"], "is a folder"),
        (["render", __file__, "-o", "a.png"], "is not a .blend file"),
        (["render", "a.blend", "-o", "a"], "'a', which has none, is not one of .png, .exr"),
        (["render", "a.blend", "-o", "a.gif"], "'.gif' of 'a.gif' is not one of"),
        (["render", "a.blend", "-o", "a.png", "--samples", "0"], "0 is not within 1 to"),
        (["render", "a.blend", "-o", "a.png", "--samples", "x"], "'x' is not a whole number"),
        (["render", "a.blend", "-o", "a.png", "--seed", "-1"], "-1 is not within 0 to"),
        (["render", "a.blend", "-o", "a.png", "-s", "5", "-e", "4"], "4, is before the first, 5"),
        (["render", "a.blend", "-o", "a.png", "-f", "5..4"], "ends before it starts"),
        (["render", "a.blend", "-o", "a.png", "-f", "9999999"], "is not within"),
        (["render", "a.blend", "-o", "a.png", "-f", "1", "-a"], "does not go together"),
    ],
)
def test_a_slip_on_the_command_line_gives_one_line_and_code_2(words, said):
    code, lines = dev(*words)
    assert code == 2
    assert len(lines) == 1
    assert said in lines[0]


def test_a_target_that_cannot_be_written_is_told_before_anything_starts(tmp_path):
    blend = tmp_path / "a.blend"
    blend.write_bytes(b"BLENDER")
    (tmp_path / "folder.png").mkdir()
    targets = {"nowhere/a.png": "there is no folder", "folder.png": "it is a folder"}
    for target, said in targets.items():
        code, lines = dev("render", blend, "-o", tmp_path / target)
        assert (code, len(lines)) == (2, 1)
        assert said in lines[0]
        code, lines = dev("render", blend, "-o", tmp_path / "a.png", "--report", tmp_path / target)
        assert (code, len(lines)) == (2, 1)
        assert said in lines[0]


@pytest.mark.parametrize(
    ("name", "frame", "numbered", "expected"),
    [
        ("a.png", 7, False, "a.png"),
        ("a.png", 7, True, "a0007.png"),
        ("a##.png", 7, False, "a07.png"),
        ("a##.png", 1234, True, "a1234.png"),
        ("a#_###b.png", 7, False, "a#_007b.png"),
        ("####", -7, True, "-0007"),
        ("a.b.exr", 12345, True, "a.b12345.exr"),
    ],
)
def test_frame_numbers_stand_where_blender_puts_them(name, frame, numbered, expected):
    found = arguments.frame_path(Path("folder#") / name, frame, numbered)
    assert found == Path("folder#") / expected


def test_frames_are_those_asked_for_or_those_of_the_file():
    def frames(*words):
        job = arguments.parse(["a.blend", "-o", "a.png", *words])
        return job.frame_numbers(current=6, start=1, end=9, step=4), job.is_numbered()

    assert frames() == ([6], False)
    assert frames("-f", "3") == ([3], False)
    assert frames("-f", "-3,5..7,1") == ([-3, 5, 6, 7, 1], True)
    assert frames("-a") == ([1, 5, 9], True)
    assert frames("-s", "2", "-e", "6") == ([2, 6], True)
    with pytest.raises(arguments.BadInput, match="the last frame, 0, is before the first, 1"):
        frames("-e", "0")


@pytest.mark.parametrize("name", ["dev.py", "tools/arguments.py", "tools/environment.py",
                                  "tools/pythons.py", "tools/stages.py"])  # fmt: skip
def test_what_must_start_on_an_old_python_is_written_for_it(name):
    ast.parse((ROOT / name).read_text("utf-8"), feature_version=(3, 8))


# ---- the choice of an interpreter


@pytest.fixture
def machine(monkeypatch):
    """Return a function that says which interpreters this machine has, in the order of search."""

    def has(*found):
        table = {python.path: python for python in found}
        monkeypatch.setattr(pythons, "candidates", lambda _: [[path] for path in table])
        monkeypatch.setattr(pythons, "examine", lambda command: table.get(command[0]))

    return has


OLD = Python("old", (3, 11, 7), "linux-x64")
NEW = Python("new", (3, 13, 0), "linux-x64")
OTHER = Python("other", (3, 12, 1), "linux-x64")


def test_the_python_that_runs_dev_comes_first_then_the_newest_blender(machine):
    machine(OTHER, OLD, NEW)
    assert environment.choose(prefer=(3, 11)) == (ENVIRONMENTS[1], OLD)
    assert environment.choose(prefer=(3, 13)) == (ENVIRONMENTS[0], NEW)
    assert environment.choose(prefer=(3, 12)) == (ENVIRONMENTS[0], NEW)
    machine(OTHER, OLD)
    assert environment.choose(prefer=(3, 13)) == (ENVIRONMENTS[1], OLD)


def test_tests_run_on_the_newest_and_the_oldest_blender_there_can_be(machine):
    def blenders():
        return [each.blender for each, _ in environment.available()]

    machine(OLD, NEW)
    assert blenders() == ["5.2", "4.2"]
    machine(OLD)
    assert blenders() == ["5.0", "4.2"]
    machine(NEW)
    assert blenders() == ["5.2"]
    machine(OLD._replace(platform="macos-x64"), NEW._replace(platform="macos-x64"))
    assert blenders() == ["4.5", "4.2"]


def test_where_no_python_suits_one_line_says_why(machine):
    machine(OTHER)
    with pytest.raises(environment.NoPython, match=r"needs Python 3.13 or 3.11, and .* has none"):
        environment.choose()
    machine(NEW._replace(flaw="lacks the venv module"), OLD._replace(platform="linux-arm64"))
    with pytest.raises(environment.NoPython) as caught:
        environment.choose()
    assert "new lacks the venv module" in str(caught.value)
    assert "old is for linux-arm64, which has no such Blender" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_interpreter_is_asked_what_it_is(tmp_path):
    found = pythons.examine((sys.executable,))
    assert found.version == sys.version_info[:3]
    assert not found.flaw
    assert found.suits(sys.version_info[:2], (found.platform,))
    assert not found.suits((3, 8), (found.platform,))
    assert not found.suits(sys.version_info[:2], ("amiga-m68k",))
    assert pythons.examine((str(tmp_path / "none"),)) is None
    assert pythons.examine((sys.executable, "-c", "raise SystemExit(3)")) is None


# ---- environments


@pytest.fixture
def fake(monkeypatch, tmp_path):
    """Return an environment in an empty folder, and the list of what would have been run."""
    commands = []

    def run(command, failure, stdout=None):
        commands.append(command)
        if "venv" in command:
            each.interpreter.parent.mkdir(parents=True)
            each.interpreter.touch()
        if "pip" in command and run.broken:
            raise environment.SetupError(failure)
        return subprocess.CompletedProcess(command, 0, str(tmp_path))

    run.broken = False
    each = ENVIRONMENTS[0]
    monkeypatch.setattr(environment, "ROOT", tmp_path)
    monkeypatch.setattr(environment, "_run", run)
    monkeypatch.setattr(environment, "_start_blender", lambda _: None)
    return each, commands, run


def test_an_environment_is_installed_once(fake):
    each, commands, _ = fake
    for _ in range(2):
        assert environment.prepare(each, NEW, "render") == each.interpreter
        assert len(commands) == 3
    assert environment.installed(each) == {*COMMON, *each.pins}

    # A further purpose only adds; the first one is then still there.
    environment.prepare(each, NEW, "render", "test")
    assert [command for command in commands[3:] if "venv" in command] == []
    assert set(PURPOSES["test"]) <= set(commands[3])
    assert "numpy" not in " ".join(commands[3])
    environment.prepare(each, NEW, "render")
    assert len(commands) == 5


def test_an_installation_that_was_interrupted_is_begun_anew(fake):
    each, commands, run = fake
    run.broken = True
    with pytest.raises(environment.SetupError, match="pip could not"):
        environment.prepare(each, NEW, "render")
    assert environment.installed(each) is None
    litter = each.interpreter.with_name("litter")
    litter.touch()
    run.broken = False
    environment.prepare(each, NEW, "render")
    assert not litter.exists()
    assert environment.installed(each) == {*COMMON, *each.pins}


@pytest.mark.parametrize("stamp", ["", "[]", "{}", '{"pins": 3}', '{"pins": ["numpy==1.0"]}'])
def test_a_stamp_that_is_damaged_or_of_other_pins_counts_for_nothing(fake, stamp):
    each, commands, _ = fake
    environment.prepare(each, NEW, "render")
    (each.folder / "stamp.json").write_text(stamp)
    environment.prepare(each, NEW, "render")
    assert len([command for command in commands if "venv" in command]) == 2


def test_only_one_dev_sets_up_an_environment_at_a_time(tmp_path):
    with environment._locked(tmp_path / "lock"), (tmp_path / "lock").open("a+b") as file:
        assert not environment._try_lock(file.fileno())
    with (tmp_path / "lock").open("a+b") as file:
        assert environment._try_lock(file.fileno())


@pytest.mark.parametrize("each", ENVIRONMENTS, ids=lambda each: each.blender)
def test_every_package_is_pinned_once(each):
    pins = [*COMMON, *each.pins, *(pin for purpose in PURPOSES.values() for pin in purpose)]
    names = [pin.partition("==")[0].lower() for pin in set(pins)]
    assert sorted(names) == sorted(set(names))
    assert all(pin.partition("==")[2] for pin in pins)


# ---- zips


@pytest.fixture
def zips(monkeypatch, tmp_path):
    """Return a function that packs a zip without asking the network for wheels."""

    def download(edition, platform, folder):
        for python in edition.pythons:
            tag = f"cp{python}-cp{python}-{package.PLATFORMS[platform]}"
            (folder / f"embreex-4.4.0.post1-{tag}.whl").write_text("wheel")
        return sorted(folder.iterdir())

    def pack(edition, platform):
        target = tmp_path / "penumbra.zip"
        package.pack(target, edition, platform)
        return target

    monkeypatch.setattr(package, "download", download)
    return pack


@pytest.mark.parametrize("edition", package.EDITIONS, ids=lambda each: each.suffix or "newest")
def test_a_zip_holds_what_blender_needs_and_nothing_else(zips, edition):
    for platform in edition.platforms:
        with zipfile.ZipFile(zips(edition, platform)) as archive:
            names = set(archive.namelist())
            manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
        assert {"__init__.py", "LICENSE", "addon/engine.py", "core/scene.py"} <= names
        tops = {name.split("/")[0] for name in names if "/" in name}
        assert tops == {"addon", "core", "wheels"}
        assert not [n for n in names if n.endswith((".pyc", "headless.py")) or "/." in n]
        assert manifest["platforms"] == [platform]
        assert {name.removeprefix("./") for name in manifest["wheels"]} <= names
        assert len(manifest["wheels"]) == len(edition.pythons)


def test_together_the_zips_of_a_platform_serve_every_blender_once():
    def bounds(edition):
        found = tomllib.loads(edition.versions)
        return found["blender_version_min"], found.get("blender_version_max")

    assert sorted(map(bounds, package.EDITIONS)) == [("4.2.0", "5.0.0"), ("5.0.0", None)]


def test_a_zip_is_valid_to_blender_and_the_same_bytes_each_time(zips, blender):
    first = zips(package.EDITIONS[0], "linux-x64").read_bytes()
    target = zips(package.EDITIONS[0], "linux-x64")
    assert target.read_bytes() == first
    package.validate(target)


def test_what_blender_refuses_fails_the_build(zips, blender, monkeypatch):
    monkeypatch.setattr(package, "manifest", lambda *_: "id = 'no'\n")
    target = zips(package.EDITIONS[0], "linux-x64")
    with pytest.raises(subprocess.CalledProcessError):
        package.validate(target)
