"""a scene -> the same picture.  What may be done to a scene that must not change what is seen.

Each transformation returns the scene and, if it turns the picture over, how to turn it back.
"""

from dataclasses import replace

import numpy as np

from penumbra.core import Instance


def _moved(scene, linear, shift, scale):
    """Put everything elsewhere: x -> linear x + shift, where `linear` scales lengths by `scale`."""
    linear, shift = np.asarray(linear, float), np.asarray(shift, float)

    def affine(matrix, by):
        out = np.empty((3, 4))
        out[:, :3] = by @ matrix[:, :3]
        out[:, 3] = linear @ matrix[:, 3] + shift
        return out

    turn = linear / scale  # keeps lengths
    view = scene.camera
    flip = np.diag([np.sign(np.linalg.det(linear)), 1.0, 1.0])
    to_world = affine(view.to_world, turn)
    to_world[:, :3] = to_world[:, :3] @ flip
    window = view.window
    if view.projection == "ORTHO":
        window = tuple(edge * scale for edge in window)
    view = replace(
        view,
        to_world=to_world,
        window=window,
        clip_start=view.clip_start * scale,
        clip_end=view.clip_end * max(scale, 1.0),
    )
    lamps = []
    for lamp in scene.lamps:
        gain = scale**2 if lamp.kind in ("POINT", "SPOT") else 1.0
        lamps.append(
            replace(
                lamp,
                to_world=affine(lamp.to_world, turn),
                strength=tuple(gain * value for value in lamp.strength),
                radius=lamp.radius * scale,
                size=tuple(scale * side for side in lamp.size),
            )
        )
    instances = (replace(x, to_world=affine(x.to_world, linear)) for x in scene.instances)
    return replace(scene, camera=view, lamps=tuple(lamps), instances=tuple(instances))


def scaled(factor):
    """Make everything `factor` times as large."""
    return lambda scene: _moved(scene, np.eye(3) * factor, np.zeros(3), factor)


def shifted(distance):
    """Move everything `distance` metres away."""
    way = np.array([2.0, -1.0, 2.0]) / 3
    return lambda scene: _moved(scene, np.eye(3), way * distance, 1.0)


def turned(scene):
    """Turn everything about a slanted axis."""
    quarter, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    quarter *= np.sign(np.linalg.det(quarter))
    return _moved(scene, quarter, np.zeros(3), 1.0)


def mirrored(scene):
    """Swap left and right; the picture is turned over."""
    return _moved(scene, np.diag([-1.0, 1.0, 1.0]), np.zeros(3), 1.0)


def _each(scene, change):
    return replace(scene, instances=tuple(change(x) for x in scene.instances))


def shuffled(scene):
    """Put the triangles of each mesh into another order."""

    def change(instance: Instance) -> Instance:
        order = np.random.default_rng(3).permutation(len(instance.mesh.triangles))
        mesh = replace(instance.mesh, triangles=instance.mesh.triangles[order])
        return replace(instance, mesh=mesh)

    return _each(scene, change)


def stretched(scene):
    """Give each mesh a parent that undoes a stretched and sheared shape."""
    shear = np.array([[2.0, 0.3, 0.0], [0.0, 0.5, 0.1], [0.0, 0.0, 3.0]])

    def change(instance: Instance) -> Instance:
        mesh = instance.mesh
        normals = mesh.normals
        if normals is not None:
            normals = normals @ shear  # the inverse transpose of the inverse
            normals = normals / np.linalg.norm(normals, axis=-1, keepdims=True)
        mesh = replace(
            mesh,
            positions=mesh.positions @ np.linalg.inv(shear).T,
            normals=None if normals is None else normals.astype(np.float32),
        )
        to_world = instance.to_world.copy()
        to_world[:, :3] = to_world[:, :3] @ shear
        return replace(instance, mesh=mesh, to_world=to_world)

    return _each(scene, change)


def cut_up(scene):
    """Cut each flat triangle into sixteen."""

    def change(instance: Instance) -> Instance:
        mesh = instance.mesh
        if mesh.normals is not None:
            return instance
        positions, faces = mesh.positions, mesh.triangles
        for _ in range(2):
            a, b, c = (positions[faces[:, k]] for k in range(3))
            count = len(faces)
            positions = np.concatenate([a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2])
            i = np.arange(count)
            a, b, c, ab, bc, ca = (i + count * k for k in range(6))
            parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
            faces = np.concatenate([np.stack(part, axis=1) for part in parts]).astype(np.int32)
        return replace(instance, mesh=replace(mesh, positions=positions, triangles=faces))

    return _each(scene, change)


def doubled(scene):
    """Show each matte object twice, in the same place."""
    matte = [x for x in scene.instances if x.materials[0].name == "Matte"]
    copies = tuple(replace(x, name=x.name + " again") for x in matte)
    return replace(scene, instances=scene.instances + copies)


def with_slivers(scene):
    """Add triangles without an area: points, lines, and corners that coincide."""

    def change(instance: Instance) -> Instance:
        faces = instance.mesh.triangles
        some = faces[:: max(len(faces) // 8, 1)]
        bad = np.concatenate([some[:, [0, 0, 1]], some[:, [2, 2, 2]]])
        mesh = instance.mesh
        return replace(instance, mesh=replace(mesh, triangles=np.concatenate([bad, faces])))

    return _each(scene, change)


TRANSFORMS = {
    "scale 1e-6": scaled(1e-6),
    "scale 1e-3": scaled(1e-3),
    "scale 1e3": scaled(1e3),
    "scale 1e6": scaled(1e6),
    "shift 1e3": shifted(1e3),
    "shift 1e6": shifted(1e6),
    "turned": turned,
    "mirrored": mirrored,
    "shuffled": shuffled,
    "stretched": stretched,
    "cut up": cut_up,
    "doubled": doubled,
    "slivers": with_slivers,
}
TURNED_OVER = {"mirrored"}
