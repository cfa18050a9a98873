"""nodes -> closures.  Each closure sends towards the viewer what Cycles' node does.

Cycles renders small squares under a sun that is a single direction (tests/support/planes.py), for
a grid of viewers and suns; the closures are evaluated for the same directions, in one picture per
sun and without noise.  They must agree within 0.3 % wherever there is a thousandth of the peak.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np
import pytest

from penumbra.core.bsdf import REGISTRY, albedo, fresnel, oren_nayar, rough_translucent, sheen
from tests.support import planes

F32 = np.float32
TOLERANCE, DARK = 3e-3, 1e-3  # relative; the share of the peak below which nothing is compared

# Viewers at all heights, none of them along an axis of the tangent's frame
COSINES = (1.0, 0.97, 0.85, 0.65, 0.4, 0.2, 0.06)
VIEWS = planes.polar(COSINES, np.arange(len(COSINES)) * 2.4 + 0.4)

try:
    BLENDER = tuple(int(part) for part in version("bpy").split(".")[:2])
except PackageNotFoundError:
    BLENDER = (0, 0)  # the fixture skips


def suns():
    """Return suns (3, S): all around, and near the mirrored and the straight way of each viewer."""
    index = np.arange(40) + 0.5
    around = [planes.polar(1 - index / 20, index * 2.399963)]
    for rotation, wo in zip(planes.frames(VIEWS), VIEWS.T, strict=True):
        for place, gap in enumerate((0.0, 0.01, 0.04, 0.12, 0.3)):
            aside = planes.polar(0.3, 1.1 * place) * gap
            for way in (wo * (-1, -1, 1), -wo):
                near = rotation @ way + aside
                around.append((near / np.linalg.norm(near))[:, None])
    return np.concatenate(around, axis=1)


@dataclass(frozen=True)
class Row:
    """A node with its inputs, and the closures that it is made of.

    lobes: from the cosines of the viewer (N,) to (closure, parameters, weight) of each; a weight
    is a number or an array that broadcasts with (3, N).
    """

    node: str
    inputs: dict
    lobes: Callable
    since: tuple[int, int] = (4, 2)

    def __str__(self):
        inside = ", ".join(
            f"{name} {value}" for name, value in self.inputs.items() if name != "Color"
        )
        return f"{self.node.removeprefix('ShaderNode')}({inside})"

    def value(self, wo, wi):
        """Return f cos (3, N) float64 of all lobes together."""
        total = np.zeros(wi.shape)
        for closure, parameters, weight in self.lobes(wo[2]):
            total += REGISTRY[closure].evaluate(parameters, wo, wi)[0] * weight
        return total


def colour(*rgb):
    return F32(rgb)[:, None]


def alone(node, closure, *parameters, since=(4, 2), **inputs):
    """A node that is one closure with constant parameters, and with its colour as the weight."""
    rgb = inputs.setdefault("Color", (0.8, 0.5, 0.1, 1.0))[:3]
    numbers = tuple(F32([value]) for value in parameters)
    return Row(node, inputs, lambda cos: [(closure, numbers, colour(*rgb))], since)


def matte(roughness, rgb):
    """Rough diffuse: 4.2 has no light that strikes several cavities."""
    inputs = {"Roughness": roughness, "Color": (*rgb, 1.0)}
    parameters = oren_nayar.prepare(F32([roughness]), colour(*rgb))
    lobes = [("oren nayar", parameters, colour(*rgb))]
    return Row("ShaderNodeBsdfDiffuse", inputs, lambda cos: lobes, since=(5, 2))


def thin_wall(roughness, anisotropy):
    """Thin-walled subsurface: rough diffuse on either side."""
    rgb = (0.8, 0.5, 0.1)
    inputs = {
        "Base Color": (*rgb, 1.0),
        "IOR": 1.0,
        "Thin Wall": True,
        "Subsurface Weight": 1.0,
        "Subsurface Anisotropy": anisotropy,
        "Diffuse Roughness": roughness,
    }
    parameters = oren_nayar.prepare(F32([roughness]), colour(*rgb))
    names = ("oren nayar", "rough translucent")
    lobes = [
        (name, parameters, colour(*rgb) * share)
        for name, share in zip(names, rough_translucent.shares(F32([anisotropy])), strict=True)
    ]
    return Row("ShaderNodeBsdfPrincipled", inputs, lambda cos: lobes, since=(5, 2))


def microfibre(roughness):
    """Sheen, whose lobe depends on the viewer."""

    def lobes(cos):
        a, b, albedo = sheen.prepare(F32([roughness]), cos)
        return [("sheen", (a, b), albedo * colour(0.8, 0.5, 0.1))]

    inputs = {"Roughness": roughness, "distribution": "MICROFIBER", "Color": (0.8, 0.5, 0.1, 1)}
    return Row("ShaderNodeBsdfSheen", inputs, lobes)


def velvet(sigma):
    kind = {"distribution": "ASHIKHMIN"}
    return alone("ShaderNodeBsdfSheen", "velvet", sigma, Roughness=sigma, **kind)


def toon(component, size, smooth):
    closure = f"toon {component.lower()}"
    kind = {"component": component, "Size": size, "Smooth": smooth}
    return alone("ShaderNodeBsdfToon", closure, size, smooth, **kind)


def glossy(distribution, roughness, anisotropy=0.0):
    """The Glossy node; below a roughness of 0.1, Cycles' own float32 tells, and is not compared."""
    alpha = roughness**2
    stretch = 1 - abs(anisotropy)
    wide, narrow = alpha / stretch, alpha * stretch
    widths = (wide, narrow) if anisotropy < 0 else (narrow, wide)
    kind = {"Roughness": roughness, "Anisotropy": anisotropy, "Rotation": 0.0}
    kind["distribution"] = distribution
    if distribution == "ASHIKHMIN_SHIRLEY":
        return alone("ShaderNodeBsdfAnisotropic", "ashikhmin shirley", *widths, **kind)
    name, widths = (" anisotropic", widths) if anisotropy else ("", widths[:1])
    closure = f"{FACETS[distribution]}{name} reflection unit"
    row = alone("ShaderNodeBsdfAnisotropic", closure, *widths, **kind)
    return compensated(row, alpha, colour(0.8, 0.5, 0.1)) if distribution == "MULTI_GGX" else row


