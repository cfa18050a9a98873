"""names -> scenes.  Small scenes that between them use what can go wrong with numbers.

Each is about as large as 1 m and near the origin; `transforms` takes it from there.
"""

import numpy as np

from penumbra.core import Link, Material

from ..support import scenes as s

SIZE = 24


def overview(eye=(0.0, -3.2, 1.1), target=(0.0, 0.0, 0.1), **more):
    return s.camera(eye, target, size=SIZE, **{"clip_start": 0.01, **more})


def floor(material=None):
    return s.put(s.quad((2, 0, 0), (0, 2, 0), name="Floor"), material or s.diffuse(0.7))


def ball(material, levels=3, radius=0.5, centre=(0.0, 0.0, 0.6), smooth=True):
    shape = s.sphere(radius, levels, smooth, name="Ball")
    return s.put(shape, material, to_world=s.affine(1.0, centre))


def lamp():
    return s.area((1.0, -0.8, 2.0), (0, 0, 0.3), radiance=8.0, size=(0.7, 0.5))


def rough(roughness=0.3, colour=0.8):
    """A rough metal."""
    sockets = {"Color": s.colour(colour), "Roughness": roughness}
    return Material("Rough", s.node("BsdfAnisotropic", **sockets))


def frosted(roughness=0.2, ior=1.45):
    """Rough glass."""
    return Material("Frosted", s.node("BsdfGlass", Color=s.colour(1), IOR=ior, Roughness=roughness))


def principled(**sockets):
    """Blender's own surface."""
    named = {"Base Color": s.colour(0.6), "IOR": 1.5, "Roughness": 0.3}
    named.update({key.replace("_", " "): value for key, value in sockets.items()})
    return Material("Principled", s.node("BsdfPrincipled", **named))


def leaf(fac=0.5):
    """Half matte, half transparent."""
    clear = s.node("BsdfTransparent", Color=s.colour((0.9, 0.7, 0.5)))
    inputs = {"Shader": Link(clear, "BSDF"), "Shader_001": Link(s.diffuse(0.6).surface, "BSDF")}
    return Material("Leaf", s.Node("MixShader", "", {**inputs, "Fac": fac}))


def sticks():
    """Needles: a strip cut into triangles a thousand times as long as wide."""
    x = np.linspace(-1, 1, 65)
    corners = [(a, y, 0.2 + 0.1 * y) for a in x for y in (-1.0, 1.0)]
    faces = [
        f
        for k in range(64)
        for f in ((2 * k, 2 * k + 2, 2 * k + 1), (2 * k + 1, 2 * k + 2, 2 * k + 3))
    ]
    return s.mesh(corners, faces, name="Needles")


def boxes(material):
    """Two boxes that share a face."""
    box = s.box(0.4)
    return (
        s.put(box, material, to_world=s.affine(1.0, (-0.4, 0, 0.5)), name="Left"),
        s.put(box, material, to_world=s.affine(1.0, (0.4, 0, 0.5)), name="Right"),
    )


# name -> (camera, things, settings)
SCENES = {
    "matte": lambda: (overview(), (floor(), ball(s.diffuse(0.6)), lamp()), {}),
    "facets": lambda: (overview(), (floor(), ball(s.diffuse(0.6), 1, smooth=False), lamp()), {}),
    "sun": lambda: (
        overview(),
        (floor(), ball(s.diffuse(0.6)), s.sun((1, -1, 2), 3.0, angle=0.1)),
        {},
    ),
    "metal": lambda: (overview(), (floor(), ball(rough()), lamp()), {}),
    "mirror": lambda: (overview(), (floor(), ball(s.mirror()), lamp(), s.world(0.3)), {}),
    "glass": lambda: (overview(), (floor(), ball(s.glass()), s.world(1.0)), {}),
    "frosted": lambda: (overview(), (floor(), ball(frosted()), s.world(1.0)), {}),
    "principled": lambda: (
        overview(),
        (floor(), ball(principled(Coat_Weight=0.5)), lamp(), s.world(0.2)),
        {},
    ),
    "leaves": lambda: (
        overview(),
        (
            floor(),
            *(
                s.put(
                    s.quad((0.5, 0, 0.2), (0, 0.5, 0.1), (0, 0, 0.3 + 0.2 * k)),
                    leaf(),
                    name=f"Leaf {k}",
                )
                for k in range(3)
            ),
            s.sun((0.3, -0.2, 1), 2.0, angle=0.05),
        ),
        {},
    ),
    "needles": lambda: (overview(), (s.put(sticks(), s.diffuse(0.7)), lamp()), {}),
    "touching": lambda: (overview(), (floor(), *boxes(s.glass(1.3)), s.world(1.0)), {}),
    "nested": lambda: (
        overview(),
        (floor(), ball(s.glass(1.5)), ball(s.glass(1.33 / 1.5), radius=0.35), s.world(1.0)),
        {},
    ),
    "glow": lambda: (overview(), (floor(), ball(s.emission(2.0), 2, 0.2)), {}),
    "points": lambda: (
        overview(),
        (
            floor(),
            ball(s.diffuse(0.5)),
            s.point((1, -1, 1.5), 2.0),
            s.spot((-1, -1, 2), intensity=3.0),
        ),
        {},
    ),
    "ortho": lambda: (
        s.orthographic((0.3, -3.0, 1.2), (0, 0, 0.3), size=SIZE, scale=2.4, clip_start=0.01),
        (floor(), ball(s.diffuse(0.6)), lamp()),
        {},
    ),
}


def build(name):
    """Return the `Scene` of a name, and its settings."""
    view, things, settings = SCENES[name]()
    return s.scene(view, *things), settings
