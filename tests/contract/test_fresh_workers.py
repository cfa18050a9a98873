"""fresh workers -> the picture of threads, by processes that share nothing, whatever happens."""

import gc
import os
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from penumbra.core import fresh, render, workers
from penumbra.core.arrays import F32
from penumbra.core.geometry.objects import EVERY_RAY
from penumbra.core.handover import Block, pack, unpack
from penumbra.core.shading.tracing import compile_tracer
from penumbra.core.workers import LEAST, LEAST_FRESH, Processes, Threads, hire
from penumbra.tests.support import slow
from penumbra.tools.environment import ROOT
from tests.contract.test_workers import CASES, FLOOR, children, plan, rendering
from tests.support import scenes as s

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/stat").exists(), reason="what is left of processes is read from /proc"
)
HALF = s.Material(
    "Half",
    s.shader(
        s.node("BsdfTransparent", Color=(0.9, 0.5, 0.3)),
        s.node("BsdfDiffuse", Color=(0.5, 0.5, 0.5)),
        "MixShader",
        0.3,
    ),
)
MORE = {
    "shaders": (
        (FLOOR, *(s.put(s.quad((1, 0, 0), (0, 0, 1), (x, 0, 1)), HALF) for x in (0, 1))),
        {},
    ),
}
PATIENCE = 60.0  # seconds that a process may take to start, on a machine that does other things


def ready(processes):
    """Wait until all are; return them."""
    end = time.monotonic() + PATIENCE
    while not all(each.is_ready or each.is_lost for each in processes):
        for each in processes:
            each.look()
        assert time.monotonic() < end
        time.sleep(0.01)
    return processes


@pytest.fixture(name="at_once")
def fixture_at_once(monkeypatch):
    """Have renders wait for their processes; return these."""
    begun, start = [], fresh.start

    def started(*of):
        begun.extend(ready(start(*of)))
        return begun

    monkeypatch.setattr(fresh, "start", started)
    return begun


def open_files():
    """Return how many files this process has open."""
    gc.collect()
    return len(list(Path("/proc/self/fd").iterdir()))


@pytest.fixture(autouse=True)
def fixture_nothing_is_left():
    before, files = children(), open_files()
    yield
    assert children() <= before
    end = time.monotonic() + 5
    while open_files() > files and time.monotonic() < end:
        time.sleep(0.01)  # threads that hand over or listen end by themselves
    assert open_files() <= files


def both():
    """Return the pictures of threads and of fresh processes."""
    described = plan(FLOOR, workers="FRESH")
    return render(replace(described, workers="THREADS"), threads=1), render(described, threads=2)


@pytest.mark.parametrize("case", (*CASES, *MORE))
def test_fresh_processes_give_the_bits_that_threads_give(case, at_once):
    things, settings = (CASES | MORE)[case]
    described = plan(*things, **(settings | {"workers": "FRESH"}))
    alone = render(replace(described, workers="THREADS"), threads=1)
    for count in (2, 3):
        at_once.clear()
        shared = render(described, threads=count)
        assert shared.statistics["processes"] == count
        assert sum(each.memory > 0 for each in at_once) >= 2  # these have worked
        assert shared.complete
        assert shared.notes == ()
        np.testing.assert_array_equal(shared.film.sums, alone.film.sums)
        np.testing.assert_array_equal(shared.film.counts, alone.film.counts)
        for key in ("rays_camera", "rays_shadow", "rays_transmission"):
            assert shared.statistics[key] == alone.statistics[key]


@pytest.mark.usefixtures("at_once")
def test_threads_do_the_work_of_processes_that_are_killed(monkeypatch):
    ask = fresh.FreshProcess.ask

    def killed(self, *of):
        os.kill(self._process.pid, signal.SIGKILL)
        return ask(self, *of)

    monkeypatch.setattr(fresh.FreshProcess, "ask", killed)
    alone, shared = both()
    assert "2 of 2 processes failed" in shared.notes[0].what
    np.testing.assert_array_equal(shared.film.sums, alone.film.sums)


@pytest.mark.usefixtures("at_once")
def test_threads_do_the_work_of_processes_that_wait_for_ever(monkeypatch):
    ask = fresh.FreshProcess.ask

    def stopped(self, *of):
        os.kill(self._process.pid, signal.SIGSTOP)
        return ask(self, *of)

    monkeypatch.setattr(fresh, "PATIENCE", 15)
    monkeypatch.setattr(fresh.FreshProcess, "ask", stopped)
    alone, shared = both()
    assert "2 of 2 processes failed" in shared.notes[0].what
    np.testing.assert_array_equal(shared.film.sums, alone.film.sums)


def test_processes_that_only_take_long_are_waited_for(monkeypatch, at_once):
    monkeypatch.setattr(fresh, "PATIENCE", 30)
    monkeypatch.setattr(rendering, "_sample", slow.sample)
    picture = render(plan(FLOOR, samples=1, workers="FRESH"), threads=2)
    assert picture.notes == ()
    assert all(each.memory > 0 for each in at_once)  # they have worked


def test_an_interrupt_of_the_terminal_is_for_the_parent_alone(monkeypatch, at_once):
    ask = fresh.FreshProcess.ask

    def interrupted(self, *of):
        os.kill(self._process.pid, signal.SIGINT)
        return ask(self, *of)

    monkeypatch.setattr(fresh.FreshProcess, "ask", interrupted)
    _, shared = both()
    assert shared.notes == ()
    assert any(each.memory > 0 for each in at_once)


def test_threads_work_until_a_process_is_ready(monkeypatch):
    monkeypatch.setattr(fresh, "START", "import time; time.sleep(3600)")
    alone, shared = both()
    assert shared.statistics["processes"] == 0
    assert shared.notes == ()
    np.testing.assert_array_equal(shared.film.sums, alone.film.sums)


