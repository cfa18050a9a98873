"""a scene at rest, motion blur on -> the plan of one without: what does not move costs nothing."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from penumbra.core import compile_plan
from tests.support import scenes as s

# Built by Embree, at other addresses each time, or timings
IGNORED = {"accel", "prepared"}


def things():
    """What can move: an object, glowing ones, lamps of two kinds, a pane, the camera."""
    pane = s.Material("Pane", s.node("BsdfTransparent", Color=(0.9, 0.5, 0.2)))
    return [
        s.camera((0, -4, 2), (0, 0, 0.5), size=16),
        s.put(s.quad((5, 0, 0), (0, 5, 0)), s.diffuse(0.7)),
        s.put(s.sphere(0.5), s.glass(), to_world=s.affine(1.0, (-0.6, 0, 0.6))),
        s.put(s.box(0.1), s.emission(3.0), to_world=s.affine(1.0, (0.7, 0, 0.5))),
        s.put(s.quad((0.4, 0, 0), (0, 0.4, 0)), pane, to_world=s.affine(1.0, (0, -0.5, 1))),
        s.area((1, -1, 3), radiance=5.0),
        s.point((-2, -1, 2), 2.0, radius=0.2),
        s.world(0.2),
    ]


def differences(one, other, name="plan"):
    """Yield the names of what is not the same in two plans, down to the numbers."""
    if type(one) is not type(other):
        yield name
    elif is_dataclass(one) and not isinstance(one, type):
        for item in fields(one):
            if item.name not in IGNORED:
                pair = getattr(one, item.name), getattr(other, item.name)
                yield from differences(*pair, f"{name}.{item.name}")
    elif isinstance(one, np.ndarray):
        if one.dtype == object or not np.array_equal(one, other, equal_nan=one.dtype.kind == "f"):
            yield name
    elif isinstance(one, tuple | list):
        if len(one) != len(other):
            yield name
        for number, pair in enumerate(zip(one, other, strict=False)):
            yield from differences(*pair, f"{name}[{number}]")
    elif isinstance(one, dict):
        if one.keys() != other.keys():
            yield name
        for key in one.keys() & other.keys():
            yield from differences(one[key], other[key], f"{name}[{key}]")
    elif isinstance(one, str | int | float | bytes | np.generic | None) and one != other:
        yield name


def plans(settings=s.DEFAULTS, move=lambda thing: thing):
    """The plan of a scene at rest, and of one whose shutter opens slowly."""
    still = s.scene(*things())
    opened = s.scene(*map(move, things()), shutter=np.linspace(0, 1, 9))
    return compile_plan(still, settings), compile_plan(opened, settings)


@pytest.mark.parametrize("rolling", ["NONE", "TOP"])
def test_a_scene_at_rest_has_the_same_plan_with_motion_blur(rolling):
    one, other = plans(replace(s.DEFAULTS, rolling_shutter_type=rolling))
    assert list(differences(one, other)) == []
    assert other.shutter is None and other.camera_motion is None
    assert other.triangles.movement is None
    kinds = [[(type(part), part.traits) for part in plan.accel.parts] for plan in (one, other)]
    assert kinds[0] == kinds[1]


def moved(kind):
    """What sets things of one kind in motion."""

    def move(thing):
        if not isinstance(thing, kind):
            return thing
        after = thing.to_world + np.eye(3, 4, 3)
        if isinstance(thing, s.Camera):
            return replace(thing, motion=(thing, replace(thing, to_world=after)))
        return replace(thing, motion=np.array([thing.to_world, after]))

    return move


@pytest.mark.parametrize(
    ("kind", "added"),
    [
        (s.Camera, {"shutter", "camera_motion"}),
        (s.Instance, {"shutter", "triangles.movement"}),
        (s.Lamp, {"shutter", "lights.groups[0].motion", "lights.groups[1].motion"}),
    ],
)
def test_only_what_moves_has_a_motion(kind, added):
    one, other = plans(move=moved(kind))
    found = {name.removeprefix("plan.") for name in differences(one, other)}
    motions = {"shutter", "camera_motion", "triangles.movement"}
    motions |= {name for name in found if name.endswith("].motion") and ".groups[" in name}
    assert found & motions == added
