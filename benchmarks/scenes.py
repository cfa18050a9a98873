"""names -> benchmark scenes.  What is rendered, at which sizes and sample counts: one table."""

from dataclasses import dataclass, field
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


@dataclass(frozen=True)
class Scene:
    """A scene, what is changed in it, and the sample counts that make its error-time curve.

    `source` is an example's name, or "" for the generated mesh.  Scenes without `reference`
    samples have no error: only their wall time counts.
    """

    name: str
    source: str
    settings: dict[str, int] = field(default_factory=dict)
    percentage: int = 100  # of the size stored in the file
    samples: tuple[int, ...] = (8, 16, 32, 64, 128)
    reference: int = 2048  # samples of the reference, half of them with another seed

    def quick(self) -> "Scene":
        """Return the same scene, smaller and with fewer samples."""
        if not self.reference:
            return self
        ladder, percentage = (4, 8, 16, 32), self.percentage // 2
        return Scene(self.name, self.source, self.settings, percentage, ladder, 512)

    def blend(self) -> Path | None:
        """Return the file to open, or None for the generated mesh."""
        return EXAMPLES / f"{self.source}.blend" if self.source else None


SCENES = (
    Scene("cornell_direct", "cornell_box", {"max_bounces": 0}),
    Scene("cornell_gi", "cornell_box", {"max_bounces": 4, "diffuse_bounces": 4}),
    Scene("lamps", "lamps", percentage=60),
    Scene("mirrors", "mirrors", percentage=60),
    Scene("glass", "glass", percentage=60),
    Scene("big_mesh", "", samples=(1,), reference=0),
)


def build_big_mesh() -> None:
    """Make a wavy carpet of two million triangles, seen in 16 x 16 pixels, in an empty file."""
    import bpy
    import numpy as np

    bpy.ops.wm.read_factory_settings(use_empty=True)
    count = 1000
    x, y = np.meshgrid(*[np.linspace(-1, 1, count + 1, dtype=np.float32)] * 2)
    positions = np.stack([x, y, 0.1 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    a, b, c, d = first, first + 1, first + count + 2, first + count + 1
    corners = np.stack([a, b, c, a, c, d], axis=1).ravel().astype(np.int32)

    mesh = bpy.data.meshes.new("Carpet")
    mesh.vertices.add(len(positions))
    mesh.vertices.foreach_set("co", positions.ravel())
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(corners) // 3)
    mesh.polygons.foreach_set("loop_start", np.arange(0, len(corners), 3, dtype=np.int32))
    mesh.update(calc_edges=True)

    scene = bpy.context.scene
    lamp, camera = bpy.data.lights.new("Sun", "SUN"), bpy.data.cameras.new("Camera")
    for name, data, height in (("Carpet", mesh, 0), ("Sun", lamp, 3), ("Camera", camera, 3)):
        thing = bpy.data.objects.new(name, data)
        thing.location.z = height
        scene.collection.objects.link(thing)
    scene.camera = scene.objects["Camera"]
    scene.render.resolution_x = scene.render.resolution_y = 16
