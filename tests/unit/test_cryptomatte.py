"""Cryptomattes: names, and how pixels are shared out among them."""

from dataclasses import replace

import numpy as np
import pytest

from penumbra.core.film.cryptomatte import as_float, hash_of, metadata
from penumbra.core.layer import MATTES, Layer
from tests.support.passes import from_above, half_clear, shown
from tests.support.scenes import diffuse, orthographic, put, quad

# As Blender 5.2 writes them
HASHES = {
    "": 0,
    "Cube": 0xA8FCE865,
    "Light": 0xC77D43E5,
    "default_surface": 0x78D05529,
    "Material": 0x3913209D,
    "object": 0x055EC73D,
}


@pytest.mark.parametrize("name", HASHES)
def test_names_have_blenders_hashes(name):
    assert hash_of(name) == HASHES[name]


def test_hashes_become_ordinary_floats():
    for number in (0, 0x7F800000, 0xFF800001, 0x80000000, 0xFFFFFFFF, 0x3F800000):
        assert np.isfinite(as_float(number))
        assert as_float(number) != 0
        assert abs(as_float(number)) >= np.finfo(np.float32).tiny
    assert as_float(0x3F800000) == 1


def test_metadata_are_those_of_the_specification():
    found = metadata("ViewLayer.CryptoObject", ["Cube", "Cube", 'Quoted "ä"'])
    assert found["cryptomatte/542cafa/name"] == "ViewLayer.CryptoObject"
    assert found["cryptomatte/542cafa/hash"] == "MurmurHash3_32"
    assert found["cryptomatte/542cafa/conversion"] == "uint32_to_float32"
    manifest = found["cryptomatte/542cafa/manifest"]
    assert manifest.startswith('{"Cube":"a8fce865","Quoted \\"ä\\"":"')


def parts_of(found, kind, y, x):
    """Return {hash: weight} of a pixel."""
    pairs = np.concatenate([found[f"{kind}{i:02}"][y, x].reshape(2, 2) for i in range(3)])
    return {float(key): float(weight) for key, weight in pairs if weight > 0}


def test_cryptomattes_share_out_each_pixel():
    veil = put(quad((9, 0, 0), (0, 9, 0), (0, 0, 4)), half_clear(0.25), name="Veil")
    left = put(quad((5, 0, 0), (0, 9, 0), (-5, 0, 2)), diffuse(0.5), name="Left")
    low = replace(put(quad((9, 0, 0), (0, 9, 0)), name="Low"), asset="Left")
    found = shown(Layer(mattes=MATTES), *from_above(veil, left, low), samples=16)

    def of(name):
        return float(as_float(hash_of(name)))

    assert parts_of(found, "CryptoObject", 3, 1) == pytest.approx(
        {of("Veil"): 0.75, of("Left"): 0.25}
    )
    assert parts_of(found, "CryptoObject", 3, 6) == pytest.approx(
        {of("Veil"): 0.75, of("Low"): 0.25}
    )
    assert parts_of(found, "CryptoAsset", 3, 6) == pytest.approx(
        {of("Veil"): 0.75, of("Left"): 0.25}
    )
    assert parts_of(found, "CryptoMaterial", 3, 6) == pytest.approx(
        {of("Veil"): 0.75, of("default_surface"): 0.25}
    )
    first = found["CryptoObject00"]
    assert (first[..., 1] >= first[..., 3]).all()


def test_cryptomattes_of_few_levels_keep_the_largest_parts():
    strips = [
        put(quad((w / 2, 0, 0), (0, 9, 0), (x + w / 2, 0, 1)), diffuse(0.5), name=f"{x}")
        for x, w in ((-0.25, 0.05), (-0.2, 0.15), (-0.05, 0.2), (0.15, 0.1))
    ]
    view = orthographic((0, 0, 10), size=1, scale=0.5)
    layer = Layer(mattes=("CryptoObject",), levels=2)
    found = shown(layer, view, *strips, samples=4096)
    assert set(found) == {"Combined", "CryptoObject00"}
    key, weight, other, less = found["CryptoObject00"][0, 0]
    assert key == as_float(hash_of("-0.05"))
    assert other == as_float(hash_of("-0.2"))
    np.testing.assert_allclose((weight, less), (0.4, 0.3), atol=0.01)
