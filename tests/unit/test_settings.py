"""core.settings -> the table of options agrees with itself and with Cycles."""

import re
from dataclasses import fields

import numpy as np
import pytest

from penumbra.core import OPTIONS, SceneError, Settings
from penumbra.core.settings import UNLIMITED, replace

# Read from Cycles 5.2.
CYCLES = {
    "samples": 4096,
    "preview_samples": 1024,
    "seed": 0,
    "use_animated_seed": False,
    "time_limit": 0.0,
    "use_sample_subset": False,
    "sample_offset": 0,
    "sample_subset_length": 2048,
    "use_adaptive_sampling": True,
    "adaptive_threshold": 0.01,
    "adaptive_min_samples": 0,
    "use_denoising": True,
    "denoising_input_passes": "RGB_ALBEDO_NORMAL",
    "denoising_prefilter": "ACCURATE",
    "denoising_quality": "HIGH",
    "use_preview_denoising": False,
    "max_bounces": 12,
    "diffuse_bounces": 4,
    "glossy_bounces": 4,
    "transmission_bounces": 12,
    "volume_bounces": 0,
    "transparent_max_bounces": 8,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 10.0,
    "use_light_tree": True,
    "light_sampling_threshold": 0.01,
    "blur_glossy": 1.0,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "rolling_shutter_type": "NONE",
    "rolling_shutter_duration": 0.1,
    "pixel_filter_type": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
    "film_exposure": 1.0,
    "film_transparent_glass": False,
    "film_transparent_roughness": 0.1,
}
OWN = {"pattern", "light_samples", "scatter_samples", "splitting", "workers", "instance_memory"}
OWN |= {"path_reuse", "texture_filter", "texture_memory"}

every = pytest.mark.parametrize("option", OPTIONS, ids=lambda option: option.name)
numbers = pytest.mark.parametrize(
    "option",
    [o for o in OPTIONS if isinstance(o.default, (int, float)) and not isinstance(o.default, bool)],
    ids=lambda option: option.name,
)


def test_defaults_are_those_of_cycles():
    for name, default in CYCLES.items():
        assert getattr(Settings(), name) == default, name


def test_every_option_is_either_of_cycles_or_known_as_ours():
    assert {option.name for option in OPTIONS} == set(CYCLES) | OWN
    assert [option.name for option in OPTIONS] == [item.name for item in fields(Settings)]


@every
def test_every_option_can_be_shown(option):
    assert option.label
    assert option.help
    assert not option.help.endswith(".")  # Blender adds it
    if isinstance(option.default, str):
        assert option.default in [identifier for identifier, _, _ in option.choices]
    elif not isinstance(option.default, bool):
        assert option.minimum is None or option.minimum <= option.default
        assert option.maximum is None or option.default <= option.maximum
        assert option.minimum is not None


@numbers
def test_numbers_out_of_range_are_refused_by_name(option):
    wrong = [option.minimum - 1, float("nan"), -np.inf]
    wrong += [] if option.maximum is None else [option.maximum * 2 + 1]
    for value in wrong:
        with pytest.raises(SceneError, match=re.escape(f"'{option.name}'")):
            Settings(**{option.name: value})


@every
def test_unknown_choices_are_refused_by_name(option):
    if option.choices:
        with pytest.raises(SceneError, match=f"'{option.name}'.*NONSENSE"):
            Settings(**{option.name: "NONSENSE"})


@pytest.mark.parametrize(
    ("changes", "expected"),
    (
        ({}, (0, 100)),
        ({"sample_offset": 10}, (0, 100)),
        ({"use_sample_subset": True, "sample_offset": 10, "sample_subset_length": 5}, (10, 15)),
        ({"use_sample_subset": True, "sample_offset": 98, "sample_subset_length": 5}, (98, 100)),
        ({"use_sample_subset": True, "sample_offset": 500, "sample_subset_length": 5}, (100, 100)),
        ({"use_sample_subset": True, "sample_subset_length": UNLIMITED}, (0, 100)),
    ),
)
def test_the_range_of_samples_stays_within_the_samples(changes, expected):
    assert replace(Settings(samples=100), **changes).sample_range() == expected
