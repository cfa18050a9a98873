"""nodes and options -> Rows.  What the pictures of `test_against_cycles` show, a tile each.

Inputs are numbers, or names of fields that vary over the tile: A, B, C vectors of either sign, P
and Q colours from 0 to 1, a, b, c numbers of either sign, p from 0 to 1.
"""

from typing import Any, NamedTuple

from penumbra.core.shading.nodes.hit import LIGHT_PATH
from penumbra.core.shading.nodes.math import MATH
from penumbra.core.shading.nodes.mix import BLENDS, PLAIN_BLENDS
from penumbra.core.shading.nodes.vectors import NUMBERS, VECTOR_MATH

TILE, OFFSET = 8, 8.0  # pixels; what is added to outputs, so that the light is positive


class Row(NamedTuple):
    """A node, its inputs by identifier, its properties, the output that is looked at."""

    family: str
    kind: str
    output: str
    inputs: dict[str, Any] = {}
    properties: dict[str, Any] = {}
    thing: str = "plane"
    setup: str = ""  # how the stage prepares the node further
    scale: float = 1.0  # of the output, where it is large

    @property
    def name(self) -> str:
        """What a test calls it."""
        parts = [self.kind, self.output, *map(str, self.properties.values()), self.setup]
        if self.family in ("place", "object"):
            parts.append(self.thing)
        given = [f"{k}={v}" for k, v in self.inputs.items() if not isinstance(v, str)]
        return " ".join(part for part in (*parts, *given) if part)


def numbers() -> list[Row]:
    """Return rows of nodes that compute with numbers."""
    rows = []
    for operation in MATH:
        choice = {"operation": operation}
        fields = {"Value": "a", "Value_001": "b", "Value_002": "c"}
        rows.append(Row("math", "Math", "Value", fields, choice, scale=0.1))
        positive = {"Value": "p", "Value_001": "p2", "Value_002": 0.3}
        rows.append(Row("math", "Math", "Value", positive, choice, scale=0.1))
    for operation in ("DIVIDE", "POWER", "LOGARITHM", "MODULO", "FLOORED_MODULO", "SNAP"):
        for value, other in ((0.7, 0.0), (0.0, 0.7), (-0.7, 0.0), (0.0, -1.0), (-0.7, 3.0)):
            zero = {"Value": value, "Value_001": other}
            rows.append(Row("math", "Math", "Value", zero, {"operation": operation}))
        zero = {"Value": "a", "Value_001": 0.0}
        rows.append(Row("math", "Math", "Value", zero, {"operation": operation}))
    for operation in ("WRAP", "PINGPONG", "ARCTAN2", "SMOOTH_MIN", "COMPARE"):
        zero = {"Value": "a", "Value_001": 0.0, "Value_002": 0.0}
        rows.append(Row("math", "Math", "Value", zero, {"operation": operation}))
    clamped = {"operation": "MULTIPLY", "use_clamp": True}
    rows.append(Row("math", "Math", "Value", {"Value": "a", "Value_001": "b"}, clamped))
    for kind in ("MINMAX", "RANGE"):
        for low, high in ((-0.2, 0.4), (0.4, -0.2)):
            inputs = {"Value": "a", "Min": low, "Max": high}
            rows.append(Row("math", "Clamp", "Result", inputs, {"clamp_type": kind}))
    return rows + ranges() + vector_maths() + links()


def ranges() -> list[Row]:
    """Return rows of Map Range."""
    rows = []
    for kind in ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP"):
        for clamp in (False, True):
            for low, high in ((-0.3, 0.6), (0.6, -0.3), (0.2, 0.2)):
                inputs = {"Value": "a", "From Min": low, "From Max": high}
                inputs |= {"To Min": 0.5, "To Max": 1.5, "Steps": 3.0}
                choice = {"interpolation_type": kind, "clamp": clamp, "data_type": "FLOAT"}
                rows.append(Row("math", "MapRange", "Result", inputs, choice))
            inputs = {"Vector": "A", "From_Min_FLOAT3": "B", "From_Max_FLOAT3": (0.6, 0.3, 1.2)}
            inputs |= {"To_Min_FLOAT3": "C", "To_Max_FLOAT3": (1, 2, -1)}
            inputs["Steps_FLOAT3"] = (2, 3, 4)
            choice = {"interpolation_type": kind, "clamp": clamp, "data_type": "FLOAT_VECTOR"}
            rows.append(Row("math", "MapRange", "Vector", inputs, choice, scale=0.05))
    return rows


