"""shader node -> lobes.  Glossy, Metallic, Glass, Refraction."""

import numpy as np

from ...bsdf import albedo, fresnel
from ...scene import Node
from ..surface import Surface
from ..tangents import tangent_of
from ..values import COLOUR, Value, clamp, constant, positive, step
from .reflection import (
    Roughness,
    add_glass,
    add_reflection,
    add_refraction,
    blurred,
    index_of,
    isotropic,
    kept_energy,
    kept_glass_energy,
    normal_reflectance,
)

# Blender's names of the distributions, and ours
DISTRIBUTIONS = {"GGX": "ggx", "MULTI_GGX": "ggx", "BECKMANN": "beckmann"}


def _glossy(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    colour = positive(graph.colour(node, "Color"))
    weight = weight * colour
    choice = graph.choice(node, "distribution", "GGX")
    rough = _stretched(surface, node, isotropic(graph.number(node, "Roughness", 0.5), normal))
    if choice == "ASHIKHMIN_SHIRLEY":
        alphas = blurred(surface, rough.x), blurred(surface, rough.y)
        frame = {"normal": rough.axis.valid, "tangent": rough.tangent}
        surface.add("ashikhmin shirley", weight, *alphas, **frame)
        surface.show("glossy", weight)
        return
    # The colour is also the facets': light that bounces between them is coloured again.
    energy = kept_energy(rough, clamp(colour)) if choice == "MULTI_GGX" else None
    distribution = DISTRIBUTIONS.get(choice, "ggx")
    add_reflection(surface, "unit", weight, rough, distribution=distribution, energy=energy)


def _stretched(surface: Surface, node: Node, rough: Roughness) -> Roughness:
    """Return the alphas of Glossy: anisotropy in [-1, 1] stretches along the tangent or across."""
    graph = surface.graph
    amount = clamp(graph.number(node, "Anisotropy"), -0.99, 0.99)
    if amount.is_constant and abs(float(amount.constant[0])) <= 1e-4:  # type: ignore[index]
        return rough
    shrink = 1.0 - step(np.abs, amount)
    wide, narrow = rough.x / shrink, rough.x * shrink
    along = clamp(step(_chosen, amount, narrow, wide))
    across = clamp(step(_chosen, amount, wide, narrow))
    tangent = tangent_of(surface, node, "Rotation", rough.axis.normal)
    return Roughness(along, across, tangent, rough.axis)


def _chosen(amount: np.ndarray, positive: np.ndarray, negative: np.ndarray) -> np.ndarray:
    return np.where(amount < 0, negative, positive)


def _metallic(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    rough = stretched_principled(
        surface,
        node,
        isotropic(graph.number(node, "Roughness", 0.5), normal),
        "Anisotropy",
        "Rotation",
    )
    choice = graph.choice(node, "distribution", "MULTI_GGX")
    distribution = DISTRIBUTIONS.get(choice, "ggx")
    thickness = graph.number(node, "Thin Film Thickness")
    if graph.choice(node, "fresnel_type", "F82") == "PHYSICAL_CONDUCTOR":
        n = positive(graph.colour(node, "IOR", (2.757, 2.513, 2.231)))
        k = positive(graph.colour(node, "Extinction", (3.867, 3.404, 3.009)))
        model = "conductor"
        parameters: tuple[Value, ...] = n, k
        fss = step(fresnel.conductor_average, n, k)
        share = step(fresnel.conductor, constant(1.0), n, k, kind=COLOUR)
    else:
        colour = clamp(graph.colour(node, "Base Color", (0.617, 0.577, 0.540)))
        tint = clamp(graph.colour(node, "Edge Tint", (0.695, 0.726, 0.770)))
        b = step(fresnel.f82_b, colour, tint)
        model, parameters = "f82", (colour, b)
        fss = step(fresnel.f82_average, colour, b)
        share = step(
            albedo.estimated_albedo_f82, rough.mean, rough.axis.cosine, colour, kind=COLOUR
        )
    energy = kept_energy(rough, fss) if choice == "MULTI_GGX" else None
    if thickness.largest() > THIN_FILM:
        model, parameters = f"{model} film", (*parameters, thickness, film_index(surface, node))
    add_reflection(
        surface,
        model,
        weight,
        rough,
        *parameters,
        importance=share,
        distribution=distribution,
        energy=energy,
    )


# Thinner films [nm] change nothing (Cycles)
THIN_FILM = 0.1


def film_index(surface: Surface, node: Node) -> Value:
    """Return the index of refraction of a node's thin film."""
    return clamp(surface.graph.number(node, "Thin Film IOR", 1.33), 1e-5, np.inf)


def stretched_principled(
    surface: Surface, node: Node, rough: Roughness, amount: str, rotation: str
) -> Roughness:
    """Return the alphas of Principled and Metallic: anisotropy in [0, 1] stretches."""
    anisotropy = clamp(surface.graph.number(node, amount))
    if not anisotropy.largest() > 0:
        return rough
    aspect = step(np.sqrt, 1.0 - anisotropy * 0.9)
    tangent = tangent_of(surface, node, rotation, rough.axis.normal)
    along, across = clamp(rough.x / aspect), rough.y * aspect
    return Roughness(along, across, tangent, rough.axis)


def _glass(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    rough = isotropic(graph.number(node, "Roughness"), normal)
    ior = index_of(surface, node)
    colour = positive(graph.colour(node, "Color"))
    choice = graph.choice(node, "distribution", "MULTI_GGX")
    energy = None
    if choice == "MULTI_GGX" and not rough.is_smooth:
        energy = kept_glass_energy(rough, ior, colour)
    f0 = normal_reflectance(ior)
    thickness = graph.number(node, "Thin Film Thickness")
    film: tuple[Value, ...] = ()
    if thickness.largest() > THIN_FILM:
        film = thickness, film_index(surface, node)
    distribution = DISTRIBUTIONS.get(choice, "ggx")
    optics = ior, f0, colour, colour
    add_glass(surface, weight, rough, *optics, distribution, film, energy)


def _refraction(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    weight = weight * positive(graph.colour(node, "Color"))
    choice = graph.choice(node, "distribution", "BECKMANN")
    rough = isotropic(graph.number(node, "Roughness"), normal)
    distribution = DISTRIBUTIONS.get(choice, "ggx")
    add_refraction(surface, weight, rough, index_of(surface, node, 1.45), distribution)


GLOSSY = {
    "BsdfAnisotropic": _glossy,
    "BsdfGlossy": _glossy,
    "BsdfMetallic": _metallic,
    "BsdfGlass": _glass,
    "BsdfRefraction": _refraction,
}
