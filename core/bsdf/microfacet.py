"""closure, wo, u -> wi, weight, pdf.  Rough reflection, glass and refraction of microfacets.

A closure type is a distribution of normals (`ggx`, `beckmann`), what the facets do, and a Fresnel
model, named so: "ggx anisotropic reflection f82".  All are built from the table ROUGH; parameters
are alpha, or alpha_x and alpha_y if anisotropic, then what the Fresnel model takes, then tints.

    reflection   a facet reflects by the model
    thin         unit reflection, carried on through the surface: a thin pane that is rough
    glass        a facet reflects F reflection, and refracts (1 - F) transmission
    refraction   a facet refracts everything, total internal reflection is black

Normals are drawn as the viewer sees them.  Half vectors are never normalised, and 1 - cos^2 is
never formed, so that alpha = 1e-4 works in float32; alpha is at least `smith.LEAST_ALPHA`.  As in
Cycles, radiance is carried without the factor eta^2, and masking is height-correlated.  Where eta
is nearer to 1 than 1e-4, facets would hardly bend light: it is moved away to 1 +- 1e-4, by which
light is bent less than 0.01 degrees.
Source: Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"; Heitz 2014,
"Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs".
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import numpy as np

from ..arrays import F32, Scalar, Vec, dot
from . import beckmann, fresnel, ggx, thin_film
from .kinds import GLOSSY
from .smith import LEAST_ALPHA, LEAST_COS, Normals

Parameters = tuple[Scalar, ...]

_TINY = F32(1e-30)
_LEAST_BEND = F32(1e-4)
_LEAST_SUM = F32(1e-3)  # of both cosines, else reflection is total


@dataclass(frozen=True)
class Model:
    """A Fresnel model: its parameters, and reflectance(cos, *parameters) -> (N,) or (3, N).

    No reflectance is 1.
    """

    name: str
    parameters: dict[str, int]
    reflectance: Callable[..., Vec] | None


def _reflected(cos: Scalar, eta: Scalar) -> Scalar:
    return fresnel.dielectric(cos, eta)[0]


FILM = {"thickness": 1, "film_ior": 1}  # [nm], and over the index on the viewer's side

MODELS = {
    model.name: model
    for model in (
        Model("unit", {}, None),
        Model("dielectric", {"eta": 1}, _reflected),
        Model("remapped", {"eta": 1, "f0": 3}, fresnel.remapped),
        Model("f82", {"f0": 3, "b": 3}, fresnel.f82),
        Model("conductor", {"n": 3, "k": 3}, fresnel.conductor),
        Model("remapped film", {"eta": 1, "f0": 3, **FILM}, thin_film.film_remapped),
        Model("f82 film", {"f0": 3, "b": 3, **FILM}, thin_film.film_f82),
        Model("conductor film", {"n": 3, "k": 3, **FILM}, thin_film.film_conductor),
    )
}


@dataclass(frozen=True, eq=False)
class Reflection:
    """Microfacets that reflect, or whose reflection goes on through the surface."""

    NAME: str
    PARAMETERS: dict[str, int]
    distribution: ModuleType
    model: Model
    TRANSMITS: bool = False

    IS_DELTA: ClassVar = False
    RAY_KIND: ClassVar = GLOSSY
    WEIGHT_IN_WI_Z: ClassVar = False
    DRAWS: ClassVar = 2

    def _read(self, parameters: Parameters) -> tuple[Scalar, Scalar, Parameters]:
        ax = ay = np.maximum(parameters[0], LEAST_ALPHA)
        if "alpha" in self.PARAMETERS:
            return ax, ay, parameters[1:]
        return ax, np.maximum(parameters[1], LEAST_ALPHA), parameters[2:]

    def evaluate(self, parameters: Parameters, wo: Vec, wi: Vec) -> tuple[Vec, Scalar]:
        """Return f |cos| (N,) or (3, N) and the pdf (N,) [1/sr]."""
        ax, ay, rest = self._read(parameters)
        if self.TRANSMITS:
            wi = np.stack([wi[0], wi[1], -wi[2]])
        h = wo + wi
        density, length2 = self.distribution.density(h, ax, ay)
        density *= (wi[2] > 0) & (wo[2] > 0)
        area, shadow = self.distribution.view(wo, ax, ay)

        # D / (4 area), and F D G2 / (4 cos_o)
        pdf = density / area
        pdf *= F32(0.25)
        value = self.distribution.shadow(wi, ax, ay)
        value *= np.maximum(wo[2], LEAST_COS)
        z = np.maximum(wi[2], F32(0))
        shadow = shadow * z
        value += shadow
        np.divide(z, value, out=value)
        value *= density
        value *= F32(0.5)
        if self.model.reflectance is None:
            return value, pdf
        cos = np.minimum(np.sqrt(length2) * F32(0.5), F32(1))
        return self.model.reflectance(cos, *rest) * value, pdf

    def sample(
        self, parameters: Parameters, wo: Vec, u: Scalar, v: Scalar, w: None = None
    ) -> tuple[Vec, Vec, Scalar]:
        """Reflect at a visible normal; what falls below the surface has weight 0."""
        ax, ay, rest = self._read(parameters)
        normals: Normals = self.distribution.sample(wo, ax, ay, u, v)
        wi = normals.h
        wi *= normals.ratio
        wi -= wo
        alive = (wi[2] > 0) & (wo[2] > 0)

        # D / (4 area), and F G2 area / cos_o
        pdf = normals.density
        pdf /= normals.area
        pdf *= F32(0.25)
        pdf *= alive
        z = np.maximum(wi[2], F32(0))
        weight = _kept(normals, self.distribution.shadow(wi, ax, ay), wo[2], z)
        weight *= alive
        if self.TRANSMITS:
            np.negative(wi[2], out=wi[2])
        if self.model.reflectance is None:
            return wi, weight, pdf
        return wi, self.model.reflectance(_facet_cos(normals), *rest) * weight, pdf


@dataclass(frozen=True, eq=False)
class Refraction:
    """Microfacets that refract and, with a Fresnel model, also reflect: glass."""

    NAME: str
    PARAMETERS: dict[str, int]
    distribution: ModuleType
    model: Model | None

    IS_DELTA: ClassVar = False
    RAY_KIND: ClassVar = GLOSSY
    WEIGHT_IN_WI_Z: ClassVar = False
    TRANSMITS: ClassVar = True

    @property
    def DRAWS(self) -> int:
        """Glass needs a third number, to choose between reflection and refraction."""
        return 2 if self.model is None else 3

    def _tints(
        self, cos: Scalar, g: Scalar, parameters: Parameters
    ) -> tuple[Vec, Vec, Scalar | None]:
        """Return reflectance and transmittance, and the probability (N,) to reflect, or None."""
        if self.model is None:
            through = (g > 0).astype(F32)
            return through, through, None
        assert self.model.reflectance is not None
        *optics, reflection, transmission = parameters
        reflectance = self.model.reflectance(cos, *optics)
        transmittance = (F32(1) - reflectance) * transmission
        reflectance = reflectance * reflection
        a = reflectance[0] + reflectance[1] + reflectance[2]
        total = transmittance[0] + transmittance[1] + transmittance[2]
        total += a
        np.maximum(total, _TINY, out=total)
        a /= total
        return reflectance, transmittance, a

    def evaluate(self, parameters: Parameters, wo: Vec, wi: Vec) -> tuple[Vec, Scalar]:
        """Return f |cos| (N,) or (3, N) and the pdf (N,) [1/sr].

        Neither is 0 where no facet can send light because it would have to be seen from behind, as
        in Cycles: such light is found by sampling lamps only, but weighted as if `sample` found it,
        too.  So glass of alpha = 1 is 7 % brighter from above under a world that is sampled than
        under one that is not, and rough glass up to 16 % at a slant.
        """
        alpha = np.maximum(parameters[0], LEAST_ALPHA)
        eta = _bending(parameters[1])
        through = wi[2] < 0

        # The half vector wo + wi or wo + eta wi; its side does not matter below.
        h = np.where(through, eta, F32(1)) * wi
        h += wo
        density, length2 = self.distribution.density(h, alpha, alpha)
        np.maximum(length2, _TINY, out=length2)
        cos = dot(wo, h)
        scale = dot(wi, h)
        scale *= cos
        np.abs(cos, out=cos)
        cos /= np.sqrt(length2)
        np.minimum(cos, F32(1), out=cos)

        # Solid angle of normals to that of directions: 1/4, or eta^2 |wo.h| |wi.h| / |h|^2 for
        # unit h in the products.
        scale *= eta * eta
        scale /= length2
        scale /= length2
        np.abs(scale, out=scale)
        density *= np.where(through, scale, F32(0.25))
        density *= wo[2] > 0

        area, shadow = self.distribution.view(wo, alpha, alpha)
        pdf = density / area
        z = np.abs(wi[2])
        value = self.distribution.shadow(wi, alpha, alpha)
        value *= np.maximum(wo[2], LEAST_COS)
        shadow = shadow * z
        value += shadow
        np.divide(z, value, out=value)
        value *= density
        value *= F32(2)
        reflected, refracted, choice = self._tints(cos, _beyond(cos, eta), parameters[1:])
        if choice is None:
            value *= refracted * through
            return value, pdf * (value > 0)
        pdf *= np.where(through, F32(1) - choice, choice)
        below = value * through
        value -= below
        return _mixed(reflected, value, refracted, below), pdf

    def sample(
        self, parameters: Parameters, wo: Vec, u: Scalar, v: Scalar, w: Scalar | None = None
    ) -> tuple[Vec, Vec, Scalar]:
        """Reflect or refract at a visible normal; what ends on the wrong side has weight 0."""
        alpha = np.maximum(parameters[0], LEAST_ALPHA)
        eta = _bending(parameters[1])
        normals: Normals = self.distribution.sample(wo, alpha, alpha, u, v)
        cos = _facet_cos(normals)
        g = _beyond(cos, eta)
        reflected, refracted, choice = self._tints(cos, g, parameters[1:])

        # wo + eta wi = -bend h for unit h, without cancellation.
        bend = cos + g
        np.maximum(bend, _LEAST_SUM, out=bend)
        np.divide((eta - F32(1)) * (eta + F32(1)), bend, out=bend)
        pdf = normals.density
        pdf /= normals.area
        scale = cos * g
        scale *= eta
        scale /= bend
        scale /= bend
        bend *= F32(-1) / eta
        bend /= np.sqrt(normals.length2)
        wi = normals.h
        if choice is None:
            through = None
            wi *= bend
            wi += wo * (F32(-1) / eta)
            z = np.negative(wi[2])
            chance = scale
        else:
            assert w is not None
            through = w >= choice
            wi *= np.where(through, bend, normals.ratio)
            wi += wo * np.where(through, F32(-1) / eta, F32(-1))
            z = np.where(through, -wi[2], wi[2])
            chance = np.where(through, F32(1) - choice, choice)
            pdf *= np.where(through, scale, F32(0.25))
        pdf *= chance
        alive = (z > 0) & (wo[2] > 0)
        pdf *= alive
        np.maximum(z, F32(0), out=z)
        weight = _kept(normals, self.distribution.shadow(wi, alpha, alpha), wo[2], z)
        weight *= alive
        if through is None:
            weight *= refracted
            pdf *= refracted
            return wi, weight, pdf
        weight /= np.maximum(chance, _TINY)
        below = weight * through
        weight -= below
        return wi, _mixed(reflected, weight, refracted, below), pdf


def _mixed(a: Vec, share_a: Scalar, b: Vec, share_b: Scalar) -> Vec:
    out = a * share_a
    out += b * share_b
    return out


def _facet_cos(normals: Normals) -> Scalar:
    cos = np.sqrt(normals.length2)
    cos *= normals.ratio
    cos *= F32(0.5)
    return np.minimum(cos, F32(1), out=cos)


def _kept(normals: Normals, shadow: Scalar, cos_o: Scalar, cos_i: Scalar) -> Scalar:
    """Return G2 area / cos_o (N,), the share of sampled light that is not masked."""
    shadow *= np.maximum(cos_o, LEAST_COS)
    masked = normals.shadow
    masked *= cos_i
    masked += shadow
    area = normals.area
    area *= cos_i
    area /= masked
    area *= F32(2)
    return area


def _bending(eta: Scalar) -> Scalar:
    """Return the relative index (N,), at least 1e-4 away from 1."""
    excess = eta - F32(1)
    return F32(1) + np.copysign(np.maximum(np.abs(excess), _LEAST_BEND), excess)


def _beyond(cos: Scalar, eta: Scalar) -> Scalar:
    """Return eta times the refracted cosine (N,), 0 where reflection is total."""
    g = cos * cos
    g += (eta - F32(1)) * (eta + F32(1))
    np.maximum(g, F32(0), out=g)
    return np.sqrt(g, out=g)


TINTS = {"reflection": 3, "transmission": 3}

METALS = ("f82", "f82 film", "conductor", "conductor film")

# (distribution, anisotropic, Fresnel models of its reflection): what the nodes of Cycles make.
REFLECTIONS = (
    (ggx, False, ("unit", "dielectric", "remapped", "remapped film")),
    (ggx, True, ("unit", "remapped", "remapped film")),
    *((ggx, stretched, METALS) for stretched in (False, True)),
    *((beckmann, stretched, ("unit", *METALS)) for stretched in (False, True)),
)

# Glass, and glass with a film on it
GLASSES = {"glass": "remapped", "glass film": "remapped film"}


def _types() -> Iterator[Reflection | Refraction]:
    for distribution, anisotropic, names in REFLECTIONS:
        alpha = {"alpha_x": 1, "alpha_y": 1} if anisotropic else {"alpha": 1}
        kind = f"{distribution.NAME} anisotropic" if anisotropic else distribution.NAME
        for name in names:
            model = MODELS[name]
            parameters = {**alpha, **model.parameters}
            yield Reflection(f"{kind} reflection {name}", parameters, distribution, model)
    for distribution in (ggx, beckmann):
        for glass, name in GLASSES.items():
            model = MODELS[name]
            parameters = {"alpha": 1, **model.parameters, **TINTS}
            yield Refraction(f"{distribution.NAME} {glass}", parameters, distribution, model)
        yield Refraction(
            f"{distribution.NAME} refraction", {"alpha": 1, "eta": 1}, distribution, None
        )
    yield Reflection("ggx thin", {"alpha": 1}, ggx, MODELS["unit"], TRANSMITS=True)


TYPES = tuple(_types())
