"""procedural textures -> the values of Cycles, at the same points.

Every row is a small plane of 8 x 8 pixels whose material shows one output of a texture, all rows
in one picture that both engines render with one sample.  Coordinates are rounded to the pixel by
nodes, in steps that float32 holds exactly, so that both engines look at the same points to the
last bit.  The module is also imported by Blender's process, where `tests` is no package.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

SIDE, ACROSS = 8, 16  # pixels of a row's plane, planes side by side
FACTOR, SUMMAND = 0.25, 0.5  # what is shown of a value: negative ones must not be lost
TOLERANCE = 1e-3  # of a value, or of the greatest value of its row where that is above 1


@dataclass(frozen=True)
class Row:
    """One texture: node, output, its choices, its inputs.

    An input that is a tuple (a, b) of strings and numbers, as ("x", 4.0), is fed by that
    coordinate times the number; at: factor and summand of the coordinates, which go from 0 to 1.
    """

    kind: str
    output: str
    choices: dict[str, Any] = field(default_factory=dict)
    inputs: dict[str, Any] = field(default_factory=dict)
    at: tuple[float, float] = (4.0, -1.5)
    mapping: dict[str, Any] = field(default_factory=dict)
    is_linked: bool = True


def _noise(output="Fac", at=(4.0, -1.5), dimensions="3D", kind="FBM", normalize=True, **inputs):
    inputs = {key.replace("_", " "): value for key, value in inputs.items()}
    choices = {"noise_dimensions": dimensions, "noise_type": kind, "normalize": normalize}
    return Row("TexNoise", output, choices, {"Scale": 1.5, "W": ("y", 3.0), **inputs}, at)


def _voronoi(output="Distance", at=(4.0, -1.5), dimensions="3D", feature="F1", metric="EUCLIDEAN",
             normalize=False, **inputs):  # fmt: skip
    choices = {"voronoi_dimensions": dimensions, "feature": feature, "normalize": normalize}
    if feature not in ("DISTANCE_TO_EDGE", "N_SPHERE_RADIUS"):
        choices["distance"] = metric
    return Row("TexVoronoi", output, choices, {"Scale": 1.5, "W": ("y", 3.0), **inputs}, at)


def _rows():
    rows = {}
    dimensions = ("1D", "2D", "3D", "4D")
    kinds = ("FBM", "MULTIFRACTAL", "HYBRID_MULTIFRACTAL", "RIDGED_MULTIFRACTAL", "HETERO_TERRAIN")

    for d in dimensions:
        for output in ("Value", "Color"):
            inputs = {"W": ("y", 3.0)}
            rows[f"white {d} {output}"] = Row(
                "TexWhiteNoise", output, {"noise_dimensions": d}, inputs
            )
    rows["white 3D unlinked"] = Row(
        "TexWhiteNoise", "Value", {"noise_dimensions": "3D"}, is_linked=False
    )

    for d in dimensions:
        for kind in kinds:
            numbers = {"Offset": 0.7, "Gain": 1.3, "Detail": 2.5}
            rows[f"noise {d} {kind}"] = _noise(dimensions=d, kind=kind, **numbers)
        rows[f"noise {d} Color"] = _noise("Color", dimensions=d)
        rows[f"noise {d} distorted"] = _noise(dimensions=d, Distortion=1.3)
        rows[f"noise {d} far"] = _noise(dimensions=d, at=(1000.3, 150000.2))
        rows[f"noise {d} very far"] = _noise(dimensions=d, at=(2.0**23, 2.0**22))
    for kind in kinds:
        for detail in (0.0, 0.5, 15.0, ("x", 5.0)):
            name = "varying" if isinstance(detail, tuple) else detail
            rows[f"noise {kind} detail {name}"] = _noise(kind=kind, Detail=detail, Roughness=0.6)
        rows[f"noise {kind} roughness 0"] = _noise(kind=kind, Roughness=0.0)
        rows[f"noise {kind} roughness 1"] = _noise(kind=kind, Roughness=1.0, Gain=2.0)
        rows[f"noise {kind} lacunarity 0"] = _noise(kind=kind, Lacunarity=0.0, Detail=3.0)
        rows[f"noise {kind} gain"] = _noise(kind=kind, Gain=("y", 3.0), Offset=("x", 2.0))
        rows[f"noise {kind} colour"] = _noise("Color", kind=kind, Distortion=0.5)
    rows["noise not normalized"] = _noise(normalize=False)
    rows["noise not normalized 1.5"] = _noise(normalize=False, Detail=1.5)
    rows["noise scale 0"] = _noise(Scale=0.0)
    rows["noise scale -7.3"] = _noise(Scale=-7.3)
    rows["noise scale varies"] = _noise(Scale=("x", 9.0))
    rows["noise roughness varies"] = _noise(Roughness=("x", 1.0), Lacunarity=("y", 4.0))
    rows["noise distortion varies"] = _noise(Distortion=("x", -4.0))
    rows["noise lacunarity -1.7"] = _noise(Lacunarity=-1.7, Detail=4.0)

    for d in dimensions:
        for feature in ("F1", "F2", "SMOOTH_F1"):
            for output in ("Distance", "Color", "Position"):
                if (d, output) != ("1D", "Position"):
                    rows[f"voronoi {d} {feature} {output}"] = _voronoi(
                        output, dimensions=d, feature=feature
                    )
            if d in ("1D", "4D"):
                rows[f"voronoi {d} {feature} W"] = _voronoi("W", dimensions=d, feature=feature)
        rows[f"voronoi {d} edge"] = _voronoi(dimensions=d, feature="DISTANCE_TO_EDGE")
        rows[f"voronoi {d} radius"] = _voronoi("Radius", dimensions=d, feature="N_SPHERE_RADIUS")
        rows[f"voronoi {d} far"] = _voronoi(dimensions=d, at=(1000.3, 150000.2))
        if d != "1D":
            for metric in ("MANHATTAN", "CHEBYCHEV", "MINKOWSKI"):
                for feature in ("F1", "F2"):
                    rows[f"voronoi {d} {feature} {metric}"] = _voronoi(
                        dimensions=d, feature=feature, metric=metric, normalize=True, Exponent=1.7
                    )
    for feature in ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE"):
        for normalize in (False, True):
            rows[f"voronoi {feature} octaves {normalize}"] = _voronoi(
                feature=feature, normalize=normalize, Detail=2.5, Roughness=0.7, Lacunarity=2.3
            )
        rows[f"voronoi {feature} detail varies"] = _voronoi(feature=feature, Detail=("x", 3.0))
        rows[f"voronoi {feature} roughness 0"] = _voronoi(
            feature=feature, Detail=2.0, Roughness=0.0
        )
        rows[f"voronoi {feature} roughness 1"] = _voronoi(
            feature=feature, Detail=2.0, Roughness=1.0
        )
        rows[f"voronoi {feature} lacunarity 0"] = _voronoi(
            feature=feature, Detail=2.0, Lacunarity=0.0
        )
        rows[f"voronoi {feature} randomness 0"] = _voronoi(feature=feature, Randomness=0.0)
        rows[f"voronoi {feature} randomness varies"] = _voronoi(
            feature=feature, Randomness=("y", 1.2)
        )
    for output in ("Color", "Position"):
        rows[f"voronoi octaves {output}"] = _voronoi(
            output, Detail=2.5, Roughness=0.7, normalize=True
        )
    rows["voronoi 2D minkowski 0.5"] = _voronoi(dimensions="2D", metric="MINKOWSKI", Exponent=0.5)
    rows["voronoi 3D minkowski 32"] = _voronoi(metric="MINKOWSKI", Exponent=32.0)
    rows["voronoi exponent varies"] = _voronoi(metric="MINKOWSKI", Exponent=("x", 4.0))
    rows["voronoi smoothness 0"] = _voronoi(feature="SMOOTH_F1", Smoothness=0.0)
    rows["voronoi smoothness varies"] = _voronoi(feature="SMOOTH_F1", Smoothness=("x", 1.0))
    rows["voronoi smooth minkowski"] = _voronoi(
        feature="SMOOTH_F1", metric="MINKOWSKI", Exponent=1.7
    )
    rows["voronoi scale 0"] = _voronoi("Position", Scale=0.0)
    rows["voronoi scale -7.3"] = _voronoi("Position", Scale=-7.3)
    rows["voronoi scale varies"] = _voronoi("Position", Scale=("x", 9.0))

    for profile in ("SIN", "SAW", "TRI"):
        for direction in ("X", "Y", "Z", "DIAGONAL"):
            choices = {"wave_type": "BANDS", "bands_direction": direction, "wave_profile": profile}
            rows[f"wave {direction} {profile}"] = Row("TexWave", "Fac", choices, {"Scale": 0.31})
    for direction in ("X", "Y", "Z", "SPHERICAL"):
        choices = {"wave_type": "RINGS", "rings_direction": direction}
        rows[f"wave rings {direction}"] = Row("TexWave", "Color", choices, {"Scale": 0.31})
    bent = {"Distortion": 2.5, "Detail": 3.5, "Detail Scale": 1.7, "Detail Roughness": 0.6}
    rows["wave bent"] = Row("TexWave", "Fac", {}, {**bent, "Phase Offset": 1.2})
    varying = {"Distortion": ("x", 3.0), "Detail": ("y", 4.0), "Phase Offset": ("x", 9.0)}
    rows["wave little"] = Row("TexWave", "Fac", {}, {**bent, "Detail": -0.4})
    rows["wave varying"] = Row("TexWave", "Fac", {}, varying)

    for depth in range(11):
        choices = {"turbulence_depth": depth}
        rows[f"magic {depth}"] = Row(
            "TexMagic", "Color", choices, {"Scale": 0.4, "Distortion": 1.2}
        )
    rows["magic fac"] = Row("TexMagic", "Fac", {}, {"Scale": 0.4})
    rows["magic flat"] = Row("TexMagic", "Color", {}, {"Scale": 0.4, "Distortion": 0.0})
    rows["magic varies"] = Row("TexMagic", "Color", {}, {"Scale": 0.4, "Distortion": ("x", -2.0)})

    colours = {
        "Color1": (0.9, 0.2, 0.1, 1),
        "Color2": (0.1, 0.5, 0.9, 1),
        "Mortar": (0.3, 0.3, 0.0, 1),
    }
    for output in ("Color", "Fac"):
        rows[f"brick {output}"] = Row(
            "TexBrick", output, {}, {**colours, "Scale": 1.3, "Mortar Size": 0.05}
        )
    squashed = {"offset": 0.3, "offset_frequency": 3, "squash": 0.6, "squash_frequency": 2}
    rows["brick squashed"] = Row("TexBrick", "Color", squashed, {**colours, "Scale": 2.3})
    rows["brick unsquashed"] = Row(
        "TexBrick", "Color", {"squash_frequency": 1, "squash": 1.4}, colours
    )
    mortar = {"Mortar Size": 0.1, "Mortar Smooth": 1.0, "Bias": -0.4, "Scale": 1.3}
    rows["brick mortar"] = Row("TexBrick", "Color", {}, {**colours, **mortar})
    sharp = {"Mortar Size": 0.11, "Mortar Smooth": 0.0, "Brick Width": 1.1, "Row Height": 0.4}
    rows["brick sharp"] = Row("TexBrick", "Color", {}, {**colours, **sharp})
    wide = {"Mortar Size": ("x", 0.1), "Bias": ("y", 1.0), "Brick Width": ("y", 1.0), "Scale": -1.3}
    rows["brick varies"] = Row("TexBrick", "Color", {}, {**colours, **wide})

    for output in ("Color", "Fac"):
        inputs = {"Color1": (0.9, 0.2, 0.1, 1), "Color2": (0.1, 0.5, 0.9, 1), "Scale": 1.7}
        rows[f"checker {output}"] = Row("TexChecker", output, {}, inputs)
    rows["checker far"] = Row("TexChecker", "Fac", {}, {"Scale": 1.0}, (8.0, -100004.0))
    rows["checker whole numbers"] = Row("TexChecker", "Fac", {}, {"Scale": -1.0}, (8.0, -4.0))
    rows["checker in the box"] = Row("TexChecker", "Fac", {}, {"Scale": 8.0}, is_linked=False)
    for kind in (
        "LINEAR",
        "QUADRATIC",
        "EASING",
        "DIAGONAL",
        "SPHERICAL",
        "QUADRATIC_SPHERE",
        "RADIAL",
    ):
        rows[f"gradient {kind}"] = Row(
            "TexGradient", "Fac", {"gradient_type": kind}, at=(2.0, -0.8)
        )
    rows["gradient colour"] = Row("TexGradient", "Color", at=(1.0, 0.0))

    for d in ("2D", "3D"):
        for output in ("Value", "Phase", "Intensity"):
            for anisotropy in (1.0, 0.0):
                inputs = {"Scale": 1.1, "Anisotropy": anisotropy, "Frequency": 1.3}
                choices = {"gabor_type": d}
                rows[f"gabor {d} {output} {anisotropy}"] = Row("TexGabor", output, choices, inputs)
    varying = {"Frequency": ("x", 3.0), "Anisotropy": ("y", 1.0), "Orientation 2D": ("x", 2.0)}
    rows["gabor 2D varies"] = Row(
        "TexGabor", "Value", {"gabor_type": "2D"}, {**varying, "Scale": 1.1}
    )
    turned = {"Orientation 3D": (0.3, -0.5, 0.8), "Anisotropy": 0.4, "Scale": 1.1}
    rows["gabor 3D turned"] = Row("TexGabor", "Value", {"gabor_type": "3D"}, turned)

    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        mapping = {
            "vector_type": kind, "translation": (0.3, 1.2, -0.4), "rotation": (0.4, -0.7, 1.9),
            "scale": (1.5, 0.6, 2.0), "mapping_x": "Y", "mapping_y": "X",
        }  # fmt: skip
        rows[f"mapped {kind}"] = Row("TexNoise", "Fac", {}, {"Scale": 1.5}, mapping=mapping)
    rows["mapped away"] = Row("TexNoise", "Fac", {}, {"Scale": 1.5}, mapping={"mapping_z": "NONE"})
    return rows


ROWS = _rows()


def material(name, row):
    """Return a material that shows a row's output, made a quarter and lifted by a half."""
    import bpy

    tree = bpy.data.materials.new(name)
    if not tree.use_nodes:
        tree.use_nodes = True
    result, tree = tree, tree.node_tree
    tree.nodes.clear()

    def new(kind, **properties):
        node = tree.nodes.new(f"ShaderNode{kind}")
        for key, value in properties.items():
            setattr(node, key, value)
        return node

    def calculated(operation, source, number=0.0):
        node = new("Math", operation=operation)
        tree.links.new(source, node.inputs[0])
        if isinstance(number, float):
            node.inputs[1].default_value = number
        else:
            tree.links.new(number, node.inputs[1])
        return node.outputs[0]

    # x and y in eighths at the middles of pixels; z is another number between 0 and 1.
    split = new("SeparateXYZ")
    tree.links.new(new("TexCoord").outputs["Generated"], split.inputs[0])
    unit = {}
    for axis in "XY":
        whole = calculated("FLOOR", calculated("MULTIPLY", split.outputs[axis], float(SIDE)))
        unit[axis.lower()] = calculated("DIVIDE", calculated("ADD", whole, 0.5), float(SIDE))
    across = calculated("MULTIPLY", unit["x"], 0.375)
    unit["z"] = calculated("ADD", across, calculated("MULTIPLY", unit["y"], 0.625))

    node = new(row.kind, **row.choices)
    for key, value in row.mapping.items():
        setattr(node.texture_mapping, key, value)
    for key, value in row.inputs.items():
        socket = next(item for item in node.inputs if item.identifier == key)
        if isinstance(value, tuple) and isinstance(value[0], str):
            tree.links.new(calculated("MULTIPLY", unit[value[0]], value[1]), socket)
        else:
            socket.default_value = value
    if row.is_linked:
        joined = new("CombineXYZ")
        for place, axis in enumerate("xyz"):
            scaled = calculated("MULTIPLY", unit[axis], row.at[0])
            tree.links.new(calculated("ADD", scaled, row.at[1]), joined.inputs[place])
        vector = next(item for item in node.inputs if item.identifier == "Vector")
        tree.links.new(joined.outputs[0], vector)

    output = next(item for item in node.outputs if item.identifier == row.output)
    emission = new("Emission")
    if output.type == "VALUE":
        shown = calculated("ADD", calculated("MULTIPLY", output, FACTOR), SUMMAND)
    else:
        parts, joined = new("SeparateXYZ"), new("CombineXYZ")
        tree.links.new(output, parts.inputs[0])
        for place in range(3):
            part = calculated("MULTIPLY", parts.outputs[place], FACTOR)
            tree.links.new(calculated("ADD", part, SUMMAND), joined.inputs[place])
        shown = joined.outputs[0]
    tree.links.new(shown, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], new("OutputMaterial").inputs["Surface"])
    return result


