"""settings -> limits.  Bounces, thresholds, seeds, and how much work a picture is."""

import numpy as np

from ..bsdf import DIFFUSE, GLOSSY
from ..geometry.mesh import Triangles
from ..lights import ray_mask
from ..sampling.patterns import PATTERNS
from ..scene import Camera, Scene, SceneError
from ..settings import Settings
from ..shading import SurfaceTable, WorldShader

# Limits of so many diffuse or glossy bounces hardly ask as what a ray counts: in a closed room of
# white plastic that is 0.2 % of the light, and 20 % of the time.
DEEP = 4

# Slots in flight: arrays that stay in the caches, yet long enough that calls cost little and
# threads seldom wait for the interpreter's lock: between short calls they hand it to and fro, which
# doubled their time where bounces leave few paths and materials ask different closures.
BATCH, LEAST_BOUNCING_BATCH, BOUNCING_BATCH, MIXED_BATCH = 1 << 15, 1 << 16, 1 << 17, 1 << 18
FEWEST_BATCHES = 12  # of a picture, for the threads to share


def bounce_limits(
    settings: Settings, surfaces: SurfaceTable
) -> tuple[int, tuple[int, int, int] | None]:
    """Return the bounces in all and of each kind, None where kinds do not matter."""
    # With one kind of scattering in the scene, its limit and the total one are a single number.
    limits = settings.diffuse_bounces, settings.glossy_bounces, settings.transmission_bounces
    if all(module.RAY_KIND == DIFFUSE and not module.TRANSMITS for module in surfaces.modules):
        return min(settings.max_bounces, limits[0]), None
    return settings.max_bounces, limits


def mixes_kinds(
    scene: Scene,
    settings: Settings,
    surfaces: SurfaceTable,
    world: WorldShader | None,
    triangles: Triangles | None,
) -> bool:
    """Tell whether surfaces send rays of several kinds the same way, and anything minds."""
    if not surfaces.mixes_kinds:
        return False
    masks = [] if triangles is None or triangles.objects is None else [triangles.objects.seen_by]
    masks += [] if scene.world is None else [np.array([ray_mask(scene.world.seen_by)])]
    return (
        min(settings.diffuse_bounces, settings.glossy_bounces) < min(settings.max_bounces, DEEP)
        or not (settings.caustics_reflective and settings.caustics_refractive)
        or surfaces.tells_kinds
        or (world is not None and world.tells_kinds)
        or any((((mask & DIFFUSE) > 0) != ((mask & GLOSSY) > 0)).any() for mask in masks)
    )


def light_threshold(settings: Settings) -> float:
    """Return the light below which shadow rays are chosen by chance."""
    # As in Cycles, where it goes without a light tree only.  Measured: dim scenes lose by it.
    if settings.use_light_tree:
        return 0.0
    return settings.light_sampling_threshold / max(settings.film_exposure, 1e-6)


def seed_of(settings: Settings, frame: int) -> int:
    """Return the seed of a frame."""
    if not settings.use_animated_seed:
        return settings.seed
    return (settings.seed + frame * 0x9E3779B1) & 0x7FFFFFFF


def check_pattern(settings: Settings) -> None:
    """Raise SceneError where a pattern of a fixed size is to be cut up."""
    if settings.use_sample_subset and not PATTERNS[settings.pattern].progressive:
        raise SceneError(
            f"Setting 'pattern': {settings.pattern} is a set of a fixed size and cannot be "
            "rendered as a sample subset; use SOBOL"
        )


def hits_expected_of(scene: Scene, settings: Settings) -> float:
    """Return about how many rays will hit something."""
    x0, y0, x1, y1 = scene.camera.rectangle()
    first, end = settings.sample_range()
    return float(x1 - x0) * (y1 - y0) * (end - first)


def batch_of(settings: Settings, camera: Camera, surfaces: SurfaceTable, max_bounces: int) -> int:
    """Return how many slots are in flight in a batch, on any number of threads."""
    if max_bounces == 0:
        return BATCH
    most = BOUNCING_BATCH if len(surfaces.modules) < 2 else MIXED_BATCH
    share = camera.width * camera.height * settings.samples // FEWEST_BATCHES
    return max(LEAST_BOUNCING_BATCH, min(most, share))


def measures_of(
    settings: Settings, surfaces: SurfaceTable, max_bounces: int, samples_lights: bool
) -> tuple[str, ...]:
    """Return which numbers of rays are to be found by measuring; see `splits`."""
    scatters = max_bounces > 0 and any(not each.IS_DELTA for each in surfaces.modules)
    wanted = {
        "light_samples": samples_lights and not settings.light_samples,
        "scatter_samples": scatters and not settings.scatter_samples,
    }
    return tuple(name for name, is_wanted in wanted.items() if is_wanted)
