"""shader node -> lobes.  Diffuse, Translucent, Sheen, Toon, and Subsurface Scattering for now."""

from ...bsdf import oren_nayar, rough_translucent, sheen
from ...scene import Node
from ..inputs import AFTER_MATTE, NORMAL_COSINE
from ..surface import Surface
from ..values import COLOUR, FLOAT, Value, clamp, positive, several

# Diffuse surfaces smoother than this are Lambertian (Cycles).
ALMOST_ZERO = 1e-5


def add_diffuse(surface: Surface, weight: Value, roughness: Value, colour: Value) -> None:
    """Add a diffuse lobe, rough where its roughness is not 0; the weight contains the colour."""
    if not roughness.largest() > ALMOST_ZERO:
        surface.add("diffuse", weight)
        return
    parameters = several(oren_nayar.prepare, roughness, colour, kinds=(FLOAT, FLOAT, COLOUR))
    surface.add("oren nayar", weight, *parameters)


def add_leaf(
    surface: Surface, weight: Value, anisotropy: Value, roughness: Value, colour: Value
) -> None:
    """Add a diffuse sheet without thickness, which scatters to both sides."""
    kinds = FLOAT, FLOAT
    reflected, passed = several(rough_translucent.shares, anisotropy, kinds=kinds)
    add_diffuse(surface, weight * reflected, roughness, colour)
    weight = weight * passed
    if not roughness.largest() > ALMOST_ZERO:
        surface.add("translucent", weight)
        return
    parameters = several(oren_nayar.prepare, roughness, colour, kinds=(FLOAT, FLOAT, COLOUR))
    surface.add("rough translucent", weight, *parameters)


def _diffuse(surface: Surface, node: Node, weight: Value) -> None:
    graph = surface.graph
    surface.note_normal(node)
    colour = positive(graph.colour(node, "Color"))
    add_diffuse(surface, weight * colour, graph.number(node, "Roughness"), clamp(colour))


def _translucent(surface: Surface, node: Node, weight: Value) -> None:
    surface.note_normal(node)
    surface.add("translucent", weight * positive(surface.graph.colour(node, "Color")))


def _sheen(surface: Surface, node: Node, weight: Value) -> None:
    graph = surface.graph
    surface.note_normal(node)
    weight = weight * positive(graph.colour(node, "Color"))
    roughness = clamp(graph.number(node, "Roughness", 0.5))
    if graph.choice(node, "distribution", "MICROFIBER") == "ASHIKHMIN":
        surface.add("velvet", weight, roughness)
    else:
        add_sheen(surface, weight, roughness)


def add_sheen(surface: Surface, weight: Value, roughness: Value) -> Value:
    """Add a microfiber lobe; return its albedo, without the weight."""
    a, b, albedo = several(sheen.prepare, roughness, NORMAL_COSINE, kinds=(FLOAT,) * 3)
    surface.add("sheen", weight * albedo, a, b)
    return albedo


def _toon(surface: Surface, node: Node, weight: Value) -> None:
    graph = surface.graph
    surface.note_normal(node)
    weight = weight * positive(graph.colour(node, "Color"))
    size, smooth = graph.number(node, "Size", 0.5), graph.number(node, "Smooth")
    if graph.choice(node, "component", "DIFFUSE") == "DIFFUSE":
        surface.add("toon diffuse", weight, size, smooth)
        return
    if not surface.rules.has_reflective_caustics:
        weight = weight * (1.0 - AFTER_MATTE)
    surface.add("toon glossy", weight, size, smooth)


def _subsurface(surface: Surface, node: Node, weight: Value) -> None:
    surface.graph.note(f"Subsurface Scattering '{node.name}' is rendered as diffuse")
    surface.note_normal(node)
    surface.add("diffuse", weight * positive(surface.graph.colour(node, "Color")))


MATTE = {
    "BsdfDiffuse": _diffuse,
    "BsdfTranslucent": _translucent,
    "BsdfSheen": _sheen,
    "BsdfVelvet": _sheen,
    "BsdfToon": _toon,
    "SubsurfaceScattering": _subsurface,
}
