"""workers -> the same picture by threads and by processes, whatever happens to these."""

import contextlib
import os
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from penumbra.core import compile_plan, fresh, render, splits, workers
from penumbra.core.film.passes import PASSES
from penumbra.core.layer import MATTES, Layer
from penumbra.core.workers import LEAST, Threads, changed, differences, hire
from penumbra.tools.environment import ROOT
from tests.support import scenes as s

pytestmark = pytest.mark.skipif(
    not workers.CAN_FORK, reason="processes are forked where that is safe: on Linux"
)
rendering = sys.modules[render.__module__]
VIEW = s.camera((0, -4, 2), (0, 0, 0.5), size=64, width=80)
FLOOR = s.put(s.quad((5, 0, 0), (0, 5, 0)), s.diffuse(0.7), name="Floor")
STAGE = (
    s.put(s.sphere(0.5), s.glass(), to_world=s.affine(1.0, (-0.6, 0, 0.6)), name="Ball"),
    s.area((1, -1, 3), radiance=5.0, size=(1.5, 1.5)),
    s.world(0.2),
)
# Passes that tell of time are never the same
LAYER = Layer(
    passes=tuple(each.name for each in PASSES if each.name not in ("Vector", "Render Time")),
    mattes=MATTES,
)
CATCHER = replace(FLOOR, is_shadow_catcher=True)
# What happens, in a render that nothing happens to
CASES = {
    "plain": ((FLOOR,), {}),
    "passes": ((FLOOR,), {"layer": LAYER}),
    "shadow catcher": ((CATCHER,), {"film_transparent": True}),
    "adaptive": (
        (FLOOR,),
        {"samples": 128, "use_adaptive_sampling": True, "adaptive_threshold": 0.05},
    ),
}


def plan(*things, layer=None, film_transparent=False, **settings):
    more = {} if layer is None else {"layer": layer}
    described = s.scene(VIEW, *STAGE, *things, film_transparent=film_transparent, **more)
    settings = {
        "workers": "PROCESSES",
        "samples": 20,
        "light_samples": 1,
        "path_reuse": "OFF",
    } | settings
    return replace(compile_plan(described, replace(s.DEFAULTS, **settings)), batch=2048)


def children():
    """Return the processes that this one has begun and not yet waited for."""
    found = set()
    for process in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # others come and go
            parent = int((process / "stat").read_text().rpartition(")")[2].split()[1])
            found |= {int(process.name)} if parent == os.getpid() else set()
    return found


@pytest.fixture(name="spoil")
def fixture_spoil(monkeypatch):
    """Return a function: what is done before each batch, in worker processes alone."""
    parent, sample = os.getpid(), rendering._sample

    def spoil(what):
        def spoilt(*of):
            if os.getpid() != parent:
                what()
            return sample(*of)

        monkeypatch.setattr(rendering, "_sample", spoilt)

    return spoil


@pytest.fixture(autouse=True)
def fixture_none_is_left():
    before = children()
    yield
    assert children() <= before


@pytest.mark.parametrize("case", CASES)
def test_processes_give_the_bits_that_threads_give(case):
    things, settings = CASES[case]
    described = plan(*things, **settings)
    alone = render(replace(described, workers="THREADS"), threads=1)
    assert alone.statistics["processes"] == 0
    for count in (2, 3):
        shared = render(described, threads=count)
        assert shared.statistics["processes"] == count
        assert shared.complete
        assert shared.notes == ()
        np.testing.assert_array_equal(shared.film.sums, alone.film.sums)
        np.testing.assert_array_equal(shared.film.counts, alone.film.counts)
        for (name, one), (_, other) in zip(shared.mattes(), alone.mattes(), strict=True):
            np.testing.assert_array_equal(one, other, err_msg=name)
        for key in ("rays_camera", "rays_shadow", "rays_transmission", "used_light_samples"):
            assert shared.statistics[key] == alone.statistics[key]


def test_processes_know_what_was_measured(monkeypatch):
    pays = {"light_samples": 2, "scatter_samples": 4, "path_reuse": 8}
    monkeypatch.setattr(splits, "choose", lambda names, errors, costs: pays)
    described = plan(FLOOR, samples=800, light_samples=0, max_bounces=2, path_reuse="AUTO")
    described = replace(described, samples=(0, 2))
    alone = render(replace(described, workers="THREADS"), threads=1)
    shared = render(described, threads=2)
    assert splits.splits_of(shared.plan) == splits.splits_of(alone.plan) == pays
    np.testing.assert_array_equal(shared.film.sums, alone.film.sums)