def render_both(folder, names):
    """Return {engine: {name: values (8, 8, 3)}} of the rows that this Blender has."""
    import bpy
    import OpenImageIO

    import penumbra

    penumbra.register()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    names = [name for name in names if hasattr(bpy.types, f"ShaderNode{ROWS[name].kind}")]
    down = -(-len(names) // ACROSS)
    for place, name in enumerate(names):
        y, x = divmod(place, ACROSS)
        mesh = bpy.data.meshes.new(name)
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
        mesh.from_pydata(corners, [], [(0, 1, 2, 3)])
        mesh.materials.append(material(name, ROWS[name]))
        plane = bpy.data.objects.new(name, mesh)
        plane.location = x, y, 0
        scene.collection.objects.link(plane)
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale = "ORTHO", max(ACROSS, down)
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.location = ACROSS / 2, down / 2, 5
    scene.collection.objects.link(scene.camera)
    scene.world = bpy.data.worlds.new("world")

    scene.render.resolution_x, scene.render.resolution_y = ACROSS * SIDE, down * SIDE
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    for settings in (scene.cycles, scene.penumbra):
        settings.samples, settings.max_bounces = 1, 0
        settings.sample_clamp_direct = settings.sample_clamp_indirect = 0
        settings.pixel_filter_type = "BOX"
    values = {}
    for engine in ("CYCLES", "PENUMBRA"):
        scene.render.engine = engine
        scene.render.filepath = str(folder / f"{engine}.exr")
        bpy.ops.render.render(write_still=True)
        pixels = OpenImageIO.ImageBuf(scene.render.filepath).get_pixels()[::-1, :, :3]
        values[engine] = {}
        for place, name in enumerate(names):
            y, x = divmod(place, ACROSS)
            part = pixels[y * SIDE : (y + 1) * SIDE, x * SIDE : (x + 1) * SIDE]
            values[engine][name] = (part.astype(float) - SUMMAND) / FACTOR
    return values


@pytest.fixture(scope="module")
def values(blender, tmp_path_factory):
    return blender(render_both, tmp_path_factory.mktemp("textures"), list(ROWS))


def difference(values, name):
    """Return the greatest difference, of 1 or of the row's greatest value, and that value."""
    theirs, ours = values["CYCLES"][name], values["PENUMBRA"][name]
    greatest = max(1.0, np.abs(theirs).max())
    return np.abs(ours - theirs).max() / greatest, greatest


@pytest.mark.parametrize("name", ROWS)
def test_a_texture_has_the_values_of_cycles(values, name):
    if name not in values["CYCLES"]:
        pytest.skip("this Blender does not have the node")
    assert np.isfinite(values["CYCLES"][name]).all()
    assert difference(values, name)[0] < TOLERANCE
