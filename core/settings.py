"""user -> settings.  Every option of the engine, once: name, default, range, label, help.

The dataclass *is* the table: the add-on makes its properties and panels by looping over
`OPTIONS`.  Names, meaning and defaults are those of Cycles wherever Cycles has the option.
"""

from dataclasses import dataclass, field, fields, replace
from typing import Any

from .scene import SceneError

UNLIMITED = 1 << 24


@dataclass(frozen=True)
class Option:
    """What the add-on needs to show one setting; `awaits` says what is missing to honour it."""

    name: str
    default: Any
    label: str
    help: str
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[tuple[str, str, str], ...] = ()
    awaits: str = ""


def _option(default: Any, label: str, help: str, **more: Any) -> Any:
    return field(default=default, metadata={"label": label, "help": help, **more})


def _count(default: int, label: str, help: str, low: int = 0, high: int = 1024) -> Any:
    return _option(default, label, help, minimum=low, maximum=high)


PATTERNS = (
    ("SOBOL", "Sobol", "Owen-scrambled Sobol sequence: the lowest error, for any sample count"),
    ("POISSON", "Poisson Disk", "Points that keep a minimum distance; for a fixed sample count"),
    ("JITTERED", "Jittered", "One random point in each cell of a grid; for a fixed sample count"),
    ("REGULAR", "Regular", "The centres of a grid in the pixel; for a fixed sample count"),
    ("RANDOM", "Random", "Independent uniform points: the yardstick the others are held against"),
)
SHUTTERS = (
    ("NONE", "None", "The whole picture is exposed at once"),
    ("TOP", "Top-Bottom", "Rows are exposed one after the other, from the top"),
)
FILTERS = (
    ("BOX", "Box", "Box filter of one pixel"),
    ("GAUSSIAN", "Gaussian", "Gaussian filter"),
    ("BLACKMAN_HARRIS", "Blackman-Harris", "Blackman-Harris filter"),
)
GUIDES = (
    ("RGB", "None", "The picture alone"),
    ("RGB_ALBEDO", "Albedo", "The colours of surfaces"),
    ("RGB_ALBEDO_NORMAL", "Albedo and Normal", "The colours and normals of surfaces"),
)
PREFILTERS = (
    ("NONE", "None", "They are taken for free of noise"),
    ("FAST", "Fast", "They are denoised together with the picture"),
    ("ACCURATE", "Accurate", "They are denoised before the picture is"),
)
REUSES = (
    ("AUTO", "Automatic", "Where measuring a few pixels says that it pays"),
    ("ON", "On", "Wherever it can be"),
    ("OFF", "Off", "Each pixel has its own paths only"),
)

WORKERS = (
    ("AUTO", "Automatic", "Processes where they pay: longer renders on several threads"),
    ("THREADS", "Threads", "Threads of Blender itself, which wait for each other now and then"),
    ("PROCESSES", "Processes", "On Linux copies of Blender that share its memory, else fresh ones"),
    ("FRESH", "Fresh Processes", "Processes without Blender, which take about a second to start"),
)
QUALITIES = (
    ("HIGH", "High", "The best"),
    ("BALANCED", "Balanced", "In between"),
    ("FAST", "Fast", "The fastest"),
)


