"""a machine -> a suitable Python interpreter.  Where one may be, and what makes it suitable.

Blender's `bpy` wheels each need one version of CPython exactly.  The interpreter that runs
`dev.py` comes first; then names on PATH, pyenv's and uv's folders, the usual places of each
system, and Windows' launcher and registry.
"""

from __future__ import annotations

import functools
import glob
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Iterable, Iterator, NamedTuple

PROBE = """
import importlib.util as u, json, platform, sys, sysconfig
print(json.dumps([sys.executable, list(sys.version_info[:3]), platform.python_implementation(),
    bool(sysconfig.get_config_var("Py_GIL_DISABLED")), sys.platform, platform.machine(),
    all(u.find_spec(name) for name in ("venv", "ensurepip"))]))
"""
SYSTEMS = {"linux": "linux", "win32": "windows", "darwin": "macos"}
MACHINES = {"x86_64": "x64", "amd64": "x64", "arm64": "arm64", "aarch64": "arm64"}


class Python(NamedTuple):
    """One interpreter that was found: its path, version and platform (as `linux-x64`)."""

    path: str
    version: tuple[int, ...]
    platform: str
    flaw: str = ""

    def suits(self, version: tuple[int, int], platforms: tuple[str, ...]) -> bool:
        """Tell whether it is that version, on one of these platforms, and can make a venv."""
        return self.version[:2] == version and self.platform in platforms and not self.flaw


@functools.lru_cache(maxsize=None)
def examine(command: tuple[str, ...]) -> Python | None:
    """Ask the interpreter what it is; None if `command` does not start one."""
    try:
        answer = subprocess.run(
            [*command, "-I", "-c", PROBE], capture_output=True, text=True, timeout=30, check=True
        )
        path, version, kind, free, system, machine, venv = json.loads(answer.stdout)
    except (OSError, ValueError, subprocess.SubprocessError):
        return None
    platform = f"{SYSTEMS.get(system, system)}-{MACHINES.get(machine.lower(), machine)}"
    flaw = ""
    if kind != "CPython" or free:
        flaw = f"is {kind if kind != 'CPython' else 'free-threaded'}, not the standard CPython"
    elif not venv:
        flaw = "lacks the venv module (Debian, Ubuntu: apt-get install python3-venv)"
    return Python(path, tuple(version), platform, flaw)


def dotted(version: tuple[int, ...], dot: str = ".") -> str:
    """Return a version as text."""
    return dot.join(map(str, version))


def candidates(version: tuple[int, int]) -> Iterator[list[str]]:
    """Yield the commands by which this machine may start that version of Python."""
    if sys.version_info[:2] == version:
        yield [sys.executable]
    dot, plain = dotted(version), dotted(version, "")
    home = Path.home()
    pyenv = Path(os.environ.get("PYENV_ROOT") or home / ".pyenv")
    patterns = [
        f"{pyenv}/versions/{dot}.*/bin/python",
        f"{home}/.local/share/uv/python/cpython-{dot}.*/bin/python{dot}",
        f"/usr/local/bin/python{dot}",
        f"/usr/bin/python{dot}",
        f"/opt/homebrew/bin/python{dot}",
        f"/opt/homebrew/opt/python@{dot}/bin/python{dot}",
        f"/usr/local/opt/python@{dot}/bin/python{dot}",
        f"/Library/Frameworks/Python.framework/Versions/{dot}/bin/python{dot}",
    ]
    if os.name == "nt":
        yield ["py", f"-{dot}"]
        yield from ([path] for path in _windows_registry(dot))
        patterns = [
            f"{pyenv}/pyenv-win/versions/{dot}.*/python.exe",
            f"{os.environ.get('LOCALAPPDATA', home)}/Programs/Python/Python{plain}/python.exe",
            f"{os.environ.get('PROGRAMFILES', 'C:/Program Files')}/Python{plain}/python.exe",
        ]
    for name in (f"python{dot}", "python3", "python"):
        yield [name]
    for pattern in patterns:
        yield from ([path] for path in sorted(glob.glob(pattern), reverse=True))  # noqa: PTH207


def _windows_registry(dot: str) -> Iterator[str]:
    if sys.platform != "win32":
        return
    import winreg

    for hive in (winreg.HKEY_CURRENT_USER, winreg.HKEY_LOCAL_MACHINE):
        try:
            key = rf"SOFTWARE\Python\PythonCore\{dot}\InstallPath"
            yield str(Path(winreg.QueryValue(hive, key)) / "python.exe")
        except OSError:
            continue


def find(
    version: tuple[int, int], platforms: tuple[str, ...], commands: Iterable[list[str]]
) -> tuple[Python | None, list[str]]:
    """Return the first suitable interpreter, and what was wrong with those of the right version."""
    flaws = []
    for command in commands:
        python = examine(tuple(command))
        if python is None or python.version[:2] != version:
            continue
        if python.suits(version, platforms):
            return python, flaws
        flaw = python.flaw or f"is for {python.platform}, which has no such Blender"
        flaws.append(f"{python.path} {flaw}")
    return None, flaws
