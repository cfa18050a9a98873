"""time -> camera.  A camera that moves, turns or zooms while the shutter is open.

Its vectors are tabulated at so many steps that straight lines between them will do (see
`geometry.motion`), and looked up at each ray's own time.  Windows change in straight lines between
the steps of the scene: so zooms a perspective camera in Cycles.  So do the size and the focus of
an aperture, which in Cycles are those of the frame; all else of a camera, and the window of a
panorama, is as in the frame here, too.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Scalar
from .camera import CompiledCamera, compile_camera
from .geometry.motion import Tracks, along_arcs, compile_tracks
from .scene import Camera
from .settings import Settings


@dataclass(frozen=True, eq=False)
class MovingCamera:
    """A camera at any time: `rest` with other vectors, of which `track` has some at any time.

    changing: names and numbers of these vectors in `CompiledCamera`, three numbers each.
    """

    rest: CompiledCamera
    changing: tuple[tuple[str, int], ...]
    track: Tracks

    def at(self, time: Scalar) -> CompiledCamera:
        """Return the camera of N rays at times (N,) in [0, 1]."""
        rows = self.track.at(np.zeros(time.size, np.int32), time)
        changed: dict[str, Any] = {}
        for place, (name, number) in enumerate(self.changing):
            vectors = changed.setdefault(name, list(getattr(self.rest, name)))
            vectors[number] = rows[3 * place : 3 * place + 3]
        for name, vectors in changed.items():
            changed[name] = tuple(vectors)
        return replace(self.rest, **changed)


def compile_moving_camera(
    camera: Camera,
    settings: Settings,
    origin: NDArray[np.float64],
    box: NDArray[np.float64] | None,
) -> MovingCamera | None:
    """Return the camera with its motion, None if it rests; see `compile_camera`."""
    if not camera.motion:
        return None
    steps = [compile_camera(step, settings, origin, box) for step in _steps(camera)]
    names = [
        (item.name, number)
        for item in fields(CompiledCamera)
        if isinstance(vectors := getattr(steps[0], item.name), tuple)
        for number in range(len(vectors))
    ]
    tables = [
        np.stack([getattr(step, name)[number][:, 0] for step in steps]) for name, number in names
    ]
    changing = [n for n, table in enumerate(tables) if (table != table[0]).any()]

    # Clip what any of them clips.
    far = [step.far for step in steps if step.far is not None]
    rest = replace(steps[0], near=max(step.near for step in steps), far=min(far) if far else None)
    if not changing:
        return None
    table = np.concatenate([tables[n] for n in changing], axis=1)
    return MovingCamera(rest, tuple(names[n] for n in changing), compile_tracks([table]))


def _steps(camera: Camera) -> list[Camera]:
    """Return the camera at equal steps of time, between which straight lines will do."""
    keys = np.stack([key.to_world for key in camera.motion])
    numbers = np.array([_numbers(camera, key) for key in camera.motion])
    fine = along_arcs(keys)
    if len(fine) < len(keys):
        # It goes straight; yet its window or lens may not
        part = np.linspace(0, 1, len(keys))[:, None, None]
        fine = fine[0] * (1 - part) + fine[-1] * part
    place = np.linspace(0, len(numbers) - 1, len(fine))
    rows = [np.interp(place, np.arange(len(numbers)), number) for number in numbers.T]
    steps = []
    for to_world, row in zip(fine, np.array(rows).T.tolist(), strict=True):
        left, right, bottom, top, *lens = row
        step = replace(camera, to_world=to_world, window=(left, right, bottom, top), motion=())
        if camera.aperture is not None:
            radius, focus = lens
            step = replace(step, aperture=replace(camera.aperture, radius=radius, focus=focus))
        steps.append(step)
    return steps


def _numbers(camera: Camera, key: Camera) -> list[float]:
    """Return the numbers that change by themselves: the window, radius and focus of the aperture.

    A key that lacks the aperture of the `camera` has it all the same: lenses do not come and go.
    """
    window = camera.window if camera.panorama is not None else key.window
    if camera.aperture is None:
        return [*window]
    aperture = key.aperture or camera.aperture
    return [*window, aperture.radius, aperture.focus]
