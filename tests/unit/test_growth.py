"""made-up measurements -> slopes, predictions, bounds, bytes.  What is said of growth is so."""

import ctypes
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from penumbra.benchmarks.bounds import _bytes, roof
from penumbra.benchmarks.footprint import MAKERS, STATUS
from penumbra.benchmarks.growth import memory_section, scaling_section, stages_section
from penumbra.benchmarks.interpreter import Watch, lock_address, predictions, speedup
from penumbra.benchmarks.memory import QUICK, SIZES, made, row, whole
from penumbra.benchmarks.page import merged
from penumbra.benchmarks.process import WorkerError
from penumbra.benchmarks.scaling import measure_scaling, point, shared, slope
from penumbra.benchmarks.stages import compared

has_proc = pytest.mark.skipif(not STATUS.exists(), reason="/proc is Linux's")
has_lock = pytest.mark.skipif(lock_address() is None, reason="the lock's place is not known")


# --- Time -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("power", [0.0, 0.4, 1.0])
def test_a_slope_is_the_power_with_which_time_grows(power):
    points = [{"value": 2**k, "sampling": 3 * (2**k + 1) ** power} for k in range(6)]
    assert slope(points, offset=1) == pytest.approx(power, abs=1e-12)


def test_a_point_has_the_medians_of_its_rounds():
    runs = [{"sampling": s, "rest": 2 * s, "parts": {"build": 3 * s}} for s in (5.0, 1.0, 2.0)]
    found = point(7, runs)
    assert found["value"] == 7 and found["all"] == [5.0, 1.0, 2.0]
    assert (found["sampling"], found["rest"], found["parts"]) == (2.0, 4.0, {"build": 6.0})


class FakeWorker:
    """Answers like `worker.py`: time in proportion to the value; Cycles takes twice as long."""

    def __init__(self):
        self.asked = []

    def call(self, name, **way):
        if name == "lock":
            return {"pid": 1, "address": None}
        self.asked.append((way["axis"], way["value"]))
        seconds = (way["value"] + 1) * (2 if way["engine"] == "CYCLES" else 1)
        found = {"sampling": seconds, "rest": 1.0, "parts": {}, "begin": 0.0, "end": seconds}
        is_split = way.get("workers") == "PROCESSES"
        return found | {"own": seconds / 10 if is_split else seconds, "processes": int(is_split)}


def test_all_axes_are_measured_in_turn_with_their_slopes(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    workers = {"CYCLES": FakeWorker(), "PENUMBRA": FakeWorker()}
    found = measure_scaling(workers, 2, True, lambda _: None)
    for axis in found["axes"]:
        assert len(axis["engines"]["CYCLES"]) >= 5
        assert axis["slopes"]["PENUMBRA"] == pytest.approx(axis["slopes"]["CYCLES"])
    bounces = next(axis for axis in found["axes"] if axis["name"] == "bounces")
    assert bounces["slopes"]["PENUMBRA"] == pytest.approx(1)
    asked = [value for axis, value in workers["CYCLES"].asked if axis == "bounces"]
    assert asked == [*asked[:5], *asked[4::-1]]  # there and back
    drawn = ElementTree.fromstring(f"<div>{scaling_section(found)}</div>")
    assert len(drawn.findall(".//svg[@role='img']")) == len(found["axes"])
    assert "seconds by bounces" in "".join(drawn.itertext())


# --- The interpreter ------------------------------------------------------------------------------


def repaired(taken, count):
    """Return the speedup by the states of a queue (machine repair), for random times."""
    weights = [1.0]
    for waiting in range(count):
        weights.append(weights[-1] * (count - waiting) * taken / (1 - taken))
    return (1 - weights[0] / sum(weights)) / taken


@pytest.mark.parametrize("taken", [0.02, 0.2, 0.8])
@pytest.mark.parametrize("count", [1, 2, 8, 64])
def test_workers_wait_for_one_server_as_queues_do(taken, count):
    assert speedup(taken, count) == pytest.approx(repaired(taken, count))


def test_an_interpreter_that_nobody_or_everybody_needs_is_no_queue():
    assert predictions(0.0, (2, 64)) == {"2": 2.0, "64": pytest.approx(64)}
    assert predictions(1.0, (2, 64)) == {"2": 1.0, "64": pytest.approx(1)}
    assert predictions(None, (2, 64)) == {}


@has_lock
def test_who_reads_its_own_lock_holds_it():
    assert ctypes.c_int.from_address(lock_address()).value == 1


@has_lock
@pytest.mark.parametrize(("work", "share"), [("while True: pass", 1.0), ("input()", 0.0)])
def test_the_lock_is_seen_from_outside(work, share):
    root = Path(__file__).resolve().parents[2]
    code = f"import interpreter as i; print(i.lock_address(), flush=True); {work}"
    if "while" in work:
        code = f"import interpreter as i; print(i.lock_address(), flush=True)\n{work}"
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [sys.executable, "-c", code], cwd=root / "benchmarks", stdin=pipe, stdout=pipe, text=True
    ) as other:
        try:
            watch = Watch(other.pid, int(other.stdout.readline()))
            while len(watch.seen) < 300:
                assert watch.is_alive
            watch.close()
        finally:
            other.kill()
    last = watch.seen[200:]
    assert watch.share(last[0][0], last[-1][0]) == pytest.approx(share, abs=0.1)
    assert watch.share(-2.0, -1.0) is None


