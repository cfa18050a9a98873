"""rows -> scenes: depth of field, panoramas, pixel filters, shifted and clipped views."""

from typing import Any

from ..nodes import diffuse, glow
from .scene import QUICK, Scene

RED = diffuse(0.8, 0.15, 0.1)
DIM = (0.06, 0.07, 0.09)
LEAN = {"max_bounces": 0}

# What is around the camera of a panorama: place, colour
AROUND = (
    ((2.5, 0, 0.3), (0.8, 0.1, 0.1)),
    ((-2.5, 0.4, 0), (0.1, 0.7, 0.1)),
    ((0.2, 2.5, -0.2), (0.1, 0.2, 0.8)),
    ((0, -2.4, 0.5), (0.7, 0.7, 0.1)),
    ((0.3, 0.2, 2.4), (0.7, 0.1, 0.7)),
    ((0.2, 0.4, -2.4), (0.1, 0.7, 0.7)),
)


def _blurred(camera: Any, f_stop: float = 0.1, focus: float = 6.2, **dof: Any) -> None:
    camera.data.dof.use_dof = True
    for name, value in dict(aperture_fstop=f_stop, focus_distance=focus, **dof).items():
        setattr(camera.data.dof, name, value)


def _sparks(s: Any, radius: float, *places: tuple[float, float, float]) -> None:
    """Put glowing balls that only the camera sees: each shows the shape of the aperture."""
    for at in places:
        spark = s.ball(glow(3.0, 1, 0.9, 0.7), at, radius, segments=16)
        for kind in ("diffuse", "glossy", "transmission", "shadow"):
            setattr(spark, f"visible_{kind}", False)


BEFORE_AND_BEHIND = ((-0.8, -3.6, 2.2), (0.9, -3.6, 1.4), (-1.7, 2.0, 2.4), (1.6, 2.0, 2.3))


def _dof(name: str, shows: str, kind: str = "PERSP", sharp_at: Any = None, **dof: Any) -> Scene:
    def build(s: Any) -> None:
        s.room(sky=DIM)
        s.key()
        ball = s.ball(RED)
        _sparks(s, 0.07, *BEFORE_AND_BEHIND)
        camera = s.camera(type=kind, ortho_scale=4.4)
        if sharp_at is not None:
            sharp_at(ball, dof)
        _blurred(camera, **dof)

    return Scene(f"dof_{name}", shows, build, LEAN, QUICK if name == "disk" else ())


def _on_ball(ball: Any, dof: dict[str, Any]) -> None:
    dof["focus_object"] = ball


def _clipped(s: Any) -> None:
    s.room(sky=DIM)
    s.key()
    s.ball(RED)
    _sparks(s, 0.07, *BEFORE_AND_BEHIND)
    _blurred(s.camera(clip_start=5.0, clip_end=8.6))


def _surrounded(s: Any, **properties: Any) -> Any:
    """Put things and lights around a panoramic camera that looks askew; return it."""
    s.world(DIM)
    for at, colour in AROUND:
        s.ball(diffuse(*colour), at, 0.8, segments=24)
    s.lamp("POINT", 60, (0.9, 1.2, 1.1), shadow_soft_size=0.3)
    s.lamp("POINT", 60, (-0.8, -1.1, 0.6), shadow_soft_size=0.3)
    return s.camera((0.1, 0, 0), (1, 0.7, 0.2), type="PANO", **properties)


def _panorama(
    name: str, shows: str, size: tuple[int, int] = (64, 64), dof: Any = None, **properties: Any
) -> Scene:
    def build(s: Any) -> None:
        camera = _surrounded(s, **properties)
        if dof is not None:
            _sparks(s, 0.04, (0.9, 0.9, 0.45), (0.9, 0.2, -0.2))
            _blurred(camera, **dof)

    return Scene(f"panorama_{name}", shows, build, LEAN, (), *size)


