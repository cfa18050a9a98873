"""Blender's list of nodes -> what stands for each: rows, another test, or a reason to leave it out.

The node suite is made of the rows of `rows`, `carried_rows`, `traced_rows`, and of the textures'
rows in `tests/render`.  `test_table` asks Blender for all nodes of shader trees and their choices:
one that is in none of the tables here cannot exist.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

from penumbra.tests.nodes import carried_rows, rows, traced_rows
from penumbra.tests.render import test_textures_against_cycles as textures


class Shown(NamedTuple):
    """What a row shows of a node: an output, by identifier, with these choices."""

    kind: str
    output: str
    choices: dict[str, Any]


# Shaders, and what makes no number: kind -> the tests that have them beside Cycles
ELSEWHERE = {
    **dict.fromkeys(
        (
            "AddShader",
            "BsdfAnisotropic",
            "BsdfDiffuse",
            "BsdfGlass",
            "BsdfMetallic",
            "BsdfPrincipled",
            "BsdfRefraction",
            "BsdfSheen",
            "BsdfToon",
            "BsdfTranslucent",
            "BsdfTransparent",
            "Emission",
            "Holdout",
            "MixShader",
        ),
        "parity/scenes",
    ),
    "Background": "parity/scenes",
    "TexSky": "tests/physics/cycles_skies.py, tests/physics/test_sky.py",
    "OutputMaterial": "tests/addon/test_export_materials.py",
    "OutputWorld": "tests/addon/test_export_images.py",
    "OutputLight": "tests/physics/test_lamp_shaders.py",
    "ShaderNodeGroup": "tests/nodes/sampler.py",
    "NodeGroupInput": "tests/nodes/sampler.py",
    "NodeGroupOutput": "tests/nodes/sampler.py",
    "NodeReroute": "tests/nodes/sampler.py",
}

VOLUMES = "volumes are rendered by nobody yet: the report names them"
HAIR = "the scattering of hair, which is not rendered yet: the report names it"

# Kind -> why it has no row
LEFT_OUT = {
    "BsdfHair": HAIR,
    "BsdfHairPrincipled": HAIR,
    "BsdfRayPortal": "a shader that sends rays elsewhere: the report names it",
    "SubsurfaceScattering": "drawn as diffuse: the report says so",
    "EeveeSpecular": "Cycles does not know it either: black in both",
    "NodeFrame": "a box drawn around others",
    "NodeImplicitConversion": "Blender makes it itself while it unrolls zones",
    "OutputAOV": "a pass, not a look",
    "OutputLineStyle": "of Freestyle's line styles, not of surfaces",
    "RadialTiling": "not drawn yet: the report names it",
    "Script": "runs programs in OSL, which needs a compiler that Penumbra does not have",
    "TexPointDensity": "gone since Blender 4.3: the report names it",
    "VolumeAbsorption": VOLUMES,
    "VolumeCoefficients": VOLUMES,
    "VolumePrincipled": VOLUMES,
    "VolumeScatter": VOLUMES,
}

SKIN = "drawn as diffuse: the report says so"
FREE = "any kind of socket: those that shaders have are shown"

# Kind and choice -> values without a row, and why
CHOICES_LEFT_OUT: dict[tuple[str, str], tuple[set[str], str]] = {
    ("BsdfPrincipled", "subsurface_method"): ({"*"}, SKIN),
    ("Mix", "data_type"): ({"ROTATION"}, "not offered in shader trees"),
    ("Mix", "outputs"): ({"Result_Rotation"}, "not offered in shader trees"),
    ("GeometryNodeMenuSwitch", "data_type"): ({"*"}, FREE),
    ("GeometryNodeMenuSwitch", "outputs"): ({"__extend__"}, "a place for new ones"),
    ("Raycast", "outputs"): ({"__extend__"}, "a place for new ones"),
    ("TexSky", "sky_type"): ({"HOSEK_WILKIE"}, "drawn as Preetham's: the report says so"),
    ("OutputMaterial", "target"): ({"*"}, "who sees an output"),
    ("OutputWorld", "target"): ({"*"}, "who sees an output"),
    ("OutputLight", "target"): ({"*"}, "who sees an output"),
}


def shown() -> Iterator[Shown]:
    """Yield what all rows of the node suite show."""
    for row in (*(row for some in rows.ROWS.values() for row in some), *rows.WORLD_ROWS):
        yield Shown(row.kind, row.output, row.properties)
        for kind in rows.BESIDE.get(row.setup, ()):
            yield Shown(kind, "", {})
    for family in carried_rows.FAMILIES.values():
        for kind, output, properties, _, _ in family().values():
            yield Shown(kind, output, properties)
    for texture in textures.ROWS.values():
        yield Shown(texture.kind, texture.output, texture.choices)
    for kind, output, properties in traced_rows.ROWS.values():
        yield Shown(kind, output, properties)