def vector_maths() -> list[Row]:
    """Return rows of Vector Math."""
    rows = []
    for operation in VECTOR_MATH:
        output = "Value" if operation in NUMBERS else "Vector"
        choice = {"operation": operation}
        fields = {"Vector": "A", "Vector_001": "B", "Vector_002": "C", "Scale": "p"}
        rows.append(Row("vector", "VectorMath", output, fields, choice, scale=0.1))
        mixed = {"Vector": "P", "Vector_001": (0.4, 0.0, -0.3), "Vector_002": "B", "Scale": 1.4}
        rows.append(Row("vector", "VectorMath", output, mixed, choice, scale=0.1))
    for axis in "XYZ":
        rows.append(Row("vector", "SeparateXYZ", axis, {"Vector": "A"}))
    rows.append(Row("vector", "CombineXYZ", "Vector", {"X": "a", "Y": "b", "Z": 0.3}))
    for output in ("Normal", "Dot"):
        rows.append(Row("vector", "Normal", output, {"Normal": "A"}, setup="tilted_normal"))
    for kind in ("POINT", "TEXTURE", "VECTOR", "NORMAL"):
        inputs = {"Vector": "A", "Location": (0.1, 0.2, 0.3), "Rotation": "B"}
        for scale in ((1.5, 0.7, -2.0), (1.5, 0.0, -2.0)):
            rows.append(
                Row(
                    "vector", "Mapping", "Vector", {**inputs, "Scale": scale}, {"vector_type": kind}
                )
            )
    for kind in ("AXIS_ANGLE", "X_AXIS", "Y_AXIS", "Z_AXIS", "EULER_XYZ"):
        for invert in (False, True):
            inputs = {"Vector": "A", "Center": (0.1, 0.2, 0.3), "Axis": "B", "Angle": "a"}
            inputs["Rotation"] = "C"
            choice = {"rotation_type": kind, "invert": invert}
            rows.append(Row("vector", "VectorRotate", "Vector", inputs, choice))
    zero = {"Vector": "A", "Center": (0.1, 0.2, 0.3), "Axis": (0, 0, 0), "Angle": "a"}
    rows.append(Row("vector", "VectorRotate", "Vector", zero, {"rotation_type": "AXIS_ANGLE"}))
    return rows


def links() -> list[Row]:
    """Return rows of links: what becomes of numbers on their way, and of inputs without one."""
    rows = []
    for source, target in (("A", "Value"), ("P", "Value"), ("a", "Vector")):
        kind, output = ("Math", "Value") if target == "Value" else ("VectorMath", "Vector")
        rows.append(Row("links", kind, output, {target: source}, {"operation": "ABSOLUTE"}))
    ways = ("Float Float", "Color Vector", "Vector Color", "Float Color", "Vector Vector")
    others = ("reroute", "muted", "value Float", "value Vector", "value Color", "unavailable")
    for way in (*(f"group {way}" for way in ways), *others):
        for source in "APa":
            setup = f"through {source} {way}"
            number, vector = {"Value": -0.7}, {"Vector": (0.3, 0.8, -0.2)}
            rows.append(Row("links", "Math", "Value", number, {"operation": "SIGN"}, setup=setup))
            choice = {"operation": "ABSOLUTE"}
            rows.append(Row("links", "VectorMath", "Vector", vector, choice, setup=setup))
            rows.append(Row("links", "RGBToBW", "Val", {"Color": (0.3, 0.8, 0.2)}, setup=setup))
            rows.append(Row("links", "LayerWeight", "Facing", {"Blend": 0.3}, setup=setup))
    for kind in ("AXIS_ANGLE", "EULER_XYZ"):
        hidden = {"Vector": (0.3, 0.8, -0.2), "Angle": "a", "Rotation": "A"}
        rows.append(Row("links", "VectorRotate", "Vector", hidden, {"rotation_type": kind}))
    rows.append(Row("links", "TexWhiteNoise", "Color", {"Vector": (0.3, 0.8, -0.2)}))
    return rows


