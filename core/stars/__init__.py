"""scene -> StarPlan.  What is smaller than a pixel, drawn without chance.

Rays through pixels hardly ever meet a star.  So the way is gone backwards: each star is found on
the picture and adds its light to the pixels whose filter covers it, as bright as the limit of a
sphere that shrinks while its power stays.  A star that moves, or is out of focus, is shared out
over times and places on the lens.  What lies between it and the camera dims it.  Stars do not light
surfaces, and are not seen in mirrors or through glass that bends rays.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camera import pixel_filter
from ..film.ledger import Ledger
from ..geometry.motion import along_arcs
from ..sampling.hashing import keys_of, uniform, words_of
from ..scene import Note, Scene
from ..settings import Settings
from ..shutter import CompiledShutter, compile_shutter
from .field import make_field

PURPOSE = 0x57A25  # of random numbers, apart from those of pixels

Steps = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cluster:
    """S stars of one object or, `is_distant`, of the world.

    light (S, 3) float64: intensity [W/sr] or, of the world, irradiance [W/m2]; places (K, S, 3), or
    unit directions, and affines (A, 3, 4) to places about the local origin [m] at equal steps of
    time; starts (S, 2) in [0, 1): where the lens samples of each begin, None without a lens; sums:
    which of the film's it adds to.
    """

    light: NDArray[np.float64]
    places: Steps
    affines: Steps
    starts: NDArray[np.float32] | None
    sums: tuple[str, ...]
    is_distant: bool = False

    @property
    def size(self) -> int:
        """The number of stars."""
        return len(self.light)

    @property
    def moves(self) -> bool:
        """Whether any of them moves while the shutter is open."""
        return len(self.places) > 1 or len(self.affines) > 1

    def at(self, star: NDArray[np.intp], time: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return where (3, N) stars (N,) are at times (N,)."""
        step, rest = _between(len(self.places), time)
        place = self.places[step, star]
        if len(self.places) > 1:
            place += (self.places[step + 1, star] - place) * rest[:, None]
        step, rest = _between(len(self.affines), time)
        affine = self.affines[step]
        if len(self.affines) > 1:
            affine += (self.affines[step + 1] - affine) * rest[:, None, None]
        x, y, z = place.T
        out = np.empty((3, star.size))
        for row, (a, b, c, d) in zip(out, affine.transpose(1, 2, 0), strict=True):
            row[:] = a * x + b * y + c * z + d
        return out


def _between(steps: int, time: NDArray[np.floating]) -> tuple[NDArray[np.intp], Steps]:
    """Return the step (N,) that times (N,) are in, and how much of it is over."""
    place = np.asarray(time, np.float64) * (steps - 1)
    step = np.clip(place.astype(np.intp), 0, max(steps - 2, 0))
    return step, place - step


@dataclass(frozen=True, eq=False)
class StarPlan:
    """The stars of a frame.

    clip [m]: near and far of the camera; reach [pixels] and density of the pixel filter; curve (n,)
    of the shutter at equal steps of its time, of mean 1, for a rolling one.
    """

    clusters: tuple[Cluster, ...]
    clip: tuple[float, float]
    reach: float
    density: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    shutter: CompiledShutter
    curve: NDArray[np.float64]


def compile_stars(
    scene: Scene,
    settings: Settings,
    origin: NDArray[np.float64],
    ledger: Ledger | None,
    notes: list[Note],
) -> StarPlan | None:
    """Return the stars about the local origin (3,) [m], None if there are none."""
    clusters: list[Cluster] = []
    has_lens = scene.camera.aperture is not None
    names = () if ledger is None else ledger.names

    def add(name: str, group: str, **fields: object) -> None:
        light = fields["light"]
        assert isinstance(light, np.ndarray)
        wanted = "combined", name, f"group:{group}"
        sums = tuple(each for each in wanted if each == "combined" or each in names)
        starts = None
        if has_lens:
            key = keys_of((PURPOSE, settings.seed, len(clusters)), len(light))
            starts = uniform(words_of(key, 2)).T
        clusters.append(Cluster(starts=starts, sums=sums, **fields))  # type: ignore[arg-type]

    # What rests is put in the world at once: there may be many instances of a single star
    resting: dict[str, list[tuple[NDArray[np.float64], NDArray[np.float64]]]] = {}
    for stars in scene.stars:
        keys = stars.to_world[None] if stars.motion is None else stars.motion
        affines = along_arcs(keys).copy()
        affines[:, :, 3] -= origin
        deformation = stars.mesh.deformation
        places = stars.mesh.positions[None] if deformation is None else deformation.positions
        shining = np.flatnonzero(stars.intensity.any(axis=1))
        if shining.size:
            light = stars.intensity.take(shining, axis=0).astype(np.float64)
            places = places.take(shining, axis=1).astype(np.float64)
            if len(affines) == len(places) == 1:
                there = places[0] @ affines[0, :, :3].T + affines[0, :, 3]
                resting.setdefault(stars.light_group, []).append((light, there))
            else:
                add("emission", stars.light_group, light=light, places=places, affines=affines)
    for group, pieces in resting.items():
        light, there = (np.concatenate(each) for each in zip(*pieces, strict=True))
        add("emission", group, light=light, places=there[None], affines=np.eye(3, 4)[None])

    # The world is not in the picture where the film is transparent, nor are its stars.
    world = scene.world
    field = None if world is None else world.stars
    if world is not None and field is not None and field.count and world.seen_by.camera:
        if scene.camera.projection == "ORTHO":
            text = "its stars are not seen by an orthographic camera, which looks one way only"
            notes.append(Note(f"World '{world.name}'", text))
        elif not scene.film_transparent and field.irradiance > 0:
            direction, light = make_field(field)
            turn = np.eye(3, 4)[None]
            way = {"places": direction[None], "affines": turn, "is_distant": True}
            add("environment", world.light_group, light=light, **way)
    if not clusters:
        return None
    curve = np.ones(2) if scene.shutter is None else np.asarray(scene.shutter, np.float64)
    return StarPlan(
        tuple(clusters),
        (scene.camera.clip_start, scene.camera.clip_end),
        *pixel_filter(settings.pixel_filter_type, settings.filter_width),
        compile_shutter(scene.shutter, settings, scene.camera.height),
        curve * ((curve.size - 1) / (curve[1:] + curve[:-1]).sum() * 2),
    )
