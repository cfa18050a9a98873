"""a few scenes of the parity suite -> verdict.  With few samples: only what is plain counts.

All in one run of `python -m penumbra.parity --quick`, which has a process for each engine.
Seeds are fixed, and deviations count from 1 % and six standard errors on.
"""

import importlib.util
import json
import os
import subprocess
import sys

import pytest

from penumbra.parity.scenes import ALL, KNOWN

NAMES = [scene.name for scene in ALL if "quick" in scene.tags]


def run(folder, *words):
    """Run the suite; return its exit code and the entries of its JSON by name."""
    target = folder / "parity.json"
    command = [sys.executable, "-m", "penumbra.parity", "--json", str(target), *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert target.exists(), done.stdout + done.stderr
    document = json.loads(target.read_text("utf-8"))
    return done.returncode, {entry["name"]: entry for entry in document["scenes"]}


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    if importlib.util.find_spec("bpy") is None:
        if os.environ.get("PENUMBRA_REQUIRE_BPY"):
            pytest.fail("bpy is not installed, and PENUMBRA_REQUIRE_BPY asks for it")
        pytest.skip("needs the bpy module")
    return run(tmp_path_factory.mktemp("parity"), "--quick")


@pytest.mark.parametrize("name", NAMES)
def test_a_scene_has_the_light_of_cycles(quick, name):
    entry = quick[1][name]
    assert entry["verdict"] in ("same", "absent") or name in KNOWN, (
        f"{entry['verdict']} {entry['reason']} {entry['comparison']}"
    )


def test_the_exit_code_tells_whether_all_are_the_same(quick):
    code, entries = quick
    assert code == any(entry["verdict"] in ("differs", "failed") for entry in entries.values())