def colours() -> list[Row]:
    """Return rows of nodes that mix and change colours."""
    rows = []
    for blend in (*PLAIN_BLENDS, *BLENDS):
        for a, b, factor in (("P", "Q", "p"), ("A", "B", 0.6), ("P", "P", "a"), ("A", "P", 1.0)):
            choice = {"data_type": "RGBA", "blend_type": blend, "clamp_factor": factor != "a"}
            inputs = {"Factor_Float": factor, "A_Color": a, "B_Color": b}
            rows.append(Row("mix", "Mix", "Result_Color", inputs, choice, scale=0.1))
        inputs = {"Fac": "a", "Color1": "A", "Color2": "Q"}
        rows.append(Row("mix", "MixRGB", "Color", inputs, {"blend_type": blend, "use_clamp": True}))
        grey = {"Fac": 0.7, "Color1": (0.3, 0.3, 0.3), "Color2": "Q"}
        rows.append(Row("mix", "MixRGB", "Color", grey, {"blend_type": blend}))
        black = {"Fac": 0.7, "Color1": "Q", "Color2": (0.0, 0.0, 0.4)}
        rows.append(Row("mix", "MixRGB", "Color", black, {"blend_type": blend}))
    for clamp in (False, True):
        inputs = {"Factor_Float": "a", "A_Float": "b", "B_Float": "c"}
        choice = {"data_type": "FLOAT", "clamp_factor": clamp}
        rows.append(Row("mix", "Mix", "Result_Float", inputs, choice))
        inputs = {"Factor_Vector": "A", "Factor_Float": "a", "A_Vector": "B", "B_Vector": "C"}
        for mode in ("UNIFORM", "NON_UNIFORM"):
            choice = {"data_type": "VECTOR", "factor_mode": mode, "clamp_factor": clamp}
            rows.append(Row("mix", "Mix", "Result_Vector", inputs, choice))
    for colour in ("P", "A"):
        inputs = {"Hue": "p", "Saturation": 1.4, "Value": 0.8, "Fac": 0.9, "Color": colour}
        rows.append(Row("colour", "HueSaturation", "Color", inputs))
        inputs = {"Color": colour, "Bright": 0.2, "Contrast": "a"}
        rows.append(Row("colour", "BrightContrast", "Color", inputs))
        rows.append(Row("colour", "Gamma", "Color", {"Color": colour, "Gamma": 2.2}))
        rows.append(Row("colour", "Gamma", "Color", {"Color": colour, "Gamma": 0.0}))
        rows.append(Row("colour", "Invert", "Color", {"Color": colour, "Fac": "p"}))
        rows.append(Row("colour", "RGBToBW", "Val", {"Color": colour}))
        rows.append(Row("old", "CombineHSV", "Color", {"H": "p", "S": "p2", "V": 0.4}))
        rows.append(Row("old", "CombineRGB", "Image", {"R": "a", "G": "p2", "B": 0.4}))
        for part in "HSV":
            rows.append(Row("old", "SeparateHSV", part, {"Color": colour}, scale=0.1))
        for part in "RGB":
            rows.append(Row("old", "SeparateRGB", part, {"Image": colour}))
        for mode in ("RGB", "HSV", "HSL"):
            parts = {"Red": "a" if colour == "A" else "p", "Green": "p2", "Blue": 0.4}
            rows.append(Row("colour", "CombineColor", "Color", parts, {"mode": mode}))
            for part in ("Red", "Green", "Blue"):
                whole = {"Color": colour}
                rows.append(Row("colour", "SeparateColor", part, whole, {"mode": mode}, scale=0.1))
    return rows + ramps()


def ramps() -> list[Row]:
    """Return rows of ramps, curves and spectra."""
    rows = []
    for kind in ("LINEAR", "EASE", "B_SPLINE", "CARDINAL", "CONSTANT"):
        rows.append(Row("ramp", "ValToRGB", "Color", {"Fac": "p"}, setup=f"RGB {kind}"))
    rows.append(Row("ramp", "ValToRGB", "Alpha", {"Fac": "a"}, setup="RGB LINEAR"))
    rows.append(Row("ramp", "ValToRGB", "Alpha", {"Fac": "p"}, setup="RGB CONSTANT"))
    for mode in ("HSV", "HSL"):
        for kind in ("NEAR", "FAR", "CW", "CCW"):
            rows.append(Row("ramp", "ValToRGB", "Color", {"Fac": "p"}, setup=f"{mode} {kind}"))
    for extend in ("HORIZONTAL", "EXTRAPOLATED"):
        curve = {"Fac": 0.9, "Color": "P"}
        rows.append(Row("ramp", "RGBCurve", "Color", curve, setup=f"curves {extend}"))
        curve = {"Fac": 0.9, "Color": "A"}
        rows.append(Row("ramp", "RGBCurve", "Color", curve, setup=f"curves {extend}", scale=0.1))
        curve = {"Fac": "p", "Vector": "A"}
        rows.append(Row("ramp", "VectorCurve", "Vector", curve, setup=f"curves {extend}"))
        curve = {"Factor": 0.9, "Value": "a"}
        rows.append(Row("ramp", "FloatCurve", "Value", curve, setup=f"curves {extend}"))
    for low, high in ((370.0, 480.0), (470.0, 580.0), (560.0, 700.0), (690.0, 800.0)):
        rows.append(Row("ramp", "Wavelength", "Color", setup=f"span {low} {high}"))
    for low, high in ((500.0, 1100.0), (900.0, 3000.0), (2500.0, 13000.0)):
        rows.append(Row("ramp", "Blackbody", "Color", setup=f"span {low} {high}", scale=0.1))
    for kind, output in (("Value", "Value"), ("RGB", "Color")):
        rows.append(Row("ramp", kind, output, setup="held"))
    return rows


