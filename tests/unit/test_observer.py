"""core.shading.black_body, nodes Blackbody and Wavelength -> the colours that Cycles gives them."""

import numpy as np
import pytest

from penumbra.core.arrays import F32
from penumbra.core.shading.black_body import seen_black_body
from penumbra.core.shading.graph import Graph
from penumbra.core.shading.nodes import NODES
from tests.support import scenes as s

# Measured with Cycles 5.2: temperature [K] -> linear Rec. 709
BLACK_BODIES = {
    800.0: (5.413, 0.0, 0.0),
    1500.0: (3.2643, 0.4340, 0.0),
    3000.0: (1.7708, 0.8443, 0.2722),
    6500.0: (1.0426, 0.9841, 1.0353),
    20000.0: (0.8263, 0.9945, 1.5663),
}


def colour_of(kind, socket, number):
    node = s.node(kind, **{socket: number})
    made = NODES[kind](Graph("Light 'L'", NODES), node, "Color")
    return made.constant[:, 0]


@pytest.mark.parametrize("temperature", BLACK_BODIES)
def test_a_black_body_has_cycles_colour(temperature):
    expected = np.array(BLACK_BODIES[temperature])
    found = colour_of("Blackbody", "Temperature", temperature)
    np.testing.assert_allclose(found, expected, atol=1e-3 * expected.max())


def test_black_bodies_have_luminance_1():
    np.testing.assert_allclose(seen_black_body(F32([500, 2000, 9000, 50000]))[1], 1, rtol=1e-6)


def test_light_that_nobody_sees_has_no_colour():
    for wavelength in (0.0, 374.9, 780.0, 1e6):
        assert colour_of("Wavelength", "Wavelength", wavelength).max() == 0


@pytest.mark.parametrize(("wavelength", "channel"), [(450.0, 2), (530.0, 1), (620.0, 0)])
def test_wavelengths_are_blue_green_and_red(wavelength, channel):
    found = colour_of("Wavelength", "Wavelength", wavelength)
    assert found.argmax() == channel
    assert 0.3 < found.max() <= 1.01
