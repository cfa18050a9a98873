"""pytest -> tests with Blender at hand.  The fixture `blender` runs code in a Blender of its own.

bpy keeps one global state, can crash or hang when it is unloaded, and must not take pytest
with it.  So `blender(function, *arguments)` starts a new process of this interpreter, imports
the function's test module there, calls the function and hands back what it returns (pickled).
The function imports bpy itself; the module must not do so at its top.
"""

import faulthandler
import importlib.util
import os
import pickle
import subprocess
import sys
import traceback
from pathlib import Path

import pytest

os.environ["PENUMBRA_CHECK"] = "1"  # before penumbra.core.arrays is imported anywhere
os.environ["PENUMBRA_OIDN"] = ""  # noise is what tests look at; those of the denoiser bring it back

TIMEOUT = 600  # seconds until a Blender that hangs is killed


class Blender:
    """Starts Blenders; see the top of this file."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.count = 0

    def run(self, function, *arguments, environment=None) -> subprocess.CompletedProcess:
        """Run a function; return the ended process, whatever became of it."""
        self.count += 1
        stem = self.folder / f"{self.count:03}"
        stem.with_suffix(".in").write_bytes(pickle.dumps(arguments))
        where = sys.modules[function.__module__].__file__
        command = [sys.executable, __file__, where, function.__name__, str(stem)]
        return subprocess.run(
            command,
            cwd=self.folder,
            env={**os.environ, "TMPDIR": str(self.folder), **(environment or {})},
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT,
        )

    def __call__(self, function, *arguments, environment=None):
        """Run a function and return its result; an exception in there fails the test."""
        process = self.run(function, *arguments, environment=environment)
        result = self.folder / f"{self.count:03}.out"
        if process.returncode or not result.exists():
            pytest.fail(
                f"{function.__name__} ended with code {process.returncode}\n"
                f"{process.stdout}\n{process.stderr}",
                pytrace=False,
            )
        return pickle.loads(result.read_bytes())


@pytest.fixture(scope="session")
def blender(tmp_path_factory) -> Blender:
    """Run functions in a Blender of their own: `blender(function, *arguments)`."""
    if importlib.util.find_spec("bpy") is None:
        if os.environ.get("PENUMBRA_REQUIRE_BPY"):
            pytest.fail("bpy is not installed, and PENUMBRA_REQUIRE_BPY asks for it")
        pytest.skip("needs the bpy module")
    return Blender(tmp_path_factory.mktemp("blender"))


def _inside(where: str, name: str, stem: str) -> int:
    """Be the process that `Blender.run` starts; return its exit code."""
    faulthandler.enable()
    sys.path[0] = str(Path(where).parent)
    module = importlib.import_module(Path(where).stem)
    arguments = pickle.loads(Path(stem + ".in").read_bytes())
    try:
        result = getattr(module, name)(*arguments)
    except BaseException:
        traceback.print_exc()
        return 1
    Path(stem + ".out").write_bytes(pickle.dumps(result))
    return 0


if __name__ == "__main__":
    code = _inside(*sys.argv[1:])
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
