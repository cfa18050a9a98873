"""rows -> scenes: the world: constant, pictures, sky models, tricks, visibility."""

import math as m
from typing import Any

from ..nodes import Node, diffuse, glossy, mix, node
from .scene import QUICK, Scene


def _sky(s: Any, shader: Node | tuple[float, ...], ball_of: Node | None = None) -> None:
    """Put the ball on its floor under the open sky, with nothing behind."""
    s.world(shader)
    s.floor()
    s.ball(ball_of or glossy(0.2, 0.9, 0.9, 0.9), (0.75, 0, 0.75), 0.75)
    s.ball(diffuse(), (-0.8, 0, 0.75), 0.75)
    s.camera((0, -7.5, 1.2), (0, 0, 1.0), 55.0)


def _background(colour: Any, strength: Any = 1.0) -> Node:
    return node("Background", Color=colour, Strength=strength)


def _picture(projection: str, **more: Any) -> Any:
    def build(s: Any) -> None:
        image = s.sky_picture("sky")
        _sky(s, _background(node("TexEnvironment", image=image, projection=projection, **more)))

    return build


def _model(kind: str, strength: float, **more: Any) -> Any:
    texture = node("TexSky", sky_type=kind, **more)
    return lambda s: _sky(s, _background(texture, strength))


def _hidden(*rays: str) -> Any:
    def build(s: Any) -> None:
        _sky(s, (0.5, 0.6, 0.8), glossy(0.0))
        s.key()
        for ray in rays:
            setattr(s.bpy.context.scene.world.cycles_visibility, ray, False)

    return build


CAMERA = node("LightPath")["Is Camera Ray"]
LOW = {"sun_elevation": m.radians(12), "sun_rotation": m.radians(220)}
HIGH = {"sun_elevation": m.radians(50), "sun_rotation": m.radians(200)}
WHERE = node("TexCoord")["Generated"]

ROWS = (
    Scene("world_constant", "A world of one colour.", lambda s: _sky(s, (0.5, 0.6, 0.8), diffuse()),
          tags=QUICK),
    Scene("world_mirror", "A world of one colour and a mirror.",
          lambda s: _sky(s, (0.5, 0.6, 0.8), glossy(0.0)), tags=QUICK),
    Scene("world_black", "No world at all.",
          lambda s: (_sky(s, (0, 0, 0)), s.key(), setattr(s.bpy.context.scene, "world", None))),
    Scene("world_picture", "An equirectangular picture with a small, bright sun.",
          _picture("EQUIRECTANGULAR")),
    Scene("world_picture_closest", "The same without interpolation.",
          _picture("EQUIRECTANGULAR", interpolation="Closest")),
    Scene("world_mirror_ball", "A picture of a mirror ball.", _picture("MIRROR_BALL")),
    Scene("sky_single_scattering", "Nishita's sky, single scattering, with its sun.",
          _model("SINGLE_SCATTERING", 0.1, sun_disc=True, sun_intensity=0.05, **HIGH)),
    Scene("sky_single_scattering_low", "The same at sunset, without the sun.",
          _model("SINGLE_SCATTERING", 0.2, sun_disc=False, **LOW)),
    Scene("sky_multiple_scattering", "The sky of multiple scattering, with its sun.",
          _model("MULTIPLE_SCATTERING", 0.1, sun_disc=True, sun_intensity=0.05, **HIGH)),
    Scene("sky_multiple_scattering_low", "The same at sunset, without the sun.",
          _model("MULTIPLE_SCATTERING", 0.2, sun_disc=False, **LOW)),
    Scene("sky_nishita", "Nishita's sky as Blender 4 has it.",
          _model("NISHITA", 0.1, sun_disc=True, sun_intensity=0.05, **HIGH)),
    Scene("sky_preetham", "Preetham's sky.", _model("PREETHAM", 0.2, sun_direction=(0.3, -0.5, 0.8),
                                                    turbidity=3.0)),
    Scene("sky_hosek_wilkie", "The sky of Hosek and Wilkie.",
          _model("HOSEK_WILKIE", 0.2, sun_direction=(0.3, -0.5, 0.8), turbidity=3.0,
                 ground_albedo=0.3)),
    Scene("world_camera_only", "The camera sees another world than the one that lights.",
          lambda s: _sky(s, mix(CAMERA, _background((0.5, 0.6, 0.8)),
                                _background((0.9, 0.3, 0.1))))),
    Scene("world_gradient", "A world coloured by direction.",
          lambda s: _sky(s, _background(WHERE))),
    Scene("film_transparent", "A transparent film: the world is not seen, but lights.",
          lambda s: (_sky(s, (0.5, 0.6, 0.8)), s.transparent_film())),
    Scene("film_transparent_glass", "Glass before a transparent film.",
          lambda s: (_sky(s, (0.5, 0.6, 0.8), node("BsdfGlass", Roughness=0.0)),
                     s.transparent_film()), {"film_transparent_glass": True}),
    Scene("world_hidden_from_camera", "The camera does not see the world.", _hidden("camera")),
    Scene("world_hidden_from_diffuse", "The world lights no matte surface.", _hidden("diffuse")),
    Scene("world_hidden_from_glossy", "Mirrors do not show the world.", _hidden("glossy")),
)  # fmt: skip
