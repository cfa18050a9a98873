"""a purpose -> a private Python environment.  Pinned packages in a venv inside the checkout.

`.env-<Blender version>/` holds `venv/`, a `lock` and, once all is installed, `stamp.json`
with the pins: an interrupted installation has no stamp and is begun anew.  pip is used as
this machine has it configured.  In the environment, `import penumbra` is this checkout.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Iterator, NamedTuple

from . import pythons
from .pythons import dotted

ROOT = Path(__file__).resolve().parent.parent


class Environment(NamedTuple):
    """One version of Blender as a Python module, with all that it needs, pinned."""

    blender: str
    python: tuple[int, int]
    platforms: tuple[str, ...]
    pins: tuple[str, ...]

    @property
    def folder(self) -> Path:
        """Return where it is, or will be, installed."""
        return ROOT / f".env-{self.blender}"

    @property
    def interpreter(self) -> Path:
        """Return its Python."""
        tail = ("Scripts", "python.exe") if os.name == "nt" else ("bin", "python")
        return self.folder.joinpath("venv", *tail)


# The pins, all of them: first what every environment has, then what depends on the Blender.
COMMON = (
    "embreex==4.4.0.post1",
    "cython==3.3.1",
    "requests==2.34.2",
    "certifi==2026.10.18",
    "charset-normalizer==3.5.2",
    "idna==3.20",
    "urllib3==2.8.0",
    "zstandard==0.25.0",
)
NUMPY_1 = ("numpy==1.26.4", "OpenImageIO==3.0.21.0")
NUMPY_2 = (
    "numpy==2.5.5",
    "OpenImageIO==3.2.2.0",
    "cattrs==26.2.1",
    "attrs==26.1.0",
    "typing_extensions==4.16.0",
)
EVERYWHERE = ("linux-x64", "windows-x64", "macos-arm64", "macos-x64")
ENVIRONMENTS = (
    Environment("5.2", (3, 13), EVERYWHERE[:3], ("bpy==5.2.3", *NUMPY_2)),
    Environment("5.0", (3, 11), EVERYWHERE[:3], ("bpy==5.0.1", *NUMPY_1)),
    Environment("4.5", (3, 11), EVERYWHERE, ("bpy==4.5.15", *NUMPY_1)),
    Environment("4.2", (3, 11), EVERYWHERE, ("bpy==4.2.0", *NUMPY_1)),
)
PURPOSES = {
    "render": (),
    "test": (
        "pytest==9.2.0",
        "iniconfig==2.3.1",
        "packaging==26.3",
        "pluggy==1.7.0",
        "pygments==2.21.0",
        "colorama==0.4.6",
        "hypothesis==6.170.15",
        "sortedcontainers==2.4.0",
    ),
    "parity": ("flip-evaluator==1.7",),
    "mitsuba": ("mitsuba==3.9.1", "drjit==1.5.0"),
    "lint": (
        "ruff==0.17.6",
        "mypy==2.4.1",
        "mypy_extensions==1.2.0",
        "typing_extensions==4.16.0",
        "pathspec==1.1.1",
        "librt==0.16.0",
        "ast_serialize==0.13.1",
    ),
}

FINDER = '''"""import penumbra -> this checkout, whatever its folder is called."""
import sys
from importlib.util import spec_from_file_location
from pathlib import Path

ROOT = next(path for path in Path(__file__).parents if path.name.startswith(".env-")).parent


class Checkout:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name != "penumbra":
            return None
        return spec_from_file_location(
            name, ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
        )


sys.meta_path.insert(0, Checkout)
'''


class SetupError(Exception):
    """The environment could not be made; the message says what is missing."""


class NoPython(SetupError):
    """There is no interpreter on this machine that any, or the wanted, Blender can use."""


def say(text: str) -> None:
    """Tell the user what goes on."""
    print(text, file=sys.stderr, flush=True)


def choose(
    among: tuple[Environment, ...] = ENVIRONMENTS, prefer: tuple[int, int] | None = None
) -> tuple[Environment, pythons.Python]:
    """Return the first of `among` that an interpreter of this machine can have, and that one.

    Blenders for Python `prefer` are looked at before the others.
    Raises NoPython with one line that says what is missing.
    """
    flaws: list[str] = []
    for environment in sorted(among, key=lambda each: each.python != prefer):
        commands = pythons.candidates(environment.python)
        python, found = pythons.find(environment.python, environment.platforms, commands)
        if python:
            return environment, python
        flaws.extend(flaw for flaw in found if flaw not in flaws)
    wanted = " or ".join(sorted({dotted(each.python) for each in among}, reverse=True))
    raise NoPython(
        f"Blender needs Python {wanted}, and this machine has none that can be used"
        + (f" ({'; '.join(flaws)})" if flaws else "")
        + ": install one, for example from python.org"
    )


def available() -> list[tuple[Environment, pythons.Python]]:
    """Return the newest and the oldest Blender that the Pythons of this machine can have.

    Raises NoPython.
    """
    newest, oldest = choose(ENVIRONMENTS), choose(ENVIRONMENTS[::-1])
    return [newest] if newest[0] == oldest[0] else [newest, oldest]


def installed(environment: Environment) -> set[str] | None:
    """Return the pins that are completely installed; None if the environment is not whole."""
    try:
        stamp = json.loads((environment.folder / "stamp.json").read_text("utf-8"))
        return set(stamp["pins"]) if environment.interpreter.exists() else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def prepare(environment: Environment, python: pythons.Python, *purposes: str) -> Path:
    """Install what is missing for `purposes`; return the environment's interpreter.

    Raises SetupError.
    """
    wanted = {*COMMON, *environment.pins}.union(*(PURPOSES[each] for each in purposes))
    if wanted <= (installed(environment) or set()):
        return environment.interpreter
    environment.folder.mkdir(exist_ok=True)
    with _locked(environment.folder / "lock"):
        have = installed(environment)
        if not wanted <= (have or set()):
            _install(environment, python, wanted, have)
    return environment.interpreter


def _install(
    environment: Environment, python: pythons.Python, wanted: set[str], have: set[str] | None
) -> None:
    # Begin anew unless what is there is whole and only lacks some packages.
    stamp = environment.folder / "stamp.json"
    names = {pin.partition("==")[0] for pin in wanted}
    if have is None or any(pin.partition("==")[0] in names for pin in have - wanted):
        have = set()
        stamp.unlink(missing_ok=True)
        shutil.rmtree(environment.folder / "venv", ignore_errors=True)
        version = dotted(python.version)
        say(f"Setting up Blender {environment.blender} for Python {version} ({python.path})")
        say(f"in {environment.folder}: once, about 400 MB to download and 1.3 GB on disk.")
        _run([python.path, "-m", "venv", str(environment.folder / "venv")], "venv failed")

    # Install with pip as configured here.  The pins are the whole list, so nothing is resolved,
    # and what an interrupted pip may have left is written again.
    missing = sorted(wanted - have)
    say("Installing " + " ".join(missing))
    pip = [str(environment.interpreter), "-m", "pip", "--disable-pip-version-check", "install"]
    how = ["--only-binary=:all:", "--no-deps", "--ignore-installed"]
    _run([*pip, *how, *missing], "pip could not download or install the packages (see above)")

    # Make `import penumbra` this checkout, and see Blender start.
    ask = "import sysconfig; print(sysconfig.get_path('purelib'))"
    answer = _run(
        [str(environment.interpreter), "-I", "-c", ask], "venv is broken", subprocess.PIPE
    )
    site = Path(answer.stdout.strip())
    (site / "penumbra_checkout.py").write_text(FINDER, "utf-8")
    (site / "penumbra_checkout.pth").write_text("import penumbra_checkout\n", "utf-8")
    _start_blender(environment)

    # The stamp comes last, and whole.
    draft = stamp.with_suffix(".tmp")
    draft.write_text(json.dumps({"pins": sorted(wanted | have)}, indent=1), "utf-8")
    draft.replace(stamp)
    say("Ready.")


def _run(command: list[str], failure: str, stdout=None) -> subprocess.CompletedProcess:
    try:
        return subprocess.run(command, stdout=stdout or sys.stderr, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise SetupError(
            f"{failure} [{error}]" if isinstance(error, OSError) else failure
        ) from None


def _start_blender(environment: Environment) -> None:
    probe = "import bpy, embreex, os; os._exit(0)"
    command = [str(environment.interpreter), "-I", "-c", probe]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    if answer.returncode:
        reason = (answer.stderr.strip().splitlines() or [f"exit code {answer.returncode}"])[-1]
        hint = ""
        if "cannot open shared object file" in reason:
            hint = " (Debian, Ubuntu: apt-get install " + " ".join(DEBIAN_LIBRARIES) + ")"
        raise SetupError(f"Blender {environment.blender} does not start: {reason}{hint}")


DEBIAN_LIBRARIES = (
    "libegl1",
    "libgl1",
    "libgomp1",
    "libice6",
    "libsm6",
    "libx11-6",
    "libxext6",
    "libxfixes3",
    "libxi6",
    "libxkbcommon0",
    "libxrender1",
    "libxt6",
    "libxxf86vm1",
)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold the lock file; the system lets it go when the process ends, however that happens."""
    with path.open("a+b") as file:
        told = False
        while not _try_lock(file.fileno()):
            if not told:
                say("Another dev.py is setting up this environment: waiting for it.")
            told = True
            time.sleep(0.5)
        yield


def _try_lock(number: int) -> bool:
    try:
        if sys.platform == "win32":
            import msvcrt

            msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
