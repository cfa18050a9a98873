"""rows -> scenes: what moves while the shutter is open: objects, vertices, the camera, lamps."""

from collections.abc import Callable
from typing import Any

from ..nodes import diffuse, glossy, node
from .scene import LEAN, QUICK, Scene

RED, BLUE = diffuse(0.8, 0.15, 0.1), diffuse(0.1, 0.3, 0.7)


def _moving(
    name: str, shows: str, build: Callable[[Any], Any], lean: bool = False, quick: bool = False,
    **shutter: Any,
) -> Scene:  # fmt: skip
    def all_of(s: Any) -> None:
        build(s)
        s.blur(**shutter)

    return Scene(f"motion_{name}", shows, all_of, LEAN if lean else {}, QUICK if quick else ())


def _ball(s: Any) -> Any:
    return s.keyed(s.standard(RED), "location", (-1.5, 0, 1), (1.5, 0, 1))


def _bar(s: Any, at: Any = (0, 0, 1)) -> Any:
    s.room()
    s.key()
    return s.box(diffuse(0.7, 0.45, 0.1), at, (2.2, 0.4, 0.6))


def _turning(s: Any) -> None:
    s.keyed(_bar(s), "rotation_euler", (0, 0, 0), (0.3, 2.6, 0))


def _fine(s: Any) -> None:
    thing = s.keyed(_bar(s), "rotation_euler", (0, 0, 0), (0, 9.0, 0))
    thing.cycles.motion_steps = 4


def _growing(s: Any) -> None:
    s.keyed(s.standard(RED, at=(0, 0, 0.8)), "scale", (0.2, 0.8, 1.0), (1.8, 0.8, 0.5))


def _sheared(s: Any) -> None:
    """A turned child of a parent that turns and is stretched: shear."""
    parent = s.empty()
    parent.location, parent.scale = (0, 0, 1), (1.6, 1, 0.5)
    thing = s.child(_bar(s, (0.2, 0, 0)), parent)
    thing.rotation_euler = (0.4, 0.5, 0.3)
    s.keyed(parent, "rotation_euler", (0, 0, 0), (0.5, 1.8, 0.4))


def _swinging(s: Any) -> None:
    """A ball on a long arm, and one that follows by constraint."""
    parent = s.empty()
    parent.location = (0, 0, 1.4)
    s.keyed(parent, "rotation_euler", (0, -1, 0), (0, 1.6, 0))
    ball = s.child(s.standard(RED, at=(0, 0, -0.9), radius=0.5), parent)
    other = s.ball(BLUE, (0, 0, 0), 0.3, name="Other")
    other.constraints.new("COPY_LOCATION").target = ball
    other.constraints[0].use_offset = True
    other.location = (0.2, -1.2, 0.4)


def _shape(s: Any) -> None:
    s.keyed(s.shape(s.standard(RED), 1.6), "value", 0.0, 1.0)


def _bones(s: Any) -> None:
    s.room()
    s.key()
    rings = 16
    outline = [(-0.35, -0.35), (0.35, -0.35), (0.35, 0.35), (-0.35, 0.35)]
    points = [(x, y, 2.0 * ring / rings) for ring in range(rings + 1) for x, y in outline]
    faces = [(4 * r + k, 4 * r + (k + 1) % 4, 4 * r + 4 + (k + 1) % 4, 4 * r + 4 + k)
             for r in range(rings) for k in range(4)]  # fmt: skip
    tower = s.mesh("Tower", points, [*faces, (3, 2, 1, 0)], RED, smooth=True)
    s.keyed(s.bent_by_bones(tower, 2.0), "rotation_euler", (0, 0, 0.0), (0, 0, 1.5))


def _instances(s: Any) -> None:
    """A collection of two balls, shown by an object that moves and one that rests."""
    s.room()
    s.key()
    balls = s.ball(RED, (0, 0, 0.5), 0.5), s.ball(BLUE, (0, 0, 1.3), 0.3, name="Upper")
    maker = s.instancer(*balls)
    s.keyed(maker, "location", (-1.5, 0, 0), (0.5, 0, 0))
    other = s.empty("Other")
    other.instance_type, other.instance_collection = "COLLECTION", maker.instance_collection
    other.location = (1.2, 0, 0)


def _together(s: Any) -> None:
    """A camera and a ball that it follows: the ball is sharp, the rest is not."""
    _ball(s)
    camera = _camera(s)
    at = camera.location
    s.keyed(camera, "location", (at.x - 1.5, at.y, at.z), (at.x + 1.5, at.y, at.z))


def _camera(s: Any) -> Any:
    return s.bpy.context.scene.camera


def _travelling(s: Any) -> None:
    s.standard(RED)
    at = _camera(s).location
    s.keyed(_camera(s), "location", (at.x - 0.5, at.y - 1, at.z), (at.x + 0.5, at.y + 1.5, at.z))


