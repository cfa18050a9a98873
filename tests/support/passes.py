"""layers, scenes -> passes.  What the tests of passes share."""

from dataclasses import replace

from penumbra.core import Material, compile_plan, render

from .scenes import (
    DEFAULTS,
    affine,
    camera,
    diffuse,
    emission,
    glass,
    node,
    orthographic,
    point,
    put,
    quad,
    scene,
    shader,
    sphere,
    world,
)


def rendered(layer, view, *things, threads=1, film_transparent=False, **settings):
    described = scene(view, *things, film_transparent=film_transparent, layer=layer)
    return render(compile_plan(described, replace(DEFAULTS, **settings)), threads=threads)


def shown(layer, view, *things, **settings):
    """Render; return the passes (H, W, C) by name, with Combined."""
    found = rendered(layer, view, *things, **settings)
    return {
        "Combined": found.combined(),
        **{each.name: pixels for each, pixels in found.passes()},
        **dict(found.mattes()),
    }


def half_clear(share=0.5, colour=(0.2, 0.4, 0.6)):
    clear = node("BsdfTransparent", Color=(1.0, 1.0, 1.0))
    solid = node("BsdfDiffuse", Color=colour)
    return Material("Veil", shader(clear, solid, "MixShader", 1 - share))


def from_above(*things, **more):
    return orthographic((0, 0, 10), size=8, scale=2.0, **more), *things


def every_kind_of_surface(size=20):
    coated = Material(
        "Paint",
        node(
            "BsdfPrincipled",
            Base_Color=(0.8, 0.2, 0.1),
            Metallic=0.3,
            Roughness=0.4,
            Coat_Weight=0.5,
            Transmission_Weight=0.3,
            Sheen_Weight=0.2,
        ),
    )
    return (
        camera((5, -5, 4), (0, 0, 0.5), size=size),
        put(quad((4, 0, 0), (0, 4, 0)), diffuse((0.5, 0.6, 0.7)), name="Floor"),
        put(sphere(1.0), coated, to_world=affine(1, (0, 0, 1.01)), name="Ball"),
        put(sphere(0.6), glass(), to_world=affine(1, (1.5, -1, 0.61)), name="Glass"),
        put(quad((1, 0, 0), (0, 0, 1), (-1.5, -1, 1)), half_clear(), name="Veil"),
        put(quad((1, 0, 0), (0, 1, 0), (-1, 2, 2)), emission((3, 2, 1)), name="Glow"),
        point((2, -2, 4), 50, radius=0.3),
        world((0.2, 0.3, 0.5)),
    )
