"""work -> counts.  What a render did, counted where it happens and added up at the end.

Tree depth and tests per ray stay inside Embree, which does not tell them through embreex.
"""

import sys
from dataclasses import dataclass, field, fields
from time import perf_counter
from typing import Any, Protocol

RAY_KINDS = ("camera", "shadow", "reflection", "transmission", "diffuse")


@dataclass
class Tally:
    """Counts and seconds of one worker's batches; added up in batch order."""

    rays_camera: int = 0
    rays_shadow: int = 0
    rays_reflection: int = 0
    rays_transmission: int = 0
    rays_diffuse: int = 0
    self_hits: int = 0
    not_finite: int = 0
    vertices: int = 0
    samples: int = 0
    embree: float = 0.0
    camera: float = 0.0
    surface: float = 0.0
    shading: float = 0.0
    lights: float = 0.0
    scatter: float = 0.0
    film: float = 0.0
    seconds: float = 0.0
    lap_start: float = field(default=0.0, repr=False)
    lap_embree: float = field(default=0.0, repr=False)

    @property
    def rays(self) -> int:
        """The rays of all kinds."""
        return sum(getattr(self, f"rays_{kind}") for kind in RAY_KINDS)

    def start(self) -> None:
        """Begin to time stages."""
        self.lap_start, self.lap_embree = perf_counter(), self.embree

    def lap(self, stage: str) -> None:
        """Count the time since the last lap, less what of it was spent in Embree, to `stage`."""
        now = perf_counter()
        inside = self.embree - self.lap_embree
        vars(self)[stage] += now - self.lap_start - inside
        self.seconds += now - self.lap_start
        self.lap_start, self.lap_embree = now, self.embree

    def add(self, other: "Tally") -> None:
        """Add another tally to this one."""
        for item in fields(self):
            setattr(self, item.name, getattr(self, item.name) + getattr(other, item.name))


@dataclass(frozen=True)
class Statistic:
    """A row of the report: key, unit, meaning."""

    key: str
    unit: str
    meaning: str


STATISTICS = (
    Statistic("rays_camera", "rays", "camera rays"),
    Statistic("rays_shadow", "rays", "shadow rays"),
    Statistic("rays_reflection", "rays", "rays reflected by mirrors and glass"),
    Statistic("rays_transmission", "rays", "rays refracted by glass"),
    Statistic("rays_diffuse", "rays", "rays scattered by matte surfaces"),
    Statistic("rays_per_pixel", "rays", "all rays divided by the pixels of the picture"),
    Statistic("self_hits", "rays", "rays traced again since they hit the triangle they left"),
    Statistic("not_finite", "samples", "samples drawn black: their light was no finite number"),
    Statistic("path_vertices", "points", "points at which light was gathered"),
    Statistic("triangles", "triangles", "triangles after instances are flattened"),
    Statistic("parts", "parts", "Embree scenes"),
    Statistic("lights", "lights", "lamps that can contribute"),
    Statistic("textures", "images", "images that shaders show"),
    Statistic("texture_bytes", "bytes", "what texels of all images take, with levels and sheets"),
    Statistic("export_seconds", "s", "reading the scene from Blender"),
    Statistic("compile_seconds", "s", "making the plan, without Embree's build"),
    Statistic("build_seconds", "s", "uploading to Embree and building its tree"),
    Statistic("sampling_seconds", "s", "wall time of sampling"),
    Statistic("thread_seconds", "s", "time of all workers together"),
    Statistic("embree_seconds", "s", "of thread_seconds: inside Embree"),
    Statistic("shading_seconds", "s", "of thread_seconds: outside Embree"),
    Statistic("stage_seconds", "s", "of shading_seconds: by stage"),
    Statistic("samples_per_pixel", "samples", "mean samples of a pixel"),
    Statistic("samples_per_second", "1/s", "pixel samples"),
    Statistic("rays_per_second", "1/s", "rays of all kinds"),
    Statistic(
        "used_light_samples", "rays", "shadow rays to each light where a camera ray meets a surface"
    ),
    Statistic("used_scatter_samples", "rays", "rays that go on from each closure there"),
    Statistic("used_path_reuse", "pixels", "pixels of a tile that share what those find"),
    Statistic("processes", "processes", "processes that did the work; 0 if threads did it"),
    Statistic("peak_memory", "bytes", "largest memory of Blender's process and of these"),
)


class Workers(Protocol):
    """Those who did the work."""

    @property
    def processes(self) -> int:
        """How many processes did it."""

    @property
    def memory(self) -> int:
        """What they had besides the memory of this process [bytes]."""


STAGES = ("camera", "surface", "shading", "lights", "scatter", "film")


@dataclass
class Preparation:
    """Seconds and sizes of what happens before sampling."""

    export_seconds: float = 0.0
    compile_seconds: float = 0.0
    build_seconds: float = 0.0
    triangles: int = 0
    parts: int = 0
    lights: int = 0
    textures: int = 0
    texture_bytes: int = 0
    extra: dict[str, Any] = field(default_factory=dict)


def summary(
    tally: Tally,
    prepared: Preparation,
    splits: dict[str, int],
    workers: Workers,
    pixels: int,
    wall: float,
) -> dict[str, Any]:
    """Return the statistics of a render by the keys of `STATISTICS`."""
    rays = tally.rays
    values: dict[str, Any] = {f"rays_{kind}": getattr(tally, f"rays_{kind}") for kind in RAY_KINDS}
    values |= {
        "rays_per_pixel": rays / max(pixels, 1),
        "self_hits": tally.self_hits,
        "not_finite": tally.not_finite,
        "path_vertices": tally.vertices,
        "triangles": prepared.triangles,
        "parts": prepared.parts,
        "lights": prepared.lights,
        "textures": prepared.textures,
        "texture_bytes": prepared.texture_bytes,
        "export_seconds": prepared.export_seconds,
        "compile_seconds": prepared.compile_seconds,
        "build_seconds": prepared.build_seconds,
        "sampling_seconds": wall,
        "thread_seconds": tally.seconds,
        "embree_seconds": tally.embree,
        "shading_seconds": tally.seconds - tally.embree,
        "stage_seconds": {stage: getattr(tally, stage) for stage in STAGES},
        "samples_per_pixel": tally.samples / max(pixels, 1),
        "samples_per_second": tally.samples / wall if wall > 0 else 0.0,
        "rays_per_second": rays / wall if wall > 0 else 0.0,
        **{f"used_{name}": number for name, number in splits.items()},
        "processes": workers.processes,
        "peak_memory": peak_memory() + workers.memory,
    }
    assert list(values) == [row.key for row in STATISTICS]
    return values


def peak_memory() -> int:
    """Return the largest resident memory that this process has had [bytes], 0 if unknown."""
    if sys.platform == "win32":
        return _peak_memory_windows()
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def _peak_memory_windows() -> int:
    import ctypes
    from ctypes import wintypes

    class Counters(ctypes.Structure):
        _fields_ = (
            ("cb", wintypes.DWORD),
            ("PageFaultCount", wintypes.DWORD),
            *((name, ctypes.c_size_t) for name in ("PeakWorkingSetSize", "WorkingSetSize")),
            *((f"quota{i}", ctypes.c_size_t) for i in range(6)),
        )

    counters = Counters(cb=ctypes.sizeof(Counters))
    windll = ctypes.windll  # type: ignore[attr-defined]
    this_process = ctypes.c_void_p(-1)
    if not windll.psapi.GetProcessMemoryInfo(this_process, ctypes.byref(counters), counters.cb):
        return 0
    return int(counters.PeakWorkingSetSize)