def compensated(row, alpha, fss):
    """The same row with the energy that GGX loses given back."""

    def lobes(cos):
        rough = F32([np.sqrt(alpha)])
        factor, _ = albedo.ggx_energy(rough, np.clip(cos, 0, 1), fss)
        return [(name, parameters, weight * factor) for name, parameters, weight in row.lobes(cos)]

    return replace(row, lobes=lobes)


def glass(distribution, roughness, ior):
    """The Glass node, seen from outside."""
    rgb = (0.8, 0.5, 0.1)
    inputs = {"Color": (*rgb, 1.0), "Roughness": roughness, "IOR": ior}
    inputs["distribution"] = distribution
    eta, tint = F32([ior]), colour(*rgb)
    f0 = np.repeat(fresnel.f0_from_ior(eta)[:, None], 3, axis=0)
    parameters = (F32([roughness**2]), eta, f0, tint, tint)

    def lobes(cos):
        factor = F32([1])
        if distribution == "MULTI_GGX":
            # What is lost meets Fresnel and both tints again, in their mean.
            mean = fresnel.remapped_average(eta, f0)
            fss = tint * mean + tint * (1 - mean)
            sides = np.zeros(1, bool)
            factor, _ = albedo.ggx_glass_energy(F32([roughness]), cos, eta, sides, fss)
        return [(f"{FACETS[distribution]} glass", parameters, factor)]

    return Row("ShaderNodeBsdfGlass", inputs, lobes)


def refraction(distribution, roughness, ior):
    kind = {"distribution": distribution, "Roughness": roughness, "IOR": ior}
    closure = f"{FACETS[distribution]} refraction"
    return alone("ShaderNodeBsdfRefraction", closure, roughness**2, ior, **kind)


def metal(distribution, roughness, anisotropy=0.0, **optics):
    """The Metallic node: base colour and edge tint, or n and k."""
    inputs = {"distribution": distribution, "Roughness": roughness, "Anisotropy": anisotropy}
    if "n" in optics:
        n, k = optics["n"], optics["k"]
        inputs |= {"fresnel_type": "PHYSICAL_CONDUCTOR", "IOR": n, "Extinction": k}
        model, constants = "conductor", (colour(*n), colour(*k))
        fss = fresnel.conductor_average(*constants)
    else:
        base, edge = optics["base"], optics["edge"]
        inputs |= {"fresnel_type": "F82", "Base Color": (*base, 1.0), "Edge Tint": (*edge, 1.0)}
        f0 = colour(*base)
        model, constants = "f82", (f0, fresnel.f82_b(f0, colour(*edge)))
        fss = fresnel.f82_average(*constants)
    aspect = np.sqrt(1 - 0.9 * anisotropy)
    alpha = roughness**2
    widths = (alpha / aspect, alpha * aspect) if anisotropy else (alpha,)
    name = " anisotropic" if anisotropy else ""
    closure = f"{FACETS[distribution]}{name} reflection {model}"
    parameters = (*(F32([width]) for width in widths), *constants)
    row = Row(
        "ShaderNodeBsdfMetallic",
        inputs,
        lambda cos: [(closure, parameters, F32([1]))],
        since=(4, 3),
    )
    return compensated(row, alpha, fss) if distribution == "MULTI_GGX" else row


