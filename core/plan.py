"""scene, settings -> Plan.  What a frame needs, compiled once; what it does not need is absent.

The plan is frozen and read by all worker threads.  Absent is None, tested once per stage.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import F32, Vec, normalize
from .bsdf import CAMERA, CLEAR, DIFFUSE, EVERY_KIND, GLOSSY, TRANSMISSION
from .camera import CompiledCamera, compile_camera
from .camera_motion import MovingCamera, compile_moving_camera
from .film.adaptive import Adaptive, compile_adaptive
from .film.denoise import Denoising, is_there
from .film.ledger import Ledger, compile_ledger, surface_facts
from .film.passes import Pass, wanted
from .geometry.accel import Accel, can_move, compile_accel, compile_own
from .geometry.attributes import OPACITY, VECTOR, Attributes, compile_attributes
from .geometry.mesh import Triangles, bare_triangles, bounds, compile_triangles
from .geometry.spaces import compile_spaces
from .geometry.view import View, compile_view
from .images.store import fit
from .kept import KEEP_NOTHING, Kept
from .lights import Emitters, Hulls, Lights, compile_hulls, compile_lights, ray_mask
from .lights.environment import Environment, compile_environment
from .optics import panoramas
from .sampling.patterns import PATTERNS
from .scene import (
    ACTIVE_UV,
    EVERY_SET,
    REST,
    Camera,
    Cancelled,
    Instance,
    Lamp,
    Link,
    Material,
    Node,
    Note,
    Scene,
    SceneError,
)
from .settings import Settings
from .shading import (
    OWN,
    Library,
    Place,
    Rules,
    Surface,
    SurfaceTable,
    WorldShader,
    compile_surface,
    compile_table,
    compile_tracer,
    compile_world,
    displace,
    fold_lamps,
    images_below,
    output_of,
)
from .shutter import CompiledShutter, compile_shutter
from .statistics import Preparation

# With fewer samples than this for each triangle, a quick build saves more than its rays cost.
QUICK_BUILD = 0.5

# Slots in flight: arrays that stay in the caches, yet long enough that calls cost little; of paths
# that bounce, few are left at the end.
BATCH, BOUNCING_BATCH = 1 << 15, 1 << 16

# So many cells wide is the map of a world that is no picture, or a sky with a sun (Cycles).
LEAST_MAP, SKY_MAP = 1024, 512

# Limits of so many diffuse or glossy bounces hardly ask as what a ray counts: in a closed room of
# white plastic that is 0.2 % of the light, and 20 % of the time.
DEEP = 4

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
    camera_motion: MovingCamera | None  # the same at any time
    shutter: CompiledShutter | None  # where anything moves
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
    splitting: bool
    batch: int  # slots in flight
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
        if self.surfaces.glows.any():
            parts.append("glowing surfaces")
        return "; ".join(parts)


def compile_plan(
    scene: Scene,
    settings: Settings,
    announce: Callable[[str], None] = lambda text: None,
    should_stop: Callable[[], bool] = lambda: False,
    kept: Kept = KEEP_NOTHING,
    origin: NDArray[np.float64] | None = None,
    hits_expected: float | None = None,
) -> Plan:
    """Compile a scene; `announce` is told what begins, `should_stop` asked between steps.

    `kept` has the steps of an earlier plan; origin (3,) [m] is the local one, None is the place
    nearest to the camera; hits_expected: for how many hits tables pay, None is all samples.
    Raises: SceneError that names the culprit; Cancelled.
    """
    started = perf_counter()
    notes = list(scene.notes)
    scene = _at_rest(scene, notes)
    _check_pattern(settings)

    # Surfaces: a column for each material that occurs.
    side, spare, image_notes = _image_memory(scene, settings, kept)
    library = kept.step("library", (side, spare is None), lambda: Library(side))
    library.renew(spare)
    notes += image_notes
    outputs = wanted(scene.layer)
    denoising = _denoising(scene, settings, notes)
    guides = () if denoising is None else denoising.guides
    materials, surfaces, surface_notes = _compile_surfaces(scene, settings, kept, library, guides)
    notes += surface_notes
    has_passes = bool(outputs or scene.layer.mattes or guides)
    if "UV" in scene.layer.passes:
        asked = surfaces.attributes | {(ACTIVE_UV, VECTOR), (ACTIVE_UV, OPACITY)}
        surfaces = replace(surfaces, attributes=asked)
    numbers = {id(material): number for number, material in enumerate(materials)}
    transparent = [
        number
        for number, material in enumerate(materials)
        if surfaces.is_transparent[number] and (material is None or material.transparent_shadow)
    ]

    # Geometry, about an origin near the camera, where rounding shows.
    announce("Flattening instances")
    box = kept.step("box", (scene.instances,), lambda: bounds(scene.instances))
    origin = scene.camera.to_world[:, 3] if origin is None else origin
    if box is not None:
        origin = np.clip(origin, box[0], box[1])
    instances, moved_notes = _displaced(scene.instances, origin, library, kept, should_stop)
    notes += moved_notes
    if instances is not scene.instances:
        scene = replace(scene, instances=instances)
        box = kept.step("displaced box", (instances,), lambda: bounds(instances))
        if surfaces.reads_spaces:
            plain = surfaces
            surfaces = kept.step("asking", (plain,), lambda: plain.asking((REST, VECTOR)))
    hits = _hits_expected(scene, settings) if hits_expected is None else hits_expected
    lamps, emissions, lamp_notes = fold_lamps(scene.lamps, library)
    notes += lamp_notes
    masks = [(lamp.receivers, lamp.blockers) for lamp in lamps]
    masks += [(instance.receivers, instance.blockers) for instance in scene.instances]
    links_lights = any(receivers != EVERY_SET for receivers, _ in masks)
    links_shadows = any(blockers != EVERY_SET for _, blockers in masks)
    is_mapped = bool(surfaces.attributes) or (surfaces.reads_spaces and _any_moves(scene))
    is_numbered = links_lights or surfaces.reads_spaces or is_mapped or has_passes
    triangles, broken = kept.step(
        "triangles",
        (
            _shapes(scene.instances, numbers, kept),
            origin.tobytes(),
            settings.instance_memory,
            hits > sum(len(instance.mesh.triangles) for instance in scene.instances),
            transparent,
            links_shadows,
            is_numbered,
            is_mapped,
        ),
        lambda: compile_triangles(
            scene.instances,
            numbers,
            origin,
            settings.instance_memory * 2**30,
            hits,
            should_stop,
            transparent,
            links_shadows,
            is_numbered,
            is_mapped,
        ),
    )
    notes += broken
    spaces = compile_spaces(scene.instances, origin) if surfaces.reads_spaces else None
    attributes: Attributes = {}
    if triangles is not None and surfaces.attributes:
        announce("Sorting attributes")
        attributes = kept.step(
            "attributes",
            (scene.instances, surfaces.attributes, triangles),
            lambda: compile_attributes(scene.instances, surfaces.attributes, triangles),
        )
    camera = compile_camera(scene.camera, settings, origin, box)
    camera_motion = compile_moving_camera(scene.camera, settings, origin, box)
    view = compile_view(scene.camera, origin)
    spread = _spread(scene.camera, view)
    first = camera if camera_motion is None else camera_motion.rest
    if scene.camera.projection == "PERSP" and first.near == 0:
        view = replace(view, clip=F32(scene.camera.clip_start))
    place = Place(origin.astype(F32)[:, None], spaces, view, triangles, spread, attributes)
    surfaces_alone, surfaces = surfaces, replace(surfaces, place=place)
    if surfaces.blurred is not None:
        surfaces = replace(surfaces, blurred=replace(surfaces.blurred, place=place))
    if should_stop():
        raise Cancelled
    announce(f"Building Embree's tree for {triangles.count if triangles else 0} triangles")
    is_quick = triangles is not None and hits < QUICK_BUILD * triangles.count
    accel, build_seconds = kept.step(
        "accel", (triangles, is_quick), lambda: compile_accel(triangles, is_quick, should_stop)
    )
    if surfaces.reach is not None and accel is not None:
        surfaces = _with_tracer(surfaces, accel, is_quick, kept, should_stop)

    # Light.
    def light() -> tuple[Emitters | None, Lights | None]:
        emitters = _compile_emitters(triangles, materials, surfaces)
        return emitters, compile_lights(lamps, origin, triangles, emitters, emissions)

    made_from = scene.lamps, origin.tobytes(), triangles, surfaces_alone
    emitters, lights = kept.step("lights", made_from, light)
    world, world_notes = compile_world(scene.world, place, library)
    notes += world_notes
    lamps_seen_by = _lamps_seen_by(lamps, lights, surfaces)
    meets = lamps_seen_by
    world_seen_by = 0 if scene.world is None or world is None else ray_mask(scene.world.seen_by)
    meets |= world_seen_by
    if surfaces.glows.any():
        meets = EVERY_KIND
    environment = kept.step(
        "environment",
        (scene.world, origin.tobytes()),
        lambda: _compile_environment(scene, world),
    )
    blur_glossy = settings.blur_glossy if surfaces.blurred is not None else 0.0

    # What the film takes for transparent.
    objects = triangles.objects if triangles is not None else None
    has_held_out = objects is not None and bool(objects.holdout.any())
    has_catchers = objects is not None and bool(objects.catcher.any())
    clear_alpha = None
    if scene.film_transparent and settings.film_transparent_glass:
        clear_alpha = F32(settings.film_transparent_roughness) ** 2
        meets |= CLEAR

    adaptive, why_not = compile_adaptive(settings)
    if why_not:
        notes.append(Note("Render settings", f"Use Adaptive Sampling: {why_not}"))
    max_bounces, kind_limits = _bounce_limits(settings, surfaces)
    prepared = Preparation(
        compile_seconds=perf_counter() - started - build_seconds,
        build_seconds=build_seconds,
        triangles=triangles.count if triangles else 0,
        parts=len(accel.parts) if accel else 0,
        lights=lights.count if lights else 0,
        textures=len(library.store.images),
        texture_bytes=library.store.memory,
    )
    moves = camera_motion is not None or any(lamp.motion is not None for lamp in lamps)
    moves = moves or (triangles is not None and triangles.movement is not None)
    shutter = compile_shutter(scene.shutter, settings, scene.camera.height)
    plan = Plan(
        camera=camera,
        camera_motion=camera_motion,
        shutter=shutter if moves else None,
        rectangle=scene.camera.rectangle(),
        frame_width=scene.camera.width,
        frame_height=scene.camera.height,
        film_transparent=scene.film_transparent,
        clear_alpha=clear_alpha,
        exposure=settings.film_exposure,
        has_alpha=(scene.film_transparent or surfaces.has_holdout or has_held_out or has_catchers),
        has_held_out=has_held_out,
        outputs=outputs,
        matte_pairs=scene.layer.pairs,
        keeps_shadows="Shadow Catcher" in scene.layer.passes,
        denoising=denoising,
        ledger=_compile_ledger(scene, materials, triangles, lights, guides) if has_passes else None,
        pattern=settings.pattern,
        seed=_seed(settings, scene.frame),
        samples=settings.sample_range(),
        total_samples=settings.samples,
        light_samples=settings.light_samples,
        splitting=settings.splitting,
        batch=BATCH if max_bounces == 0 else BOUNCING_BATCH,
        time_limit=settings.time_limit,
        adaptive=adaptive,
        max_bounces=max_bounces,
        kind_limits=kind_limits,
        clamp_direct=3 * settings.sample_clamp_direct,
        clamp_indirect=3 * settings.sample_clamp_indirect,
        transparent_max_bounces=settings.transparent_max_bounces,
        transparent_passes=settings.transparent_max_bounces + scene.spare_passes,
        light_threshold=_light_threshold(settings),
        blur_glossy=blur_glossy,
        has_transparent=bool(surfaces.is_transparent.any()),
        links_lights=links_lights,
        links_shadows=links_shadows,
        shifts_terminators=_shifts_terminators(triangles),
        emission_varies=surfaces.plain_emission is None,
        mixes_kinds=_mixes_kinds(scene, settings, surfaces, world, triangles),
        needs_pdf=(
            environment is not None
            or emitters is not None
            or lamps_seen_by & ~CAMERA != 0
            or blur_glossy > 0
            or surfaces.reach is not None
        ),
        triangles=triangles,
        accel=accel,
        surfaces=surfaces,
        lights=lights,
        lamp_hulls=kept.step(
            "hulls",
            (lights, lamps_seen_by, origin.tobytes()),
            lambda: _compile_hulls(lights, lamps_seen_by, origin, should_stop),
        ),
        world=world,
        environment=environment,
        world_seen_by=world_seen_by,
        world_max_bounces=scene.world.max_bounces if scene.world else 0,
        world_casts_shadow=scene.world is None or scene.world.casts_shadow,
        lamps_seen_by=lamps_seen_by,
        kinds_that_meet_light=meets,
        alone=None,
        notes=tuple(dict.fromkeys(notes)),
        prepared=prepared,
    )
    return replace(plan, alone=_catchers_alone(plan)) if has_catchers else plan


def _any_moves(scene: Scene) -> bool:
    return any(instance.moves for instance in scene.instances)


def _at_rest(scene: Scene, notes: list[Note]) -> Scene:
    """Return the scene without moving objects, if Embree cannot place them, and note it."""
    names = [instance.name for instance in scene.instances if instance.moves]
    if not names or can_move():
        return scene
    text = "motion blur needs Embree's own library, which was not found: objects are still"
    notes += [Note(f"Object '{name}'", text) for name in dict.fromkeys(names)]
    resting = (
        replace(i, motion=None, mesh=replace(i.mesh, deformation=None)) if i.moves else i
        for i in scene.instances
    )
    return replace(scene, instances=tuple(resting))


def _compile_ledger(
    scene: Scene,
    materials: list[Material | None],
    triangles: Triangles | None,
    lights: Lights | None,
    guides: tuple[str, ...],
) -> Ledger | None:
    """Return where what the passes ask for goes."""
    lamps = [] if lights is None else [lamp.light_group for _, lamp in lights.lamps]
    glowing = None
    if lights is not None and lights.triangle_of is not None:
        assert triangles is not None
        glowing = triangles.ids[:, 2].take(lights.triangle_of)
    world = "" if scene.world is None else scene.world.light_group
    return compile_ledger(scene.layer, scene.instances, materials, lamps, glowing, world, guides)


def _denoising(scene: Scene, settings: Settings, notes: list[Note]) -> Denoising | None:
    """Return how the picture is denoised, None if it is not."""
    if not (settings.use_denoising and scene.layer.is_denoised):
        return None
    why = None
    if settings.use_sample_subset:
        why = "a subset of the samples keeps its noise until it is merged"
    elif not is_there():
        why = "OpenImageDenoise is not there: the picture keeps its noise"
    if why is not None:
        notes.append(Note("Render settings", f"Use Denoising: {why}"))
        return None
    kinds = settings.denoising_input_passes
    has_albedo, has_normal = "ALBEDO" in kinds, "NORMAL" in kinds
    how = settings.denoising_prefilter, settings.denoising_quality
    return Denoising(has_albedo, has_normal, *how)


def _catchers_alone(plan: Plan) -> Plan:
    """Return what there would be if all but the shadow catchers and their lights were away."""
    assert plan.accel is not None and plan.triangles is not None
    lights = plan.lights
    if lights is not None:
        is_on = np.array([lamp.lights_catchers for _, lamp in lights.lamps], np.bool_)
        if lights.triangle_of is not None:
            assert plan.triangles.objects is not None
            instance = plan.triangles.ids[:, 2].take(lights.triangle_of)
            is_on = np.append(is_on, plan.triangles.objects.catcher.take(instance))
        lights = lights.switched(is_on)
    return replace(plan, accel=plan.accel.only_catchers(), lights=lights, ledger=None)


def _shifts_terminators(triangles: Triangles | None) -> bool:
    objects = None if triangles is None else triangles.objects
    return objects is not None and objects.terminator_shading is not None


def _spread(camera: Camera, view: View) -> tuple[float, float]:
    """Return how wide a pixel is at the camera [m], and what it gains per metre."""
    left, right, bottom, top = camera.window
    if camera.panorama is not None:
        middle = np.array([[left + right], [bottom + top]], F32) * F32(0.5)
        direction, _ = panoramas.direction(camera.panorama, *middle)
        return 0.0, float(view.footprint(normalize(direction))[0])
    size = 0.5 * ((right - left) / camera.width + (top - bottom) / camera.height)
    return (0.0, size) if camera.projection == "PERSP" else (size, 0.0)


def _hits_expected(scene: Scene, settings: Settings) -> float:
    x0, y0, x1, y1 = scene.camera.rectangle()
    first, end = settings.sample_range()
    return float(x1 - x0) * (y1 - y0) * (end - first)


def _compile_surfaces(
    scene: Scene, settings: Settings, kept: Kept, library: Library, guides: tuple[str, ...]
) -> tuple[list[Material | None], SurfaceTable, list[Note]]:
    """Return the materials that occur, once each, their surfaces in this order, and notes."""
    found = {id(m): m for instance in scene.instances for m in instance.materials or (None,)}
    materials = list(found.values())
    rules = Rules(
        has_reflective_caustics=settings.caustics_reflective,
        has_refractive_caustics=settings.caustics_refractive,
        occlusion_distance=np.inf if scene.world is None else scene.world.occlusion_distance,
        shown=surface_facts(scene.layer, guides),
    )

    def surfaces(name: str, rules: Rules) -> list[Surface]:
        return kept.each(
            name,
            [(material, rules, library) for material in materials],
            lambda key: compile_surface(_owner(key[0]), *key),
        )

    def table() -> tuple[SurfaceTable, list[Note]]:
        plain = surfaces("surfaces", rules)
        table = compile_table(plain, rules.shown)
        if settings.blur_glossy > 0 and table.has_specular:
            # A second table, of what paths see that filter glossy blurs.
            blurred = surfaces("blurred surfaces", replace(rules, is_blurred=True, shown=()))
            table = replace(table, blurred=compile_table(blurred))
        return table, [note for surface in plain for note in surface.notes]

    made_from = tuple(materials), rules, settings.blur_glossy > 0, library
    return materials, *kept.step("surface table", made_from, table)


def _with_tracer(
    surfaces: SurfaceTable,
    accel: Accel,
    is_quick: bool,
    kept: Kept,
    should_stop: Callable[[], bool],
) -> SurfaceTable:
    """Return surfaces whose shaders trace rays of their own."""
    assert surfaces.reach is not None
    own = None
    ids = accel.triangles.ids
    instances = np.zeros(int(ids[:, 2].max()) + 1, np.bool_)
    instances[ids[surfaces.reach.take(ids[:, 0]) == OWN, 2]] = True
    if instances.any():
        made_from = accel, instances.tobytes(), is_quick
        own = kept.step(
            "own accel", made_from, lambda: compile_own(accel, instances, is_quick, should_stop)
        )
    place = replace(surfaces.place, tracer=compile_tracer(accel, own))
    blurred = surfaces.blurred
    blurred = None if blurred is None else replace(blurred, place=place)
    return replace(surfaces, place=place, blurred=blurred)


# Fields of instances that triangles do not depend on
_NOT_SHAPES = {"name", "label", "attributes", "mesh", "to_world", "motion", "materials"}


def _shapes(
    instances: tuple[Instance, ...], numbers: dict[int, int], kept: Kept
) -> list[tuple[Any, ...]]:
    """Return all that the table of triangles is made from, of each instance."""
    if kept is KEEP_NOTHING:
        return []
    names = [field.name for field in fields(Instance) if field.name not in _NOT_SHAPES]

    def shape(instance: Instance) -> tuple[Any, ...]:
        materials = tuple(numbers[id(material)] for material in instance.materials or (None,))
        rest = tuple(getattr(instance, name) for name in names)
        motion = None if instance.motion is None else instance.motion.tobytes()
        return instance.mesh, instance.to_world.tobytes(), motion, materials, *rest

    made_from = instances, tuple(numbers.items())
    return kept.step("shapes", made_from, lambda: [shape(instance) for instance in instances])


def _image_memory(
    scene: Scene, settings: Settings, kept: Kept
) -> tuple[int, float | None, list[Note]]:
    """Return what the sides of images are limited to, so that they fit the memory; 0: nothing.

    And what is left for their levels [bytes], None if there shall be none; and notes that name
    images that will be smaller.
    """
    materials = {id(m): m for i in scene.instances for m in i.materials if m is not None}
    glows = tuple(each.surface for each in (scene.world, *scene.lamps) if each and each.surface)

    def fitted() -> tuple[int, float, list[Note]]:
        notes: list[Note] = []
        roots = [output_of(material) for material in materials.values()]
        roots += [Node("Output", "", {"Surface": Link(glow, "Surface")}) for glow in glows]
        sources = [source for root in roots for source in images_below(root)]
        memory = settings.texture_memory * 2**30
        return *(fit(sources, memory, notes) if sources else (0, 0.0)), notes

    made_from = tuple(materials.values()), glows, settings.texture_memory
    side, spare, notes = kept.step("image memory", made_from, fitted)

    # How wide a pixel of a panorama is depends on where it is
    if not settings.texture_filter or scene.camera.panorama is not None:
        return side, None, notes
    # A byte of levels takes as long as a twentieth of a ray: a tenth of the time may go there.
    # The rays are those of the whole frame, so that its parts look alike
    rays = scene.camera.width * scene.camera.height * settings.samples
    return side, min(spare, 2.0 * rays), notes


def _displaced(
    instances: tuple[Instance, ...],
    origin: NDArray[np.float64],
    library: Library,
    kept: Kept,
    should_stop: Callable[[], bool],
) -> tuple[tuple[Instance, ...], list[Note]]:
    """Return instances whose meshes are displaced where materials ask for it, and notes."""

    def moved() -> tuple[tuple[Instance, ...], list[Note]]:
        notes: list[Note] = []
        return displace(instances, origin, library, notes, should_stop), notes

    return kept.step("displaced", (instances, origin.tobytes(), library), moved)


def _compile_environment(scene: Scene, world: WorldShader | None) -> Environment | None:
    """Return how the world is sampled; None where that would not help: it is even, or not asked."""
    if world is None or scene.world is None or world.is_constant or not scene.world.sampled:
        return None
    width = world.finest[0] or (SKY_MAP if world.discs else LEAST_MAP)

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


def _compile_emitters(
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


# Blender's choice of the sides of a glowing surface that are sampled, and ours
_SIDES = {"NONE": 0, "AUTO": 3, "FRONT": 1, "BACK": 2, "FRONT_BACK": 3}


def _owner(material: Material | None) -> str:
    return f"Material '{material.name}'" if material else "Default material"


def _lamps_seen_by(lamps: Sequence[Lamp], lights: Lights | None, surfaces: SurfaceTable) -> int:
    """Return the ray kinds that may run into a lamp; rays from matte surfaces have sampled it."""
    if lights is None or not lights.lamps:
        return 0
    possible = CAMERA | GLOSSY | TRANSMISSION if surfaces.has_specular else CAMERA
    seen = 0
    for lamp in lamps:
        seen |= ray_mask(lamp.seen_by) if lamp.sampled else 0
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
    if all(module.RAY_KIND == DIFFUSE and not module.TRANSMITS for module in surfaces.modules):
        return min(settings.max_bounces, limits[0]), None
    return settings.max_bounces, limits


def _mixes_kinds(
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


def _light_threshold(settings: Settings) -> float:
    # As in Cycles, where it goes without a light tree only.  Measured: dim scenes lose by it.
    if settings.use_light_tree:
        return 0.0
    return settings.light_sampling_threshold / max(settings.film_exposure, 1e-6)


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
