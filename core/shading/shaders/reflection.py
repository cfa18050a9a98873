"""roughness, Fresnel model -> a reflecting lobe.  How nodes name the microfacet closures."""

from typing import NamedTuple

import numpy as np

from ...bsdf import albedo, fresnel, thin_film, thin_wall
from ...scene import Node
from ..inputs import AFTER_MATTE, BACK, BLUR, COSINE, FROM_CAMERA
from ..normals import cosine_at, valid
from ..surface import Surface
from ..values import COLOUR, FLOAT, Array, Number, Value, clamp, constant, several, step

# Below this, alpha_x alpha_y counts as perfectly smooth (Cycles).
SMOOTH = 2e-10
WHITE = constant((1.0, 1.0, 1.0))


class Axis(NamedTuple):
    """A unit normal of a node's own, None is the shading normal, and as lobes use it.

    valid: bent so that mirrored rays leave the surface; cosine: of the viewer's direction at that.
    """

    normal: Value | None
    valid: Value | None
    cosine: Value


SHADING = Axis(None, None, COSINE)


class Roughness(NamedTuple):
    """The alphas of a lobe along its two tangents, the tangent if they differ, and its axis."""

    x: Value
    y: Value
    tangent: Value | None = None
    axis: Axis = SHADING

    @property
    def is_smooth(self) -> bool:
        """Whether the surface is a mirror at all points."""
        return self.x.largest() * self.y.largest() <= SMOOTH

    @property
    def mean(self) -> Value:
        """The roughness that tables of albedo know it by."""
        return step(albedo.roughness_of, self.x, self.y)


class Energy(NamedTuple):
    """By what a lobe is multiplied for the light between its facets, and the darkening in it."""

    factor: Value
    darkening: Value

    def share(self, estimated: Number = 1.0) -> Value:
        """Return by what the lobe is chosen, so multiplied: Cycles does not count the gain."""
        return self.darkening / self.factor * estimated


def isotropic(roughness: Value, normal: Value | None = None) -> Roughness:
    """Return the alphas of a node's roughness, its square."""
    alpha = clamp(roughness)
    alpha = alpha * alpha
    if normal is None:
        return Roughness(alpha, alpha)
    bent = valid(normal)
    return Roughness(alpha, alpha, None, Axis(normal, bent, cosine_at(bent)))


def add_reflection(
    surface: Surface,
    model: str,
    weight: Value,
    rough: Roughness,
    *parameters: Number,
    importance: Value | None = None,
    distribution: str = "ggx",
    energy: Energy | None = None,
) -> None:
    """Add a reflecting lobe with a Fresnel model: smooth, isotropic or anisotropic.

    Matte surfaces see none of it if reflective caustics are off; filter glossy widens it.  energy:
    what scattering between its facets adds.
    """
    shown = weight if importance is None else weight * importance
    surface.show("glossy", shown if energy is None else shown * energy.darkening)
    if energy is not None:
        weight = weight * energy.factor
        importance = energy.share(1.0 if importance is None else importance)
    if not surface.rules.has_reflective_caustics:
        weight = weight * (1.0 - AFTER_MATTE)
    alphas: tuple[Value, ...] = ()
    if rough.is_smooth and not surface.rules.is_blurred:
        name = f"smooth reflection {model}"
    elif rough.tangent is None:
        name = f"{distribution} reflection {model}"
        alphas = (blurred(surface, rough.x),)
    else:
        name = f"{distribution} anisotropic reflection {model}"
        alphas = blurred(surface, rough.x), blurred(surface, rough.y)
    frame = {"normal": rough.axis.valid, "tangent": rough.tangent}
    surface.add(name, weight, *alphas, *parameters, **frame, importance=importance)


def add_glass(
    surface: Surface,
    weight: Value,
    rough: Roughness,
    ior: Value,
    f0: Value,
    reflection: Value,
    transmission: Value,
    distribution: str = "ggx",
    film: tuple[Value, ...] = (),
    energy: Energy | None = None,
) -> None:
    """Add glass that reflects and refracts, seen from either side; film: thickness and index."""
    shown = weight if energy is None else weight * energy.darkening
    estimate = _glass_reflectance(rough, ior, f0, film)
    surface.show("glossy", shown * estimate * reflection)
    surface.show("transmission", shown * (1.0 - estimate) * transmission)
    if not surface.rules.has_reflective_caustics:
        reflection = reflection * (1.0 - AFTER_MATTE)
    if not surface.rules.has_refractive_caustics:
        transmission = transmission * (1.0 - AFTER_MATTE)
    reflected = estimated(rough, ior, f0) if film else estimate
    share = reflected * reflection + (1.0 - reflected) * transmission
    if energy is not None:
        weight, share = weight * energy.factor, energy.share(share)
    model = "glass"
    optics: tuple[Value, ...] = relative_index(ior), f0
    if film:
        # From behind, the film lies between what it covers and the viewer's side.
        thickness, film_ior = film
        optics = *optics, thickness, step(_film_index, film_ior, ior, BACK)
        model = "glass film"
    parameters = *optics, reflection, transmission
    if rough.is_smooth and not surface.rules.is_blurred:
        surface.add(
            f"smooth {model}", weight, *parameters, normal=rough.axis.valid, importance=share
        )
    else:
        alpha = blurred(surface, rough.x)
        name, parameters = f"{distribution} {model}", (alpha, *parameters)
        surface.add(name, weight, *parameters, normal=rough.axis.valid, importance=share)