def _rolling(s: Any) -> None:
    s.standard(RED)
    turn = _camera(s).rotation_euler
    s.keyed(_camera(s), "rotation_euler", (turn.x, -0.5, turn.z - 0.1), (turn.x, 0.5, turn.z + 0.1))


def _zooming(s: Any) -> None:
    s.standard(RED)
    s.keyed(_camera(s).data, "lens", 45.0, 90.0)


def _zooming_flat(s: Any) -> None:
    s.standard(RED)
    _camera(s).data.type = "ORTHO"
    s.keyed(_camera(s).data, "ortho_scale", 3.0, 6.0)


def _pulling(s: Any) -> None:
    s.standard(RED)
    dof = _camera(s).data.dof
    dof.use_dof, dof.aperture_fstop = True, 0.03
    s.keyed(dof, "focus_distance", 2.5, 10.5)


def _glow(s: Any) -> None:
    s.room((0.02, 0.02, 0.03))
    ball = s.ball(node("Emission", Color=(1, 0.8, 0.5), Strength=12.0), radius=0.4)
    s.keyed(ball, "location", (-2.0, -0.5, 0.6), (2.0, -0.5, 1.6))


def _mirror(s: Any) -> None:
    s.keyed(s.standard(glossy(0.1)), "location", (-1, 0, 1), (1, 0, 1))


def _glass(s: Any) -> None:
    glass = node("BsdfGlass", Roughness=0.0)
    s.keyed(s.standard(glass), "location", (-1, 0, 1), (1, 0, 1))


def _pane(s: Any) -> None:
    """A pane of coloured foil that swings between the lamp and the wall."""
    s.standard(RED)
    foil = node("BsdfTransparent", Color=(0.2, 0.6, 0.9))
    pane = s.plane(foil, (-0.7, -1.3, 1.2), (80, 0, 20), 1.2)
    s.keyed(pane, "location", (-1.2, -1.3, 1.2), (0.4, -1.3, 1.2))


def _still(s: Any) -> None:
    _ball(s).cycles.use_motion_blur = False


def _stiff(s: Any) -> None:
    ball = _ball(s)
    s.keyed(s.shape(ball, 1.6), "value", 0.0, 1.0)
    ball.cycles.use_deform_motion = False


def _lamp(s: Any) -> None:
    s.standard(RED, lamp_on=False)
    s.keyed(s.key(), "location", (-4, -2.8, 4.6), (4, -2.8, 4.6))


def _row_by_row(s: Any) -> None:
    _ball(s)
    for options in (s.bpy.context.scene.cycles, s.bpy.context.scene.penumbra):
        options.rolling_shutter_type, options.rolling_shutter_duration = "TOP", 0.2


ROWS = (
    _moving("object", "A ball that moves along.", _ball, quick=True),
    _moving("turn", "A box that turns about an axis, seldom looked at.", _turning),
    _moving("turn_fine", "A box that turns fast, at many steps.", _fine),
    _moving("scale", "A ball that is stretched.", _growing),
    _moving("shear", "A box that is sheared by its parent.", _sheared),
    _moving("parent", "A ball that swings on an arm, and one that follows.", _swinging),
    _moving("shape_key", "A ball that grows by a shape key.", _shape),
    _moving("bones", "A tower that bends by its bones.", _bones, quick=True),
    _moving("instances", "A collection that moves as it is shown.", _instances),
    _moving("together", "A camera that moves with a ball.", _together),
    _moving("camera", "A camera that comes nearer, on its way aside.", _travelling),
    _moving("camera_turn", "A camera that rolls and pans.", _rolling),
    _moving("zoom", "A lens that zooms.", _zooming),
    _moving("zoom_orthographic", "A camera without perspective that zooms.", _zooming_flat),
    _moving("focus", "A lens that is focused farther and farther away.", _pulling),
    _moving("glow", "A ball of light that flies through the room.", _glow),
    _moving("glossy", "A shiny ball that moves.", _mirror, lean=True),
    _moving("glass", "A glass ball that moves.", _glass, lean=True),
    _moving("transparent", "A coloured pane that moves, and its shadow.", _pane),
    _moving("object_off", "A ball that is not blurred.", _still),
    _moving("deformation_off", "A ball that grows, which is not blurred, on its way.", _stiff),
    _moving("lamp", "A lamp that moves, and is not blurred.", _lamp, position="END"),
    _moving("start", "A shutter that opens at the frame.", _ball, position="START", shutter=0.5),
    _moving("end", "A shutter that closes at the frame.", _ball, position="END", shutter=0.5),
    _moving("long", "A shutter that is open for two frames.", _ball, shutter=2.0),
    _moving("off_at_start", "What is not blurred, with a shutter that opens at the frame.", _still,
            position="START"),
    _moving("curve", "A shutter that opens slowly.", _ball, curve=(0.0, 0.1, 1.0, 0.3)),
    _moving("rolling", "A shutter that passes the picture from the top.", _row_by_row),
    _moving("rest", "Nothing moves.", lambda s: s.standard(RED)),
)  # fmt: skip
