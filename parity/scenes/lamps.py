"""rows -> scenes: lamps of each kind, seen and unseen, many of them, with node trees."""

import math as m
from typing import Any

from ..nodes import diffuse, glossy, glow, math, node
from .scene import LEAN, QUICK, Scene

HIGH = (-2.6, -2.8, 4.6)
POLISHED = glossy(0.3, 0.7, 0.7, 0.7)
DIRECT = {"max_bounces": 0}  # caustics are rare and bright, and not what this is about


def _lamp(
    name: str, shows: str, kind: str, energy: float, at: tuple[float, ...] = HIGH, **more: Any
) -> Scene:
    """Return two matte things, a polished floor and a lamp: NEE and MIS have both to be right."""

    def build(s: Any) -> None:
        s.room((0.03, 0.035, 0.04), floor_of=POLISHED)
        s.ball(diffuse())
        s.ball(glossy(0.45, 0.5, 0.5, 0.5), (1.35, -0.7, 0.5), 0.5, name="Shiny ball")
        s.lamp(kind, energy, at, (0, 0, 0.6), **more)

    return Scene(f"lamp_{name}", shows, build, DIRECT)


def _seen(s: Any, kind: str, energy: float, **more: Any) -> None:
    """Show a lamp to the camera, with a mirror beside it."""
    s.room()
    s.ball(glossy(0.0), (0.9, 0, 0.8), 0.8)
    s.lamp(kind, energy, (-0.9, -0.6, 1.6), (0, -3, 1), **more).visible_camera = True


def _matte(s: Any) -> None:
    """Light matte things on a mirror by one lamp of each kind."""
    s.room((0.03, 0.035, 0.04), floor_of=glossy(0.0))
    s.ball(diffuse())
    s.ball(diffuse(0.8, 0.6, 0.3), (1.35, -0.7, 0.45), 0.45)
    s.lamp("POINT", 60, (-2.6, -1.8, 2.6), (0, 0, 1), color=(1, 0.5, 0.3), shadow_soft_size=0.2)
    s.lamp("SPOT", 300, (2.6, -2.8, 3.6), (0, 0, 0.6), color=(0.3, 0.6, 1), spot_size=m.radians(35))
    s.lamp("SUN", 0.5, (0, -3, 4), (0, 0, 0), color=(0.5, 1, 0.5), angle=m.radians(5))
    s.lamp("AREA", 60, (-0.5, -2.5, 4), (0, 0, 0.6), size=1.5)


def _many(s: Any) -> None:
    s.room((0, 0, 0))
    s.ball(diffuse())
    for k in range(200):
        turn, reach = 2.399963 * k, 0.25 * m.sqrt(k + 0.5)
        at = (reach * m.cos(turn), reach * m.sin(turn) - 0.4, 0.35 + 2.2 * ((k * 0.618) % 1))
        if abs(m.dist(at, (0, 0, 1))) < 1.1:
            continue
        colour = [0.4 + 0.6 * ((k * step) % 1) for step in (0.37, 0.53, 0.71)]
        s.lamp("POINT", 0.3 + 2.5 * ((k * 0.29) % 1), at, color=colour, shadow_soft_size=0.03)


def _tree(
    name: str, shows: str, shader: Any, kind: str = "POINT", energy: float = 220, **more: Any
) -> Scene:
    def build(s: Any) -> None:
        s.room((0.03, 0.035, 0.04))
        s.ball(diffuse())
        s.light_nodes(s.lamp(kind, energy, HIGH, (0, 0, 0.6), **more), shader)

    return Scene(f"lamp_tree_{name}", shows, build)


def _half(vector: Any) -> Any:
    """Return a vector of -1 to 1 as a colour."""
    half = (0.5, 0.5, 0.5)
    return node("Mapping", Vector=vector, Location=half, Scale=half)


# What Object Info is asked for, the strength of the lamp, and where it is
LABELS = (
    ("Location", 20, (2.2, -2.2, 2.6)),
    ("Color", 60, (-2.6, -2.6, 2.6)),
    ("Alpha", 60, (0.0, -3.0, 3.6)),
    ("Object_Index", 20, (-1.6, -0.6, 3.2)),
    ("Random", 60, (1.7, -0.4, 3.2)),
)


def _labelled(s: Any, output: str, energy: float, at: tuple[float, ...]) -> None:
    told = node("ObjectInfo")[output.replace("_", " ")]
    told = node("VectorMath", operation="ABSOLUTE", Vector=told)["Vector"]  # no negative light
    lamp = s.lamp("POINT", energy, at, shadow_soft_size=0.1)
    lamp.color, lamp.pass_index = (0.9, 0.5, 0.2, 0.7), 3
    s.light_nodes(lamp, node("Emission", Color=told, Strength=1.0))


