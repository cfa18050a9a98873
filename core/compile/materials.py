"""materials, images -> surfaces.  Materials, and shapes that they change."""

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..film.ledger import surface_facts
from ..geometry.accel import Accel, compile_own
from ..images.store import Asked, fit
from ..kept import KeepNothing, Kept
from ..scene import Instance, Link, Material, Node, Note, Scene
from ..settings import Settings
from ..shading import (
    OWN,
    Library,
    Rules,
    Surface,
    SurfaceTable,
    compile_surface,
    compile_table,
    compile_tracer,
    displace,
    images_below,
    keep_used,
    on_sheets,
    output_of,
)

SHEETS = 800.0  # bytes of sheets that pay for each ray


def worn(instances: tuple[Instance, ...]) -> tuple[Instance, ...]:
    """Return instances whose slots hold no material that none of their faces has."""
    used: dict[tuple[int, int], list[bool]] = {}
    out = []
    for instance in instances:
        slots, materials = instance.mesh.slots, instance.materials
        if len(materials) > 1 and len(instance.mesh.triangles):
            key = id(instance.mesh), len(materials)
            if key not in used:
                used[key] = _used(slots, len(materials))
            first = materials[used[key].index(True)]
            pairs = zip(materials, used[key], strict=True)
            kept = tuple(material if is_used else first for material, is_used in pairs)
            if kept != materials:
                instance = replace(instance, materials=kept)
        out.append(instance)
    return tuple(out)


def _used(slots: NDArray[np.int32] | None, count: int) -> list[bool]:
    """Return which of `count` slots faces have; as everywhere, those beyond are the last."""
    if slots is None:
        return [True] + [False] * (count - 1)
    numbers = np.bincount(np.clip(slots, 0, count - 1), minlength=count)
    found: list[bool] = (numbers > 0).tolist()
    return found


def compile_materials(
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
        _read_ahead([material for material in materials if material is not None], rules, library)
        plain = surfaces("surfaces", rules)
        joined = on_sheets(plain, library)
        table = compile_table(joined, rules.shown)
        if settings.blur_glossy > 0 and table.has_specular:
            # A second table, of what paths see that filter glossy blurs.
            blurred = surfaces("blurred surfaces", replace(rules, is_blurred=True, shown=()))
            blurred = on_sheets(blurred, library)
            table = replace(table, blurred=compile_table(blurred))
            joined = joined + blurred
        keep_used(joined, library)
        return table, [note for surface in plain for note in surface.notes]

    made_from = tuple(materials), rules, settings.blur_glossy > 0, library
    return materials, *kept.step("surface table", made_from, table)


def _read_ahead(materials: Sequence[Material], rules: Rules, library: Library) -> None:
    """Read the files that surfaces will ask for, several at the same time.

    Graphs tell which these are: an image that nothing of the surface depends on is not read.
    """
    below = (source for material in materials for source in images_below(output_of(material)))
    if len({source for source in below if source not in library}) < 2:
        return
    asked = Asked()
    trial = Library(store=asked)
    for material in materials:
        compile_surface(_owner(material), material, rules, trial)
    library.read(asked.sources)


def with_tracer(
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


def shapes_of(
    instances: tuple[Instance, ...], numbers: dict[int, int], kept: Kept
) -> list[tuple[Any, ...]]:
    """Return all that the table of triangles is made from, of each instance."""
    if isinstance(kept, KeepNothing):
        return []
    names = [field.name for field in fields(Instance) if field.name not in _NOT_SHAPES]

    def shape(instance: Instance) -> tuple[Any, ...]:
        materials = tuple(numbers[id(material)] for material in instance.materials or (None,))
        rest = tuple(getattr(instance, name) for name in names)
        motion = None if instance.motion is None else instance.motion.tobytes()
        return instance.mesh, instance.to_world.tobytes(), motion, materials, *rest

    made_from = instances, tuple(numbers.items())
    return kept.step("shapes", made_from, lambda: [shape(instance) for instance in instances])


def image_memory(
    scene: Scene, settings: Settings, kept: Kept
) -> tuple[int, float | None, float, list[Note]]:
    """Return what the sides of images are limited to, so that they fit the memory; 0: nothing.

    And what is left for their levels [bytes], None if there shall be none, and for their sheets;
    and notes that name images that will be smaller.
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

    # A byte of levels takes as long as a twentieth of a ray: a tenth of the time may go there; one
    # of sheets takes two nanoseconds, and they save some 800 for each ray, in the next renders,
    # too, which find them done.  Whether they do must not show: so the same holds for the first.
    # The rays are those of the whole frame, so that its parts look alike
    rays = scene.camera.width * scene.camera.height * settings.samples
    room = min(spare, SHEETS * rays)
    # How wide a pixel of a panorama is depends on where it is
    if not settings.texture_filter or scene.camera.panorama is not None:
        return side, None, room, notes
    levels = min(spare, 2.0 * rays)
    return side, levels, min(room, spare - levels), notes


def displaced(
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


def _owner(material: Material | None) -> str:
    return f"Material '{material.name}'" if material else "Default material"
