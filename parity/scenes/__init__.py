"""names -> scenes of the parity suite.  One feature or extreme each, and what it shows: one table.

A scene is a row of one of the lists that are joined here. `build` gets the module `stage` and
fills an empty file with it; nothing here imports bpy, so that scenes can be listed without it.
`KNOWN` names the scenes that differ and why, as shown and not as guessed: 5 % of them at most;
`KNOWN_BEFORE` those that differ from what Cycles was in older versions of Blender.
"""

from . import (
    basics,
    bumps,
    cameras,
    coats,
    dielectrics,
    displacement,
    emitters,
    inputs,
    lamps,
    limits,
    metals,
    movement,
    normals,
    shaders,
    skies,
    transparency,
    visibility,
)
from .scene import Scene

_MODULES = (basics, lamps, skies, emitters, dielectrics, metals, coats, shaders, inputs)
_MODULES += (transparency, visibility, normals, bumps, displacement, limits, cameras, movement)

ALL: tuple[Scene, ...] = tuple(scene for module in _MODULES for scene in module.ROWS)
SCENES: dict[str, Scene] = {scene.name: scene for scene in ALL}

# name -> the cause of its difference
_SUBSURFACE = "Subsurface scattering is drawn as diffuse, and the report says so"
KNOWN: dict[str, str] = {
    "principled_subsurface": _SUBSURFACE,
    "principled_subsurface_half": _SUBSURFACE,
    "subsurface_node": _SUBSURFACE,
    "sky_hosek_wilkie": "Drawn as Preetham's sky, and the report says so: its data are missing",
    "transparent_limit_0": "Cycles counts lamps that rays meet as transparent surfaces: with a "
    "limit of 0 they hide the sky. With lamps that rays do not meet (no MIS) both are the same",
    "path_is_diffuse_ray": "Cycles weighs what glows for diffuse rays only against light samples "
    "that find nothing, and loses light by the odds of its light tree. Without emission sampling "
    "both are the same",
    "motion_zoom_orthographic": "Cycles does not blur the zoom of a camera without perspective: "
    "its picture is, to the last bit, the one at rest with the scale of the middle of the time",
    "motion_focus": "Cycles does not blur the focus: its picture is, to the last bit, the one with "
    "the focus of the frame. Penumbra's is the mean of Cycles' pictures of all times, as "
    "tests/render/test_cameras_against_cycles.py asserts",
    "motion_glow": "Cycles leaves out the first 0.2 % of the shutter's time and the last 0.6 % "
    "(core/shutter.py): done so, the difference of 3.7 % was -0.2 % with an error of 0.2 %",
}

# name -> the Blender that the difference ends with, and its cause
_COAT = "Until Blender 4.5 Cycles' rough coats lose the light that scatters twice: drawn as since"
_FILM = "Until Blender 5.0 Cycles sums spectra of thin films by fitted curves: drawn as since"
_SINGLE = "Until Blender 4.3 Cycles' Oren-Nayar loses the light that scatters twice: drawn as since"
KNOWN_BEFORE: dict[str, tuple[tuple[int, int], str]] = {
    "diffuse_rough": ((4, 3), _SINGLE),
    "diffuse_half_rough": ((4, 3), _SINGLE),
    "bump_diffuse_rough": ((4, 3), _SINGLE),
    "coat_rough": ((4, 5), _COAT),
    "film_dielectric": ((5, 0), _FILM),
    "lamp_tree_sun": (
        (4, 4),
        "Until Blender 4.4 falloffs of suns overflow in Cycles: drawn as since",
    ),
}


def known(name: str, version: str) -> str | None:
    """Return why a scene differs from this version's Cycles ("4.2.0"); None if it should not."""
    first, cause = KNOWN_BEFORE.get(name, ((0, 0), ""))
    major, minor = (int(part) for part in version.split(".")[:2])
    return cause if (major, minor) < first else KNOWN.get(name)
