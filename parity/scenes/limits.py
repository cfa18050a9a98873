"""rows -> scenes: bounce limits, clamps, caustics switches, filter glossy."""

from typing import Any

from ..nodes import diffuse, glass, glossy, principled
from .scene import LEAN, QUICK, Scene

BRIGHT = diffuse(0.85, 0.8, 0.7)


def _matte(s: Any) -> None:
    s.room(floor_of=BRIGHT)
    s.key()
    s.ball(BRIGHT)


def _mirrors(s: Any) -> None:
    """Face two mirror balls and a mirror floor."""
    s.room(floor_of=glossy(0.0, 0.9, 0.9, 0.9))
    s.key()
    s.ball(glossy(0.0, 0.9, 0.6, 0.4), (-0.85, 0, 0.8), 0.8)
    s.ball(glossy(0.0, 0.5, 0.7, 0.9), (0.85, 0, 0.8), 0.8)


def _glasses(s: Any) -> None:
    """Stand two panes of glass one before the other."""
    s.standard(diffuse(0.8, 0.5, 0.3))
    s.box(glass(), (-0.3, -1.5, 0.9), (1.4, 0.15, 1.6), "Pane")
    s.box(glass(), (0.3, -2.2, 0.8), (1.0, 0.15, 1.2), "Other pane")


def _point(s: Any) -> None:
    """Light matte things by a lamp without size: each light sample is the same."""
    s.room((0, 0, 0), floor_of=BRIGHT)
    s.ball(BRIGHT)
    s.lamp("POINT", 150, (-1.2, -1.6, 2.6), shadow_soft_size=0.0)


def _caustics(s: Any) -> None:
    """Throw caustics of a metal ring and a glass ball from a big lamp, which has few fireflies."""
    s.room((0.1, 0.12, 0.15))
    s.ball(glass(0.2), (-0.8, 0, 0.75), 0.75)
    s.ball(principled(Metallic=1.0, Roughness=0.2), (0.85, 0, 0.75), 0.75)
    s.lamp("AREA", 700, (-2.0, -2.0, 4.5), (0, 0, 0.6), size=3.5)


def _limit(name: str, shows: str, build: Any, *tags: str, **settings: Any) -> Scene:
    lean = LEAN if build in (_mirrors, _glasses) else {}
    return Scene(name, shows, build, lean | settings, tags)


ROWS = (
    _limit("bounces_0", "No bounce: direct light only.", _matte, *QUICK, max_bounces=0),
    _limit("bounces_1", "One bounce in all.", _matte, max_bounces=1),
    _limit("bounces_2_mirrors", "Two bounces in all, between mirrors.", _mirrors, max_bounces=2),
    _limit("diffuse_bounces_0", "No diffuse bounce.", _matte, diffuse_bounces=0),
    _limit("diffuse_bounces_1", "One diffuse bounce.", _matte, *QUICK, diffuse_bounces=1),
    _limit("diffuse_bounces_12", "Twelve diffuse bounces.", _matte, diffuse_bounces=12),
    _limit("glossy_bounces_0", "No glossy bounce.", _mirrors, glossy_bounces=0),
    _limit("glossy_bounces_1", "One glossy bounce.", _mirrors, glossy_bounces=1),
    _limit("glossy_bounces_8", "Eight glossy bounces.", _mirrors, glossy_bounces=8),
    _limit("transmission_bounces_0", "No transmission bounce.", _glasses, transmission_bounces=0),
    _limit("transmission_bounces_2", "Two transmission bounces.", _glasses,
           transmission_bounces=2),
    _limit("transmission_bounces_4", "Four transmission bounces: through both panes.", _glasses,
           transmission_bounces=4),
    Scene("lamp_max_bounces_0", "A lamp that lights only what the camera sees.",
          lambda s: (s.standard(BRIGHT, lamp_on=False),
                     setattr(s.key().data.cycles, "max_bounces", 0))),
    Scene("world_max_bounces_1", "A world that lights up to the first bounce.",
          lambda s: (s.standard(BRIGHT),
                     setattr(s.bpy.context.scene.world.cycles, "max_bounces", 1))),
    _limit("clamp_direct", "Direct light clamped to 0.8.", _point, sample_clamp_direct=0.8,
           max_bounces=0),
    _limit("clamp_indirect", "Indirect light clamped to 0.3.", _point, sample_clamp_indirect=0.3,
           max_bounces=1),
    _limit("caustics", "Caustics of metal and glass.", _caustics),
    _limit("caustics_reflective_off", "Caustics of metal switched off.", _caustics,
           caustics_reflective=False),
    _limit("caustics_refractive_off", "Caustics of glass switched off.", _caustics,
           caustics_refractive=False),
    _limit("caustics_off", "All caustics switched off.", _caustics, caustics_reflective=False,
           caustics_refractive=False),
    _limit("filter_glossy", "Filter Glossy 1: caustics blurred.", _caustics, blur_glossy=1.0),
    _limit("filter_glossy_mirrors", "Filter Glossy 1 of sharp mirrors.", _mirrors,
           blur_glossy=1.0, diffuse_bounces=4),
)  # fmt: skip
