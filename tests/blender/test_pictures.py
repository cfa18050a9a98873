"""a real Blender -> pictures of the first three steps, for README.

To take them again:

    PENUMBRA_PICTURES=1 python3 dev.py test --env 5.2 tests/blender/test_pictures.py
"""

import os
import shutil

import pytest

from penumbra.tools.environment import ROOT

STEPS = ("step_install", "step_engine", "step_viewport")


@pytest.mark.skipif("PENUMBRA_PICTURES" not in os.environ, reason="only where it is asked for")
def test_the_pictures_of_the_first_steps_are_taken(real):
    example = shutil.copy(ROOT / "examples" / "still_life.blend", real.home)
    found = real.drive("drive_pictures", PENUMBRA_EXAMPLE=str(example))
    assert found["samples"] == 16
    for step in STEPS:
        taken = real.home / f"drive_pictures.json.{step}.png"
        assert 5_000 < taken.stat().st_size < 300_000
        shutil.copy(taken, ROOT / "examples" / "pictures" / f"{step}.png")
