"""rows -> scenes: glass, refraction, transmission, thin walls."""

from ..nodes import Node, glass, node, principled
from .scene import LEAN, QUICK, Scene, ball_of


def _through(name: str, shows: str, shader: Node, tags: tuple[str, ...] = ()) -> Scene:
    return Scene(name, shows, ball_of(shader), LEAN, tags)


def _transmission(name: str, shows: str, **inputs: object) -> Scene:
    given = {"Base_Color": (0.7, 0.9, 1.0), "Transmission_Weight": 1.0, "Roughness": 0.0}
    return _through(f"transmission_{name}", shows, principled(**(given | inputs)))


ROWS = (
    _through("glass", "Clear glass.", glass(), QUICK),
    Scene("glass_bounces", "Clear glass, with all bounces and its caustics.", ball_of(glass())),
    Scene("glass_rough_bounces", "Rough glass, with all bounces and its caustics.",
          ball_of(glass(0.3))),
    _through("glass_colour", "Coloured glass of index 1.8.", glass(0.0, 0.9, 0.5, 0.2, IOR=1.8)),
    _through("glass_ior_1", "Glass of index 1: invisible, but for its colour.",
             glass(0.0, 0.9, 0.8, 0.5, IOR=1.0)),
    _through("glass_inverted", "Index 0.7: a bubble of air in something denser.",
             glass(IOR=0.7)),
    _through("glass_rough", "Rough glass, GGX.", glass(0.3)),
    _through("glass_very_rough", "Glass of roughness 0.8, GGX.", glass(0.8, 0.9, 0.7, 0.5)),
    _through("glass_beckmann", "Rough glass, Beckmann.", glass(0.3, distribution="BECKMANN")),
    _through("glass_multi", "Rough glass, multi-scatter GGX.",
             glass(0.6, 0.9, 0.7, 0.5, distribution="MULTI_GGX")),
    _through("glass_film", "Glass under a thin film of 500 nm.",
             glass(0.0, Thin_Film_Thickness=500.0)),
    _through("refraction", "Refraction without reflection.",
             node("BsdfRefraction", Roughness=0.0, IOR=1.3, distribution="GGX")),
    _through("refraction_rough", "Rough refraction, GGX.",
             node("BsdfRefraction", Roughness=0.35, IOR=1.45, distribution="GGX")),
    _through("refraction_beckmann", "Rough refraction, Beckmann.",
             node("BsdfRefraction", Roughness=0.35, IOR=1.45, distribution="BECKMANN")),
    _transmission("sharp", "Principled glass."),
    _transmission("roughness_02", "Principled glass of roughness 0.2.", Roughness=0.2),
    _transmission("roughness_06", "Principled glass of roughness 0.6.", Roughness=0.6),
    _transmission("half", "Transmission 0.5 over the base colour.",
                  Transmission_Weight=0.5, Roughness=0.2),
    _transmission("tint", "Principled glass with a tinted reflection.",
                  Specular_Tint=(1.0, 0.4, 0.2), Roughness=0.2, IOR=2.0),
    _transmission("thin_wall", "Thin wall: transmitted without bending.", Thin_Wall=True),
    _transmission("thin_wall_rough", "Thin wall of roughness 0.4.", Thin_Wall=True, Roughness=0.4),
    Scene("thin_wall_leaf", "A thin wall with subsurface: light comes through as from a leaf.",
          lambda s: (s.room(), s.key(), s.plane(principled(
              Thin_Wall=True, Subsurface_Weight=1.0), (0, 0, 1), (70, 0, 30), 2.0))),
    Scene("thin_wall_shadow", "A thin wall in the way of a lamp without size: a faint shadow.",
          lambda s: (s.room(), s.lamp("POINT", 300, (-1.5, -2, 3), shadow_soft_size=0.0),
                     s.plane(principled(Thin_Wall=True, Transmission_Weight=1.0, Roughness=0.0,
                                        Base_Color=(0.7, 0.9, 1.0)), (-0.5, -0.8, 1.4),
                             (20, -20, 0), 1.8))),
    Scene("glass_pane", "A box of glass before the wall: a shifted view and reflections.",
          lambda s: (s.room(), s.key(), s.box(glass(), (0, -0.5, 1), (1.8, 0.3, 1.8)))),
)  # fmt: skip
