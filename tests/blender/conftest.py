"""zip -> a real Blender.  Installs the extension as a user does.

PENUMBRA_BLENDER is the command that starts Blender (real_blender.sh makes one); the zip is the
one that `dev.py build` made.
"""

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from penumbra.tools.environment import ROOT

COMMAND = shlex.split(os.environ.get("PENUMBRA_BLENDER", ""))
PLATFORM = {"linux": "linux-x64", "win32": "windows-x64", "darwin": "macos-arm64"}
HERE = Path(__file__).parent


class Real:
    """A real Blender, with the extension installed and enabled, in a home of its own."""

    def __init__(self, home: Path) -> None:
        self.home = home

    def __call__(self, *arguments):
        """Run it with arguments; return the ended process."""
        return self._run([*COMMAND, *map(str, arguments)], {}, 300)

    def drive(self, name, timeout=300, **environment):
        """Run a drive in its window, on a virtual screen; return what it found."""
        for path in HERE.glob("*.py"):
            shutil.copy(path, self.home)
        shutil.copy(HERE / "on_screen.sh", self.home)
        target = self.home / f"{name}.json"
        command = [*COMMAND[:-1], "sh", str(self.home / "on_screen.sh"), COMMAND[-1]]
        command += ["--gpu-backend", "opengl", "--window-geometry", "0", "0", "1200", "800"]
        command += ["--python", str(self.home / f"{name}.py")]
        environment["PENUMBRA_FOUND"] = str(target)
        done = self._run(command, environment, timeout)
        said = done.stdout + done.stderr
        assert target.exists(), f"Blender ended with {done.returncode}:\n{said}"
        found = json.loads(target.read_text("utf-8"))
        assert found["error"] == "", f"{found['error']}\n{said}"
        assert done.returncode == 0, said
        assert "Traceback" not in said, said
        return found

    def _run(self, command, environment, timeout):
        """Run a command; what it started goes with it when it takes too long."""
        environ = {**os.environ, "BLENDER_USER_RESOURCES": str(self.home), **environment}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        with subprocess.Popen(
            command, cwd=self.home, env=environ, start_new_session=True, **pipes
        ) as process:
            try:
                said = process.communicate(timeout=timeout)
            except BaseException as error:
                os.killpg(process.pid, signal.SIGKILL)
                said = process.communicate()
                if isinstance(error, subprocess.TimeoutExpired):
                    pytest.fail(f"{command} did not end in {timeout} s:\n{''.join(said)}")
                raise
        return subprocess.CompletedProcess(command, process.returncode, *said)


@pytest.fixture(scope="session")
def real(tmp_path_factory) -> Real:
    """Run the real Blender: `real(arguments...)`, or `real.drive(name)` with its window."""
    if not COMMAND:
        pytest.skip("PENUMBRA_BLENDER does not name a Blender")
    run = Real(tmp_path_factory.mktemp("home"))
    (zipped,) = (ROOT / "dist").glob(f"penumbra-*-{PLATFORM[sys.platform]}.zip")
    copy = run.home / zipped.name
    copy.write_bytes(zipped.read_bytes())
    options = ("--repo", "user_default", "--enable")
    done = run("--background", "--command", "extension", "install-file", *options, copy)
    assert done.returncode == 0, done.stdout + done.stderr
    return run
