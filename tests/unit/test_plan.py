"""core.plan -> words.  A plan tells what a scene needs, and what it does without."""

import numpy as np
import pytest

from penumbra.core import Scene, StarField, compile_plan
from penumbra.core.optics import Aperture
from tests.support import scenes as s

FLOOR = s.put(s.quad(u=(2, 0, 0), v=(0, 2, 0)), s.diffuse(0.7))
BALL = s.put(s.sphere(0.5, 1), s.glass(), to_world=s.affine(1.0, (0, 0, 0.6)))


def words(scene: Scene, **settings):
    """Return the three parts of a description: what is counted, what there is, and what is not."""
    text = compile_plan(scene, s.replace(s.DEFAULTS, **settings)).describe()
    counted = [part for part in text.split("; ") if not part.startswith("with")]
    named = {part.partition(" ")[0]: part for part in text.split("; ") if part.startswith("with")}
    lists = [named.get(key, "").partition(" ")[2].split(", ") for key in ("with", "without")]
    return counted, *lists


VIEW = s.camera((0, -4, 1), (0, 0, 0.5))
CASES = {
    "lens": (s.replace(VIEW, aperture=Aperture(radius=0.1, focus=3.0)), {}),
    "smooth normals": (BALL, {}),
    "glowing surfaces": (s.put(s.box(0.2), s.emission()), {}),
    "stars": (s.replace(s.world(0.0), stars=StarField(10, 1.0)), {}),
    "clamps": (s.point((0, 0, 3)), {"sample_clamp_direct": 3.0}),
    "adaptive sampling": (s.point((0, 0, 3)), {"use_adaptive_sampling": True, "samples": 1024}),
}


def test_a_plain_scene_is_without_all_that_it_does_not_need():
    counted, present, absent = words(s.scene(VIEW, FLOOR, s.point((0, 0, 3))))
    assert "2 triangles in 1 parts" in counted and "1 closures: diffuse" in counted
    assert "1 lamps" in counted and "a black world" in counted
    assert present == [""]
    assert set(CASES) < set(absent) and "motion" in absent and "passes" in absent


@pytest.mark.parametrize("what", CASES)
def test_what_a_scene_needs_is_named(what):
    thing, settings = CASES[what]
    things = [thing, FLOOR] if what == "lens" else [VIEW, FLOOR, thing]
    _, present, absent = words(s.scene(*things), **settings)
    assert what in present and what not in absent


def slotted(slots, *materials):
    floor = s.quad(u=(2, 0, 0), v=(0, 2, 0))
    return s.put(s.replace(floor, slots=None if slots is None else np.array(slots)), *materials)


def closures(*things):
    plan = compile_plan(s.scene(VIEW, s.point((0, 0, 3)), *things), s.DEFAULTS)
    return {module.NAME for module in plan.surfaces.modules}


MATTE, SHINY = s.diffuse(0.7), s.mirror()
DULL, SHINE = closures(slotted(None, MATTE)), closures(slotted(None, SHINY))
SLOTS = (
    *((DULL, slots) for slots in (None, [0, 0], [-3, 0])),
    *((SHINE, slots) for slots in ([1, 1], [1, 7])),
    *((DULL | SHINE, slots) for slots in ([0, 1], [7, 0])),
)


@pytest.mark.parametrize(("expected", "slots"), SLOTS)
def test_materials_that_no_face_has_are_left_out(expected, slots):
    assert len(expected) == 1 or DULL != SHINE
    assert closures(slotted(slots, MATTE, SHINY)) == expected


def test_a_mesh_that_others_show_with_other_materials_is_judged_for_each():
    one = slotted([1, 1], MATTE, SHINY)
    other = s.replace(one, materials=(SHINY, MATTE, s.glass()))
    third = s.replace(one, materials=(MATTE,))
    assert closures(one, other, third) == DULL | SHINE
    assert closures(other, third) == DULL
    assert closures(one) == SHINE


def test_a_picture_without_an_unused_material_is_that_with_it():
    light, plain = s.point((1, 0, 3), 9.0), slotted(None, MATTE)
    seen = s.pixels(VIEW, plain, light)
    assert seen.max() > 0.01
    np.testing.assert_array_equal(s.pixels(VIEW, slotted([1, 1], SHINY, MATTE), light), seen)