def places() -> list[Row]:
    """Return rows of nodes that read the hit point or the object hit."""
    rows = []
    for thing in ("tilted", "mirrored", "smooth"):
        for output in ("Generated", "Normal", "Object", "Camera", "Window", "Reflection"):
            rows.append(Row("place", "TexCoord", output, thing=thing))
        rows.append(Row("place", "TexCoord", "Object", thing=thing, setup="other_object"))
        for output in ("Position", "Normal", "Tangent", "True Normal", "Incoming", "Parametric"):
            rows.append(Row("place", "NewGeometry", output, thing=thing))
        for axis in "XYZ":
            choice = {"direction_type": "RADIAL", "axis": axis}
            rows.append(Row("place", "Tangent", "Tangent", {}, choice, thing))
        for output in ("View Vector", "View Z Depth", "View Distance"):
            rows.append(Row("place", "CameraData", output, thing=thing))
        for kind in ("POINT", "VECTOR", "NORMAL"):
            for start in ("WORLD", "OBJECT", "CAMERA"):
                for end in ("WORLD", "OBJECT", "CAMERA"):
                    choice = {"vector_type": kind, "convert_from": start, "convert_to": end}
                    inputs = {"Vector": (0.3, -0.2, 0.6)}
                    rows.append(Row("place", "VectorTransform", "Vector", inputs, choice, thing))
        for output in ("Fresnel", "Facing"):
            rows.append(Row("place", "LayerWeight", output, {"Blend": 0.3}, thing=thing))
            inputs = {"Blend": 0.7, "Normal": "T"}
            rows.append(Row("place", "LayerWeight", output, inputs, thing=thing))
        rows.append(Row("place", "Fresnel", "Fac", {"IOR": 1.6}, thing=thing))
        rows.append(Row("place", "Fresnel", "Fac", {"IOR": 1.6, "Normal": "T"}, thing=thing))
        for pixels, size in ((False, 0.05), (True, 3.0)):
            choice = {"use_pixel_size": pixels}
            rows.append(Row("place", "Wireframe", "Fac", {"Size": size}, choice, thing))
        moved = {"Height": 0.8, "Midlevel": 0.3, "Scale": 1.7}
        for space in ("OBJECT", "WORLD"):
            choice = {"space": space}
            rows.append(Row("place", "Displacement", "Displacement", moved, choice, thing))
        moved = {"Vector": (0.7, 0.4, -0.6), "Midlevel": 0.2, "Scale": 1.7}
        for space in ("OBJECT", "WORLD"):  # those of tangents are among `carried_rows`
            choice = {"space": space}
            rows.append(Row("place", "VectorDisplacement", "Displacement", moved, choice, thing))
        for output in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random"):
            rows.append(Row("object", "ObjectInfo", output, thing=thing))
    for output in ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random"):
        rows.append(Row("object", "ObjectInfo", output, thing="instanced"))
    for output in ("Generated", "UV"):
        choice = {"from_instancer": True}
        rows.append(Row("object", "TexCoord", output, {}, choice, "instanced"))
    for output in ("Index", "Random", "Age", "Lifetime", "Location", "Size", "Velocity"):
        rows.append(Row("object", "ParticleInfo", output, thing="tilted"))
    rows.append(Row("object", "ParticleInfo", "Angular Velocity", thing="tilted"))
    return rows


