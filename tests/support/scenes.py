"""a few words -> Scene.  Builders of the small scenes that the tests render without Blender."""

from dataclasses import replace

import numpy as np

from penumbra.core import (
    Camera,
    Instance,
    Lamp,
    Link,
    Material,
    Mesh,
    Node,
    Scene,
    Settings,
    World,
    compile_plan,
    render,
)

BLACK = Material("Black")  # neither scatters nor emits


# --- Materials ----------------------------------------------------------------------------------


def colour(value):
    return tuple(value) if np.ndim(value) else (float(value),) * 3


def node(kind, name="", **inputs):
    """A node; keywords are sockets, with _ for a space in their names."""
    return Node(kind, name, {key.replace("_", " "): value for key, value in inputs.items()})


def shader(first, second, kind="AddShader", fac=0.5):
    """The sum or, with kind='MixShader', the mixture of two shader nodes."""
    inputs = {"Shader": Link(first, "BSDF"), "Shader_001": Link(second, "BSDF"), "Fac": fac}
    return Node(kind, "", inputs)


def diffuse(albedo=1.0):
    return Material("Matte", node("BsdfDiffuse", Color=colour(albedo)))


def emission(radiance=1.0):
    return Material("Glow", node("Emission", Color=colour(radiance), Strength=1.0))


def glowing(albedo, radiance):
    """A matte surface that also glows."""
    return Material("Lime", shader(diffuse(albedo).surface, emission(radiance).surface))


def mirror(reflectance=1.0):
    return Material("Mirror", node("BsdfAnisotropic", Color=colour(reflectance), Roughness=0.0))


def glass(ior=1.5, tint=1.0):
    return Material("Glass", node("BsdfGlass", Color=colour(tint), IOR=ior, Roughness=0.0))


def refraction(ior=1.5, tint=1.0):
    return Material("Lens", node("BsdfRefraction", Color=colour(tint), IOR=ior, Roughness=0.0))


def world(radiance=1.0):
    return World("World", node("Background", Color=colour(radiance), Strength=1.0))


# --- Places -------------------------------------------------------------------------------------


def affine(linear=None, shift=(0.0, 0.0, 0.0)):
    """A (3, 4) matrix from a scale, a diagonal or a (3, 3) matrix, and a translation."""
    linear = np.asarray(1.0 if linear is None else linear, float)
    if linear.ndim < 2:
        linear = np.diag(np.broadcast_to(linear, 3))
    return np.hstack([linear, np.reshape(np.asarray(shift, float), (3, 1))])


def look_at(eye, target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0)):
    """The matrix of something at `eye` whose -z looks at `target`."""
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    z = (eye - target) / np.linalg.norm(eye - target)
    x = np.cross(np.asarray(up, float), z)
    if np.linalg.norm(x) < 1e-6:
        x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z, eye])


def camera(eye, target=(0.0, 0.0, 0.0), size=8, fov=40.0, width=None, **more):
    """A square perspective camera; fov [degrees] is that of the `width` x `size` picture."""
    half = np.tan(np.radians(fov) / 2)
    aspect = (width or size) / size
    window = (-half * aspect, half * aspect, -half, half)
    return Camera(look_at(eye, target), window, width or size, size, **more)


def orthographic(eye, target=(0.0, 0.0, 0.0), size=8, scale=1.0, **more):
    """A square orthographic camera that sees `scale` metres."""
    half = scale / 2
    return Camera(
        look_at(eye, target), (-half, half, -half, half), size, size, projection="ORTHO", **more
    )


def centres(size, scale):
    """World x, y (size, size) of the pixel centres of `orthographic` pictures from above."""
    middle = ((np.arange(size) + 0.5) / size - 0.5) * scale
    return np.meshgrid(middle, middle)


# --- Shapes -------------------------------------------------------------------------------------


def mesh(positions, triangles, normals=None, slots=None, name="Mesh"):
    return Mesh(
        name,
        np.asarray(positions, float).reshape(-1, 3),
        np.asarray(triangles, np.int32).reshape(-1, 3),
        None if normals is None else np.asarray(normals, np.float32),
        None if slots is None else np.asarray(slots, np.int32),
    )


