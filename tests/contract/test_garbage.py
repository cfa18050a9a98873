"""batches -> nothing that is left.  Arrays that wait for the collector cost others new pages."""

import gc
import sys
import threading
from dataclasses import replace

import pytest

from penumbra.core import compile_plan, render
from penumbra.core.batches import Batch, Schedule
from tests.support import scenes as s
from tests.support.passes import every_kind_of_surface

rendering = sys.modules[render.__module__]


@pytest.mark.parametrize("scatter_samples", (1, 3))
def test_a_batch_leaves_nothing_to_the_collector(scatter_samples):
    settings = replace(s.DEFAULTS, samples=4, scatter_samples=scatter_samples)
    plan = compile_plan(s.scene(*every_kind_of_surface(16)), settings)
    film = rendering._film(plan, 16, 16)
    batches = [each for each in Schedule(plan, film).batches() if isinstance(each, Batch)]
    rendering._sample(plan, batches[0], threading.Event())  # tables are made once
    gc.collect()
    gc.disable()
    gc.set_debug(gc.DEBUG_SAVEALL)
    try:
        rendering._sample(plan, batches[-1], threading.Event())
        gc.collect()
        found = [each for each in gc.garbage if not isinstance(each, type)]
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()
    assert found == []
