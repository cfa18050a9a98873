"""names -> scenes of the parity suite.  One feature or extreme each, and what it shows: one table.

A scene is a row of one of the lists that are joined here. `build` gets the module `stage` and
fills an empty file with it; nothing here imports bpy, so that scenes can be listed without it.
`KNOWN` names the scenes that differ and why, as shown and not as guessed: 5 % of them at most.
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
    normals,
    shaders,
    skies,
    transparency,
    visibility,
)
from .scene import Scene

_MODULES = (basics, lamps, skies, emitters, dielectrics, metals, coats, shaders, inputs)
_MODULES += (transparency, visibility, normals, bumps, displacement, limits, cameras)

ALL: tuple[Scene, ...] = tuple(scene for module in _MODULES for scene in module.ROWS)
SCENES: dict[str, Scene] = {scene.name: scene for scene in ALL}

# name -> the cause of its difference
_SUBSURFACE = "Subsurface scattering is drawn as diffuse, and the report says so"
KNOWN: dict[str, str] = {
    "principled_subsurface": _SUBSURFACE,
    "principled_subsurface_half": _SUBSURFACE,
    "subsurface_node": _SUBSURFACE,
    "sky_hosek_wilkie": "Drawn as Preetham's sky, and the report says so: its data are missing",
    "path_is_diffuse_ray": "Cycles weighs what glows for diffuse rays only against light "
    "samples that find nothing, and loses light: done so, Penumbra was 5 % darker than before",
}
