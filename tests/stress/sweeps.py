"""parameters -> pictures at their extremes.  Values that files have by mistake, or on purpose.

A sweep gives scenes for the values of one parameter, and what is known of them: `within` are the
least and the largest mean of the picture, (1, 1) where theory gives the number.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from penumbra.core import Aperture, Scene

from ..support import scenes as s
from .scenes import SIZE, ball, floor, frosted, overview, principled, rough

ANY = (0.0, np.inf)


@dataclass(frozen=True)
class Sweep:
    """A parameter: its values, the scene for one, and bounds for the mean of the picture."""

    values: tuple[float, ...]
    build: Any
    within: Any = lambda value: ANY
    settings: Any = lambda value: {}
    tolerance: float = 1e-3


def _scene(*things, view=None, **more) -> Scene:
    return s.scene(view or overview(), *things, **more)


def _furnace(material, **more):
    """Nothing but a ball in a white world."""
    return _scene(ball(material, **more), s.world(1.0))


def _furnace_through(aperture):
    """The same, seen through a lens."""
    return _scene(ball(s.diffuse()), s.world(1.0), view=replace(overview(), aperture=aperture))


def _in_a_room(*things, view=None):
    walls = s.put(s.box(2.0), s.diffuse(0.8), name="Room")
    inside = s.camera((0, -1.5, 0.2), (0, 0, 0), size=SIZE, fov=70, clip_start=1e-3)
    return s.scene(view or inside, walls, *things)


def lit_by_a_small_lamp() -> float:
    """Return the mean of the picture of a white floor, 1.5 m below a lamp of 1 W/(sr m^2) m^2."""
    view = overview()
    left, right, bottom, top = view.window
    steps = (np.arange(32 * SIZE) + 0.5) / (32 * SIZE)
    x, y = np.meshgrid(left + (right - left) * steps, bottom + (top - bottom) * steps)
    ways = np.stack([x, y, -np.ones_like(x)], axis=-1) @ view.to_world[:, :3].T
    eye = view.to_world[:, 3]
    with np.errstate(divide="ignore"):
        hit = eye + ways * (-eye[2] / ways[..., 2])[..., None]
    on_floor = (ways[..., 2] < 0) & (np.abs(hit[..., :2]) <= 2).all(axis=-1)
    squared = (hit[..., :2] ** 2).sum(axis=-1) + 1.5**2
    return float(np.where(on_floor, 1.5**2 / squared**2 / np.pi, 0.0).mean())


ONE = (1.0, 1.0)

SWEEPS = {
    # Light is neither lost nor made: white surfaces in a white world
    "IOR of glass": Sweep(
        (0.5, 0.667, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.33, 2.4, 3.0),
        lambda ior: _furnace(s.glass(ior)),
        lambda ior: ONE,
        lambda ior: {"max_bounces": 64, "transmission_bounces": 64, "glossy_bounces": 64},
    ),
    "IOR of frosted glass": Sweep(
        (0.5, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.5, 3.0),
        lambda ior: _furnace(frosted(0.3, ior)),
        lambda ior: (0.8, 1.001),
        lambda ior: {"max_bounces": 64, "transmission_bounces": 64, "glossy_bounces": 64},
    ),
    "roughness of metal": Sweep(
        (0.0, 1e-8, 1e-5, 1e-3, 0.01, 0.1, 0.5, 1.0),
        lambda roughness: _furnace(rough(roughness, 1.0)),
        lambda roughness: (0.75, 1.001),
    ),
    "roughness of glass": Sweep(
        (0.0, 1e-8, 1e-5, 1e-3, 0.01, 0.1, 0.5, 1.0),
        lambda roughness: _furnace(frosted(roughness)),
        lambda roughness: (0.75, 1.001),
        lambda roughness: {"max_bounces": 64, "transmission_bounces": 64, "glossy_bounces": 64},
    ),
    "roughness of Principled": Sweep(
        (0.0, 1e-8, 1e-4, 0.3, 1.0),
        lambda r: _furnace(principled(Base_Color=s.colour(1.0), Roughness=r, Coat_Weight=1.0)),
        lambda r: (0.75, 1.001),
    ),
    "IOR of Principled": Sweep(
        (0.5, 1.0, 1.0 + 1e-6, 1.5, 3.0, 1e3),
        lambda ior: _furnace(principled(Base_Color=s.colour(1.0), IOR=ior)),
        lambda ior: (0.75, 1.001 if ior >= 1 else 1.2),  # Cycles' makes light below 1, too
    ),
    "anisotropy": Sweep(
        (0.0, 1e-6, 0.5, 0.99, 1.0),
        lambda a: _furnace(principled(Metallic=1.0, Anisotropic=a, Base_Color=s.colour(1.0))),
        lambda a: (0.75, 1.001),
    ),
    # Lamps: their power does not depend on their size
    "size of an area lamp": Sweep(
        (1e-6, 1e-4, 1e-2, 0.1),
        lambda size: _scene(
            floor(s.diffuse(1.0)),
            s.area((0, 0, 1.5), (0, 0, 0), radiance=1 / size**2, size=(size, size)),
        ),
        lambda size: (lit_by_a_small_lamp(),) * 2,
    ),
    "large area lamps": Sweep(
        (1e1, 1e2, 1e3),
        lambda size: _scene(
            floor(s.diffuse(1.0)), s.area((0, 0, 1.5), (0, 0, 0), size=(size, size))
        ),
        lambda size: (0.2, 1.001),
    ),
    "radius of a point lamp": Sweep(
        (0.0, 1e-6, 1e-3, 0.1, 1.0, 10.0),
        lambda radius: _scene(floor(), s.point((0, 0, 1.5), 2.0, radius=radius)),
        lambda radius: ANY,
    ),
    "angle of a sun": Sweep(
        (0.0, 1e-8, 1e-4, 0.1, np.pi / 2, np.pi),
        lambda angle: _scene(floor(s.diffuse(1.0)), s.sun((0, 0, 1), np.pi, angle=angle)),
        lambda angle: (0.2, 1.001),
    ),
    "angle of a spot": Sweep(
        (0.0, 1e-6, 0.01, 1.0, np.pi - 1e-6, np.pi),
        lambda angle: _scene(floor(), s.spot((0, 0, 1.5), spot_angle=angle)),
    ),
    "blend of a spot": Sweep(
        (0.0, 1e-8, 0.5, 1.0), lambda b: _scene(floor(), s.spot((0, 0, 1.5), spot_blend=b))
    ),
    "a lamp this far above the floor": Sweep(
        (0.0, 1e-9, 1e-6, 1e-3),
        lambda height: _scene(floor(), s.area((0, 0, height), (0, 0, -1), size=(0.5, 0.5))),
    ),
    "a point lamp this far above the floor": Sweep(
        (0.0, 1e-9, 1e-6, 1e-3), lambda height: _scene(floor(), s.point((0, 0, height), 1.0))
    ),
    # Cameras
    "camera this far from a wall": Sweep(
        (0.0, 1e-7, 1e-4),
        lambda gap: _in_a_room(
            view=s.camera((0, 2 - gap, 0), (0, 0, 0), size=SIZE, fov=70, clip_start=1e-5)
        ),
        lambda gap: (0.0, 0.0),
    ),
    "camera inside glass": Sweep(
        (1.0, 1.33, 2.0),
        lambda ior: _scene(ball(s.glass(ior), radius=3.5, centre=(0, -3, 1)), s.world(1.0)),
        lambda ior: ONE,
        lambda ior: {"max_bounces": 200, "transmission_bounces": 200, "glossy_bounces": 200},
        1e-2,
    ),
    "focal length of 36 mm film": Sweep(
        (1.0, 10.0, 500.0, 5000.0),
        lambda mm: _scene(
            floor(),
            ball(s.diffuse()),
            s.world(1.0),
            view=s.camera(
                (0, -3, 1), (0, 0, 0.5), size=SIZE, fov=np.degrees(2 * np.arctan(18 / mm))
            ),
        ),
        lambda mm: (0.3, 1.001),
    ),
    "f-stop of a lens of 50 mm": Sweep(
        (0.01, 0.5, 8.0, 1000.0),
        lambda stop: _furnace_through(Aperture(radius=0.025 / stop, focus=3.0)),
        lambda stop: ONE,
    ),
    "focus distance of a fast lens": Sweep(
        (1e-6, 1e-2, 1.0, 1e6, 1e12),
        lambda distance: _furnace_through(Aperture(radius=0.05, focus=distance)),
        lambda distance: ONE,
    ),
    "shift of a camera": Sweep(
        (-1e3, -1.0, 1e-6, 10.0, 1e3),
        lambda shift: _scene(
            ball(s.diffuse()),
            s.world(1.0),
            view=replace(overview(), window=tuple(np.add(overview().window, shift))),
        ),
        lambda shift: ONE,
    ),
    # Numbers
    "brightness of everything": Sweep(
        (0.0, 1e-38, 1e-30, 1e-12, 1e12, 1e30),
        lambda value: _scene(
            floor(s.diffuse(1.0)), ball(rough()), s.sun((0, -1, 2), value), s.world(value)
        ),
    ),
    "colour of everything": Sweep(
        (0.0, 1e-45, 1e-38, 1e-20, 1.0),
        lambda value: _scene(floor(s.diffuse(value)), ball(s.mirror(value)), s.world(1.0)),
        lambda value: (0.0, 1.001),
    ),
    "albedo above 1": Sweep(
        (1.5, 10.0), lambda value: _scene(floor(s.diffuse(value)), ball(rough()), s.world(1.0))
    ),
    # Long runs
    "bounces in a closed white room": Sweep(
        (10.0, 1000.0),
        lambda bounces: s.scene(
            s.camera((0, -1.5, 0.2), size=4, fov=70, clip_start=1e-3),
            s.put(s.box(2.0), s.glowing(0.95, 1.0)),
        ),
        # The last bounce still sees light: it is direct there
        lambda bounces: ((1 - 0.95 ** (bounces + 2)) / 0.05,) * 2,
        lambda bounces: {
            "max_bounces": int(bounces),
            "diffuse_bounces": int(bounces),
            "samples": 64,
        },
    ),
    "samples of a pixel": Sweep(
        (16.0, 10000.0),
        lambda count: s.scene(
            s.camera((0, -3, 1), (0, 0, 0), size=2, fov=1), floor(s.diffuse(0.5)), s.world(1.0)
        ),
        lambda count: (0.5, 0.5),
        lambda count: {"samples": int(count)},
        1e-5,
    ),
}

LONG = {"bounces in a closed white room": 1000.0, "samples of a pixel": 10000.0}
