"""shader nodes -> lobes.  What each shading node means, as weighted closures and emission.

A surface is a sum of lobes, each a closure type of `bsdf` with a colour weight and parameters,
plus emitted radiance.  The arrangement of Principled's layers is Blender's (its manual, "Principled
BSDF").  What cannot be honoured is written down by name, never dropped silently.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..scene import Colour, Link, Material, Node, Note, Socket

# Below this, roughness^4 (GGX alpha_x alpha_y) counts as perfectly smooth, as in Blender.
SMOOTH = 5e-7
BLACK: Colour = (0.0, 0.0, 0.0)
WHITE: Colour = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Lobe:
    """One closure: its type's name, its colour weight, its parameters in the type's order."""

    closure: str
    weight: Colour
    parameters: tuple[float, ...] = ()


@dataclass
class Surface:
    """The lobes of a material, its emitted radiance [W/(sr m2)], and what it leaves out."""

    owner: str
    lobes: list[Lobe] = field(default_factory=list)
    emission: Colour = BLACK
    notes: list[Note] = field(default_factory=list)

    def note(self, what: str) -> None:
        """Write down, once, what the picture does not honour."""
        note = Note(self.owner, what)
        if note not in self.notes:
            self.notes.append(note)

    def add(self, closure: str, weight: Colour, *parameters: float) -> None:
        """Add a lobe, unless it is black."""
        if max(weight) > 0:
            self.lobes.append(Lobe(closure, weight, tuple(float(x) for x in parameters)))

    def scalar(self, node: Node, socket: str, default: float = 0.0) -> float:
        """Return the constant at an input; a link that is no constant is noted."""
        value = self._constant(node, socket, default)
        if isinstance(value, (tuple, list)):
            return float(0.2126 * value[0] + 0.7152 * value[1] + 0.0722 * value[2])
        return float(value)  # type: ignore[arg-type]

    def colour(self, node: Node, socket: str, default: Colour = WHITE) -> Colour:
        """Return the constant colour at an input; a link that is no constant is noted."""
        value = self._constant(node, socket, default)
        if isinstance(value, (tuple, list)):
            return float(value[0]), float(value[1]), float(value[2])
        grey = float(value)  # type: ignore[arg-type]
        return grey, grey, grey

    def is_linked(self, node: Node, socket: str, what: str) -> None:
        """Note an input that only matters when something feeds it (normals, tangents)."""
        if isinstance(node.inputs.get(socket), Link):
            self.note(f"{_title(node)}: {what} is not honoured")

    def _constant(self, node: Node, socket: str, default: Socket) -> Socket:
        value = node.inputs.get(socket, default)
        while isinstance(value, Link):
            source = value.node
            if source.kind in ("Value", "RGB"):
                value = source.inputs.get("Value", source.inputs.get("Color", value.default))
                continue
            self.note(
                f"{_title(source)} feeding {socket} of {_title(node)} is replaced by the "
                "input's own value"
            )
            value = value.default
        return default if value is None else value


def compile_surface(owner: str, material: Material | None) -> Surface:
    """Return the lobes and the emission of a material; None is Blender's default surface."""
    surface = Surface(owner)
    if material is None:
        surface.add("diffuse", (0.8, 0.8, 0.8))
    elif material.surface is not None:
        _add(surface, material.surface, WHITE)
    return surface


def compile_emission(owner: str, node: Node | None) -> tuple[Colour, list[Note]]:
    """Return the constant radiance of a world shader and what it leaves out."""
    surface = Surface(owner)
    if node is not None:
        _add(surface, node, WHITE)
    return surface.emission, surface.notes


def _add(surface: Surface, node: Node, weight: Colour) -> None:
    if not max(weight) > 0:
        return
    shader = SHADERS.get(node.kind)
    if shader is None:
        surface.note(f"{_title(node)} is not honoured: it is rendered black")
        return
    shader(surface, node, weight)


def _title(node: Node) -> str:
    return f"{node.kind} '{node.name}'" if node.name else node.kind


def _times(a: Colour, b: Colour | float) -> Colour:
    if isinstance(b, (int, float)):
        b = (b, b, b)
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


def _positive(colour: Colour) -> Colour:
    return max(colour[0], 0.0), max(colour[1], 0.0), max(colour[2], 0.0)


def _emit(surface: Surface, radiance: Colour) -> None:
    old = surface.emission
    surface.emission = old[0] + radiance[0], old[1] + radiance[1], old[2] + radiance[2]


def _diffuse(surface: Surface, node: Node, weight: Colour) -> None:
    if surface.scalar(node, "Roughness") > 0:
        surface.note(f"{_title(node)}: Roughness is not honoured")
    surface.is_linked(node, "Normal", "its normal")
    surface.add("diffuse", _times(weight, _positive(surface.colour(node, "Color"))))


def _glossy(surface: Surface, node: Node, weight: Colour) -> None:
    surface.is_linked(node, "Normal", "its normal")
    weight = _times(weight, _positive(surface.colour(node, "Color")))
    roughness = surface.scalar(node, "Roughness")
    _add_mirror(surface, node, weight, roughness, WHITE, WHITE)


def _add_mirror(
    surface: Surface, node: Node, weight: Colour, roughness: float, f0: Colour, f90: Colour
) -> None:
    if roughness**4 > SMOOTH:
        if roughness >= 0.5:
            surface.note(f"{_title(node)}: Roughness {roughness:.3g} is rendered as matte")
            surface.add("diffuse", _times(weight, f0))
            return
        surface.note(f"{_title(node)}: Roughness {roughness:.3g} is rendered as 0")
    surface.add("mirror", weight, *f0, *f90)


