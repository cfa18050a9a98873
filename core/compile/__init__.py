"""scene, settings -> Plan.  THE COMPILER: from descriptions to tables, in the order of the stages.

What it makes of an earlier frame or edit is kept and made again only where something changed.
"""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ..arrays import F32
from ..bsdf import CAMERA, CLEAR, EVERY_KIND
from ..camera import compile_camera
from ..camera_motion import compile_moving_camera
from ..film.adaptive import compile_adaptive
from ..film.passes import wanted
from ..geometry.accel import can_move, compile_accel
from ..geometry.attributes import OPACITY, VECTOR, Attributes, compile_attributes
from ..geometry.mesh import Triangles, boxes_of, compile_triangles, enclosing
from ..geometry.spaces import compile_spaces
from ..geometry.speeds import compile_speeds
from ..geometry.view import compile_view
from ..kept import KEEP_NOTHING, Kept
from ..lights import Emitters, Lights, compile_lights, ray_mask
from ..lights.reach import useful_lamps
from ..plan import Plan
from ..scene import ACTIVE_UV, EVERY_SET, REST, Cancelled, Instance, Note, Scene, Stars
from ..settings import Settings
from ..shading import Library, Place, compile_world, fold_lamps
from ..shutter import compile_shutter
from ..stars import compile_stars
from ..statistics import Preparation
from .light import compile_emitters, compile_lamp_hulls, who_meets_lamps, world_map
from .limits import (
    batch_of,
    bounce_limits,
    check_pattern,
    hits_expected_of,
    light_threshold,
    measures_of,
    mixes_kinds,
    seed_of,
)
from .materials import compile_materials, displaced, image_memory, shapes_of, with_tracer, worn
from .picture import catchers_alone, denoising_of, ledger_of, note_guides, spread_of
from .reuse import with_reuse

T = TypeVar("T", Instance, Stars)

