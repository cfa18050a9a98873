"""scene, settings -> passes.  What the picture has besides light."""

from dataclasses import replace

import numpy as np

from ..arrays import F32, normalize
from ..bsdf import GLOSSY, shown_as
from ..film.denoise import Denoising, is_there
from ..film.ledger import TRANSMISSION, Ledger, compile_ledger, lobe_of
from ..geometry.mesh import Triangles
from ..geometry.view import View
from ..lights import Lights
from ..optics import panoramas
from ..plan import Plan
from ..scene import Camera, Material, Note, Scene
from ..settings import Settings
from ..shading import SurfaceTable


def ledger_of(
    scene: Scene,
    materials: list[Material | None],
    triangles: Triangles | None,
    lights: Lights | None,
    surfaces: SurfaceTable,
    guides: tuple[str, ...],
) -> Ledger | None:
    """Return where what the passes ask for goes."""
    lobes = {lobe_of(shown_as(module)) for module in surfaces.modules}
    if any(module.TRANSMITS for module in surfaces.modules):
        lobes.add(TRANSMISSION)
    lamps = [] if lights is None else [lamp.light_group for _, lamp in lights.lamps]
    glowing = None
    if lights is not None and lights.triangle_of is not None:
        assert triangles is not None
        glowing = triangles.ids[:, 2].take(lights.triangle_of)
    world = "" if scene.world is None else scene.world.light_group
    return compile_ledger(
        scene.layer, scene.instances, materials, lamps, glowing, world, lobes, guides
    )


def denoising_of(scene: Scene, settings: Settings, notes: list[Note]) -> Denoising | None:
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


def note_guides(scene: Scene, surfaces: SurfaceTable, notes: list[Note]) -> None:
    """Add to notes that passes of guides show smooth surfaces themselves, where there are any."""
    is_smooth = any(each.IS_DELTA and each.RAY_KIND == GLOSSY for each in surfaces.modules)
    if is_smooth and "Denoising Albedo" in scene.layer.passes:
        text = "Denoising Data show mirrors and clear glass themselves, not what is seen in them"
        notes.append(Note("Render settings", text))


def catchers_alone(plan: Plan) -> Plan:
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


def spread_of(camera: Camera, view: View) -> tuple[float, float]:
    """Return how wide a pixel is at the camera [m], and what it gains per metre."""
    left, right, bottom, top = camera.window
    if camera.panorama is not None:
        middle = np.array([[left + right], [bottom + top]], F32) * F32(0.5)
        direction, _ = panoramas.direction(camera.panorama, *middle)
        return 0.0, float(view.footprint(normalize(direction))[0])
    size = 0.5 * ((right - left) / camera.width + (top - bottom) / camera.height)
    return (0.0, size) if camera.projection == "PERSP" else (size, 0.0)
