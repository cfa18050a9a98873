"""closure types -> what to test them with.  One row, or more, for every closure of the registry."""

from dataclasses import dataclass, field

import numpy as np

from penumbra.core.bsdf import REGISTRY, oren_nayar


@dataclass(frozen=True)
class Case:
    """A closure with parameters by name, and what is known of it.

    A colour may be given as a number, which is grey.  albedo: the share of light it sends back
    whatever the direction, None if that depends; most: what it sends back at most.  reciprocal:
    whether f is the same with the directions exchanged; edge: whether its pdf ends at an edge.
    """

    closure: str
    parameters: dict[str, float | tuple[float, float, float]] = field(default_factory=dict)
    albedo: float | None = None
    most: float = 1.0
    reciprocal: bool = True
    edge: bool = False

    @property
    def module(self):
        return REGISTRY[self.closure]

    @property
    def eta(self):
        """The relative index, 1 if there is none."""
        return self.parameters.get("eta", 1.0)

    def constants(self, count):
        """The parameters of so many points, all in one column but the thickness of a film.

        A film that is the same everywhere is interpolated, which has its own tests.
        """
        names = zip(self.module.PARAMETERS, self.columns(), self.columns(count), strict=True)
        return tuple(many if name == "thickness" else one for name, one, many in names)

    @property
    def turned(self):
        """The parameters that are others where light comes from the other side of the surface."""
        eta, found = self.eta, {}
        if "eta" in self.parameters:
            found["eta"] = 1 / eta
        if self.module.TRANSMITS and "film_ior" in self.parameters:
            # Thickness counts in wavelengths on the viewer's side.
            found["film_ior"] = self.parameters["film_ior"] / eta
            found["thickness"] = self.parameters["thickness"] * eta
        return found

    def possible(self, wo, wi):
        """Tell to which wi (n,) a facet can bend light: on others evaluate answers as Cycles does.

        The facet's normal, -(wo + eta wi) or its opposite, and wo are on one side, wi is not.
        """
        if not self.module.TRANSMITS or "eta" not in self.parameters:
            return np.ones(wi.shape[1], bool)
        # The closure itself moves the index away from 1 by as much.
        eta = 1 + np.copysign(max(abs(self.eta - 1), 1e-4), self.eta - 1)
        h = (wo + eta * wi.astype(float)) * np.sign(1 - eta)
        bent = (h[2] > 0) & ((wo * h).sum(axis=0) > 0) & ((wi * h).sum(axis=0) < 0)
        return bent | (wi[2] > 0)

    def columns(self, count=1, **changes):
        """The parameters of so many points, in the closure's order."""
        given = {**self.parameters, **changes}
        return tuple(
            np.repeat(np.full(rows, given[name], np.float32)[:, None], count, axis=1)
            if rows == 3
            else np.full(count, given[name], np.float32)
            for name, rows in self.module.PARAMETERS.items()
        )

    def __str__(self):
        def show(value):
            return "/".join(f"{x:g}" for x in value) if isinstance(value, tuple) else f"{value:g}"

        inside = ", ".join(f"{name} {show(value)}" for name, value in self.parameters.items())
        return f"{self.closure}({inside})"


WHITE = {"reflection": 1, "transmission": 1}
TINTED = {"reflection": (0.9, 0.5, 0.0), "transmission": (0.2, 0.6, 1.0)}
GOLD = {"f0": (1.0, 0.71, 0.29), "b": (0.5, 2.0, 6.0)}
COPPER = {"n": (0.2, 0.92, 1.1), "k": (3.91, 2.45, 2.14)}
ALPHAS = (1e-4, 0.01, 0.3, 1.0)
BRUSHED = ((0.5, 0.05), (0.02, 0.2), (1.0, 0.3))

COATED = {"eta": 1.5, "f0": (0.08, 0.04, 0.0)}

# The fit that Cycles takes for Beckmann's masking may send back a little more than there was.
FIT = 1.004


def glass(eta, **tints):
    """A dielectric's own curve."""
    return {"eta": eta, "f0": ((eta - 1) / (eta + 1)) ** 2, **(tints or WHITE)}


