"""numbers -> meshes and materials.  What the built scenes share beyond the examples' stage."""

import bpy
import numpy as np

# isort: split
import bmesh  # which the bpy module brings along
from mathutils import Matrix

from ...examples._stage import put, start, surface

# A file's default bounce limits, which a user of Cycles meets first.
BOUNCES = {
    "max_bounces": 12,
    "diffuse_bounces": 4,
    "glossy_bounces": 4,
    "transmission_bounces": 12,
    "transparent_max_bounces": 8,
}


def begin(width, height, world=(0, 0, 0), exposure=0.0):
    """Empty the file and set size, world colour and the default bounce limits."""
    start(width, height, world=world, exposure=exposure, **BOUNCES)


def plastic(name, color, roughness=0.5):
    """Return a Principled material as Blender's default has it, but for colour and roughness."""
    return surface(name, "BsdfPrincipled", color, Roughness=roughness)


def metal(name, color, roughness=0.2):
    """Return a rough metal."""
    return surface(name, "BsdfPrincipled", color, Metallic=1.0, Roughness=roughness)


def lathe(profile, segments=48, smooth=True):
    """Return the mesh that a profile of (radius, height) sweeps around z, no caps.

    Normals point to the right of the profile's way: outwards where it climbs.
    A radius of 0 at either end closes the shape there.
    """
    rings = [(r, z) for r, z in profile if r > 0]
    angle = 2 * np.pi * np.arange(segments) / segments
    points = [(r * np.cos(a), r * np.sin(a), z) for r, z in rings for a in angle]
    faces = []
    for ring in range(len(rings) - 1):
        first, above = ring * segments, (ring + 1) * segments
        for k in range(segments):
            after = (k + 1) % segments
            faces.append((first + k, first + after, above + after, above + k))
    for end, first in ((0, 0), (-1, (len(rings) - 1) * segments)):
        if profile[end][0] > 0:
            continue
        points.append((0.0, 0.0, profile[end][1]))
        tip = len(points) - 1
        for k in range(segments):
            a, b = first + k, first + (k + 1) % segments
            faces.append((tip, b, a) if end == 0 else (a, b, tip))
    data = bpy.data.meshes.new("Lathe")
    data.from_pydata(points, [], faces)
    data.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    return data


def rounded(points, steps=4):
    """Return a profile with its inner corners replaced by quadratic curves of `steps` pieces."""
    points = [np.asarray(p, float) for p in points]
    t = np.linspace(0, 1, steps + 1)[:, None]
    result = [points[0][None]]
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        a, b = (before + corner) / 2, (corner + after) / 2
        result.append((1 - t) ** 2 * a + 2 * t * (1 - t) * corner + t**2 * b)
    result.append(points[-1][None])
    return [tuple(p) for p in np.concatenate(result)]


def soft_box(x, y, z, radius, segments=3):
    """Return a box about the origin with rounded edges."""
    build = bmesh.new()
    bmesh.ops.create_cube(build, size=1, matrix=Matrix.Diagonal((x, y, z, 1)))
    bmesh.ops.bevel(
        build, geom=build.edges[:], offset=radius, segments=segments, profile=0.5, affect="EDGES"
    )
    for face in build.faces:
        face.smooth = True
    data = bpy.data.meshes.new("Soft box")
    build.to_mesh(data)
    build.free()
    return data


def suzanne(name, material, at, turn=(0, 0, 0), size=1.0, levels=2):
    """Put Suzanne, 968 triangles, four times as many by each level of subdivision."""
    build = bmesh.new()
    bmesh.ops.create_monkey(build)
    for face in build.faces:
        face.smooth = True
    data = bpy.data.meshes.new(name)
    build.to_mesh(data)
    build.free()
    thing = put(name, data, material, at, turn, (size, size, size))
    divide = thing.modifiers.new("Divide", "SUBSURF")
    divide.levels = divide.render_levels = levels
    return thing


def bead(radius=1.0, subdivisions=2):
    """Return an icosphere: 20 triangles, four times as many by each subdivision past the first."""
    build = bmesh.new()
    bmesh.ops.create_icosphere(build, subdivisions=subdivisions, radius=radius)
    data = bpy.data.meshes.new("Bead")
    build.to_mesh(data)
    build.free()
    return data


def copies(source, places, sizes=1.0, turns=0.0, smooth=False):
    """Return one mesh with the faces of `source` at each of `places` (N, 3).

    `sizes` are broadcast against (N, 3), `turns` [rad] about z against (N,).
    """
    # Scale, turn and move the points of each copy.
    points = np.empty(len(source.vertices) * 3, np.float32)
    source.vertices.foreach_get("co", points)
    places = np.asarray(places, np.float32)[:, None]
    sizes = np.broadcast_to(np.asarray(sizes, np.float32), (len(places), 3))[:, None]
    turns = np.broadcast_to(np.asarray(turns, np.float32), len(places))[:, None]
    x, y, z = np.moveaxis(points.reshape(-1, 3) * sizes, 2, 0)
    cos, sin = np.cos(turns), np.sin(turns)
    positions = np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1) + places

    # Repeat the faces.
    totals = np.empty(len(source.polygons), np.int32)
    source.polygons.foreach_get("loop_total", totals)
    corners = np.empty(len(source.loops), np.int32)
    source.loops.foreach_get("vertex_index", corners)
    shift = len(source.vertices) * np.arange(len(places), dtype=np.int32)
    corners = (corners + shift[:, None]).ravel()
    totals = np.tile(totals, len(places))

    data = bpy.data.meshes.new("Copies")
    data.vertices.add(positions.size // 3)
    data.vertices.foreach_set("co", positions.ravel())
    data.loops.add(len(corners))
    data.loops.foreach_set("vertex_index", corners)
    data.polygons.add(len(totals))
    data.polygons.foreach_set("loop_start", (np.cumsum(totals) - totals).astype(np.int32))
    data.update(calc_edges=True)
    if not smooth:
        data.shade_flat()
    return data
