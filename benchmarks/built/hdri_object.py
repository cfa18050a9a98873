"""numbers -> a toy of plastic and metal on a plane, lit by a picture of the sky.

The picture (equirectangular, 1024 x 512, OpenEXR) is computed: a clear sky that grows pale
towards the horizon, clouds of fractal noise that the sun shines through, a dark ground, and a
sun of one degree: seven pixels, 25,000 times as bright as the sky, with half of the light that
falls on the plane. The metals are rough enough that what they throw on the plane converges.
"""

import math
import os
from pathlib import Path

import bpy
import numpy as np

from ...examples._stage import box, camera, cone, put
from . import fingerprint
from .shapes import begin, lathe, metal, plastic, rounded, soft_box, suzanne

WIDTH, HEIGHT = 1024, 512
SUN = (math.radians(-140), math.radians(38))  # azimuth from +x to +y, elevation
SUN_RADIUS, SUN_LIGHT = math.radians(0.5), 3.0  # [rad], irradiance it gives
CACHE = Path(__file__).resolve().parent.parent / "cache"


def build():
    """Make the toy in an empty file, and the sky's picture if it is not there."""
    begin(360, 264, exposure=-0.2)
    _world(_picture())
    _toy()
    ground = plastic("Ground", (0.30, 0.28, 0.25), 0.6)
    put("Ground", box(400, 400, 0.1), ground, at=(0, 0, -0.05))
    camera(at=(2.4, -5.4, 1.15), to=(0.05, 0, 1.12), lens=46)


def _world(path):
    tree = bpy.context.scene.world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = bpy.data.images.load(str(path))
    texture.image.colorspace_settings.name = "Linear Rec.709"
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])


def _toy():
    red, white = plastic("Red", (0.65, 0.04, 0.03)), plastic("White", (0.8, 0.8, 0.78), 0.35)
    blue, black = plastic("Blue", (0.03, 0.12, 0.40), 0.25), plastic("Black", (0.02, 0.02, 0.02))
    steel, gold = metal("Steel", (0.70, 0.71, 0.73), 0.35), metal("Gold", (1.0, 0.70, 0.28), 0.3)
    base = [(0, 0), (1.0, 0), (1.05, 0.04), (1.05, 0.14), (0.98, 0.2), (0, 0.2)]
    put("Base", lathe(rounded(base), 128), steel)
    body = [(0, 0), (0.45, 0), (0.62, 0.25), (0.5, 0.62), (0.3, 0.75), (0, 0.78)]
    put("Body", lathe(rounded(body), 96), red, at=(0, 0, 0.2))
    put("Belt", lathe(rounded([(0.5, 0), (0.62, 0.02), (0.62, 0.1), (0.5, 0.12)]), 96), gold,
        at=(0, 0, 0.42))  # fmt: skip
    suzanne("Head", white, (0, 0, 1.42), (-8, 0, 18), 0.58, levels=2)
    put("Hat", lathe([(0.3, 0), (0.55, 0.0), (0.3, 0.03), (0.27, 0.33), (0, 0.34)], 96), blue,
        at=(0.03, 0.14, 1.88), turn=(-14, 10, 0))  # fmt: skip
    for x in (-0.75, 0.75):
        put("Ball", lathe(rounded([(0, 0), (0.26, 0), (0.26, 0.48), (0, 0.48)], 24), 64),
            gold if x < 0 else steel, at=(x, -0.42, 0.2))  # fmt: skip
    put("Cube", soft_box(0.42, 0.42, 0.42, 0.05, 4), blue, (1.45, -0.55, 0.211), (0, 0, 25))
    put("Cone", cone(0.26, 0.0, 0.6, 64), black, at=(-1.5, -0.35, 0.001))


def _picture():
    """Return the path of the sky's picture; write it whole or not at all."""
    path = CACHE / f"sky-{fingerprint('hdri_object').hex()[:16]}.exr"
    if not path.exists():
        import OpenImageIO as oiio

        CACHE.mkdir(exist_ok=True)
        partial = path.with_name(f"{os.getpid()}.partial.exr")
        spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "float")
        spec.attribute("compression", "zip")
        output = oiio.ImageOutput.create(str(partial))
        if not output or not output.open(str(partial), spec) or not output.write_image(sky()):
            raise OSError(f"{partial} cannot be written: {oiio.geterror()}")
        output.close()
        partial.replace(path)
    return path


def sky():
    """Return the radiance (512, 1024, 3) of sky, clouds, sun and ground; the top row is up."""
    # Directions of the pixels; the middle of the picture looks along +x, its left half to +y.
    elevation = math.pi * (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT)[:, None]
    azimuth = 2 * math.pi * (0.5 - (np.arange(WIDTH) + 0.5) / WIDTH)[None]
    to = np.stack(np.broadcast_arrays(
        np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)
    ))  # fmt: skip
    sun = (math.cos(SUN[1]) * math.cos(SUN[0]), math.cos(SUN[1]) * math.sin(SUN[0]),
           math.sin(SUN[1]))  # fmt: skip
    cosine = np.tensordot(sun, to, 1)

    # Blue above, pale at the horizon, brighter around the sun.
    up = np.clip(to[2], 0, 1)
    haze = np.exp(-4.5 * up)[..., None]
    picture = (1 - haze) * (0.16, 0.30, 0.62) + haze * (0.80, 0.78, 0.74)
    glare = 0.9 * np.exp((cosine - 1) * 14) + 6.0 * np.exp((cosine - 1) * 400)
    picture += glare[..., None] * (1.0, 0.88, 0.70)

    # Clouds on a plane above, thinner at the horizon; their edges towards the sun shine.
    plane = to[:2] / (up + 0.12)
    cover = np.clip((_noise(plane * 1.7) - 0.50) * 5.5, 0, 1) * np.clip(up * 7, 0, 1)
    thick = np.clip((_noise(plane * 1.7 + 0.11) - 0.50) * 4, 0, 1)
    shine = 1.15 - 0.75 * thick + 2.5 * np.exp((cosine - 1) * 9) * (1 - thick)
    picture += cover[..., None] * (shine[..., None] * (1.0, 0.97, 0.93) - picture)

    # The ground, and the sun over all.
    soil = 0.14 + 0.10 * _noise(to[:2] / (np.abs(to[2]) + 0.02) * 0.5)
    below = np.clip(-to[2] * 60 + 0.5, 0, 1)[..., None]
    picture += below * (soil[..., None] * (1.0, 0.86, 0.68) - picture)
    disk = cosine > math.cos(SUN_RADIUS)
    solid = (np.cos(elevation) * disk).sum() * (math.pi / HEIGHT) * (2 * math.pi / WIDTH)
    picture += disk[..., None] * (SUN_LIGHT / solid) * np.array([1.0, 0.90, 0.76])
    return np.ascontiguousarray(picture, np.float32)


def _noise(at):
    """Return fractal value noise in 0..1 at the points (2, H, W)."""
    lattice = np.random.default_rng(5).random((256, 256))
    total, weight = 0.0, 0.0
    for octave in range(6):
        x, y = at * 2.0**octave + 37.3 * octave
        i, j = np.floor(x).astype(int), np.floor(y).astype(int)
        u, v = x - i, y - j
        u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
        corner = [[lattice[(i + a) % 256, (j + b) % 256] for b in (0, 1)] for a in (0, 1)]
        low = corner[0][0] * (1 - v) + corner[0][1] * v
        high = corner[1][0] * (1 - v) + corner[1][1] * v
        total += 0.55**octave * (low * (1 - u) + high * u)
        weight += 0.55**octave
    return total / weight
