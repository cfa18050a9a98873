"""shader node -> lobes.  Diffuse, Translucent, Sheen, Toon, and Subsurface Scattering for now."""

from ...bsdf import oren_nayar, rough_translucent, sheen
from ...scene import Node
from ..inputs import AFTER_MATTE, NORMAL_COSINE
from ..normals import cosine_at, valid
from ..surface import Surface
from ..values import COLOUR, FLOAT, Value, clamp, positive, several

# Diffuse surfaces smoother than this are Lambertian (Cycles).
ALMOST_ZERO = 1e-5


def add_diffuse(
    surface: Surface, weight: Value, roughness: Value, colour: Value, normal: Value | None = None
) -> None:
    """Add a diffuse lobe, rough where its roughness is not 0; the weight contains the colour."""
    if not roughness.largest() > ALMOST_ZERO:
        surface.add("diffuse", weight, normal=normal)
        return
    parameters = several(oren_nayar.prepare, roughness, colour, kinds=(FLOAT, FLOAT, COLOUR))
    surface.add("oren nayar", weight, *parameters, normal=normal)


def add_leaf(
    surface: Surface,
    weight: Value,
    anisotropy: Value,
    roughness: Value,
    colour: Value,
    normal: Value | None = None,
) -> None:
    """Add a diffuse sheet without thickness, which scatters to both sides."""
    kinds = FLOAT, FLOAT
    reflected, passed = several(rough_translucent.shares, anisotropy, kinds=kinds)
    add_diffuse(surface, weight * reflected, roughness, colour, normal)
    weight = weight * passed
    if not roughness.largest() > ALMOST_ZERO:
        surface.add("translucent", weight, normal=normal)
        return
    parameters = several(oren_nayar.prepare, roughness, colour, kinds=(FLOAT, FLOAT, COLOUR))
    surface.add("rough translucent", weight, *parameters, normal=normal)


def _diffuse(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    colour = positive(graph.colour(node, "Color"))
    roughness = graph.number(node, "Roughness")
    add_diffuse(surface, weight * colour, roughness, clamp(colour), normal)


def _translucent(surface: Surface, node: Node, weight: Value) -> None:
    normal = surface.normal_of(node)
    weight = weight * positive(surface.graph.colour(node, "Color"))
    surface.add("translucent", weight, normal=normal)


def _sheen(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    weight = weight * positive(graph.colour(node, "Color"))
    roughness = clamp(graph.number(node, "Roughness", 0.5))
    if graph.choice(node, "distribution", "MICROFIBER") == "ASHIKHMIN":
        surface.add("velvet", weight, roughness, normal=normal)
        surface.show("glossy", weight)
    else:
        add_sheen(surface, weight, roughness, normal)


def add_sheen(
    surface: Surface, weight: Value, roughness: Value, normal: Value | None = None
) -> Value:
    """Add a microfiber lobe; return its albedo, without the weight."""
    cosine = NORMAL_COSINE if normal is None else cosine_at(normal)
    a, b, albedo = several(sheen.prepare, roughness, cosine, kinds=(FLOAT,) * 3)
    surface.add("sheen", weight * albedo, a, b, normal=normal)
    return albedo


def _toon(surface: Surface, node: Node, weight: Value) -> None:
    graph, normal = surface.graph, surface.normal_of(node)
    weight = weight * positive(graph.colour(node, "Color"))
    size, smooth = graph.number(node, "Size", 0.5), graph.number(node, "Smooth")
    if graph.choice(node, "component", "DIFFUSE") == "DIFFUSE":
        surface.add("toon diffuse", weight, size, smooth, normal=normal)
        return
    if not surface.rules.has_reflective_caustics:
        weight = weight * (1.0 - AFTER_MATTE)
    surface.add("toon glossy", weight, size, smooth, normal=normal and valid(normal))
    surface.show("glossy", weight)


def _subsurface(surface: Surface, node: Node, weight: Value) -> None:
    surface.graph.note(f"Subsurface Scattering '{node.name}' is rendered as diffuse")
    normal = surface.normal_of(node)
    weight = weight * positive(surface.graph.colour(node, "Color"))
    surface.add("diffuse", weight, normal=normal)


MATTE = {
    "BsdfDiffuse": _diffuse,
    "BsdfTranslucent": _translucent,
    "BsdfSheen": _sheen,
    "BsdfVelvet": _sheen,
    "BsdfToon": _toon,
    "SubsurfaceScattering": _subsurface,
}