def _glass(surface: Surface, node: Node, weight: Colour) -> None:
    surface.is_linked(node, "Normal", "its normal")
    if surface.scalar(node, "Thin Film Thickness") > 0:
        surface.note(f"{_title(node)}: Thin Film is not honoured")
    colour = _positive(surface.colour(node, "Color"))
    _smooth_glass_note(surface, node)
    surface.add("glass", weight, _ior(surface, node), *colour, *colour)


def _refraction(surface: Surface, node: Node, weight: Colour) -> None:
    surface.is_linked(node, "Normal", "its normal")
    _smooth_glass_note(surface, node)
    weight = _times(weight, _positive(surface.colour(node, "Color")))
    surface.add("refraction", weight, _ior(surface, node))


def _smooth_glass_note(surface: Surface, node: Node) -> None:
    roughness = surface.scalar(node, "Roughness")
    if roughness**4 > SMOOTH:
        surface.note(f"{_title(node)}: Roughness {roughness:.3g} is rendered as 0")


def _ior(surface: Surface, node: Node) -> float:
    return max(surface.scalar(node, "IOR", 1.45), 1e-5)


def _transparent(surface: Surface, node: Node, weight: Colour) -> None:
    _pass_straight(surface, node, _times(weight, _positive(surface.colour(node, "Color"))))


def _pass_straight(surface: Surface, node: Node, weight: Colour) -> None:
    surface.note(
        f"{_title(node)}: transparency counts as refraction of index 1: it casts a full shadow"
    )
    surface.add("refraction", weight, 1.0)


def _emission(surface: Surface, node: Node, weight: Colour) -> None:
    strength = surface.scalar(node, "Strength", 1.0)
    _emit(surface, _times(_times(weight, surface.colour(node, "Color")), strength))


def _mix(surface: Surface, node: Node, weight: Colour) -> None:
    factor = float(np.clip(surface.scalar(node, "Fac", 0.5), 0, 1))
    for socket, share in (("Shader", 1 - factor), ("Shader_001", factor)):
        _add_linked(surface, node, socket, _times(weight, share))


def _sum(surface: Surface, node: Node, weight: Colour) -> None:
    for socket in ("Shader", "Shader_001"):
        _add_linked(surface, node, socket, weight)


def _add_linked(surface: Surface, node: Node, socket: str, weight: Colour) -> None:
    link = node.inputs.get(socket)
    if isinstance(link, Link):
        _add(surface, link.node, weight)


# Principled inputs that do nothing at this value, and what is said if they have another one.
_UNUSED = (
    ("Diffuse Roughness", 0.0),
    ("Subsurface Weight", 0.0),
    ("Coat Weight", 0.0),
    ("Sheen Weight", 0.0),
    ("Thin Film Thickness", 0.0),
    ("Thin Wall", 0.0),
)


def _principled(surface: Surface, node: Node, weight: Colour) -> None:
    for socket, neutral in _UNUSED:
        if surface.scalar(node, socket, neutral) > neutral:
            surface.note(f"{_title(node)}: {socket} is not honoured")
    for socket in ("Normal", "Coat Normal", "Tangent"):
        surface.is_linked(node, socket, f"the {socket.lower()} input")
    base = _positive(surface.colour(node, "Base Color", (0.8, 0.8, 0.8)))
    clamped = min(base[0], 1.0), min(base[1], 1.0), min(base[2], 1.0)
    tint = _positive(surface.colour(node, "Specular Tint"))
    roughness = _unit(surface, node, "Roughness", 0.5)

    # Alpha and emission lie above all other layers.
    alpha = _unit(surface, node, "Alpha", 1.0)
    if alpha < 1:
        _pass_straight(surface, node, _times(weight, 1 - alpha))
        weight = _times(weight, alpha)
    strength = surface.scalar(node, "Emission Strength", 0.0)
    _emit(surface, _times(_times(weight, surface.colour(node, "Emission Color")), strength))

    # Metal, glass and the dielectric share what light there is.
    metallic = _unit(surface, node, "Metallic", 0.0)
    if metallic > 0:
        if min(tint) < 1:
            surface.note(f"{_title(node)}: Specular Tint of metal is not honoured")
        if roughness**4 > SMOOTH and surface.scalar(node, "Anisotropic") > 0:
            surface.note(f"{_title(node)}: Anisotropic is not honoured")
        _add_mirror(surface, node, _times(weight, metallic), roughness, clamped, WHITE)
        weight = _times(weight, 1 - metallic)
    transmission = _unit(surface, node, "Transmission Weight", 0.0)
    if transmission > 0 and max(weight) > 0:
        _smooth_glass_note(surface, node)
        root = tuple(float(np.sqrt(x)) for x in clamped)
        surface.add("glass", _times(weight, transmission), _ior(surface, node), *tint, *root)
        weight = _times(weight, 1 - transmission)
    if not max(weight) > 0:
        return
    level = surface.scalar(node, "Specular IOR Level", 0.5)
    if level > 0 and _ior(surface, node) != 1:
        surface.note(f"{_title(node)}: the specular layer over the diffuse base is left out")
    surface.add("diffuse", _times(weight, base))


def _unit(surface: Surface, node: Node, socket: str, default: float) -> float:
    return float(np.clip(surface.scalar(node, socket, default), 0, 1))


SHADERS: dict[str, Callable[[Surface, Node, Colour], None]] = {
    "BsdfPrincipled": _principled,
    "BsdfDiffuse": _diffuse,
    "BsdfGlossy": _glossy,
    "BsdfAnisotropic": _glossy,
    "BsdfGlass": _glass,
    "BsdfRefraction": _refraction,
    "BsdfTransparent": _transparent,
    "Emission": _emission,
    "Background": _emission,
    "MixShader": _mix,
    "AddShader": _sum,
}
