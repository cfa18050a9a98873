"""closure types -> what to test them with.  One row, or more, for every closure of the registry."""

from dataclasses import dataclass

import numpy as np

from penumbra.core.bsdf import REGISTRY


@dataclass(frozen=True)
class Case:
    """A closure with parameters, and what is known of it.

    albedo: the share of light it sends back whatever the direction, None if that depends.
    """

    closure: str
    parameters: tuple[float, ...] = ()
    albedo: float | None = None

    @property
    def module(self):
        return REGISTRY[self.closure]

    def columns(self, count):
        """The parameters (P, count) of so many points."""
        return np.repeat(np.array(self.parameters, np.float32)[:, None], count, axis=1)

    def __str__(self):
        return f"{self.closure}({', '.join(f'{x:g}' for x in self.parameters)})"


CASES = (
    Case("diffuse", (), 1.0),
    Case("mirror", (1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1.0),
    Case("mirror", (0.9, 0.5, 0.1, 1.0, 0.9, 0.3)),
    Case("glass", (1.5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1.0),
    Case("glass", (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1.0),
    Case("glass", (0.7, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1.0),
    Case("glass", (2.4, 0.9, 0.5, 0.0, 0.2, 0.6, 1.0)),
    Case("glass", (1.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0.0),
    Case("glass", (1e-5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1.0),
    Case("refraction", (1.5,)),
    Case("refraction", (1.0,), 1.0),
    Case("refraction", (0.7,)),
)

CONTINUOUS = tuple(case for case in CASES if not case.module.IS_DELTA)
DELTA = tuple(case for case in CASES if case.module.IS_DELTA)