def _filtered(kind: str, width: float) -> Scene:
    def build(s: Any) -> None:
        s.room()
        s.key()
        s.plane(glow(3.0), (0, -1, 1), (90, 20, 0), (0.3, 3))
        s.ball(RED)

    settings = {"pixel_filter_type": kind, "filter_width": width, "max_bounces": 0}
    return Scene(
        f"pixel_filter_{kind.lower()}", f"Filter {kind} of width {width:g}.", build, settings
    )


def _shifted(s: Any) -> None:
    s.standard(RED)
    s.camera(shift_x=0.2, shift_y=-0.15, sensor_fit="VERTICAL", sensor_height=30)


ROWS = (
    _dof("disk", "Lights out of focus: disks."),
    _dof("five_blades", "An aperture of five blades, turned.", aperture_blades=5,
         aperture_rotation=0.4),
    _dof("two_blades", "Two blades are a disk.", aperture_blades=2, aperture_rotation=0.4),
    _dof("anamorphic", "Seven blades, squeezed.", aperture_blades=7, aperture_ratio=2.0),
    _dof("wide", "An aperture wider than high.", aperture_ratio=0.5, f_stop=0.3),
    _dof("orthographic", "Orthographic: the f-stop is of a metre.", "ORTHO", f_stop=2.5,
         aperture_blades=3),
    _dof("focus_object", "Sharp where an object is.", sharp_at=_on_ball, focus=1.0),
    Scene("dof_clipped", "Clipping planes before a wide lens.", _clipped, LEAN),
    Scene("camera_shift", "A shifted view, the sensor fitted to its height.", _shifted),
    _panorama("equirectangular", "All around.", (96, 48), panorama_type="EQUIRECTANGULAR"),
    _panorama("limits", "A part of the longitudes and latitudes.", panorama_type="EQUIRECTANGULAR",
              longitude_min=-1.2, longitude_max=2.0, latitude_min=-0.3, latitude_max=1.3),
    _panorama("cube_face", "A face of a cube.", panorama_type="EQUIANGULAR_CUBEMAP_FACE"),
    _panorama("mirror_ball", "A mirror ball; outside of it is nothing.",
              panorama_type="MIRRORBALL"),
    _panorama("equidistant", "Fisheye of equal distances.",
              panorama_type="FISHEYE_EQUIDISTANT", fisheye_fov=3.6),
    _panorama("equisolid", "Fisheye of equal areas, shifted.", (80, 64),
              panorama_type="FISHEYE_EQUISOLID", fisheye_fov=3.2, shift_x=0.1, shift_y=-0.05),
    _panorama("polynomial", "Fisheye of a measured lens.", (80, 64),
              panorama_type="FISHEYE_LENS_POLYNOMIAL", fisheye_fov=2.6,
              fisheye_polynomial_k1=-0.06, fisheye_polynomial_k2=-0.002),
    _panorama("cylinder", "A cylinder around the camera.", (80, 64),
              panorama_type="CENTRAL_CYLINDRICAL", central_cylindrical_range_v_min=-1.2,
              central_cylindrical_range_u_max=2.0),
    _panorama("dof", "Depth of field all around.", (96, 48), {"f_stop": 0.3, "focus": 2.2},
              panorama_type="EQUIRECTANGULAR"),
    _panorama("dof_blades", "Blades of a fisheye, squeezed.", (64, 64),
              {"f_stop": 0.3, "focus": 2.2, "aperture_blades": 4, "aperture_ratio": 1.6},
              panorama_type="FISHEYE_EQUIDISTANT"),
    _panorama("dof_mirror_ball", "Blades of a mirror ball.", (64, 64),
              {"f_stop": 0.3, "focus": 2.2, "aperture_blades": 3, "aperture_rotation": 0.5},
              panorama_type="MIRRORBALL"),
    _filtered("BOX", 1.5),
    _filtered("GAUSSIAN", 3.0),
    _filtered("BLACKMAN_HARRIS", 4.0),
)  # fmt: skip
