"""scene, settings -> Plan.  What a frame needs, compiled once; what it does not need is absent.

The plan is frozen and read by all worker threads.  Absent is None, tested once per stage.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, Vec
from .bsdf import CAMERA, DIFFUSE, EVERY_KIND, GLOSSY, TRANSMISSION
from .camera import CompiledCamera, compile_camera
from .geometry.accel import Accel, compile_accel
from .geometry.mesh import Triangles, bare_triangles, bounds, compile_triangles
from .lights import Hulls, Lights, compile_hulls, compile_lights, ray_mask
from .sampling.patterns import PATTERNS
from .scene import Cancelled, Material, Note, Scene, SceneError
from .settings import OPTIONS, Settings
from .shading import Surface, SurfaceTable, compile_emission, compile_surface, compile_table
from .statistics import Preparation

# With fewer samples than this for each triangle, a quick build saves more than its rays cost.
QUICK_BUILD = 0.5

# Slots in flight: arrays that stay in the caches, yet long enough that calls cost little; of paths
# that bounce, few are left at the end.
BATCH, BOUNCING_BATCH = 1 << 15, 1 << 16

# Up to so many lamps are tried one by one by rays that might meet them.
LAMPS_TRIED_EACH = 16


@dataclass(frozen=True, eq=False)
class LampHulls:
    """How rays find lamps when there are many: hulls, as triangles and in Embree."""

    hulls: Hulls
    triangles: Triangles
    accel: Accel


@dataclass(frozen=True, eq=False)
class Plan:
    """A frame, ready to be sampled."""

    # Picture
    camera: CompiledCamera
    rectangle: tuple[int, int, int, int]  # x0, y0, x1, y1 of the pixels rendered
    frame_width: int
    frame_height: int
    film_transparent: bool
    exposure: float

    # Sampling
    pattern: str
    seed: int
    samples: tuple[int, int]  # the first, and the one past the last
    total_samples: int
    light_samples: int
    splitting: bool
    batch: int  # slots in flight
    time_limit: float

    # Limits; kind_limits (diffuse, glossy, transmission) is None if all is diffuse
    max_bounces: int
    kind_limits: tuple[int, int, int] | None
    clamp_direct: float  # of the sum of the channels, as in Cycles; 0 is no limit
    clamp_indirect: float

    # What rays meet
    triangles: Triangles | None
    accel: Accel | None
    surfaces: SurfaceTable
    lights: Lights | None
    lamp_hulls: LampHulls | None  # where many lamps may be met by chance
    world: Vec | None  # (3, 1) radiance
    world_seen_by: int  # ray kinds on which the world shines
    lamps_seen_by: int  # ray kinds that lamps let see them
    kinds_that_meet_light: int  # ray kinds that can run into light of any sort

    notes: tuple[Note, ...]
    prepared: Preparation

    def describe(self) -> str:
        """Return the plan in plain words."""
        names = [module.NAME for module in self.surfaces.modules]
        x0, y0, x1, y1 = self.rectangle
        parts = [
            f"{x1 - x0} x {y1 - y0} pixels, {self.samples[1] - self.samples[0]} samples",
            f"{self.prepared.triangles} triangles in {self.prepared.parts} parts",
            f"{len(names)} closures: {', '.join(names)}" if names else "no closures",
            f"{self.lights.count} lamps" if self.lights else "no lamps",
            "a world that shines" if self.world is not None else "a black world",
            f"up to {self.max_bounces} bounces",
        ]
        if self.triangles is not None and self.triangles.is_flat:
            parts.append("no smooth normals")
        if self.surfaces.emission is not None:
            parts.append("glowing surfaces")
        return "; ".join(parts)


def compile_plan(
    scene: Scene,
    settings: Settings,
    announce: Callable[[str], None] = lambda text: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Plan:
    """Compile a scene; `announce` is told what begins, `should_stop` asked between steps.

    Raises: SceneError that names the culprit; Cancelled.
    """
    started = perf_counter()
    notes = list(scene.notes)
    _check_pattern(settings)

    # Surfaces: a column for each material that occurs.
    numbers, surfaces = _compile_surfaces(scene, notes)

    # Geometry, about an origin near the camera, where rounding shows.
    announce("Flattening instances")
    box = bounds(scene.instances)
    origin = scene.camera.to_world[:, 3]
    if box is not None:
        origin = np.clip(origin, box[0], box[1])
    hits = _hits_expected(scene, settings)
    triangles, broken = compile_triangles(
        scene.instances, numbers, origin, settings.instance_memory * 2**30, hits, should_stop
    )
    notes += broken
    if should_stop():
        raise Cancelled
    announce(f"Building Embree's tree for {triangles.count if triangles else 0} triangles")
    is_quick = triangles is not None and hits < QUICK_BUILD * triangles.count
    accel, build_seconds = compile_accel(triangles, is_quick, should_stop)

    # Light.
    radius = 1.0 if box is None else float(np.linalg.norm(box[1] - box[0])) / 2
    lights = compile_lights(scene.lamps, origin, radius)
    radiance, world_notes = _compile_world(scene)
    notes += world_notes
    world = np.array(radiance, F32)[:, None] if max(radiance) > 0 else None
    lamps_seen_by = _lamps_seen_by(scene, lights, surfaces)
    meets = lamps_seen_by
    world_seen_by = 0 if scene.world is None or world is None else ray_mask(scene.world.seen_by)
    meets |= world_seen_by
    if surfaces.emission is not None:
        meets = EVERY_KIND

    notes += _settings_notes(settings, surfaces)
    max_bounces, kind_limits = _bounce_limits(settings, surfaces)
    prepared = Preparation(
        compile_seconds=perf_counter() - started - build_seconds,
        build_seconds=build_seconds,
        triangles=triangles.count if triangles else 0,
        parts=len(accel.parts) if accel else 0,
        lights=lights.count if lights else 0,
    )
    return Plan(
        camera=compile_camera(scene.camera, settings, origin, box),
        rectangle=scene.camera.rectangle(),
        frame_width=scene.camera.width,
        frame_height=scene.camera.height,
        film_transparent=scene.film_transparent,
        exposure=settings.film_exposure,
        pattern=settings.pattern,
        seed=_seed(settings, scene.frame),
        samples=settings.sample_range(),
        total_samples=settings.samples,
        light_samples=settings.light_samples,
        splitting=settings.splitting,
        batch=BATCH if max_bounces == 0 else BOUNCING_BATCH,
        time_limit=settings.time_limit,
        max_bounces=max_bounces,
        kind_limits=kind_limits,
        clamp_direct=3 * settings.sample_clamp_direct,
        clamp_indirect=3 * settings.sample_clamp_indirect,
        triangles=triangles,
        accel=accel,
        surfaces=surfaces,
        lights=lights,
        lamp_hulls=_compile_hulls(lights, lamps_seen_by, origin, should_stop),
        world=world,
        world_seen_by=world_seen_by,
        lamps_seen_by=lamps_seen_by,
        kinds_that_meet_light=meets,
        notes=tuple(dict.fromkeys(notes)),
        prepared=prepared,
    )


def _hits_expected(scene: Scene, settings: Settings) -> float:
    x0, y0, x1, y1 = scene.camera.rectangle()
    first, end = settings.sample_range()
    return float(x1 - x0) * (y1 - y0) * (end - first)


def _compile_surfaces(scene: Scene, notes: list[Note]) -> tuple[dict[int, int], SurfaceTable]:
    numbers: dict[int, int] = {}
    surfaces: list[Surface] = []
    for instance in scene.instances:
        for material in instance.materials or (None,):
            if id(material) not in numbers:
                numbers[id(material)] = len(surfaces)
                surfaces.append(compile_surface(_owner(material), material))
                notes += surfaces[-1].notes
    return numbers, compile_table(surfaces)


def _owner(material: Material | None) -> str:
    return f"Material '{material.name}'" if material else "Default material"


def _compile_world(scene: Scene) -> tuple[tuple[float, float, float], list[Note]]:
    if scene.world is None:
        return (0.0, 0.0, 0.0), []
    return compile_emission(f"World '{scene.world.name}'", scene.world.surface)


def _lamps_seen_by(scene: Scene, lights: Lights | None, surfaces: SurfaceTable) -> int:
    """Return the ray kinds that may run into a lamp; rays from rough surfaces have sampled it."""
    if lights is None:
        return 0
    possible = CAMERA | GLOSSY | TRANSMISSION if surfaces.has_specular else CAMERA
    seen = 0
    for lamp in scene.lamps:
        seen |= ray_mask(lamp.seen_by)
    return seen & possible


def _compile_hulls(
    lights: Lights | None,
    seen_by: int,
    origin: NDArray[np.float64],
    should_stop: Callable[[], bool],
) -> LampHulls | None:
    if lights is None or not seen_by or lights.count <= LAMPS_TRIED_EACH:
        return None
    hulls = compile_hulls(lights, origin)
    if hulls is None:
        return None
    triangles = bare_triangles(hulls.vertices, hulls.corners)
    accel, _ = compile_accel(triangles, False, should_stop)
    return LampHulls(hulls, triangles, accel) if accel else None


def _bounce_limits(
    settings: Settings, surfaces: SurfaceTable
) -> tuple[int, tuple[int, int, int] | None]:
    # With one kind of scattering in the scene, its limit and the total one are a single number.
    limits = settings.diffuse_bounces, settings.glossy_bounces, settings.transmission_bounces
    if all(module.RAY_KIND == DIFFUSE for module in surfaces.modules):
        return min(settings.max_bounces, limits[0]), None
    return settings.max_bounces, limits


def _seed(settings: Settings, frame: int) -> int:
    if not settings.use_animated_seed:
        return settings.seed
    return (settings.seed + frame * 0x9E3779B1) & 0x7FFFFFFF


def _check_pattern(settings: Settings) -> None:
    if settings.use_sample_subset and not PATTERNS[settings.pattern].progressive:
        raise SceneError(
            f"Setting 'pattern': {settings.pattern} is a set of a fixed size and cannot be "
            "rendered as a sample subset; use SOBOL"
        )


def _settings_notes(settings: Settings, surfaces: SurfaceTable) -> list[Note]:
    """Name the settings that ask for what is not there yet, where it would change the picture."""
    specular = surfaces.has_specular
    matter = {
        "use_adaptive_sampling": settings.use_adaptive_sampling,
        "use_denoising": settings.use_denoising,
        "blur_glossy": specular and settings.blur_glossy > 0,
        "caustics_reflective": specular and not settings.caustics_reflective,
        "caustics_refractive": specular and not settings.caustics_refractive,
    }
    return [
        Note("Render settings", f"{option.label}: {option.awaits} (not available yet)")
        for option in OPTIONS
        if matter.get(option.name)
    ]
