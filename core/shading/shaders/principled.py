"""shader node -> lobes.  Principled: layers of closures, from the top down.

Alpha; sheen and coat, which let less light down; emission; metal; transmission; the dielectric's
reflection over its diffuse base.  The arrangement is Blender's (its manual, "Principled BSDF").
"""

import numpy as np

from ...bsdf import albedo, fresnel, thin_film
from ...scene import Node
from ..inputs import NORMAL
from ..normals import unit_normal
from ..surface import Surface
from ..values import COLOUR, VECTOR, Array, Value, clamp, mix, positive, read, step
from .glossy import THIN_FILM, film_index, stretched_principled
from .matte import add_diffuse, add_leaf, add_sheen
from .reflection import (
    WHITE,
    Roughness,
    add_glass,
    add_pane,
    add_reflection,
    estimated,
    index_of,
    isotropic,
    kept_energy,
    kept_glass_energy,
    normal_reflectance,
)


def principled(surface: Surface, node: Node, weight: Value) -> None:
    """Add all layers of a Principled node."""
    graph = surface.graph
    normal = surface.normal_of(node)
    coat_normal = surface.normal_of(node, "Coat Normal")
    is_thin = not graph.number(node, "Thin Wall").is_exactly(0)
    is_multiple = graph.choice(node, "distribution", "MULTI_GGX") == "MULTI_GGX"

    # Alpha lies above all other layers.
    alpha = clamp(graph.number(node, "Alpha", 1.0))
    surface.let_through(weight * (1.0 - alpha))
    weight = weight * alpha
    weight = _sheen(surface, node, weight, normal, coat_normal)
    weight = _coat(surface, node, weight, coat_normal)
    strength = graph.number(node, "Emission Strength")
    surface.emit(weight * graph.colour(node, "Emission Color") * strength)

    base = positive(graph.colour(node, "Base Color", (0.8, 0.8, 0.8)))
    clamped = clamp(base)
    ior = index_of(surface, node, 1.5)
    tint = positive(graph.colour(node, "Specular Tint"))
    smooth = isotropic(graph.number(node, "Roughness", 0.5), normal)
    rough = stretched_principled(surface, node, smooth, "Anisotropic", "Anisotropic Rotation")
    thickness = graph.number(node, "Thin Film Thickness")
    film: tuple[Value, ...] = ()
    if thickness.largest() > THIN_FILM:
        film = thickness, film_index(surface, node)

    # Metal
    metallic = clamp(graph.number(node, "Metallic"))
    if metallic.largest() > 0:
        b = step(fresnel.f82_b, clamped, clamp(tint))
        energy = None
        if is_multiple:
            energy = kept_energy(rough, step(fresnel.f82_average, clamped, b))
        share = step(
            albedo.estimated_albedo_f82, rough.mean, rough.axis.cosine, clamped, kind=COLOUR
        )
        over = film if graph.choice(node, "films_metal", True) else ()
        optics = clamped, b, *over
        metal = named("f82", over), weight * metallic, rough
        add_reflection(surface, *metal, *optics, importance=share, energy=energy)
        weight = weight * (1.0 - metallic)

    # Glass
    transmission = clamp(graph.number(node, "Transmission Weight"))
    if transmission.largest() > 0:
        glass = weight * transmission
        if is_thin:
            add_pane(surface, glass, smooth, ior, tint, clamped, film)
        else:
            root = step(np.sqrt, clamped)
            energy = None
            if is_multiple and not smooth.is_smooth:
                energy = kept_glass_energy(smooth, ior, root)
            f0 = clamp(normal_reflectance(ior) * tint)
            optics = ior, f0, WHITE, root
            add_glass(surface, glass, smooth, *optics, film=film, energy=energy)
        weight = weight * (1.0 - transmission)

    # The dielectric's reflection, and what it lets down to the base
    weight = _specular(surface, node, weight, is_multiple, rough, ior, tint, film)
    roughness = clamp(graph.number(node, "Diffuse Roughness"))
    subsurface = clamp(graph.number(node, "Subsurface Weight"))
    if subsurface.largest() > 0:
        share = weight * clamped * subsurface
        if is_thin:
            anisotropy = graph.number(node, "Subsurface Anisotropy")
            add_leaf(surface, share, anisotropy, roughness, clamped, normal)
        else:
            graph.note(f"Principled '{node.name}': Subsurface is rendered as diffuse")
            surface.add("diffuse", share, normal=normal)
        weight = weight * (1.0 - subsurface)
    add_diffuse(surface, weight * base, roughness, clamped, normal)