def rough(roughness, colour):
    """Rough matte closures."""
    colour = np.full(3, colour, np.float32)[:, None]
    values = oren_nayar.prepare(np.float32([roughness]), colour)
    numbers = (value[:, 0].tolist() if value.ndim > 1 else value.tolist() for value in values)
    return {
        name: tuple(each) if len(each) == 3 else each[0]
        for name, each in zip(oren_nayar.PARAMETERS, numbers, strict=True)
    }


SOAP = {"thickness": 400.0, "film_ior": 1.33}
OXIDE = {"thickness": 150.0, "film_ior": 2.2}
SHEENS = ((0.3, -0.15), (0.9, -0.01), (0.05, -0.1), (0.014, 0.0006))
TOONS = ("toon diffuse", "toon glossy")
CONES = ((0.5, 0.0), (0.4, 0.3), (0.0, 0.0), (1.0, 1.0), (0.02, 0.01))

CASES = (
    Case("diffuse", {}, 1.0),
    *(Case("ggx reflection unit", {"alpha": alpha}) for alpha in ALPHAS),
    Case("ggx reflection dielectric", {"alpha": 0.2, "eta": 1.5}),
    Case("ggx reflection dielectric", {"alpha": 0.2, "eta": 0.7}),
    Case("ggx reflection remapped", {"alpha": 0.3, "eta": 1.5, "f0": (0.08, 0.04, 0.0)}),
    Case("ggx reflection remapped", {"alpha": 0.01, "eta": 1.0001, "f0": 0.0}),
    Case("ggx reflection f82", {"alpha": 0.3, **GOLD}),
    Case("ggx reflection f82", {"alpha": 1.0, "f0": 0.9, "b": 0.0}),
    Case("ggx reflection conductor", {"alpha": 0.2, **COPPER}),
    *(Case("ggx anisotropic reflection unit", {"alpha_x": x, "alpha_y": y}) for x, y in BRUSHED),
    Case(
        "ggx anisotropic reflection remapped",
        {"alpha_x": 0.1, "alpha_y": 0.4, "eta": 1.5, "f0": (0.08, 0.04, 0.0)},
    ),
    Case("ggx anisotropic reflection f82", {"alpha_x": 0.1, "alpha_y": 0.4, **GOLD}),
    Case("ggx anisotropic reflection conductor", {"alpha_x": 0.4, "alpha_y": 0.1, **COPPER}),
    *(Case("beckmann reflection unit", {"alpha": alpha}, most=FIT) for alpha in ALPHAS),
    Case("beckmann reflection f82", {"alpha": 0.3, **GOLD}),
    Case("beckmann reflection conductor", {"alpha": 0.3, **COPPER}),
    *(
        Case("beckmann anisotropic reflection unit", {"alpha_x": x, "alpha_y": y}, most=FIT)
        for x, y in BRUSHED
    ),
    Case("beckmann anisotropic reflection f82", {"alpha_x": 0.1, "alpha_y": 0.4, **GOLD}),
    Case("beckmann anisotropic reflection conductor", {"alpha_x": 0.4, "alpha_y": 0.1, **COPPER}),
    *(Case("ggx glass", {"alpha": alpha, **glass(1.5)}) for alpha in ALPHAS),
    *(Case("ggx glass", {"alpha": 0.3, **glass(eta)}) for eta in (1.0001, 1 / 1.5, 2.4)),
    Case("ggx glass", {"alpha": 0.1, **glass(0.7, **TINTED)}),
    Case("ggx glass", {"alpha": 0.2, "eta": 1.5, "f0": (0.2, 0.04, 0.0), **TINTED}),
    Case("ggx glass", {"alpha": 0.2, **glass(1.5, reflection=0, transmission=0)}, 0.0),
    *(Case("beckmann glass", {"alpha": alpha, **glass(1.5)}, most=FIT) for alpha in ALPHAS),
    Case("beckmann glass", {"alpha": 0.3, **glass(0.7, **TINTED)}),
    *(Case("ggx refraction", {"alpha": alpha, "eta": 1.5}) for alpha in ALPHAS),
    *(Case("ggx refraction", {"alpha": 0.3, "eta": eta}) for eta in (1.0001, 0.7, 2.4)),
    Case("beckmann refraction", {"alpha": 0.3, "eta": 1.5}, most=FIT),
    Case("beckmann refraction", {"alpha": 0.1, "eta": 0.7}, most=FIT),
    *(Case("ggx thin", {"alpha": alpha}) for alpha in (0.01, 0.5)),
    Case("smooth reflection unit", {}, 1.0),
    Case("smooth reflection dielectric", {"eta": 1.5}),
    Case("smooth reflection remapped", {"eta": 1.5, "f0": (0.08, 0.04, 0.0)}),
    Case("smooth reflection f82", GOLD),
    Case("smooth reflection f82", {"f0": 1.0, "b": 0.0}, 1.0),
    Case("smooth reflection conductor", COPPER),
    *(Case("smooth glass", glass(eta), 1.0) for eta in (1.5, 1.0, 0.7, 1e-5)),
    Case("smooth glass", glass(2.4, **TINTED)),
    Case("smooth glass", glass(1.5, reflection=0, transmission=0), 0.0),
    Case("smooth refraction", {"eta": 1.5}, 1.0),
    Case("smooth refraction", {"eta": 1.0}, 1.0),
    Case("smooth refraction", {"eta": 0.7}),
    Case("smooth thin", {}, 1.0),
    Case("translucent", {}, 1.0),
    Case("oren nayar", rough(0.0, 1.0), 1.0),
    Case("oren nayar", rough(0.5, (1.0, 0.5, 0.0))),
    Case("oren nayar", rough(1.0, 1.0)),
    Case("rough translucent", rough(0.3, (0.0, 0.5, 0.9))),
    Case("rough translucent", rough(1.0, 1.0)),
    *(Case("sheen", {"a": a, "b": b}, 1.0, reciprocal=False) for a, b in SHEENS),
    *(Case("velvet", {"sigma": sigma}) for sigma in (0.05, 0.1, 0.3, 1.0)),
    *(
        Case(name, {"size": size, "smooth": smooth}, reciprocal=False, edge=True)
        for name in TOONS
        for size, smooth in CONES
    ),
    *(Case("ashikhmin shirley", {"alpha_x": alpha, "alpha_y": alpha}) for alpha in ALPHAS),
    *(Case("ashikhmin shirley", {"alpha_x": x, "alpha_y": y}) for x, y in BRUSHED),
    Case("transparent", {}, 1.0),
    Case("ggx reflection remapped film", {"alpha": 0.3, **COATED, **SOAP}),
    Case("ggx reflection remapped film", {"alpha": 0.01, **COATED, **OXIDE}),
    Case(
        "ggx anisotropic reflection remapped film",
        {"alpha_x": 0.1, "alpha_y": 0.4, **COATED, **SOAP},
    ),
    *(
        Case(f"{kind} reflection {metal} film", {**alphas, **optics, **film})
        for kind, alphas, film in (
            ("ggx", {"alpha": 0.3}, SOAP),
            ("ggx anisotropic", {"alpha_x": 0.1, "alpha_y": 0.4}, OXIDE),
            ("beckmann", {"alpha": 0.1}, OXIDE),
            ("beckmann anisotropic", {"alpha_x": 0.4, "alpha_y": 0.1}, SOAP),
        )
        for metal, optics in (("f82", GOLD), ("conductor", COPPER))
    ),
    *(Case("ggx glass film", {"alpha": 0.3, **glass(eta), **SOAP}) for eta in (1.5, 1 / 1.5)),
    Case("ggx glass film", {"alpha": 0.1, **glass(1.5, **TINTED), **OXIDE}),
    Case("beckmann glass film", {"alpha": 0.3, **glass(1.5), **SOAP}),
    Case("smooth reflection remapped film", {**COATED, **SOAP}),
    Case("smooth reflection f82 film", {**GOLD, **SOAP}),
    Case("smooth reflection conductor film", {**COPPER, **OXIDE}),
    Case("smooth glass film", {**glass(1.5), **SOAP}, 1.0),
    Case("smooth glass film", {**glass(0.7, **TINTED), **OXIDE}),
)

CONTINUOUS = tuple(case for case in CASES if not case.module.IS_DELTA)
DELTA = tuple(case for case in CASES if case.module.IS_DELTA)