# With fewer samples than this for each triangle, a quick build saves more than its rays cost.
QUICK_BUILD = 0.5


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
    cameras = scene.camera.motion or (scene.camera,) * 3
    if scene.spans_frames:
        # What moves is asked how fast it is, and drawn where it is in the frame itself
        stars = tuple(_still(each) for each in scene.stars)
        scene = replace(scene, camera=replace(scene.camera, motion=()), stars=stars)
    else:
        scene = at_rest(scene, notes)
    check_pattern(settings)
    instances = kept.step("worn", (scene.instances,), lambda: worn(scene.instances))
    scene = replace(scene, instances=instances)

    # Surfaces: a column for each material that occurs.
    side, spare, room, image_notes = image_memory(scene, settings, kept)
    library = kept.step("library", (side, spare is None), lambda: Library(side, shelf=kept.shelf))
    library.renew(spare, room)
    notes += image_notes
    outputs = wanted(scene.layer)
    denoising = denoising_of(scene, settings, notes)
    guides = () if denoising is None else denoising.guides
    materials, surfaces, surface_notes = compile_materials(scene, settings, kept, library, guides)
    notes += surface_notes
    note_guides(scene, surfaces, notes)
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
    boxes = kept.step("boxes", (scene.instances,), lambda: boxes_of(scene.instances))
    box = enclosing(boxes)
    origin = scene.camera.to_world[:, 3] if origin is None else origin
    if box is not None:
        origin = np.clip(origin, box[0], box[1])
    instances, moved_notes = displaced(scene.instances, origin, library, kept, should_stop)
    notes += moved_notes
    if instances is not scene.instances:
        scene = replace(scene, instances=instances)
        boxes = kept.step("displaced boxes", (instances,), lambda: boxes_of(instances))
        box = enclosing(boxes)
        if surfaces.reads_spaces:
            plain = surfaces
            surfaces = kept.step("asking", (plain,), lambda: plain.asking((REST, VECTOR)))
    hits = hits_expected_of(scene, settings) if hits_expected is None else hits_expected
    lamps, emissions, lamp_notes = fold_lamps(scene.lamps, library)
    notes += lamp_notes
    masks = [(lamp.receivers, lamp.blockers) for lamp in lamps]
    masks += [(instance.receivers, instance.blockers) for instance in scene.instances]
    links_lights = any(receivers != EVERY_SET for receivers, _ in masks)
    links_shadows = any(blockers != EVERY_SET for _, blockers in masks)
    asks_where = surfaces.reads_spaces or scene.spans_frames
    is_mapped = bool(surfaces.attributes) or (asks_where and any_moves(scene))
    is_numbered = links_lights or surfaces.reads_spaces or is_mapped or has_passes
    triangles, broken = kept.step(
        "triangles",
        (
            shapes_of(scene.instances, numbers, kept),
            origin.tobytes(),
            settings.instance_memory,
            hits > sum(len(instance.mesh.triangles) for instance in scene.instances),
            transparent,
            links_shadows,
            is_numbered,
            is_mapped,
            scene.spans_frames,
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
            not scene.spans_frames,
        ),
    )
    notes += broken
    speeds = None
    if scene.spans_frames:
        speeds = compile_speeds(cameras, origin, triangles.frames if triangles else None)
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
    spread = spread_of(scene.camera, view)
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
        surfaces = with_tracer(surfaces, accel, is_quick, kept, should_stop)

    # Light.
    def light() -> tuple[Emitters | None, Lights | None]:
        emitters = compile_emitters(triangles, materials, surfaces)
        useful = lamps if any_moves(scene) else useful_lamps(lamps, scene.instances, boxes, origin)
        return emitters, compile_lights(useful, origin, triangles, emitters, emissions)

    made_from = scene.lamps, origin.tobytes(), triangles, surfaces_alone
    emitters, lights = kept.step("lights", made_from, light)
    world, world_notes = compile_world(scene.world, place, library)
    notes += world_notes
    lamps_seen_by = who_meets_lamps(lights, surfaces)
    meets = lamps_seen_by
    world_seen_by = 0 if scene.world is None or world is None else ray_mask(scene.world.seen_by)
    meets |= world_seen_by
    if surfaces.glows.any():
        meets = EVERY_KIND
    environment = kept.step(
        "environment",
        (scene.world, origin.tobytes()),
        lambda: world_map(scene, world),
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
    max_bounces, kind_limits = bounce_limits(settings, surfaces)
    if kept.shelf is not None:
        kept.shelf.limit(settings.texture_memory * 2**30)
    prepared = Preparation(
        compile_seconds=perf_counter() - started - build_seconds,
        build_seconds=build_seconds,
        triangles=triangles.count if triangles else 0,
        parts=len(accel.parts) if accel else 0,
        lights=lights.count if lights else 0,
        textures=len(library.store.images),
        texture_bytes=library.memory,
    )
    moves = camera_motion is not None or any(lamp.motion is not None for lamp in lamps)
    moves = moves or (triangles is not None and triangles.movement is not None)
    shutter = ledger = None
    if moves:
        shutter = compile_shutter(scene.shutter, settings, scene.camera.height)
    if has_passes:
        ledger = ledger_of(scene, materials, triangles, lights, surfaces, guides)
    samples_lights = lights is not None or environment is not None
    plan = Plan(
        camera=camera,
        camera_motion=camera_motion,
        shutter=shutter,
        speeds=speeds,
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
        ledger=ledger,
        pattern=settings.pattern,
        seed=seed_of(settings, scene.frame),
        samples=settings.sample_range(),
        total_samples=settings.samples,
        light_samples=settings.light_samples or 1,
        scatter_samples=settings.scatter_samples or 1,
        measures=measures_of(settings, surfaces, max_bounces, samples_lights),
        splitting=settings.splitting,
        path_reuse=1,
        batch=batch_of(settings, scene.camera, surfaces, max_bounces),
        workers=settings.workers,
        time_limit=settings.time_limit,
        adaptive=adaptive,
        max_bounces=max_bounces,
        kind_limits=kind_limits,
        clamp_direct=3 * settings.sample_clamp_direct,
        clamp_indirect=3 * settings.sample_clamp_indirect,
        transparent_max_bounces=settings.transparent_max_bounces,
        transparent_passes=settings.transparent_max_bounces + scene.spare_passes,
        light_threshold=light_threshold(settings),
        blur_glossy=blur_glossy,
        has_transparent=bool(surfaces.is_transparent.any()),
        links_lights=links_lights,
        links_shadows=links_shadows,
        shifts_terminators=shifts_terminators(triangles),
        emission_varies=surfaces.plain_emission is None,
        mixes_kinds=mixes_kinds(scene, settings, surfaces, world, triangles),
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
            lambda: compile_lamp_hulls(lights, lamps_seen_by, origin, should_stop),
        ),
        world=world,
        environment=environment,
        world_seen_by=world_seen_by,
        world_max_bounces=scene.world.max_bounces if scene.world else 0,
        world_casts_shadow=scene.world is None or scene.world.casts_shadow,
        lamps_seen_by=lamps_seen_by,
        kinds_that_meet_light=meets,
        stars=compile_stars(scene, settings, origin, ledger, notes),
        alone=None,
        notes=tuple(dict.fromkeys(notes)),
        prepared=prepared,
    )
    if has_catchers:
        plan = replace(plan, alone=catchers_alone(plan))
    return with_reuse(plan, settings)


def any_moves(scene: Scene) -> bool:
    """Tell whether anything moves while the shutter is open."""
    return any(instance.moves for instance in scene.instances)


def at_rest(scene: Scene, notes: list[Note]) -> Scene:
    """Return the scene without moving objects, if Embree cannot place them, and note it."""
    names = [instance.name for instance in scene.instances if instance.moves]
    if not names or can_move():
        return scene
    text = "motion blur needs Embree's own library, which was not found: objects are still"
    notes += [Note(f"Object '{name}'", text) for name in dict.fromkeys(names)]
    return replace(scene, instances=tuple(_still(i) if i.moves else i for i in scene.instances))


def _still(thing: T) -> T:
    return replace(thing, motion=None, mesh=replace(thing.mesh, deformation=None))


def shifts_terminators(triangles: Triangles | None) -> bool:
    """Tell whether an object darkens or moves the terminator."""
    objects = None if triangles is None else triangles.objects
    return objects is not None and objects.terminator_shading is not None
