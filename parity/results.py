"""estimates, verdict -> what is told of one scene, in a line, as JSON, as pictures."""

import base64
import importlib.util
import struct
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .statistics import BLOCK, LUMINANCE, Comparison, Estimate

# verdict -> does it fail, what it means
VERDICTS = {
    "same": (False, "within the margins"),
    "known": (False, "differs, listed with its cause"),
    "absent": (False, "this Blender lacks what it is about"),
    "reference": (False, "only the reference was made"),
    "noisy": (True, "not enough samples in the given time to tell"),
    "differs": (True, "beyond the margins"),
    "failed": (True, "an engine raised, crashed or hung"),
}


@dataclass
class Result:
    """What became of one scene."""

    name: str
    shows: str
    verdict: str = "failed"
    reason: str = ""
    notes: list[str] = field(default_factory=list)
    reference: Estimate | None = None
    ours: Estimate | None = None
    comparison: Comparison | None = None
    flip: float | None = None
    pictures: dict[str, str] = field(default_factory=dict)
    engines: dict[str, dict[str, float]] = field(default_factory=dict)

    def judge(self, ours: Estimate, comparison: Comparison) -> None:
        """Set the verdict of a comparison, and FLIP if it is installed."""
        assert self.reference
        self.ours, self.comparison = ours, comparison
        self.verdict = "differs" if not comparison.same else "same"
        if comparison.same and not comparison.certain:
            self.verdict, self.reason = "noisy", f"error of a block {comparison.error:.2%}"
        self.flip = flip(self.reference.picture, ours.picture)

    @property
    def fails(self) -> bool:
        """Tell whether this verdict makes the run fail."""
        return VERDICTS[self.verdict][0]

    def paint(self) -> None:
        """Make the pictures of the page, as PNG in text."""
        if self.reference is None:
            return
        truth = self.reference.picture
        bright = max(float(np.percentile(truth[..., :3] @ LUMINANCE, 95)), 1e-6)
        self.pictures["Cycles"] = png(srgb(truth * (0.8 / bright)))
        if self.ours is None:
            return
        mine = self.ours.picture
        self.pictures["Penumbra"] = png(srgb(mine * (0.8 / bright)))
        floor = max(0.01 * bright, 1e-7)
        light = [picture[..., :3].astype(np.float64) @ LUMINANCE for picture in (mine, truth)]
        self.pictures["pixels, +-20 %"] = png(signed(light, floor, 0.2))
        rows, columns = (size // BLOCK for size in light[0].shape)
        means = [
            each[: rows * BLOCK, : columns * BLOCK]
            .reshape(rows, BLOCK, columns, BLOCK)
            .mean(axis=(1, 3))
            for each in light
        ]
        self.pictures["blocks, +-2 %"] = png(signed(means, floor, 0.02))

    def forget(self) -> None:
        """Let go of the arrays, and keep what was measured."""
        for engine, estimate in (("cycles", self.reference), ("penumbra", self.ours)):
            if estimate is not None:
                self.engines[engine] = {
                    "samples": estimate.samples,
                    "seeds": estimate.seeds,
                    "seconds": estimate.seconds,
                    "error": estimate.error(),
                }
        self.reference = self.ours = None

    def document(self) -> dict[str, Any]:
        """Return the scene's entry of the JSON."""
        entry: dict[str, Any] = {"name": self.name, "shows": self.shows, "verdict": self.verdict}
        entry |= {"reason": self.reason, "not_honoured": self.notes, "flip": self.flip}
        entry["engines"] = self.engines
        entry["comparison"] = asdict(self.comparison) if self.comparison else None
        return entry


def flip(reference: NDArray[np.float32], ours: NDArray[np.float32]) -> float | None:
    """Return the mean HDR-FLIP of a pair of pictures, None where it is not installed."""
    if importlib.util.find_spec("flip_evaluator") is None:
        return None
    import flip_evaluator

    pair = [np.ascontiguousarray(np.maximum(p[..., :3], 0), np.float32) for p in (reference, ours)]
    if not pair[0].any():
        return 0.0 if not pair[1].any() else 1.0
    return float(flip_evaluator.evaluate(*pair, "HDR", applyMagma=False)[1])


def print_result(result: Result) -> None:
    """Print one scene's line."""
    line = f"{result.verdict:9s} {result.name:30s}"
    if result.comparison:
        line += f" {result.comparison.block!s:38s} {result.comparison.picture!s:36s}"
        line += f" FLIP {result.flip:.4f}" if result.flip is not None else ""
    print(line.rstrip() + (f" {result.reason}" if result.reason else ""), flush=True)
    for note in result.notes[:3]:
        print(f"{'':10s}not honoured: {note}", flush=True)


def print_summary(results: Sequence[Result]) -> None:
    """Print how many scenes got which verdict."""
    print(f"\n{len(results)} scenes: {summary(results)}")


def summary(results: Sequence[Result]) -> str:
    """Return how many scenes got which verdict, in words."""
    counts = Counter(result.verdict for result in results)
    return ", ".join(f"{counts[name]} {name}" for name in VERDICTS if counts[name])


# ---- pictures


def srgb(picture: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return display bytes (H, W, 3) of linear colours (H, W, 3 or 4)."""
    x = np.clip(picture[..., :3].astype(np.float64), 0, 1)
    encoded = np.where(x < 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055)
    return (255 * encoded + 0.5).astype(np.uint8)


def signed(pair: Sequence[NDArray[np.float64]], floor: float, full: float) -> NDArray[np.uint8]:
    """Return red where the first is brighter than the second, blue where darker."""
    ratio = (pair[0] - pair[1]) / np.maximum(pair[1], floor) / full
    up, down = np.clip(ratio, 0, 1), np.clip(-ratio, 0, 1)
    return (255 * (1 - np.stack([down, np.maximum(up, down), up], axis=-1))).astype(np.uint8)


def png(pixels: NDArray[np.uint8]) -> str:
    """Return a PNG of bytes (H, W, 3), in base64 (RFC 2083)."""
    height, width, _ = pixels.shape

    def chunk(kind: bytes, data: bytes) -> bytes:
        check = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + check

    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = (
        chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes())) + chunk(b"IEND", b"")
    )
    return base64.b64encode(b"\x89PNG\r\n\x1a\n" + body).decode()
