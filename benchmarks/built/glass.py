"""numbers -> a bottle of tea, a tumbler of water, and balls of clear and frosted glass on a table.

Glass and liquid meet in surfaces of their own: where the bottle's inner wall is wet, its index is
that of the liquid over that of glass. A large area lamp stands behind and another above, so that
caustics fall on the table; they are met by chance, as in any path tracer.
"""

from ...examples._stage import ball, box, camera, lamp, matte, orb, put, surface
from .shapes import begin, lathe, plastic, rounded

GLASS, WATER = 1.5, 1.33


def build():
    """Make the table in an empty file."""
    begin(360, 256, world=(0.20, 0.23, 0.27))
    clear = _glass("Glass", GLASS)
    _room()
    _bottle(clear)
    _tumbler(clear)
    orb("Clear ball", 0.2, clear, at=(0.14, -0.55, 0.2005))
    orb("Frosted ball", 0.2, _glass("Frosted glass", GLASS, 0.12), at=(0.62, -0.42, 0.2005))
    frosted = surface(
        "Frosted", "BsdfPrincipled", (0.75, 0.9, 0.95), Roughness=0.2, IOR=1.45,
        Transmission_Weight=1.0,
    )  # fmt: skip
    put("Block", box(0.32, 0.16, 0.5), frosted, at=(-0.95, -0.1, 0.2505), turn=(0, 0, 25))
    lamp("Window", "AREA", 110, (-1.2, 2.0, 2.4), (0, 0, 0.2), (1.0, 0.95, 0.88),
         shape="RECTANGLE", size=2.4, size_y=1.6)  # fmt: skip
    lamp("Fill", "AREA", 25, (2.4, -1.6, 2.2), (0, 0, 0.3), (0.8, 0.9, 1.0),
         shape="SQUARE", size=1.0)  # fmt: skip
    camera(at=(0.1, -3.3, 1.35), to=(-0.05, 0, 0.42), lens=52)


def _glass(name, ior, roughness=0.0, color=(1, 1, 1)):
    return surface(name, "BsdfGlass", color, Roughness=roughness, IOR=ior)


def _room():
    put("Table", box(5, 3.2, 0.1), matte("Table", (0.52, 0.36, 0.24)), at=(0, 0, -0.05))
    put("Wall", box(12, 0.1, 6), matte("Wall", (0.36, 0.42, 0.45)), at=(0, 2.6, 1.5))
    put("Runner", box(1.7, 0.9, 0.002), matte("Runner", (0.75, 0.73, 0.68)), at=(0, -0.35, 0.0011))
    # Something to look at through the glass.
    for k, color in enumerate([(0.7, 0.1, 0.06), (0.8, 0.5, 0.08), (0.1, 0.3, 0.45)]):
        put("Post", box(0.13, 0.13, 0.55), plastic(f"Post {k}", color),
            at=(-0.65 + 0.5 * k, 0.85, 0.275), turn=(0, 0, 20 * k))  # fmt: skip
    put("Cherry", ball(0.09, 48), plastic("Cherry", (0.6, 0.02, 0.03)), at=(-0.42, -0.72, 0.0925))


def _vessel(name, glass, inner, level, outer, liquid, at, tint, segments=96):
    """Put glass between two profiles that rise to the same rim, filled up to `level`.

    The outer wall looks out, the dry inner wall into the air inside; the wet inner wall and the
    top of the liquid look out of the liquid.
    """
    wet = [p for p in inner if p[1] <= level]
    radius = _radius_at(inner, level)
    dry = [(radius, level)] + [p for p in inner if p[1] > level]
    put(f"{name} outside", lathe(outer, segments), glass, at)
    put(f"{name} inside", lathe([outer[-1], *dry[::-1]], segments), glass, at)
    wall = _glass(f"{name} wet wall", liquid / GLASS, 0.0, tint)
    put(f"{name} wet wall", lathe([*wet, (radius, level)], segments), wall, at)
    top = _glass(f"{name} top", liquid, 0.0, tint)
    put(f"{name} top", lathe([(radius, level), (0, level)], segments, False), top, at)


def _radius_at(profile, level):
    for (r0, z0), (r1, z1) in zip(profile, profile[1:], strict=False):
        if z0 <= level < z1:
            return r0 + (r1 - r0) * (level - z0) / (z1 - z0)
    raise ValueError(f"the profile does not reach {level}")


def _bottle(clear):
    outer = [(0, 0.0), (0.22, 0.0), (0.25, 0.04), (0.25, 0.55), (0.24, 0.66), (0.09, 0.78),
             (0.085, 1.0), (0.085, 1.08)]  # fmt: skip
    inner = [(0, 0.05), (0.2, 0.05), (0.225, 0.08), (0.225, 0.54), (0.215, 0.64), (0.065, 0.77),
             (0.06, 1.0), (0.06, 1.08)]  # fmt: skip
    tea = (0.93, 0.66, 0.30)
    at = (-0.42, 0.12, 0.0025)
    _vessel("Bottle", clear, rounded(inner), 0.5, rounded(outer), WATER, at, tea)


def _tumbler(clear):
    outer = [(0, 0.0), (0.16, 0.0), (0.18, 0.03), (0.2, 0.3), (0.22, 0.5)]
    inner = [(0, 0.06), (0.13, 0.06), (0.16, 0.09), (0.18, 0.3), (0.2, 0.5)]
    at = (0.36, 0.1, 0.0025)
    _vessel("Tumbler", clear, rounded(inner), 0.33, rounded(outer), WATER, at, (1, 1, 1))