@dataclass(frozen=True)
class Settings:
    """All options of a render; construct with keywords, change with `dataclasses.replace`."""

    # Sampling
    samples: int = _count(4096, "Samples", "Number of samples for each pixel", 1, UNLIMITED)
    preview_samples: int = _option(
        1024,
        "Viewport Samples",
        "Number of samples in the viewport, unlimited if 0",
        minimum=0,
        maximum=UNLIMITED,
    )
    pattern: str = _option(
        "SOBOL", "Pattern", "How the samples of a pixel are spread", choices=PATTERNS
    )
    light_samples: int = _count(
        0,
        "Light Samples",
        "Shadow rays to each light where a camera ray meets a surface; 0 measures what pays",
        0,
        64,
    )
    scatter_samples: int = _count(
        0,
        "Scatter Samples",
        "Rays that go on from each closure where a camera ray meets a surface; 0 measures what "
        "pays",
        0,
        64,
    )
    path_reuse: str = _option(
        "AUTO",
        "Path Reuse",
        "Whether tiles of pixels share what their scattered rays find: less noise in indirect "
        "light, but alike within tiles; AUTO measures what pays, and has none with denoising",
        choices=REUSES,
    )
    splitting: bool = _option(
        True,
        "Splitting",
        "Follow both the reflected and the refracted ray where a path first meets glass, "
        "instead of one of the two",
    )
    seed: int = _count(0, "Seed", "Gives another noise pattern", 0, 2**31 - 1)
    use_animated_seed: bool = _option(
        False, "Use Animated Seed", "Use another seed, and so another noise pattern, each frame"
    )
    time_limit: float = _option(
        0.0,
        "Time Limit",
        "Stop sampling after this many seconds; no limit if 0",
        minimum=0.0,
        maximum=3.4e38,
    )
    use_sample_subset: bool = _option(
        False, "Use Sample Subset", "Render only a part of the samples, to share a frame out"
    )
    sample_offset: int = _count(
        0, "Sample Subset Offset", "First sample of the subset, counted from 0", 0, UNLIMITED
    )
    sample_subset_length: int = _count(
        2048, "Sample Subset Length", "Number of samples in the subset", 1, UNLIMITED
    )
    use_adaptive_sampling: bool = _option(
        True,
        "Use Adaptive Sampling",
        "Stop sampling pixels whose noise is below the threshold; for progressive patterns",
    )
    adaptive_threshold: float = _option(
        0.01,
        "Adaptive Sampling Threshold",
        "Noise level at which sampling stops; 0 takes it from the number of samples",
        minimum=0.0,
        maximum=1.0,
    )
    adaptive_min_samples: int = _option(
        0,
        "Adaptive Min Samples",
        "Samples before the noise is judged, rounded up to a power of two; 0 takes it from the "
        "threshold",
        minimum=0,
        maximum=4096,
    )
    use_denoising: bool = _option(
        True,
        "Use Denoising",
        "Denoise the rendered image with OpenImageDenoise, where Blender brings it along",
    )
    denoising_input_passes: str = _option(
        "RGB_ALBEDO_NORMAL",
        "Denoising Passes",
        "What tells the denoiser edges from noise",
        choices=GUIDES,
    )
    denoising_prefilter: str = _option(
        "ACCURATE",
        "Denoising Prefilter",
        "What is done against noise in what guides the denoiser",
        choices=PREFILTERS,
    )
    denoising_quality: str = _option(
        "HIGH", "Denoising Quality", "How much time denoising may take", choices=QUALITIES
    )

    use_preview_denoising: bool = _option(
        False,
        "Viewport Denoising",
        "Denoise the picture in the viewport once it has all its samples",
    )

    # Light paths
    max_bounces: int = _count(12, "Max Bounces", "Bounces in all; 0 is direct light only")
    diffuse_bounces: int = _count(4, "Diffuse Bounces", "Diffuse bounces, bounded by the total")
    glossy_bounces: int = _count(4, "Glossy Bounces", "Reflections, bounded by the total")
    transmission_bounces: int = _count(
        12, "Transmission Bounces", "Refractions, bounded by the total"
    )
    volume_bounces: int = _option(
        0, "Volume Bounces", "Scattering in volumes", minimum=0, maximum=1024, awaits="volumes"
    )
    transparent_max_bounces: int = _option(
        8,
        "Transparent Max Bounces",
        "Transparent surfaces that a ray passes",
        minimum=0,
        maximum=1024,
    )
    sample_clamp_direct: float = _option(
        0.0, "Clamp Direct", "Largest direct light of a sample; no limit if 0", minimum=0.0
    )
    sample_clamp_indirect: float = _option(
        10.0, "Clamp Indirect", "Largest indirect light of a sample; no limit if 0", minimum=0.0
    )
    use_light_tree: bool = _option(
        True,
        "Light Tree",
        "Trace all light samples; many lights are chosen by what they contribute anyhow",
    )
    light_sampling_threshold: float = _option(
        0.01,
        "Light Sampling Threshold",
        "Without Light Tree: light samples that add less than this are left out at random, without "
        "bias",
        minimum=0.0,
        maximum=1.0,
    )
    blur_glossy: float = _option(
        1.0,
        "Filter Glossy",
        "Blur reflections that are seen after a diffuse bounce",
        minimum=0.0,
        maximum=10.0,
    )
    caustics_reflective: bool = _option(
        True, "Reflective Caustics", "Light that mirrors throw on matte surfaces"
    )
    caustics_refractive: bool = _option(
        True, "Refractive Caustics", "Light that glass throws on matte surfaces"
    )

    # Film
    rolling_shutter_type: str = _option(
        "NONE", "Rolling Shutter", "How the shutter passes the picture", choices=SHUTTERS
    )
    rolling_shutter_duration: float = _option(
        0.1,
        "Rolling Shutter Duration",
        "The share of the shutter's time for which a row is exposed",
        minimum=0.0,
        maximum=1.0,
    )
    pixel_filter_type: str = _option(
        "BLACKMAN_HARRIS", "Filter Type", "Pixel filter", choices=FILTERS
    )
    filter_width: float = _option(
        1.5, "Filter Width", "Pixel filter width [pixels]", minimum=0.01, maximum=10.0
    )
    film_exposure: float = _option(
        1.0, "Exposure", "Factor on the brightness of the picture", minimum=0.0, maximum=2.0**32
    )

    film_transparent_glass: bool = _option(
        False,
        "Transparent Glass",
        "With a transparent film, what is seen through glass is transparent, too",
    )
    film_transparent_roughness: float = _option(
        0.1,
        "Transparent Roughness Threshold",
        "Glass of more than this roughness stays opaque",
        minimum=0.0,
        maximum=1.0,
    )

    # Performance
    workers: str = _option(
        "AUTO", "Workers", "Who does the work of each thread in final renders", choices=WORKERS
    )
    instance_memory: float = _option(
        4.0,
        "Instance Memory",
        "Gigabytes that the flattened triangles of the scene may take before the render stops "
        "with an error that names the largest object",
        minimum=0.01,
        maximum=4096.0,
    )

    texture_filter: bool = _option(
        True,
        "Texture Filter",
        "Look images up smaller where they are far away, if the converged picture stays the same: "
        "less noise",
    )
    texture_memory: float = _option(
        4.0,
        "Texture Memory",
        "Gigabytes that images may take before the largest are read at half their size, or less; "
        "the report names them",
        minimum=0.001,
        maximum=4096.0,
    )

    def __post_init__(self) -> None:
        for option in OPTIONS:
            value = getattr(self, option.name)
            if option.choices:
                if value not in (identifier for identifier, _, _ in option.choices):
                    names = ", ".join(identifier for identifier, _, _ in option.choices)
                    raise SceneError(f"Setting '{option.name}': {value!r} is not one of {names}")
                continue
            low, high = option.minimum, option.maximum
            if not value == value or (low is not None and value < low):
                raise SceneError(f"Setting '{option.name}': {value} is below {low}")
            if high is not None and value > high:
                raise SceneError(f"Setting '{option.name}': {value} is above {high}")

    def sample_range(self) -> tuple[int, int]:
        """Return the first sample and the one past the last, counted from 0."""
        if not self.use_sample_subset:
            return 0, self.samples
        first = min(self.sample_offset, self.samples)
        return first, min(first + self.sample_subset_length, self.samples)


OPTIONS: tuple[Option, ...] = tuple(
    Option(name=item.name, default=item.default, **item.metadata) for item in fields(Settings)
)

__all__ = ["OPTIONS", "Option", "Settings", "replace"]