def _linked(s: Any, collection: str, state: str) -> None:
    s.room()
    ball, other = s.ball(diffuse(), (-0.8, 0, 0.8), 0.8), s.ball(diffuse(), (0.9, 0, 0.8), 0.8)
    lamp = s.key()
    side = s.lamp("POINT", 90, (2.5, -2.5, 3), color=(0.3, 0.5, 1.0), shadow_soft_size=0.3)
    setattr(lamp.light_linking, collection, s.linked("First", [ball], state))
    setattr(side.light_linking, collection, s.linked("Second", [other], state))


ROWS = (
    _lamp("point", "A point lamp of some size.", "POINT", 260, shadow_soft_size=0.3),
    _lamp("point_sharp", "A point lamp without size: sharp shadows, no mirror image.",
          "POINT", 260, shadow_soft_size=0.0),
    _lamp("point_hard_falloff", "A big point lamp near things, without soft falloff.",
          "POINT", 60, at=(-1.0, -1.1, 2.0), shadow_soft_size=0.6, use_soft_falloff=False),
    _lamp("point_soft_falloff", "A big point lamp near things, with soft falloff.",
          "POINT", 60, at=(-1.0, -1.1, 2.0), shadow_soft_size=0.6, use_soft_falloff=True),
    _lamp("spot", "A spot with a soft edge.", "SPOT", 900, shadow_soft_size=0.2,
          spot_size=m.radians(40), spot_blend=0.5),
    _lamp("spot_square", "A square spot with a hard edge.", "SPOT", 900, shadow_soft_size=0.1,
          spot_size=m.radians(35), spot_blend=0.0, use_square=True),
    _lamp("sun", "A sun of half a degree.", "SUN", 3.0, angle=m.radians(0.53)),
    _lamp("sun_wide", "A sun of 40 degrees, as through clouds.", "SUN", 1.5,
          angle=m.radians(40)),
    _lamp("area_square", "A square lamp.", "AREA", 260, shape="SQUARE", size=1.2),
    _lamp("area_rectangle", "A long rectangle.", "AREA", 260, shape="RECTANGLE", size=0.1,
          size_y=3.0),
    _lamp("area_disk", "A disk.", "AREA", 260, shape="DISK", size=1.5),
    _lamp("area_ellipse", "An ellipse.", "AREA", 260, shape="ELLIPSE", size=0.6, size_y=2.5),
    _lamp("area_spread", "A square lamp of spread 40 degrees.", "AREA", 40, shape="SQUARE",
          size=1.2, spread=m.radians(40)),
    _lamp("area_beam", "A square lamp of spread 0: a beam.", "AREA", 8, shape="SQUARE",
          size=1.2, spread=0.0),
    _lamp("not_normalized", "A disk whose energy is not shared out over its area.", "AREA", 40,
          shape="DISK", size=1.5, normalize=False),
    _lamp("exposure_temperature", "A lamp of 3000 K with an exposure of 1 stop.", "POINT", 130,
          shadow_soft_size=0.2, exposure=1.0, use_temperature=True, temperature=3000.0),
    _lamp("no_shadow", "A lamp that throws no shadow.", "POINT", 260, shadow_soft_size=0.3,
          use_shadow=False),
    Scene("lamp_seen_area", "An area lamp that the camera sees, and its mirror image.",
          lambda s: _seen(s, "AREA", 60, size=0.8), LEAN),
    Scene("lamp_seen_point", "A point lamp that the camera sees, and its mirror image.",
          lambda s: _seen(s, "POINT", 60, shadow_soft_size=0.3), LEAN),
    Scene("lamp_seen_spot", "A spot that the camera sees from aside.",
          lambda s: _seen(s, "SPOT", 200, shadow_soft_size=0.3, spot_size=m.radians(100)), LEAN),
    Scene("lamp_hidden_from_glossy", "A lamp whose mirror image is switched off.",
          lambda s: (s.standard(glossy(0.1), lamp_on=False),
                     setattr(s.key(), "visible_glossy", False)), LEAN),
    Scene("lamp_hidden_from_diffuse", "A lamp that lights no matte surface.",
          lambda s: (s.standard(glossy(0.3), lamp_on=False),
                     setattr(s.key(), "visible_diffuse", False)), LEAN),
    Scene("lamps_matte", "A point, a spot, a sun and an area on matte things and a mirror.", _matte,
          DIRECT, QUICK),
    Scene("lamps_many", "Two hundred lamps of all colours and strengths.", _many),
    _tree("strength", "A lamp's tree: colour and strength.", glow(2.0, 1.0, 0.5, 0.2)),
    _tree("falloff_linear", "A lamp's tree: linear falloff.",
          glow(node("LightFalloff", Strength=1.0)["Linear"]), energy=60),
    _tree("falloff_constant", "A lamp's tree: constant falloff.",
          glow(node("LightFalloff", Strength=0.4)["Constant"]), energy=20),
    _tree("falloff_smooth", "A lamp's tree: quadratic falloff, smoothed near the lamp.",
          glow(node("LightFalloff", Strength=1.0, Smooth=10.0)["Quadratic"]), energy=260),
    _tree("ray_length", "A lamp's tree: strength by the length of the ray.",
          glow(math("MULTIPLY", node("LightPath")["Ray Length"], 0.2)), energy=220),
    _tree("area", "An area lamp's tree.", glow(1.5, 0.4, 0.7, 1.0), "AREA", 200),
    _tree("blackbody", "A lamp's tree: the colour of a black body.",
          node("Emission", Color=node("Blackbody", Temperature=2500.0), Strength=1.0)),
    _tree("wavelength", "A lamp's tree: the colour of a wavelength.",
          node("Emission", Color=node("Wavelength", Wavelength=585.0), Strength=2.0)),
    _tree("sun", "A sun's tree: distances do not count.",
          glow(node("LightFalloff", Strength=1.5)["Constant"], 1.0, 0.8, 0.5), "SUN", 2),
    _tree("position", "A lamp's tree: the place on an area lamp is its colour.",
          node("Emission", Color=node("NewGeometry")["Parametric"], Strength=3.0), "AREA", 200,
          size=2.0),
    _tree("spot", "A spot's tree: a picture in its cone.",
          node("Emission", Color=node("NewGeometry")["Parametric"], Strength=3.0), "SPOT", 400,
          spot_size=m.radians(60), shadow_soft_size=0.1),
    _tree("normal", "A point lamp's tree: colours by the direction of light.",
          node("Emission", Color=_half(node("TexCoord")["Normal"]), Strength=1.0), energy=400),
    _tree("ball", "A ball-shaped lamp's tree: the place in its own space.",
          node("Emission", Color=node("VectorMath", operation="ABSOLUTE",
               Vector=node("TexCoord")["Object"])["Vector"], Strength=2.0),
          energy=300, shadow_soft_size=1.0, use_soft_falloff=False),
    _tree("reflection", "An area lamp's tree: colours by the mirrored direction.",
          node("Emission", Color=_half(node("TexCoord")["Reflection"]), Strength=1.0), "AREA", 300),
    _tree("noise", "A lamp's tree: a texture that is not told where.",
          node("Emission", Color=node("TexNoise", Scale=1.5)["Color"], Strength=2.0), energy=300,
          shadow_soft_size=0.8, use_soft_falloff=False),
    Scene("lamp_tree_label", "Lamps coloured by what Object Info tells of them.",
          lambda s: (s.room((0.03, 0.035, 0.04)), s.ball(diffuse()),
                     [_labelled(s, *row) for row in LABELS])),
    _tree("depth", "A lamp's tree: other colours for light that has bounced.",
          node("Emission", Color=node("Mix", data_type="RGBA", Factor_Float=math(
              "GREATER_THAN", node("LightPath")["Ray Depth"], 1.5), A_Color=(1, 0.2, 0.1),
              B_Color=(0.1, 0.3, 1)), Strength=1.0), "AREA", 400),
    Scene("lamp_tree_seen", "A lamp with a tree that the camera sees, and its mirror image.",
          lambda s: (_seen(s, "AREA", 60, size=0.8), s.light_nodes(
              s.bpy.context.scene.objects["Area"], node("Emission", Strength=2.0,
              Color=node("NewGeometry")["Parametric"])))),
    Scene("lamps_many_trees", "Two hundred lamps with linear falloff.",
          lambda s: (_many(s), [s.light_nodes(thing, glow(node(
              "LightFalloff", Strength=1.0)["Linear"])) for thing in
              s.bpy.context.scene.objects if thing.type == "LIGHT"])),
    Scene("lamp_unsampled", "A lamp without multiple importance sampling, seen by the camera.",
          lambda s: (_seen(s, "POINT", 60, shadow_soft_size=0.3),
                     setattr(s.bpy.data.lights["Point"].cycles,
                             "use_multiple_importance_sampling", False))),
    Scene("light_linking", "Two lamps that each light one of two balls only.",
          lambda s: _linked(s, "receiver_collection", "INCLUDE")),
    Scene("light_linking_exclude", "Two lamps that each leave out one of two balls.",
          lambda s: _linked(s, "receiver_collection", "EXCLUDE")),
    Scene("shadow_linking", "Two lamps that each see the shadow of one of two balls only.",
          lambda s: _linked(s, "blocker_collection", "INCLUDE")),
)  # fmt: skip
