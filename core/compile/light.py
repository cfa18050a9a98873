"""lamps, what glows, world -> lights.  What light can be sampled, and who runs into it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32, Vec
from ..bsdf import CAMERA, GLOSSY, TRANSMISSION
from ..geometry.accel import compile_accel
from ..geometry.mesh import Triangles, bare_triangles
from ..lights import Emitters, Lights, compile_hulls, ray_mask
from ..lights.environment import Environment, compile_environment
from ..plan import LampHulls
from ..scene import Material, Scene
from ..shading import SurfaceTable, WorldShader

# So many cells wide is the map of a world that is no picture, or a sky with a sun (Cycles).
LEAST_MAP, SKY_MAP = 1024, 512


# Up to so many lamps are tried one by one by rays that might meet them.
LAMPS_TRIED_EACH = 16


# Blender's choice of the sides of a glowing surface that are sampled, and ours
_SIDES = {"NONE": 0, "AUTO": 3, "FRONT": 1, "BACK": 2, "FRONT_BACK": 3}


def world_map(scene: Scene, world: WorldShader | None) -> Environment | None:
    """Return how the world is sampled; None where that would not help: it is even, or not asked."""
    if world is None or scene.world is None or world.is_constant or not scene.world.sampled:
        return None
    # A row of the map takes two columns, and pictures may have one
    width = max(world.finest[0] or (SKY_MAP if world.discs else LEAST_MAP), 2)

    def radiance(direction: Vec) -> Vec:
        return world.radiance(direction, 0, with_discs=False)

    # Suns shine by what the rest of the shader makes of them.
    discs = []
    for disc in world.discs:
        middle = np.array(disc.direction, F32)[:, None]
        seen = world.radiance(middle, 0) - radiance(middle)
        red, green, blue = seen[:, 0].tolist()
        discs.append(replace(disc, radiance=(red, green, blue)))
    return compile_environment(radiance, (width, width // 2), discs)


def compile_emitters(
    triangles: Triangles | None, materials: list[Material | None], surfaces: SurfaceTable
) -> Emitters | None:
    """Return the triangles that glow and are sampled on purpose, None if there are none."""
    if triangles is None or not surfaces.glows.any():
        return None
    radiance = surfaces.typical_emission()
    sides = np.array([_SIDES[m.emission_sampling if m else "AUTO"] for m in materials], np.int32)
    is_sampled = (sides > 0) & radiance.any(axis=0)
    number = triangles.ids[:, 0]
    chosen = is_sampled.take(number)
    if triangles.movement is not None:
        # Light that moves is found by chance alone.
        chosen &= ~triangles.movement.moves.take(triangles.ids[:, 2])
    index = np.flatnonzero(chosen).astype(np.int32)
    if not index.size:
        return None
    assert triangles.objects is not None
    objects, instance = triangles.objects, triangles.ids[:, 2].take(index)
    number = number.take(index)
    return Emitters(
        index,
        radiance.take(number, axis=1),
        objects.seen_by.take(instance).astype(np.int32),
        sides.take(number),
        objects.receivers.take(instance),
        objects.blockers.take(instance),
    )


def who_meets_lamps(lights: Lights | None, surfaces: SurfaceTable) -> int:
    """Return the ray kinds that may run into a lamp; rays from matte surfaces have sampled it."""
    if lights is None or not lights.lamps:
        return 0
    possible = CAMERA | GLOSSY | TRANSMISSION if surfaces.has_specular else CAMERA
    seen = 0
    for _, lamp in lights.lamps:
        seen |= ray_mask(lamp.seen_by) if lamp.sampled else 0
    return seen & possible


def compile_lamp_hulls(
    lights: Lights | None,
    seen_by: int,
    origin: NDArray[np.float64],
    should_stop: Callable[[], bool],
) -> LampHulls | None:
    """Return how rays find lamps, where they are too many to be tried one by one."""
    if lights is None or not seen_by or lights.count <= LAMPS_TRIED_EACH:
        return None
    hulls = compile_hulls(lights, origin)
    if hulls is None:
        return None
    triangles = bare_triangles(hulls.vertices, hulls.corners)
    accel, _ = compile_accel(triangles, False, should_stop)
    return LampHulls(hulls, triangles, accel) if accel else None
