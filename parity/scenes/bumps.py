"""rows -> scenes: normals bent by maps, by heights, by displacement."""

from typing import Any

from ..nodes import Node, diffuse, glossy, math, node, principled
from .scene import LEAN, QUICK, Scene, ball_of

PLACE = node("SeparateXYZ", Vector=node("NewGeometry")["Position"])


def _wave(output: str, rate: float) -> Node:
    return math("SINE", math("MULTIPLY", PLACE[output], rate))


WAVES = math("ADD", _wave("X", 9.0), _wave("Z", 7.0))
MAP = node("CombineXYZ", X=math("MULTIPLY_ADD", _wave("X", 8.0), 0.3, 0.5),
           Y=math("MULTIPLY_ADD", _wave("Z", 6.0), 0.3, 0.5), Z=0.8)  # fmt: skip
BUMP = node("Bump", Height=WAVES, Distance=0.06, Strength=1.0)["Normal"]
STEEP = node("Bump", Height=WAVES, Distance=0.2, Strength=1.0)["Normal"]
MAPPED = node("NormalMap", Color=MAP, space="WORLD")["Normal"]


def _displaced(s: Any, shader: Node) -> None:
    s.displace(s.standard(shader), node("Displacement", Height=WAVES, Scale=0.06, Midlevel=0.0))


def _uncorrected(s: Any) -> None:
    """Put steep waves whose light is not softened near the terminator."""
    ball = s.standard(node("BsdfDiffuse", Normal=STEEP))
    ball.data.materials[0].cycles.use_bump_map_correction = False


def _row(name: str, shows: str, shader: Node, tags: tuple[str, ...] = (), **more: Any) -> Scene:
    return Scene(f"bump_{name}", shows, ball_of(shader, **more), LEAN, tags)


ROWS = (
    _row("diffuse", "Matte waves.", node("BsdfDiffuse", Normal=BUMP), QUICK),
    _row("diffuse_steep", "Steep matte waves, which darken near the terminator.",
         node("BsdfDiffuse", Normal=STEEP)),
    Scene("bump_uncorrected", "The same without bump map correction.", _uncorrected, LEAN),
    _row("diffuse_rough", "Waves of clay.", node("BsdfDiffuse", Roughness=1.0, Normal=BUMP)),
    _row("flat", "Waves on facets.", node("BsdfDiffuse", Normal=BUMP), smooth=False),
    _row("glossy", "Brushed waves.", glossy(0.3, Normal=BUMP)),
    _row("glossy_steep", "Steep glossy waves.", glossy(0.4, Normal=STEEP)),
    _row("glass", "Wavy frosted glass.", node("BsdfGlass", Roughness=0.4, Normal=BUMP)),
    _row("translucent", "Waves that let light through.", node("BsdfTranslucent", Normal=BUMP)),
    _row("sheen", "Waves of cloth.", node("BsdfSheen", Roughness=0.5, Normal=BUMP)),
    _row("principled", "Principled, all of it with waves.",
         principled(Roughness=0.4, Coat_Weight=0.5, Normal=BUMP)),
    _row("coat", "Waves below an even coat.",
         principled(Roughness=0.4, Coat_Weight=1.0, Coat_Roughness=0.3, Normal=BUMP,
                    Coat_Normal=node("NewGeometry")["Normal"])),
    _row("coat_only", "An even base below a wavy coat.",
         principled(Roughness=0.4, Coat_Weight=1.0, Coat_Roughness=0.3, Coat_Normal=BUMP)),
    Scene("bump_displacement", "Waves by displacement.",
          lambda s: _displaced(s, diffuse()), LEAN),
    Scene("bump_displacement_glossy", "Glossy waves by displacement.",
          lambda s: _displaced(s, glossy(0.3)), LEAN),
    _row("map_world", "A map of normals in the world.", node("BsdfDiffuse", Normal=MAPPED)),
)  # fmt: skip
