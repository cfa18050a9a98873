"""name -> Pass.  The pictures besides Combined that a view layer may ask for: the one table.

The film sums up what wanted passes read and nothing else; the add-on tells Blender their names.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ..layer import Layer
from . import reading
from .film import MIDDLES, Film


@dataclass(frozen=True)
class Pass:
    """A picture by its name in Blender >= 5, with a letter for each channel.

    flag: the property by which a view layer asks for it, after "own." one of the engine's, and
    another that it needs besides; reads: names of `SUMS` or `MIDDLES`, which `read` makes the
    picture of.
    """

    name: str
    channels: str
    flag: str
    read: Callable[..., reading.Array]
    reads: tuple[str, ...] = ()
    before_5: str = ""
    besides: str = ""

    def pixels(self, film: Film, exposure: float) -> reading.Array:
        """Return the picture (C, pixels)."""
        return self.read(film, exposure, *self.reads)


def _lobe(name: str, short: str) -> Iterator[Pass]:
    """Yield the passes of one sort of closures."""
    low, flag = name.lower(), f"use_pass_{name.lower()}"
    for kind in ("Direct", "Indirect"):
        sums = f"{low}_{kind.lower()}", low
        old = f"{short}{kind[:3]}"
        yield Pass(f"{name} {kind}", "RGB", f"{flag}_{kind.lower()}", reading.lighting, sums, old)
    yield Pass(f"{name} Color", "RGB", f"{flag}_color", reading.mean, (low,), f"{short}Col")


STORES, IS_DENOISED = "own.denoising_store_passes", "own.use_denoising"
CATCHER = "own.use_pass_shadow_catcher"

PASSES = (
    Pass("Depth", "Z", "use_pass_z", reading.depth, ("depth",)),
    Pass("Mist", "Z", "use_pass_mist", reading.mist, ("mist",)),
    Pass("Position", "XYZ", "use_pass_position", reading.middle, ("position",)),
    Pass("Normal", "XYZ", "use_pass_normal", reading.mean, ("normal",)),
    Pass("Vector", "XYZW", "use_pass_vector", reading.speed, ("speed",)),
    Pass("UV", "UVA", "use_pass_uv", reading.mean, ("uv",)),
    Pass(
        "Object Index", "X", "use_pass_object_index", reading.middle, ("object_index",), "IndexOB"
    ),
    Pass(
        "Material Index",
        "X",
        "use_pass_material_index",
        reading.middle,
        ("material_index",),
        "IndexMA",
    ),
    *_lobe("Diffuse", "Diff"),
    *_lobe("Glossy", "Gloss"),
    *_lobe("Transmission", "Trans"),
    Pass("Emission", "RGB", "use_pass_emit", reading.exposed, ("emission",), "Emit"),
    Pass("Environment", "RGB", "use_pass_environment", reading.exposed, ("environment",), "Env"),
    Pass(
        "Ambient Occlusion",
        "RGB",
        "use_pass_ambient_occlusion",
        reading.mean,
        ("occlusion",),
        "AO",
    ),
    Pass("Noisy Image", "RGBA", IS_DENOISED, reading.noisy),
    Pass("Denoising Albedo", "RGB", STORES, reading.mean, ("albedo",)),
    Pass("Denoising Normal", "XYZ", STORES, reading.mean, ("bearing",)),
    Pass("Denoising Depth", "Z", STORES, reading.mean, ("reach",)),
    Pass("Shadow Catcher", "RGB", CATCHER, reading.catcher),
    Pass("Noisy Shadow Catcher", "RGB", CATCHER, reading.catcher, besides=IS_DENOISED),
    Pass("Debug Sample Count", "X", "own.pass_debug_sample_count", reading.samples),
    Pass("Render Time", "X", "own.pass_render_time", reading.milliseconds, ("seconds",)),
)
BY_NAME = {each.name: each for each in PASSES}


def wanted(layer: Layer) -> tuple[Pass, ...]:
    """Return the passes of a layer, with its own ones, but no cryptomattes."""
    found = [BY_NAME[name] for name in layer.passes]
    for name, is_colour in layer.aovs:
        sums = f"aov_color:{name}" if is_colour else f"aov_value:{name}"
        found.append(Pass(name, "RGBA" if is_colour else "X", "", reading.mean, (sums,)))
    for name in layer.light_groups:
        found.append(Pass(f"Combined_{name}", "RGB", "", reading.exposed, (f"group:{name}",)))
    return tuple(found)


def sums_of(passes: tuple[Pass, ...]) -> tuple[str, ...]:
    """Return all that passes read, each once."""
    return tuple(dict.fromkeys(name for each in passes for name in each.reads))


def needs_middles(passes: tuple[Pass, ...]) -> bool:
    """Tell whether any pass shows the middles of pixels."""
    return any(name in MIDDLES for name in sums_of(passes))