@pytest.mark.usefixtures("at_once")
def test_processes_that_do_not_start_are_told(monkeypatch):
    monkeypatch.setattr(fresh, "START", "raise ImportError")
    alone, shared = both()
    assert "2 of 2 processes failed" in shared.notes[0].what
    np.testing.assert_array_equal(shared.film.sums, alone.film.sums)


@pytest.mark.usefixtures("at_once")
def test_what_cannot_be_sent_is_named_and_threads_work(monkeypatch):
    def fail(*of):
        raise TypeError("cannot pickle 'Suzanne'")

    monkeypatch.setattr(fresh, "pack", fail)
    alone, shared = both()
    assert "Suzanne" in shared.notes[0].what
    np.testing.assert_array_equal(shared.film.sums, alone.film.sums)


@pytest.mark.usefixtures("at_once")
def test_a_render_that_is_stopped_waits_for_no_process():
    described = plan(FLOOR, samples=10_000, workers="FRESH")
    begun = time.monotonic()
    picture = render(described, 2, lambda now: now.sample > 0)
    assert not picture.complete
    assert picture.film.counts.any()
    assert time.monotonic() - begun < PATIENCE


def test_processes_end_with_their_parent_and_do_not_hold_its_output():
    code = """
        import sys
        sys.path.insert(0, sys.argv[1])
        from tests.contract import test_fresh_workers as t
        start = t.fresh.start
        def started(*of):
            processes = t.ready(start(*of))
            print(*(each._process.pid for each in processes), flush=True)
            return processes
        t.fresh.start = started
        t.render(t.plan(t.FLOOR, workers="FRESH", samples=1_000_000), 2)
    """
    program = [sys.executable, "-c", textwrap.dedent(code), str(ROOT)]
    path = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen(program, stdout=subprocess.PIPE, env=path)
    pids = [int(pid) for pid in parent.stdout.readline().split()]
    assert len(pids) == 2
    parent.kill()
    parent.stdout.read()  # comes to its end
    parent.stdout.close()
    parent.wait()
    deadline = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in pids) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


def test_what_takes_a_while_to_start_is_for_renders_that_take_longer(monkeypatch):
    monkeypatch.setattr(workers, "CAN_FORK", False)
    begun = [SimpleNamespace(close=lambda: None)]
    monkeypatch.setattr(fresh, "start", lambda plan, work, count: begun)
    described = plan(FLOOR, workers="AUTO", samples=2)
    for pixels, kind in ((LEAST, Threads), (LEAST_FRESH // 2, Processes)):
        found = hire(described, rendering._sample, 2, pixels)
        found.close()
        assert isinstance(found, kind)


def test_an_interpreter_is_found_beside_blender(monkeypatch, tmp_path):
    assert fresh.interpreter() == sys.executable
    monkeypatch.setattr(sys, "executable", str(tmp_path / "blender"))
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(sys, "base_prefix", str(tmp_path))
    assert fresh.interpreter() is None
    picture = render(plan(FLOOR, workers="FRESH"), threads=2)
    assert "no Python" in picture.notes[0].what
    (tmp_path / "bin").mkdir()
    own = tmp_path / "bin" / f"python{sys.version_info[0]}.{sys.version_info[1]}"
    own.touch()
    assert fresh.interpreter() == str(own)


def test_arrays_that_are_handed_over_are_apart_and_have_room_behind_them():
    block = Block()
    arrays = [np.arange(count, dtype=F32) for count in (1, 1000, 7, 0)]
    data, place, spans = pack(arrays, block)
    found = unpack(data, os.dup(place) if isinstance(place, int) else place, spans)
    for one, other in zip(arrays, found, strict=True):
        np.testing.assert_array_equal(one, other)
    for (_, end), (begin, _) in zip(spans, spans[1:], strict=False):
        assert begin % 64 == 0 and begin - end >= 64
    found[0][0] = 5  # seen by nobody else
    assert unpack(data, os.dup(place) if isinstance(place, int) else place, spans)[0][0] == 0
    block.close()


def test_parts_that_other_rays_see_keep_that_and_share_their_tree():
    hidden = s.replace(FLOOR, name="Hidden", seen_by=replace(FLOOR.seen_by, diffuse=False))
    accel = plan(FLOOR, hidden).accel
    tracer = compile_tracer(accel, None)
    block = Block()
    data, place, spans = pack((accel, tracer), block)
    again, traced = unpack(data, os.dup(place) if isinstance(place, int) else place, spans)
    block.close()
    assert len(again.parts) == len(traced.whole.parts) == len(accel.parts) > 1
    for part, other, own in zip(again.parts, traced.whole.parts, accel.parts, strict=True):
        assert part.scene is other.scene
        assert part.traits == own.traits
        assert other.traits.seen_by == EVERY_RAY


def test_the_frame_is_kept_until_the_processes_have_it(monkeypatch):
    """On Windows it would be gone, and what they open empty."""
    begun, closed = [], []
    start, close = fresh.start, Block.close

    def started(*of):
        begun.extend(start(*of))
        return begun

    def record(block):
        closed.append([each._has_frame.is_set() for each in begun])  # or has ended
        close(block)

    monkeypatch.setattr(fresh, "START", "import time; time.sleep(3600)")
    monkeypatch.setattr(fresh, "start", started)
    monkeypatch.setattr(Block, "close", record)
    both()
    end = time.monotonic() + PATIENCE
    while not closed and time.monotonic() < end:
        time.sleep(0.01)
    assert closed == [[True, True]]