def test_what_threads_and_processes_share_is_told_apart():
    def run(own, processes):
        return {"begin": 0.0, "end": 2.0, "sampling": 4.0, "own": own, "processes": processes}

    class Seen:
        @staticmethod
        def share(begin, end):
            return 0.25

    points = {"THREADS 1": [run(4.0, 0)], "THREADS 2": [run(4.0, 0)], "PROCESSES 2": [run(0.1, 2)]}
    found = shared(points, Seen)
    assert found["taken"] == 0.25 and found["handed"] == pytest.approx(0.025)
    assert found["threads"]["64"] == pytest.approx(4, rel=1e-3)
    assert found["processes"]["8"] > found["threads"]["8"]
    assert shared(points, None)["threads"] == {}
    assert "25.0 %" in scaling_section({"axes": [], "workers": [found | {"name": "box"}]})


# --- Stages ---------------------------------------------------------------------------------------


@dataclass
class Held:
    """Something that a stage hands on."""

    vector: np.ndarray
    table: np.ndarray
    rest: tuple


def test_arrays_of_points_count_once_and_tables_do_not():
    vector, ids = np.zeros((3, 8), np.float32), np.zeros(8, np.int32)
    held = Held(vector, np.zeros((8, 5), np.float32), (ids, vector[:], np.float32(1), None))
    assert _bytes([held, vector, [held]], 8) == 8 * 16
    assert _bytes([np.broadcast_to(np.float32(1), (3, 8))], 8) == 0
    assert _bytes([held], 5) == held.table.nbytes


def test_a_roof_is_of_positive_times():
    found = roof(512, 100)
    assert found["size"] == 512 and all(found[key] > 0 for key in ("byte", "addition", "row"))


def test_a_stage_stands_beside_what_its_bytes_would_take():
    def run(seconds, byte):
        return {
            "path_vertices": 1000,
            "stage_seconds": {"surface": seconds, "film": 2 * seconds},
            "embree_seconds": 3 * seconds,
            "bytes": {"surface": 40_000, "film": 8_000},
            "roof": {"byte": byte, "addition": 0.5, "row": 4.0, "size": 9},
        }

    found = compared([run(2e-6, 0.1), run(1e-6, 0.2)])
    assert found["embree"] == pytest.approx(3)
    surface, film = found["stages"]["surface"], found["stages"]["film"]
    assert surface == pytest.approx({"ns": 1, "bytes": 40, "bound": 8, "passes": 2})
    assert film == pytest.approx({"ns": 2, "bytes": 8, "bound": 0.8, "passes": 4})
    assert ">40<" in stages_section([found | {"name": "box"}])


# --- Memory ---------------------------------------------------------------------------------------

MIB = 1 << 20


STEPS = """
import json
import numpy as np
from penumbra.benchmarks.footprint import Steps
at = Steps()
with at("two"):
    kept = np.ones(64 << 20, np.uint8)
    gone = np.ones(128 << 20, np.uint8)
    del gone
with at("none"):
    pass
print(json.dumps(at.found))
"""


@has_proc
def test_a_step_tells_what_stays_and_what_there_was_at_most():
    # In a process of its own: this one gives back what earlier tests have freed at any time
    path = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    found = json.loads(subprocess.check_output([sys.executable, "-c", STEPS], env=path))
    assert found["two"] == pytest.approx({"kept": 64 * MIB, "peak": 192 * MIB}, rel=0.1)
    assert found["none"]["peak"] == pytest.approx(64 * MIB, rel=0.15)


def test_what_a_unit_takes_is_the_slope():
    def step(kept, peak):
        return {"image": {"kept": kept, "peak": peak}}

    found = [{"units": n, "start": 7, "steps": step(900 + 4 * n, 5000 + 30 * n)} for n in (1, 5, 9)]
    slopes = row("texel: x", found)
    assert slopes["steps"]["image"] == pytest.approx({"kept": 4, "peak": 30})
    assert slopes["units"] == [1, 5, 9]
    large = whole("triangle: flat", found[2])
    assert large["peaks"] == {"image": 7 + 5270}
    text = memory_section({"units": [slopes], "large": [large]})
    assert "<td>4</td><td>30</td>" in text and "9 triangles" in text


def test_everything_has_three_sizes():
    for name in MAKERS:
        kind = name.partition(":")[0].split()[0]
        assert len(SIZES[kind]) == len(QUICK[kind]) == 3


@has_proc
def test_things_are_made_in_processes_of_their_own():
    found = made("triangle: flat, few samples", 200)
    assert found["units"] == 200
    assert list(found["steps"]) == ["description", "tables and Embree", "picture"]
    with pytest.raises(WorkerError, match="nothing"):
        made("nothing", 1)


def test_pages_of_several_files_have_what_each_measured():
    first = {"schema": 1, "quick": False, "stages": [{"name": "old"}], "scaling": {"axes": []}}
    other = {"schema": 1, "quick": False, "stages": [{"name": "new"}], "footprints": {"units": []}}
    found = merged([first, other])
    assert found["stages"] == [{"name": "new"}] and "scaling" in found and "footprints" in found


def test_sections_without_measurements_are_empty():
    assert scaling_section(None) == stages_section([]) == memory_section(None) == ""
