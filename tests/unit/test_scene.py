"""core.scene -> what cannot be rendered is refused at the door, by name."""

import re

import numpy as np
import pytest

from penumbra.core import (
    Aperture,
    Camera,
    Eye,
    Instance,
    Lamp,
    Mesh,
    Panorama,
    SceneError,
    compile_plan,
    render,
)
from tests.support import scenes as s

SQUARE = np.zeros((4, 3))
ONE = np.array([(0, 1, 2)], np.int32)
NAN = s.affine()
NAN[1, 2] = np.nan
FAR = s.affine(shift=(1e19, 0, 0))


def mesh(**changes):
    return Mesh(**{"name": "Suzanne", "positions": SQUARE, "triangles": ONE, **changes})


def lamp(**changes):
    basics = {"name": "Key", "kind": "POINT", "to_world": s.affine(), "strength": (1.0, 1.0, 1.0)}
    return Lamp(**{**basics, **changes})


def camera(**changes):
    basics = {"to_world": s.affine(), "window": (-1, 1, -1, 1), "width": 8, "height": 6}
    return Camera(**{**basics, **changes})


def around(kind="EQUIRECTANGULAR", **changes):
    return camera(projection="PANO", panorama=Panorama(kind, **changes))


REFUSED = (
    (lambda: mesh(positions=np.zeros((4, 2))), "Mesh 'Suzanne': positions has shape (4, 2)"),
    (lambda: mesh(triangles=np.zeros((1, 4), int)), "Mesh 'Suzanne': triangles has shape (1, 4)"),
    (lambda: mesh(normals=np.zeros((1, 3))), "Mesh 'Suzanne': normals has shape (1, 3)"),
    (lambda: mesh(slots=np.zeros(2, int)), "Mesh 'Suzanne': slots has shape (2,)"),
    (
        lambda: mesh(triangles=np.array([(0, 1, 2), (2, 3, 4)])),
        "Mesh 'Suzanne': corner 5 points to vertex 4 of 4",
    ),
    (
        lambda: mesh(triangles=np.array([(0, -1, 2)])),
        "Mesh 'Suzanne': corner 1 points to vertex -1 of 4",
    ),
    (
        lambda: Instance("Cube", mesh(), np.eye(4)),
        "Object 'Cube': its matrix has shape (4, 4), expected (3, 4)",
    ),
    (
        lambda: Instance("Cube", mesh(), s.affine(), blocker_set=64),
        "Object 'Cube': there is no light linking set 64",
    ),
    (
        lambda: Instance("Cube", mesh(), s.affine(), receivers=1 << 64),
        "Object 'Cube': a mask of light linking sets does not fit",
    ),
    (lambda: lamp(blockers=-1), "Light 'Key': a mask of light linking sets does not fit"),
    (lambda: Instance("Cube", mesh(), NAN), "Object 'Cube': its matrix has a number that is not"),
    (
        lambda: s.Material("Clay", bump_softening="SOFT"),
        "Material 'Clay': unknown bump softening 'SOFT'",
    ),
    (lambda: lamp(kind="LASER"), "Light 'Key': unknown kind 'LASER'"),
    (lambda: lamp(to_world=NAN), "Light 'Key': its matrix has a number that is not finite"),
    (lambda: lamp(strength=(1.0, np.inf, 1.0)), "Light 'Key': strength is"),
    (lambda: lamp(strength=()), "Light 'Key': strength is (), expected 3 finite numbers"),
    (lambda: lamp(to_world=FAR), "Light 'Key': its matrix has a number that is not finite, or bey"),
    (lambda: camera(window=()), "Camera: window is (), expected 4 finite numbers"),
    (lambda: lamp(radius=np.nan), "Light 'Key': radius is nan, expected a finite number"),
    (lambda: lamp(size=(1.0, np.nan)), "Light 'Key': size is (1.0, nan), expected 2 finite"),
    (lambda: camera(to_world=NAN), "Camera: its matrix has a number that is not finite"),
    (lambda: camera(projection="FILM"), "Camera: projection 'FILM' is not PERSP, ORTHO or PANO"),
    (lambda: camera(projection="PANO"), "Camera: PANO and panorama None do not match"),
    (lambda: camera(panorama=Panorama("MIRRORBALL")), "Camera: PERSP and panorama Panorama("),
    (lambda: camera(projection="ORTHO", eye=Eye(0.1)), "Camera: an orthographic camera has no eye"),
    (lambda: camera(aperture=Aperture(0.0, 1.0)), "Camera: the radius of its aperture is 0.0"),
    (lambda: camera(aperture=Aperture(1, np.nan)), "Camera: the focus of its aperture is nan"),
    (lambda: camera(aperture=Aperture(1, 1, ratio=0)), "Camera: the ratio of its aperture is 0"),
    (lambda: camera(aperture=Aperture(1, 1, 3, np.inf)), "Camera: the rotation of its aperture"),
    (lambda: around("TUBE"), "Camera: panorama 'TUBE' is not one of EQUIRECTANGULAR, "),
    (lambda: around(lens=0.0), "Camera: lens 0.0 and sensor (36.0, 24.0) of its panorama must"),
    (lambda: around(fov=np.nan), "Camera: a number of its panorama is not finite"),
    (lambda: camera(eye=Eye(0.1, 0.0)), "Camera: an eye at 0.1 m that looks at 0.0 m is not"),
    (lambda: camera(eye=Eye(0.1, 1.0, (0, np.nan))), "Camera: eyes that come together at (0, nan)"),
    (lambda: camera(width=0), "Camera: a picture of 0 x 6 pixels is empty"),
    (lambda: camera(border=(2, 2, 2, 4)), "Camera: border (2, 2, 2, 4) is empty or outside"),
    (lambda: camera(border=(0, 0, 9, 4)), "Camera: border (0, 0, 9, 4) is empty or outside"),
)


@pytest.mark.parametrize(("make", "message"), REFUSED, ids=[message for _, message in REFUSED])
def test_the_culprit_is_named(make, message):
    with pytest.raises(SceneError, match=re.escape(message)):
        make()


def test_what_is_sound_passes():
    mesh(normals=np.zeros((4, 3)))
    mesh(normals=np.zeros((1, 3, 3)), slots=np.zeros(1, int))
    mesh(positions=np.zeros((0, 3)), triangles=np.zeros((0, 3), np.int32))
    lamp(strength=(0.0, 0.0, 0.0))
    assert camera().rectangle() == (0, 0, 8, 6)
    assert camera(border=(1, 2, 3, 4)).rectangle() == (1, 2, 3, 4)


@pytest.mark.parametrize("lamps", ("none", "black", "flat", "squeezed"))
def test_lamps_that_cannot_shine_are_no_error(lamps):
    things = {
        "none": (),
        "black": (lamp(strength=(0.0, 0.0, 0.0)),),
        "flat": (lamp(kind="AREA", size=(0.0, 1.0)),),
        "squeezed": tuple(
            lamp(kind=kind, to_world=s.affine(0.0)) for kind in ("SPOT", "AREA", "SUN")
        ),
    }[lamps]
    plan = compile_plan(
        s.scene(s.orthographic((0, 0, 5)), s.put(s.quad(), s.diffuse()), *things), s.DEFAULTS
    )
    assert plan.lights is None
    assert render(plan, threads=1).combined()[..., :3].max() == 0
