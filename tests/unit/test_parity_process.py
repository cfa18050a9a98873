"""workers that misbehave -> verdict.  A process that dies or hangs is replaced, and said to be."""

import sys

import pytest

from penumbra.parity.process import Absent, Worker, WorkerError

# Answers, fails, dies, hangs or lacks something, as it is asked to.
FAKE = """
import json, os, sys, time
for line in sys.stdin:
    request = json.loads(line)
    if request["call"] == "die": os._exit(3)
    if request["call"] == "hang": time.sleep(60)
    answer = {"fail": {"error": "RuntimeError: no"}, "lack": {"absent": "no node"}}
    print(json.dumps(answer.get(request["call"], {"pid": os.getpid()})), flush=True)
"""


@pytest.fixture
def worker():
    made = Worker((sys.executable, "-c", FAKE), patience=3.0)
    yield made
    made.close()


def test_a_worker_stays_for_several_calls(worker):
    assert worker.call("hello") == worker.call("hello")


def test_an_error_is_told_and_the_worker_stays(worker):
    before = worker.call("hello")
    with pytest.raises(WorkerError, match="RuntimeError: no"):
        worker.call("fail")
    with pytest.raises(Absent, match="no node"):
        worker.call("lack")
    assert worker.call("hello") == before


def test_a_worker_that_dies_is_replaced(worker):
    before = worker.call("hello")
    with pytest.raises(WorkerError, match="crashed .exit code 3."):
        worker.call("die")
    assert worker.call("hello") != before


def test_a_worker_that_hangs_is_killed_and_replaced(worker):
    before = worker.call("hello")
    process = worker.process
    with pytest.raises(WorkerError, match="no answer within 3 s"):
        worker.call("hang")
    assert process.poll() is not None
    assert worker.call("hello") != before


def test_closing_ends_the_process_and_may_be_done_twice(worker):
    worker.call("hello")
    process = worker.process
    worker.close()
    worker.close()
    assert process.poll() is not None
