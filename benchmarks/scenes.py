"""names -> benchmark scenes.  What is rendered, at which sizes and sample counts: one table."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


@dataclass(frozen=True)
class Scene:
    """A scene, what is changed in it, and the sample counts that make its error-time curve.

    `example` names a file in `examples`; without one, the module `built.<name>` makes the scene,
    or of names with a dash a variant of it.
    Scenes without `reference` samples have no error: only their wall time counts. `target` is how
    many times longer than Penumbra Cycles shall take to the same relMSE.  With `thresholds`, both
    engines sample adaptively: the curve is made by these, each with up to the last of `samples`.
    The page's mean is over the scenes with a `title`, one for each kind of scene.
    """

    name: str
    example: str = ""
    settings: dict[str, int] = field(default_factory=dict)
    percentage: int = 100  # of the size stored in the file
    samples: tuple[int, ...] = (4, 8, 16, 32, 64, 128)
    reference: int = 2048  # samples of the reference, half of them with another seed
    target: float | None = None
    thresholds: tuple[float, ...] = ()
    title: str = ""

    def points(self) -> list[tuple[int, dict[str, Any]]]:
        """Return the points of the curve: samples, and the settings that only this point has."""
        adaptive = {"use_adaptive_sampling": True}
        most = self.samples[-1]
        by_threshold = [(most, adaptive | {"adaptive_threshold": t}) for t in self.thresholds]
        return by_threshold or [(samples, {}) for samples in self.samples]

    def quick(self) -> "Scene":
        """Return the same scene, smaller and with fewer samples; no target is set for that."""
        if not self.reference:
            return self
        return replace(
            self,
            percentage=self.percentage // 2,
            samples=tuple(sorted({max(1, count // 2) for count in self.samples})[:4]),
            reference=min(512, self.reference // 2),
            target=None,
        )

    def blend(self) -> Path | None:
        """Return the file to open, or None for a scene that is built."""
        return EXAMPLES / f"{self.example}.blend" if self.example else None


FEW = (2, 4, 8, 16, 32, 64)
FEWER = (1, 2, 4, 8, 16, 32)
THRESHOLDS = (0.2, 0.1, 0.05, 0.03, 0.02, 0.01)
ADAPTIVE: dict[str, Any] = {"samples": (512,), "reference": 2048, "thresholds": THRESHOLDS}
EVEN = dict.fromkeys(
    ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"), 8
)
SCENES = (
    Scene(
        "cornell_direct",
        "cornell_box",
        {"max_bounces": 0},
        target=4.0,
        title="Cornell box, direct light",
    ),
    Scene(
        "cornell_gi",
        "cornell_box",
        {"max_bounces": 4, "diffuse_bounces": 4},
        target=3.0,
        title="Cornell box, four bounces",
    ),
    Scene("soft_shadows", samples=FEW, reference=1024, title="Soft shadows"),
    Scene("lamps", "lamps", percentage=60, title="Six kinds of lamp"),
    Scene("mirrors", "mirrors", percentage=60, title="Hall of mirrors"),
    Scene("mirrors_and_glass", "", EVEN, samples=FEW, reference=2048, title="Mirrors and glass"),
    Scene("caustics", "glass", percentage=60, title="Caustics"),
    Scene("glossy_interior", samples=FEW, reference=512, target=3.0, title="Glossy interior"),
    Scene("glass", samples=FEW, reference=768, target=3.0, title="Bottle, tumbler, frosted glass"),
    Scene("many_lights", samples=FEWER, reference=256, target=3.0, title="A thousand lamps"),
    Scene(
        "many_emitters", samples=FEW, reference=384, target=3.0, title="100,000 glowing triangles"
    ),
    Scene("hdri_object", samples=FEW, reference=1024, target=3.0, title="Object under an HDRI"),
    Scene("emissive_mesh", samples=FEW, reference=768, target=3.0, title="Neon letters"),
    Scene("materials-constant", samples=FEW, reference=768),
    Scene("materials-image", samples=FEW, reference=768),
    Scene("materials-pbr", samples=FEW, reference=768, target=2.0, title="PBR textures"),
    Scene("materials-procedural", samples=FEW, reference=768, title="Procedural textures"),
    Scene("materials-many", samples=FEW, reference=768),
    Scene("materials-one", samples=FEW, reference=768),
    Scene("character", samples=FEW, reference=768, title="Character, subdivided"),
    Scene("five_million", samples=FEWER, reference=384, title="Five million triangles"),
    Scene("instances", samples=FEWER, reference=384, title="3,600 instances"),
    Scene("depth_of_field", samples=FEW, reference=768, title="Depth of field"),
    Scene("motion_blur", samples=FEW, reference=768, title="Motion blur"),
    Scene("empty_world", samples=FEW, reference=0, title="Empty world"),
    Scene("cornell_gi_adaptive", "cornell_box", {"max_bounces": 4}, 30, target=3.0, **ADAPTIVE),
    Scene("lamps_adaptive", "lamps", percentage=30, target=3.0, **ADAPTIVE),
    Scene("mirrors_adaptive", "mirrors", percentage=30, target=3.0, **ADAPTIVE),
    Scene("caustics_adaptive", "glass", percentage=30, target=3.0, **ADAPTIVE),
    Scene("still_life_adaptive", "still_life", percentage=30, target=3.0, **ADAPTIVE),
    Scene("big_mesh", samples=(1,), reference=0),
)