def named(model: str, film: tuple[Value, ...]) -> str:
    """Return the name of a Fresnel model, with a film on it or not."""
    return f"{model} film" if film else model


def _sheen(
    surface: Surface, node: Node, weight: Value, normal: Value | None, coat_normal: Value | None
) -> Value:
    """Add the sheen; return the weight of what lies below."""
    graph = surface.graph
    amount = positive(graph.number(node, "Sheen Weight"))
    if not amount.largest() > 0:
        return weight
    tint = positive(graph.colour(node, "Sheen Tint"))
    own = weight * tint * amount
    if coat_normal is not normal:
        # Fibres stand on what lies on top.
        covered = clamp(graph.number(node, "Coat Weight"))
        normal = mix(normal or NORMAL, coat_normal or NORMAL, covered)
        normal = read(unit_normal, normal, kind=VECTOR)
    roughness = clamp(graph.number(node, "Sheen Roughness", 0.5))
    share = add_sheen(surface, own, roughness, normal)
    return step(albedo.layering, own * share, weight, kind=COLOUR)


def _coat(surface: Surface, node: Node, weight: Value, normal: Value | None) -> Value:
    """Add the coat; return the weight of what lies below."""
    graph = surface.graph
    amount = positive(graph.number(node, "Coat Weight"))
    if not amount.largest() > 0:
        return weight
    rough = isotropic(graph.number(node, "Coat Roughness", 0.03), normal)
    ior = clamp(graph.number(node, "Coat IOR", 1.5), 1.0, np.inf)
    own = weight * amount
    share = estimated(rough, ior, normal_reflectance(ior))
    energy = kept_energy(rough, step(fresnel.dielectric_average, ior))
    add_reflection(surface, "dielectric", own, rough, ior, importance=share, energy=energy)
    below = step(albedo.layering, own * energy.darkening * share, weight, kind=COLOUR)

    # Light that goes down and up is coloured by the way it takes through the coat.
    tint = positive(graph.colour(node, "Coat Tint"))
    if tint.is_exactly(1):
        return below
    return below * mix(WHITE, step(_absorbed, tint, rough.axis.cosine, ior), amount)


def _absorbed(tint: Array, cosine: Array, ior: Array) -> Array:
    beyond = np.sqrt(np.float32(1) - (np.float32(1) - cosine * cosine) / (ior * ior))
    return np.power(tint, np.float32(1) / beyond)


def _specular(
    surface: Surface,
    node: Node,
    weight: Value,
    is_multiple: bool,
    rough: Roughness,
    ior: Value,
    tint: Value,
    film: tuple[Value, ...],
) -> Value:
    """Add the dielectric's reflection; return the weight of its base."""
    level = positive(surface.graph.number(node, "Specular IOR Level", 0.5))
    eta, f0 = ior, normal_reflectance(ior)
    if not level.is_exactly(0.5):
        f0 = f0 * 2.0 * level
        eta = step(_index_of_reflectance, f0, ior)
    if eta.is_exactly(1) and not film:
        return weight
    f0 = clamp(f0 * tint)
    energy, darkening = None, WHITE
    if is_multiple:
        energy = kept_energy(rough, step(fresnel.remapped_average, eta, f0, kind=COLOUR))
        darkening = energy.darkening
    if film:
        share = step(thin_film.film_remapped, rough.axis.cosine, eta, f0, *film, kind=COLOUR)
    else:
        share = estimated(rough, eta, f0)
    layer = named("remapped", film), weight, rough
    add_reflection(surface, *layer, eta, f0, *film, importance=share, energy=energy)
    return step(albedo.layering, weight * darkening * share, weight, kind=COLOUR)


def _index_of_reflectance(f0: Array, ior: Array) -> Array:
    eta = fresnel.ior_from_f0(f0)
    return np.where(ior < 1, np.float32(1) / eta, eta)


PRINCIPLED = {"BsdfPrincipled": principled}
