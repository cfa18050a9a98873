"""features -> what they cost.  CPU time with and without each, where it is used and where not.

Each feature is a change of the Cornell box.  Unused, it is measured against the plain file; used,
in a scene that gives it something to do, against that same scene without it.  All pictures of a
feature are rendered in turn in one process, round after round, and a ratio is the median over the
rounds: so what else the machine does is in both.  `skips.py` has what a scene can do without.
"""

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING, Any

from .skips import SKIPS, Skip

if TYPE_CHECKING:
    from .process import Worker

FILE, SIZE, SAMPLES = "cornell_box", 160, 16
STATES = ("plain", "unused", "bare", "on")  # bare: the scene of "on" without the feature


def _set(owner: str, **values: Any) -> Callable[[Any], None]:
    """Return a change of properties; owner: their path from "scene", "layer" or "camera"."""

    def change(scene: Any) -> None:
        place = {"layer": scene.view_layers[0], "camera": scene.camera.data, "scene": scene}
        first, *rest = owner.split(".")
        found = place[first]
        for name in rest:
            found = getattr(found, name)
        for name, value in values.items():
            setattr(found, name, value)

    return change


def _ask(*names: str) -> Callable[[Any], None]:
    """Return a change that asks for passes."""
    return _set("layer", **{f"use_pass_{name}": True for name in names})


def _lobe(name: str) -> tuple[str, ...]:
    return tuple(f"{name}_{kind}" for kind in ("direct", "indirect", "color"))


def _meshes(scene: Any) -> list[Any]:
    return sorted(
        (each for each in scene.objects if each.type == "MESH"), key=lambda each: each.name
    )


def _key(thing: Any) -> None:
    """Make an object go by a little from frame to frame."""
    for frame, aside in ((0, -0.1), (2, 0.1)):
        thing.location.x += aside
        thing.keyframe_insert("location", frame=frame)
        thing.location.x -= aside


def _move_object(scene: Any) -> None:
    _key(min(_meshes(scene), key=lambda each: max(each.dimensions)))
    scene.frame_set(1)


def _move_camera(scene: Any) -> None:
    _key(scene.camera)
    scene.frame_set(1)