def put(shape, *materials, to_world=None, name=None):
    """An instance of a mesh."""
    matrix = affine() if to_world is None else to_world
    return Instance(name or shape.name, shape, matrix, materials)


def quad(u=(1.0, 0.0, 0.0), v=(0.0, 1.0, 0.0), centre=(0.0, 0.0, 0.0), name="Quad"):
    """A parallelogram of two triangles whose normal is u x v; u and v are half its sides."""
    u, v, centre = (np.asarray(x, float) for x in (u, v, centre))
    corners = [centre - u - v, centre + u - v, centre + u + v, centre - u + v]
    return mesh(corners, [(0, 1, 2), (0, 2, 3)], name=name)


def box(half=1.0, name="Box"):
    """A box about the origin, of outward normals."""
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * half
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [part for a, b, c, d in sides for part in ((a, b, c), (a, c, d))]
    return mesh(corners, faces, name=name)


def sphere(radius=1.0, levels=3, smooth=True, name="Sphere"):
    """An icosphere: an icosahedron whose triangles are cut into four, `levels` times."""
    g = (1 + 5**0.5) / 2
    positions = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)]
    positions += [(0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g)]
    positions += [(g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = np.array(
        [
            (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11),
            (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6), (7, 1, 8),
            (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9),
            (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1),
        ]
    )  # fmt: skip
    corners = np.array(positions, float)
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    for _ in range(levels):
        count = len(corners)
        edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]))
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = corners[unique[:, 0]] + corners[unique[:, 1]]
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        corners = np.concatenate([corners, middle])
        ab, bc, ca = (inverse.reshape(-1) + count).reshape(3, -1)
        a, b, c = faces.T
        parts = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        faces = np.concatenate([np.stack(part, axis=1) for part in parts])
    return mesh(corners * radius, faces, corners if smooth else None, name=name)


# --- Lamps --------------------------------------------------------------------------------------


def point(position, intensity=1.0, radius=0.0, **more):
    return Lamp("Point", "POINT", affine(1.0, position), colour(intensity), radius=radius, **more)


def spot(position, target=(0.0, 0.0, 0.0), intensity=1.0, **more):
    return Lamp("Spot", "SPOT", look_at(position, target), colour(intensity), **more)


def sun(towards=(0.0, 0.0, 1.0), irradiance=1.0, **more):
    """A sun that stands in the direction `towards`."""
    return Lamp("Sun", "SUN", look_at(towards), colour(irradiance), **more)


def area(position, target=(0.0, 0.0, 0.0), radiance=1.0, size=(1.0, 1.0), **more):
    return Lamp("Area", "AREA", look_at(position, target), colour(radiance), size=size, **more)


# --- Pictures -----------------------------------------------------------------------------------

DEFAULTS = Settings(
    samples=4,
    pixel_filter_type="BOX",
    sample_clamp_indirect=0.0,
    use_adaptive_sampling=False,
    use_denoising=False,
    blur_glossy=0.0,
)


def scene(view, *things, **more):
    """A scene of instances, lamps and a world in any order."""
    instances = tuple(x for x in things if isinstance(x, Instance))
    lamps = tuple(x for x in things if isinstance(x, Lamp))
    worlds = [x for x in things if isinstance(x, World)]
    return Scene(view, instances, lamps, worlds[0] if worlds else None, **more)


def picture(view, *things, threads=1, film_transparent=False, **settings):
    """Render a scene; return the whole `Picture`."""
    described = scene(view, *things, film_transparent=film_transparent)
    return render(compile_plan(described, replace(DEFAULTS, **settings)), threads=threads)


def pixels(view, *things, **settings):
    """Render a scene; return (H, W, 4) float32, row 0 at the bottom."""
    return picture(view, *things, **settings).combined()


def means(view, *things, count=8, **settings):
    """Render a scene with `count` seeds; return the mean of the green channel of each."""
    return np.array(
        [pixels(view, *things, **settings, seed=seed)[..., 1].mean() for seed in range(count)]
    )