def _glass_reflectance(rough: Roughness, ior: Value, f0: Value, film: tuple[Value, ...]) -> Value:
    """Return about what share of light glass reflects."""
    if film:
        optics = relative_index(ior), f0, film[0], step(_film_index, film[1], ior, BACK)
        return step(thin_film.film_remapped, rough.axis.cosine, *optics, kind=COLOUR)
    return estimated(rough, ior, f0)


def estimated(rough: Roughness, eta: Value, f0: Value) -> Value:
    """Return about what share of light a dielectric reflects that starts at f0."""
    args = rough.mean, rough.axis.cosine, eta, f0
    return step(albedo.estimated_albedo_remapped, *args, kind=f0.kind)


def add_pane(
    surface: Surface,
    weight: Value,
    rough: Roughness,
    ior: Value,
    tint: Value,
    colour: Value,
    film: tuple[Value, ...],
) -> None:
    """Add glass without thickness: what it reflects, and what goes straight on, rougher."""
    switches = surface.rules.has_reflective_caustics, surface.rules.has_refractive_caustics
    f0 = clamp(normal_reflectance(ior) * tint)
    layer = film or (constant(0.0), constant(1.0))
    reflected, passed = several(
        thin_wall.thin_glass, rough.axis.cosine, ior, f0, colour, *layer, kinds=(COLOUR, COLOUR)
    )
    if not all(switches):
        # Matte surfaces see no such light.
        kept = [1.0 - AFTER_MATTE * (0.0 if switch else 1.0) for switch in switches]
        reflected, passed = reflected * kept[0], passed * kept[1]
    energy = kept_energy(rough, tint)
    add_reflection(surface, "unit", weight * reflected, rough, energy=energy)
    alpha = step(thin_wall.transmission_alpha, rough.x, ior)
    weight = weight * passed
    surface.show("transmission", weight)
    if alpha.largest() <= np.sqrt(SMOOTH):
        # A surface for the camera; to other rays, those to lights too, it is not there (Cycles).
        surface.add("smooth thin", weight * FROM_CAMERA, normal=rough.axis.valid)
        surface.let_through(weight * (1.0 - FROM_CAMERA))
        return
    energy = kept_energy(Roughness(alpha, alpha, None, rough.axis), None)
    weight, alpha = weight * energy.factor, blurred(surface, alpha)
    normal, share = rough.axis.valid, energy.share()
    surface.add("ggx thin", weight, alpha, normal=normal, importance=share)


def add_refraction(
    surface: Surface, weight: Value, rough: Roughness, ior: Value, distribution: str
) -> None:
    """Add a lobe that refracts all light and reflects none."""
    if not surface.rules.has_refractive_caustics:
        weight = weight * (1.0 - AFTER_MATTE)
    surface.show("transmission", weight)
    eta = relative_index(ior)
    if rough.is_smooth and not surface.rules.is_blurred:
        surface.add("smooth refraction", weight, eta, normal=rough.axis.valid)
    else:
        alpha = blurred(surface, rough.x)
        surface.add(f"{distribution} refraction", weight, alpha, eta, normal=rough.axis.valid)


def blurred(surface: Surface, alpha: Value) -> Value:
    """Return alpha, at least what filter glossy asks for."""
    return step(np.maximum, alpha, BLUR) if surface.rules.is_blurred else alpha


def relative_index(ior: Value) -> Value:
    """Return the index beyond the surface over that on the viewer's side."""
    return step(_inverted, ior, BACK)


def _inverted(ior: Array, back: Array) -> Array:
    return np.where(back > 0, np.float32(1) / ior, ior)


def _film_index(film_ior: Array, ior: Array, back: Array) -> Array:
    return np.where(back > 0, film_ior / ior, film_ior)


def index_of(surface: Surface, node: Node, default: float = 1.5) -> Value:
    """Return a node's index of refraction, above 0."""
    return clamp(surface.graph.number(node, "IOR", default), 1e-5, np.inf)


def normal_reflectance(ior: Value) -> Value:
    """Return the reflectance at perpendicular incidence."""
    return step(fresnel.f0_from_ior, ior)


def kept_energy(rough: Roughness, fss: Value | None) -> Energy:
    """Return what multiple scattering adds to GGX reflection; fss None: nothing is absorbed."""
    e = step(albedo.ggx_albedo, rough.mean, rough.axis.cosine)
    average = step(albedo.ggx_average_albedo, rough.mean)
    args = (e, average) if fss is None else (e, average, fss)
    kind = FLOAT if fss is None else fss.kind
    return Energy(*several(albedo.kept_energy, *args, kinds=(kind, kind)))


def kept_glass_energy(rough: Roughness, ior: Value, fss: Value) -> Energy:
    """Return the same for glass."""
    args = rough.mean, rough.axis.cosine, ior, BACK, fss
    return Energy(*several(_glass_energy, *args, kinds=(fss.kind, fss.kind)))


def _glass_energy(
    rough: Array, mu: Array, ior: Array, back: Array, fss: Array
) -> tuple[Array, Array]:
    return albedo.ggx_glass_energy(rough, mu, ior, back > 0, fss)