def _shine(scene: Any) -> None:
    """Make all surfaces glossy."""
    import bpy

    gloss = bpy.data.materials.new("Gloss")
    if bpy.app.version < (5, 0):
        gloss.use_nodes = True
    tree = gloss.node_tree
    node = tree.nodes.new("ShaderNodeBsdfAnisotropic")
    node.inputs["Roughness"].default_value = 0.4
    tree.links.new(node.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    scene.view_layers[0].material_override = gloss


def _catch(scene: Any) -> None:
    max(_meshes(scene), key=lambda each: max(each.dimensions)).is_shadow_catcher = True


def _step_back(scene: Any) -> None:
    """Make half of the picture background."""
    scene.camera.data.lens *= 0.5


def _ask_group(scene: Any) -> None:
    scene.view_layers[0].lightgroups.add(name="Group")


def _use_group(scene: Any) -> None:
    for each in scene.objects:
        each.lightgroup = "Group"


def _ask_aov(scene: Any) -> None:
    aov = scene.view_layers[0].aovs.add()
    aov.name, aov.type = "Own", "COLOR"


def _use_aov(scene: Any) -> None:
    for each in {slot.material for item in _meshes(scene) for slot in item.material_slots}:
        node = each.node_tree.nodes.new("ShaderNodeOutputAOV")
        node.aov_name = "Own"


def _fisheye(scene: Any) -> None:
    """Look as wide as before, through another lens."""
    data = scene.camera.data
    angle = data.angle
    data.type = "PANO"
    owner = data if hasattr(data, "panorama_type") else data.cycles
    owner.panorama_type, owner.fisheye_fov = "FISHEYE_EQUIDISTANT", angle


def _stop_noisy(scene: Any) -> None:
    scene.penumbra.samples = 128


@dataclass(frozen=True)
class Feature:
    """What turns a feature on, and what makes a scene use it; None if every scene does."""

    name: str
    turn_on: Callable[[Any], None]
    use: Callable[[Any], None] | None = None

    def states(self) -> tuple[str, ...]:
        """Return which of `STATES` are rendered."""
        return STATES if self.use is not None else ("bare", "on")

    def apply(self, state: str, scene: Any) -> None:
        """Change the plain scene to a state."""
        if self.use is not None and state in ("bare", "on"):
            self.use(scene)
        if state in ("unused", "on"):
            self.turn_on(scene)


_OWN, _RENDER, _DATA = "scene.penumbra", "scene.render", "layer.penumbra"
_BLUR = _set(_RENDER, use_motion_blur=True)
_ADAPT = _set(_OWN, use_adaptive_sampling=True, adaptive_threshold=0.1)
FEATURES = (
    Feature("depth of field", _set("camera.dof", use_dof=True, aperture_fstop=1.0)),
    Feature("motion blur, one object", _BLUR, _move_object),
    Feature("motion blur, camera", _BLUR, _move_camera),
    Feature("adaptive sampling", _ADAPT, _stop_noisy),
    Feature(
        "depth, mist, position, normal, UV, indices",
        _ask("z", "mist", "position", "normal", "uv", "object_index", "material_index"),
    ),
    Feature("vector", _ask("vector"), _move_object),
    Feature("diffuse, emission, environment", _ask(*_lobe("diffuse"), "emit", "environment")),
    Feature("glossy", _ask(*_lobe("glossy")), _shine),
    Feature("ambient occlusion", _ask("ambient_occlusion")),
    Feature("cryptomattes", _ask("cryptomatte_object", "cryptomatte_material")),
    Feature("light group", _ask_group, _use_group),
    Feature("own pass (AOV)", _ask_aov, _use_aov),
    Feature("shadow catcher", _set(_DATA, use_pass_shadow_catcher=True), _catch),
    Feature("denoising data", _set(_DATA, denoising_store_passes=True)),
    Feature(
        "sample count, render time",
        _set(_DATA, pass_debug_sample_count=True, pass_render_time=True),
    ),
    Feature("denoising", _set(_OWN, use_denoising=True)),
    Feature("Gaussian filter", _set(_OWN, pixel_filter_type="GAUSSIAN")),
    Feature("Blackman-Harris filter", _set(_OWN, pixel_filter_type="BLACKMAN_HARRIS")),
    Feature("panorama (fisheye)", _fisheye),
    Feature("film transparent", _set(_RENDER, film_transparent=True), _step_back),
)
ALL: tuple[Feature | Skip, ...] = FEATURES + SKIPS
BY_NAME = {each.name: each for each in ALL}


def measure_costs(
    worker: "Worker", blend: str, rounds: int, quick: bool, say: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Return the costs of all features: ratios, and the CPU seconds of each state."""
    size, results = (SIZE // 2 if quick else SIZE), []
    worker.call("cost", blend=blend, feature=FEATURES[0].name, state="bare", size=size)
    for feature in ALL:
        say(feature.name)
        states = feature.states()
        seconds: dict[str, list[float]] = {state: [] for state in states}
        for number in range(rounds):
            for state in states[:: 1 if number % 2 == 0 else -1]:
                way = {"blend": blend, "feature": feature.name, "state": state, "size": size}
                seconds[state].append(worker.call("cost", **way)["cpu_seconds"])
        results.append({"name": feature.name, "cpu_seconds": seconds} | ratios(seconds))
    return results


def ratios(seconds: dict[str, list[float]]) -> dict[str, float | None]:
    """Return ratios of time, None where not measured.

    What a feature costs unused, and on, and how much longer it takes where it is not skipped.
    """

    def ratio(state: str, other: str) -> float | None:
        if state not in seconds or other not in seconds:
            return None
        return median(a / b for a, b in zip(seconds[state], seconds[other], strict=True))

    found = {"unused": ratio("unused", "plain"), "on": ratio("on", "bare")}
    return found | {"gain": ratio("kept", "unused")}


def print_costs(results: list[dict[str, Any]]) -> None:
    """Print the table, as README shows it."""
    print("\n| feature | off | on, unused | on | skipping gains |\n|---|---|---|---|---|")
    for each in results:
        shown = (each[key] for key in ("unused", "on", "gain"))
        cells = ("" if value is None else f"{value:.2f}" for value in shown)
        print(f"| {each['name']} | 1 | {' | '.join(cells)} |")