def others() -> list[Row]:
    """Return rows of what is neither, and of nodes that Cycles does not know itself."""
    rows = []
    for thing in ("tilted", "islands"):
        for output in ("Pointiness", "Random Per Island"):
            rows.append(Row("object", "NewGeometry", output, thing=thing))
    for thing in ("tilted", "behind"):
        rows.append(Row("object", "NewGeometry", "Backfacing", thing=thing))
    outputs = {
        "HairInfo": ("Is Strand", "Intercept", "Length", "Thickness", "Tangent Normal", "Random"),
        "PointInfo": ("Position", "Radius", "Random"),
        "VolumeInfo": ("Color", "Density", "Flame", "Temperature"),
    }
    for kind, names in outputs.items():
        rows += [Row("object", kind, name, thing="tilted", scale=0.01) for name in names]
    for output in ("Quadratic", "Linear", "Constant"):
        for smooth in (0.0, 2.0):
            inputs = {"Strength": 0.02, "Smooth": smooth}
            rows.append(Row("object", "LightFalloff", output, inputs, thing="tilted"))
    for output in LIGHT_PATH:
        rows.append(Row("object", "LightPath", output, thing="tilted"))
    for kind in "CBA":
        for mode in ("INTERNAL", "EXTERNAL"):
            for shape in ("half", "whole"):
                setup = f"ies {kind} {shape}"
                inputs, choice = {"Vector": "A", "Strength": "p"}, {"mode": mode}
                rows.append(Row("object", "TexIES", "Fac", inputs, choice, "plane", setup))
    rows.append(Row("object", "TexIES", "Fac", {"Vector": "A"}, setup="ies C quarter"))
    rows.append(Row("object", "TexIES", "Fac", {"Vector": "A"}, {"mode": "EXTERNAL"}, scale=0.01))
    rows.append(Row("object", "TexIES", "Fac", {"Vector": "A"}, scale=0.01))
    for output in ("Is Hit", "Self Hit", "Hit Distance", "Hit Position", "Hit Normal"):
        for local in (False, True):
            direction = {"Direction": (-0.9, 0.3, 0.25), "Length": 1.3}
            choice = {"only_local": local}
            rows.append(Row("object", "Raycast", output, direction, choice, "tilted"))
    for kind in ("InputBool", "InputInt", "InputVector"):
        output = {"InputBool": "Boolean", "InputInt": "Integer"}.get(kind, "Vector")
        rows.append(Row("zone", f"FunctionNode{kind}", output, setup="constant"))
    rows.append(Row("zone", "FunctionNodeInputMenu", "Menu", setup="menu"))
    for kind in ("FLOAT", "INT", "BOOLEAN", "VECTOR", "RGBA"):
        inputs = {"Item_0": "p", "Item_1": "P"}
        choice = {"data_type": kind}
        rows.append(Row("zone", "GeometryNodeMenuSwitch", "Output", inputs, choice))
    rows.append(Row("zone", "GeometryNodeMenuSwitch", "Item_0"))
    rows.append(Row("zone", "GeometryNodeMenuSwitch", "Item_1"))
    for output in ("Frame", "Seconds"):
        rows.append(Row("zone", "GeometryNodeInputSceneTime", output, scale=0.1))
    for kind in ("repeat", "closure", "bundle"):
        rows.append(Row("zone", "Value", "Value", setup=kind))
    for kind, output in UNKNOWN:
        rows.append(Row("unknown", kind, output))
    for kind, output in (("TexGradient", "Fac"), ("Fresnel", "Fac"), ("TexImage", "Alpha")):
        rows.append(Row("object", kind, output, thing="tilted", setup="through p unknown"))
    return rows


# What Cycles does not know: the input that it feeds keeps its own value
UNKNOWN = (
    ("Squeeze", "Value"),
    ("ShaderToRGB", "Color"),
    ("ShaderToRGB", "Alpha"),
    ("UVAlongStroke", "UV"),
)
# Nodes of `zone` rows that a setup puts beside the one that is looked at
BESIDE = {
    "repeat": ("GeometryNodeRepeatInput", "GeometryNodeRepeatOutput"),
    "closure": ("NodeClosureInput", "NodeClosureOutput", "NodeEvaluateClosure"),
    "bundle": ("NodeCombineBundle", "NodeJoinBundle", "NodeSeparateBundle"),
}

ROWS = {"numbers": [*numbers(), *colours()], "places": places(), "others": others()}
WORLD_ROWS = [
    *(Row("world", "TexCoord", o) for o in ("Generated", "Normal", "Object", "Camera", "Window")),
    Row("world", "TexCoord", "Reflection"),
    *(Row("world", "CameraData", o) for o in ("View Vector", "View Z Depth", "View Distance")),
    *(Row("world", "NewGeometry", o) for o in ("Position", "Normal", "Incoming", "True Normal")),
    *(Row("world", "ObjectInfo", o) for o in ("Location", "Color", "Alpha", "Random")),
]
