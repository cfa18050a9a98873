"""rows -> scenes: who sees an object: ray kinds, holdout, shadow catcher, collections."""

from typing import Any

from ..nodes import Node, diffuse, glossy, node
from .scene import LEAN, Scene

RED = diffuse(0.8, 0.15, 0.1)
MATTE, SHINY = diffuse(0.55, 0.52, 0.48), glossy(0.05)


def _hidden(name: str, shows: str, floor_of: Node, *flags: str) -> Scene:
    def build(s: Any) -> None:
        s.room(floor_of=floor_of)
        s.key()
        ball = s.ball(RED)
        for flag in flags:
            setattr(ball, f"visible_{flag}", False)

    return Scene(f"hidden_from_{name}", shows, build, LEAN if floor_of is SHINY else {})


def _layer(name: str, shows: str, flag: str) -> Scene:
    def build(s: Any) -> None:
        s.transparent_film()
        ball = s.standard(RED, at=(0.5, 0, 1))
        s.ball(diffuse(), (-0.9, -0.4, 0.5), 0.5, name="Other ball")
        setattr(s.collection("Special", ball), flag, True)

    return Scene(name, shows, build)


def _catcher(s: Any) -> None:
    """Catch the shadow of the ball on a floor that is not in the picture."""
    s.transparent_film()
    s.world()
    s.key()
    s.camera()
    s.floor().is_shadow_catcher = True
    s.ball(RED)


def _object_holdout(s: Any) -> None:
    s.transparent_film()
    s.standard(RED, at=(0.5, 0, 1)).is_holdout = True
    s.ball(diffuse(), (-0.9, -0.4, 0.5), 0.5, name="Other ball")


ROWS = (
    _hidden("camera", "The camera does not see the ball, but its shadow and mirror image.",
            SHINY, "camera"),
    _hidden("diffuse", "Matte surfaces do not see the ball.", MATTE, "diffuse"),
    _hidden("glossy", "Mirrors do not see the ball.", SHINY, "glossy"),
    _hidden("shadow", "The ball throws no shadow.", MATTE, "shadow"),
    _hidden("all_but_camera", "Only the camera sees the ball.", MATTE, "diffuse", "glossy",
            "transmission", "shadow"),
    Scene("hidden_from_transmission", "Through glass the ball is not seen.",
          lambda s: (s.room(), s.key(), setattr(s.ball(RED), "visible_transmission", False),
                     s.box(node("BsdfGlass", Roughness=0.0), (0.4, -1.6, 0.8), (1, 0.2, 1.6))),
          LEAN),
    Scene("hidden_from_render", "A ball that is switched off for renders.",
          lambda s: setattr(s.standard(RED), "hide_render", True)),
    Scene("object_holdout", "An object that is a holdout.", _object_holdout),
    Scene("shadow_catcher", "A floor that shows nothing but the shadow.", _catcher),
    _layer("collection_holdout", "A collection that is a holdout.", "holdout"),
    _layer("collection_indirect_only", "A collection that is seen indirectly only.",
           "indirect_only"),
    _layer("collection_excluded", "A collection that is excluded.", "exclude"),
)  # fmt: skip
