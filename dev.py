"""command -> environment, then what was asked.  Penumbra's one command for all that developers do.

Runs on any Python from 3.8 on, with nothing but the standard library: what needs more runs
in a private environment, which is set up on first use (tools/environment.py).
Exit codes: 0 done; 1 it failed; 2 bad arguments or input.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from tools import arguments, environment
from tools.environment import ENVIRONMENTS, ROOT, SetupError, say
from tools.pythons import dotted

# Runs a script to its end; bpy may crash when it is unloaded, so that it never is.
RUN_SCRIPT = """
import os, runpy, sys
sys.path.insert(0, os.path.dirname(sys.argv[1]))
runpy.run_path(sys.argv[1], run_name="__main__")
sys.stdout.flush()
os._exit(0)
"""


def _command(python: Path, module: str, argv: list[str]) -> list[str]:
    return [str(python), "-I", "-m", module, *argv]


def _call(command: list[str], **options) -> int:
    """Run `command` to its end; Ctrl-C is the command's own affair, its exit code ours."""
    with subprocess.Popen(command, **options) as process:
        before = signal.signal(signal.SIGINT, signal.SIG_IGN)
        try:
            code = process.wait()
        finally:
            signal.signal(signal.SIGINT, before)
    return 128 - code if code < 0 else code


def _newest(*purposes: str) -> Path:
    """Return the interpreter of the newest Blender that this machine can have."""
    return environment.prepare(*environment.choose(), *purposes)


def render(argv: list[str]) -> int:
    """Render a .blend file: FILE.blend -o OUT [options]; render --help lists them."""
    arguments.parse(argv).check()
    chosen = environment.choose(prefer=sys.version_info[:2])
    python = environment.prepare(*chosen, "render")
    command = _command(python, "penumbra.addon.headless", argv)
    if os.name == "posix":
        os.execv(command[0], command)
    return _call(command)


def test(argv: list[str]) -> int:
    """Run the tests on the newest and the oldest Blender here: [--env 5.2] [pytest's options]."""
    chosen, argv = _environment_option(argv)
    runs = [environment.choose(chosen)] if chosen else environment.available()
    lines, worst = [], 0
    for each, python in runs:
        interpreter = environment.prepare(each, python, "render", "test")
        name = f"Blender {each.blender}, Python {dotted(python.version)}"
        say(f"\n== {name} ==")
        start = time.monotonic()
        again = {"PENUMBRA_TESTED_ONCE": "1"} if lines else {}
        code = _call(_command(interpreter, "pytest", argv), cwd=ROOT, env={**os.environ, **again})
        verdict = "passed" if code == 0 else f"FAILED (pytest's exit code {code})"
        lines.append(f"{name}: {verdict} in {time.monotonic() - start:.0f} s")
        worst = max(worst, min(code, 1))
        if code == 130:
            break
    if not chosen and len(runs) == 1:
        lines.append("the other Blenders were not tested: there is no Python for them here")
    say("\n" + "\n".join(lines))
    return worst


def _environment_option(argv: list[str]) -> tuple[tuple[environment.Environment, ...], list[str]]:
    if "--env" not in argv:
        return (), argv
    place = argv.index("--env")
    name = argv[place + 1] if place + 1 < len(argv) else ""
    chosen = tuple(each for each in ENVIRONMENTS if each.blender == name)
    if not chosen:
        known = ", ".join(each.blender for each in ENVIRONMENTS)
        raise arguments.BadInput(f"--env {name!r}: not one of {known}")
    return chosen, argv[:place] + argv[place + 2 :]


def lint(argv: list[str]) -> int:
    """Check style (ruff) and types (mypy, the core)."""
    python = _newest("render", "lint")
    checks = (["ruff", "check", "."], ["ruff", "format", "--check", "."], ["mypy", "core"])
    codes = [_call(_command(python, check[0], check[1:] + argv), cwd=ROOT) for check in checks]
    return max(codes)


def build(argv: list[str]) -> int:
    """Make and validate the extension's zips in dist/, one per platform: [PLATFORM ...]."""
    return _call(_command(_newest("render"), "penumbra.tools.package", argv))


def bench(argv: list[str]) -> int:
    """Measure Penumbra against Cycles; bench --help lists the options."""
    others = [name for name in ("mitsuba",) if {name, f"{name}-llvm", "all"} & {*argv}]
    return _call(_command(_newest("render", "parity", *others), "penumbra.benchmarks", argv))


def parity(argv: list[str]) -> int:
    """Compare scenes, one for each feature, with Cycles; parity --help lists the options."""
    return _call(_command(_newest("render", "parity"), "penumbra.parity", argv))


def stress(argv: list[str]) -> int:
    """Render under extremes and look for what breaks; stress --help lists the options."""
    return _call(_command(_newest("render", "test"), "penumbra.tests.stress", argv))


def examples(argv: list[str]) -> int:
    """Make the example files and their pictures again: [NAME ...]."""
    folder = ROOT / "examples"
    known = sorted({path.stem for path in folder.glob("[!_]*.py")} - {"pictures"})
    for name in argv or known:
        if name not in known:
            raise arguments.BadInput(f"no example {name!r}; there are {', '.join(known)}")

    # The oldest Blender makes the files: every later one can open them.
    maker = environment.prepare(*environment.choose(ENVIRONMENTS[::-1]), "render")
    painter = _newest("render")
    for name in argv or known:
        code = _call([str(maker), "-I", "-c", RUN_SCRIPT, str(folder / f"{name}.py")])
        if code:
            say(f"dev.py examples: {name}.py failed")
            return code
    return _call([str(painter), "-I", str(folder / "pictures.py"), *argv])


def stages(argv: list[str]) -> int:
    """Write README's table of stages again, from the modules' first lines."""
    from tools import stages as table

    try:
        table.write()
    except (OSError, ValueError) as error:
        say(f"dev.py stages: {error}")
        return 1
    return 0


COMMANDS = {
    command.__name__: command
    for command in (render, test, bench, parity, stress, build, lint, examples, stages)
}


def main(argv: list[str]) -> int:
    """Carry out the command; return the exit code."""
    if argv[:1] in (["-h"], ["--help"]):
        print("usage: python3 dev.py COMMAND ...\n")
        print("\n".join(f"  {name:10}{each.__doc__}" for name, each in COMMANDS.items()))
        return 0
    if not argv or argv[0] not in COMMANDS:
        found = f"unknown command {argv[0]!r}" if argv else "which command?"
        say(f"dev.py: {found} One of: {', '.join(COMMANDS)} (--help explains them)")
        return 2
    try:
        return COMMANDS[argv[0]](argv[1:])
    except (arguments.BadInput, environment.NoPython) as error:
        say(f"dev.py {argv[0]}: {error}")
        return 2
    except SetupError as error:
        say(f"dev.py {argv[0]}: {error}")
        return 1
    except KeyboardInterrupt:
        say("Stopped.")
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