def test_processes_are_for_long_renders_on_several_threads_that_want_them():
    described = plan(FLOOR, workers="AUTO", samples=2)

    def processes(plan, threads, pixels):
        workers = hire(plan, rendering._sample, threads, pixels)
        workers.close()
        return workers.processes

    assert processes(described, 2, LEAST // 2) == 2
    assert processes(described, 2, LEAST // 2 - 1) == 0
    assert processes(described, 1, LEAST) == 0
    assert processes(replace(described, workers="THREADS"), 2, LEAST) == 0
    assert processes(replace(described, workers="PROCESSES"), 2, 1) == 2


def test_where_processes_cannot_be_had_threads_work_and_it_is_said(monkeypatch):
    monkeypatch.setattr(workers, "CAN_FORK", False)
    monkeypatch.setattr(fresh, "interpreter", lambda: None)
    picture = render(plan(FLOOR), threads=2)
    assert picture.statistics["processes"] == 0
    assert "no Python" in picture.notes[0].what
    assert isinstance(hire(plan(FLOOR, workers="AUTO"), rendering._sample, 2, LEAST), Threads)


@pytest.mark.parametrize("allowed", (0, 1))
def test_threads_work_for_processes_that_the_system_refuses(monkeypatch, allowed):
    expected = render(plan(FLOOR, workers="THREADS"), threads=1)
    fork, left = os.fork, [allowed]

    def few():
        if not left[0]:
            raise OSError("Cannot allocate memory")
        left[0] -= 1
        return fork()

    monkeypatch.setattr(os, "fork", few)
    picture = render(plan(FLOOR), threads=2)
    assert picture.statistics["processes"] == allowed
    np.testing.assert_array_equal(picture.film.sums, expected.film.sums)


@pytest.mark.parametrize("case", ("killed", "raises", "waits for ever"))
def test_threads_do_the_work_of_processes_that_fail(monkeypatch, spoil, case):
    expected = render(plan(FLOOR, workers="THREADS"), threads=1)
    monkeypatch.setattr(workers, "PATIENCE", 4)

    def fail():
        if case == "killed":
            os.kill(os.getpid(), signal.SIGKILL)
        if case == "raises":
            raise MemoryError
        time.sleep(3600)

    spoil(fail)
    picture = render(plan(FLOOR), threads=2)
    assert picture.complete
    assert "2 of 2 processes failed" in picture.notes[0].what
    np.testing.assert_array_equal(picture.film.sums, expected.film.sums)


def test_processes_that_only_take_long_are_waited_for(monkeypatch, spoil):
    monkeypatch.setattr(workers, "PATIENCE", 4)

    def compute():
        end = time.process_time() + 2 * 4 * workers.LOOK
        while time.process_time() < end:
            pass

    spoil(compute)
    assert render(plan(FLOOR, samples=2), threads=2).notes == ()


def test_what_is_wrong_with_a_batch_is_raised_to_the_caller(monkeypatch):
    def wrong(*of):
        raise ValueError("Floor is wrong")

    monkeypatch.setattr(rendering, "_sample", wrong)
    with pytest.raises(ValueError, match="Floor is wrong"):
        render(plan(FLOOR), threads=2)


@pytest.mark.parametrize("lingers", (True, False))
def test_a_render_that_is_stopped_keeps_what_it_has_and_waits_for_no_process(spoil, lingers):
    spoil(lambda: time.sleep(0.0 if next(calls) < 3 else 3600))
    calls = iter(range(1000))  # in each process
    picture = render(
        plan(FLOOR, samples=10_000), 2, lambda now: now.sample > 0 and now.seconds > 0.5,
        lingers=lingers,
    )  # fmt: skip
    assert not picture.complete
    assert picture.film.counts.any()
    assert picture.notes == ()


def test_an_interrupt_of_the_terminal_is_for_the_parent_alone(spoil):
    spoil(lambda: os.kill(os.getpid(), signal.SIGINT))
    assert render(plan(FLOOR), threads=2).notes == ()


def test_processes_end_with_their_parent_and_do_not_hold_its_output():
    code = """
        import os, sys, time
        sys.path.insert(0, sys.argv[1])
        from tests.contract import test_workers as t
        t.rendering._sample = lambda *of: time.sleep(3600)
        def tell(now):
            print(*t.children(), flush=True)
        t.render(t.plan(t.FLOOR), 2, tell)
    """
    program = [sys.executable, "-c", textwrap.dedent(code), str(ROOT)]
    parent = subprocess.Popen(
        program, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    )
    pids = [int(pid) for pid in parent.stdout.readline().split()]
    assert len(pids) == 2
    parent.kill()
    parent.stdout.read()  # comes to its end
    parent.wait()
    deadline = time.monotonic() + 20
    while any(Path(f"/proc/{pid}").exists() for pid in pids) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert [pid for pid in pids if Path(f"/proc/{pid}").exists()] == []


def test_plans_of_one_render_are_sent_by_what_differs():
    base = plan(CATCHER, film_transparent=True)
    assert base.alone is not None
    other = replace(base, light_samples=4, alone=replace(base.alone, light_samples=2), ledger=None)
    found = differences(base, other)
    assert found == {"light_samples": 4, "alone": {"light_samples": 2}}
    again = changed(base, found)
    assert (again.light_samples, again.alone.light_samples) == (4, 2)
    assert again.accel is base.accel
    assert again.alone.accel is base.alone.accel
    assert differences(base, base) == {}
