"""compiled tables -> Plan.  What a frame needs, compiled once; what it does not need is absent.

The plan is frozen and read by all worker threads.  Absent is None, tested once per stage.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .camera import CompiledCamera
from .camera_motion import MovingCamera
from .film.adaptive import Adaptive
from .film.denoise import Denoising
from .film.ledger import Ledger
from .film.passes import Pass
from .geometry.accel import Accel
from .geometry.mesh import Triangles
from .geometry.speeds import Speeds
from .lights import Hulls, Lights
from .lights.environment import Environment
from .scene import Note
from .shading import SurfaceTable, WorldShader
from .shutter import CompiledShutter
from .stars import StarPlan
from .statistics import Preparation


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
    camera_motion: MovingCamera | None  # the same at any time
    shutter: CompiledShutter | None  # where anything moves
    speeds: Speeds | None  # from frame to frame, for the pass that shows them
    rectangle: tuple[int, int, int, int]  # x0, y0, x1, y1 of the pixels rendered
    frame_width: int
    frame_height: int
    film_transparent: bool
    clear_alpha: np.float32 | None  # glass of no more is as good as transparent to the film
    exposure: float
    has_alpha: bool
    has_held_out: bool  # whether some objects are holes in the picture
    outputs: tuple[Pass, ...]  # pictures besides Combined
    matte_pairs: int  # pictures of each cryptomatte
    denoising: Denoising | None
    keeps_shadows: bool  # of shadow catchers, in a pass of their own
    ledger: Ledger | None  # where light and data go, if not only to Combined

    # Sampling
    pattern: str
    seed: int
    samples: tuple[int, int]  # the first, and the one past the last
    total_samples: int
    light_samples: int
    scatter_samples: int
    measures: tuple[str, ...]  # which of these, and of path_reuse, are to be found
    path_reuse: int  # pixels that share what scattered rays find; 1: each has its own
    splitting: bool
    batch: int  # slots in flight
    workers: str  # threads, processes, or what pays
    time_limit: float
    adaptive: Adaptive | None  # None: all pixels get all samples

    # Limits; kind_limits (diffuse, glossy, transmission) is None if all is diffuse
    max_bounces: int
    kind_limits: tuple[int, int, int] | None
    clamp_direct: float  # of the sum of the channels, as in Cycles; 0 is no limit
    clamp_indirect: float
    transparent_max_bounces: int  # of shadow rays, with what their paths have passed
    transparent_passes: int  # of paths
    light_threshold: float  # fainter light samples play roulette; 0 is none
    blur_glossy: float  # 0 where no closure is blurred
    has_transparent: bool
    links_lights: bool  # whether lights shine on some objects only, or
    links_shadows: bool  # some cast no shadows of some lights
    shifts_terminators: bool  # some dim what light grazes
    emission_varies: bool  # over what glows
    mixes_kinds: bool  # whether it matters as which of several kinds a ray counts
    needs_pdf: bool  # whether anything that paths meet was sampled as well

    # What rays meet
    triangles: Triangles | None
    accel: Accel | None
    surfaces: SurfaceTable
    lights: Lights | None
    lamp_hulls: LampHulls | None  # where many lamps may be met by chance
    world: WorldShader | None
    environment: Environment | None  # the world, if it is sampled
    world_seen_by: int  # ray kinds on which the world shines
    world_max_bounces: int  # paths with more of them do not sample it
    world_casts_shadow: bool  # of such samples
    lamps_seen_by: int  # ray kinds that lamps let see them
    kinds_that_meet_light: int  # ray kinds that can run into light of any sort
    stars: StarPlan | None
    alone: "Plan | None"  # the shadow catchers as if there was nothing else

    notes: tuple[Note, ...]
    prepared: Preparation

    @property
    def least_limit(self) -> int:
        """The number of bounces before which no path can be at its end."""
        return min(self.max_bounces, *(self.kind_limits or (self.max_bounces,)))

    @property
    def has_lights(self) -> bool:
        """Whether anything is sampled on purpose."""
        return self.lights is not None or self.environment is not None

    @property
    def has_background(self) -> bool:
        """Whether shadows fall on a background that is seen."""
        return self.alone is not None and not self.film_transparent and not self.keeps_shadows

    @property
    def passes(self) -> tuple[str, ...]:
        """What pixels sum up, of the film's `SUMS`."""
        passes: tuple[str, ...] = ("combined", "alpha") if self.has_alpha else ("combined",)
        if self.alone is not None:
            passes += ("caught", "opacity", "alone")
        if self.has_background:
            passes += ("background",)
        return passes if self.ledger is None else passes + self.ledger.names

    @cached_property
    def may_darken(self) -> bool:
        """Whether anything may shine with negative light."""
        if self.lights is None:
            return False
        glows = self.lights.of_triangle is not None
        return self.lights.may_darken or (glows and self.emission_varies)

    @property
    def weighs_paths(self) -> bool:
        """Whether anything asks for the least likely bounce of a path."""
        return self.blur_glossy > 0 or self.surfaces.reach is not None

    @property
    def needs_place(self) -> bool:
        """Whether points must be told by what lights are chosen there, and paths remember it."""
        chooses = self.lights is not None and self.lights.chooses
        return chooses or (self.needs_pdf and self.has_lights)

    def describe(self) -> str:
        """Return the plan in plain words: what there is, and what there is not, at no cost."""
        names = [module.NAME for module in self.surfaces.modules]
        x0, y0, x1, y1 = self.rectangle
        parts = [
            f"{x1 - x0} x {y1 - y0} pixels, {self.samples[1] - self.samples[0]} samples "
            f"({self.pattern})",
            f"{self.prepared.triangles} triangles in {self.prepared.parts} parts",
            f"{len(names)} closures: {', '.join(names)}" if names else "no closures",
            f"{self.lights.count} lamps" if self.lights else "no lamps",
            "a world that shines" if self.world is not None else "a black world",
            f"up to {self.max_bounces} bounces",
            f"{self.batch} samples in flight",
            f"where the camera looks {self.light_samples} shadow rays to each light and "
            f"{self.scatter_samples} rays on",
        ]
        present = [name for name, is_there in self._features.items() if is_there]
        absent = [name for name, is_there in self._features.items() if not is_there]
        parts += [f"with {', '.join(present)}"] if present else []
        parts += [f"without {', '.join(absent)}"] if absent else []
        return "; ".join(parts)

    @property
    def _features(self) -> dict[str, bool]:
        triangles, surfaces = self.triangles, self.surfaces
        return {
            "lens": self.camera.aperture is not None,
            "panorama": self.camera.panorama is not None,
            "motion": self.shutter is not None,
            "smooth normals": triangles is not None and not triangles.is_flat,
            "several instances told apart": triangles is not None and triangles.is_numbered,
            "textures": self.prepared.textures > 0,
            "attributes": bool(surfaces.attributes),
            "shaders that trace": surfaces.reach is not None,
            "transparency": self.has_transparent,
            "glowing surfaces": bool(surfaces.glows.any()),
            "choice among lights": self.lights is not None and self.lights.chooses,
            "stars": self.stars is not None,
            "sampled world": self.environment is not None,
            "multiple importance sampling": self.needs_pdf,
            "light linking": self.links_lights or self.links_shadows,
            "filter glossy": self.blur_glossy > 0,
            "re-use of paths": self.path_reuse > 1,
            "clamps": self.clamp_direct > 0 or self.clamp_indirect > 0,
            "alpha": self.has_alpha,
            "holdouts": self.has_held_out,
            "shadow catchers": self.alone is not None,
            "passes": self.ledger is not None,
            "adaptive sampling": self.adaptive is not None,
            "denoising": self.denoising is not None,
        }