FACETS = {"GGX": "ggx", "MULTI_GGX": "ggx", "BECKMANN": "beckmann"}
GOLD = {"base": (1.0, 0.7, 0.3), "edge": (0.9, 0.6, 1.0)}
COPPER = {"n": (0.2, 0.92, 1.1), "k": (3.91, 2.45, 2.14)}


ROWS = (
    alone("ShaderNodeBsdfDiffuse", "diffuse", Roughness=0.0),
    alone("ShaderNodeBsdfTranslucent", "translucent"),
    *(matte(each, (0.8, 0.5, 0.1)) for each in (0.1, 0.5, 1.0)),
    matte(1.0, (1.0, 1.0, 1.0)),
    thin_wall(0.7, 0.0),
    thin_wall(1.0, -0.6),
    *(microfibre(each) for each in (0.015, 0.03, 0.13, 0.3, 0.5, 0.777, 1.0)),
    *(velvet(each) for each in (0.1, 0.3, 1.0)),
    *(toon(kind, 0.5, 0.0) for kind in ("DIFFUSE", "GLOSSY")),
    *(toon(kind, 0.4, 0.3) for kind in ("DIFFUSE", "GLOSSY")),
    *(toon(kind, 0.9, 0.9) for kind in ("DIFFUSE", "GLOSSY")),
    *(glossy("ASHIKHMIN_SHIRLEY", roughness) for roughness in (0.2, 0.5, 1.0)),
    *(glossy("ASHIKHMIN_SHIRLEY", roughness, 0.6) for roughness in (0.15, 0.5)),
    glossy("ASHIKHMIN_SHIRLEY", 0.5, -0.5),
    *(glossy(kind, roughness) for kind in FACETS for roughness in (0.2, 0.5, 1.0)),
    *(glossy(kind, 0.4, anisotropy) for kind in FACETS for anisotropy in (0.6, -0.5)),
    *(glass(kind, roughness, 1.5) for kind in FACETS for roughness in (0.2, 0.5, 1.0)),
    *(glass(kind, 0.4, ior) for kind in FACETS for ior in (0.7, 2.4)),
    *(refraction(kind, 0.4, ior) for kind in ("GGX", "BECKMANN") for ior in (1.5, 0.7)),
    *(metal(kind, 0.4, **optics) for kind in FACETS for optics in (GOLD, COPPER)),
    *(metal(kind, 0.5, 0.7, **optics) for kind in FACETS for optics in (GOLD, COPPER)),
)


@pytest.fixture(scope="module")
def measured(blender):
    """{row: f cos (3, S, V)} as Cycles has it, of the rows that this Blender knows."""
    rows = [row for row in ROWS if row.since <= BLENDER]
    values = blender(planes.radiance, [(row.node, row.inputs) for row in rows], VIEWS, suns())
    return {id(row): values[:, :, place] for place, row in enumerate(rows)}


@pytest.mark.parametrize("row", ROWS, ids=str)
def test_a_closure_scatters_what_cycles_does(row, measured):
    if row.since > BLENDER:
        pytest.skip(f"Blender has it since {row.since}")
    theirs = measured[id(row)]
    wi = planes.local(VIEWS, suns())
    wo = np.broadcast_to(VIEWS[:, None], wi.shape)
    flat = tuple(each.reshape(3, -1).astype(F32) for each in (wo, wi))
    ours = row.value(*flat).reshape(wi.shape)
    peak = theirs.max()
    bright = np.maximum(ours, theirs) > DARK * peak
    assert peak > 1e-5
    assert bright.mean() > 0.01
    error = np.where(bright, np.abs(ours - theirs) / np.maximum(theirs, 1e-9 * peak), 0)
    worst = np.unravel_index(error.argmax(), error.shape)
    assert error[worst] < TOLERANCE, (
        f"{error[worst]:.1e} off: {ours[worst]:.6g}, Cycles {theirs[worst]:.6g}, "
        f"wo {VIEWS[:, worst[2]]}, wi {wi[:, worst[1], worst[2]]}"
    )
