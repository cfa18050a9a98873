"""an open scene, an engine -> pictures of many seeds, until the noise is low enough.

Cycles' are kept in a folder, by the fingerprint of the scene and the version of Blender; a later
run with more time goes on where the last one stopped. The block means of each seed are kept with
them, so that nothing about the spread is assumed.
"""

import hashlib
import os
from pathlib import Path
from time import monotonic

import numpy as np

from .process import Worker
from .statistics import REFERENCE_ERROR, SEEDS, Estimate, samples_for

CACHE = Path(__file__).resolve().parent / "cache"
PILOT = 16  # samples of a seed, from which the noise is judged first
MOST_SAMPLES = 4096  # of a seed: as many points as Cycles' tables have places for
MANY = 128  # pictures; where more would be needed, they get more samples
FIRST_SEED = {"CYCLES": 1_000_003, "PENUMBRA": 1}


def estimate(
    worker: Worker,
    engine: str,
    error: float,
    seconds: float,
    threads: int,
    begun: Estimate | None = None,
) -> tuple[Estimate, list[str]]:
    """Render the open scene until a block's error is below `error` or the time is over.

    Returns the pictures and what the engine did not honour. Raises WorkerError.
    """
    end = monotonic() + seconds
    result, notes = begun or Estimate(PILOT), []

    def add(count: int) -> None:
        for _ in range(count):
            seed = FIRST_SEED[engine] + result.seeds
            answer, picture = worker.render(engine, result.samples, seed, threads)
            result.add(picture, answer["seconds"])
            notes[:] = answer["notes"]

    # A pilot tells how many samples are needed; it takes about a quarter of them for each seed.
    # What a render costs to start (a map of the world: seconds) is not what its samples cost.
    if begun is None:
        add(SEEDS)
        if result.error() > error:
            start = worker.render(engine, 1, FIRST_SEED[engine], threads)[0]["seconds"]
            seed_seconds = result.seconds / SEEDS
            each = max(seed_seconds - start, 0.01 * seed_seconds) / (PILOT - 1)
            affordable = max((end - monotonic()) / (2 * SEEDS) - start, 0.0) / each
            wanted = min(samples_for(result, error) // 4, int(affordable), MOST_SAMPLES)
            if wanted > PILOT:
                result = Estimate(1 << (wanted.bit_length() - 1))
                add(SEEDS)

    # Further seeds, until it is enough. The pilot misjudges rare light, and what it costs to start.
    while (reached := result.error()) > error and monotonic() < end:
        if _needs_longer(result, reached / error, end - monotonic()):
            result.merge()
        add(SEEDS // 4)
    return result, notes


def _needs_longer(result: Estimate, excess: float, seconds: float) -> bool:
    """Tell whether further seeds should have twice the samples, and can have them in the time."""
    pictures = len(result.chunks)
    next_seconds = 2 * result.seconds / pictures * (SEEDS // 4)
    return (
        pictures >= 2 * SEEDS
        and pictures % 2 == 0
        and pictures * excess**2 > MANY
        and 2 * result.samples <= MOST_SAMPLES
        and next_seconds < seconds
    )


def fixed(worker: Worker, engine: str, samples: int, seeds: int, threads: int) -> Estimate:
    """Render the open scene with a given number of samples and seeds.  Raises WorkerError."""
    result = Estimate(samples)
    for k in range(seeds):
        answer, picture = worker.render(engine, samples, FIRST_SEED[engine] + k, threads)
        result.add(picture, answer["seconds"])
    return result


class References:
    """The cached references of one Blender version in one folder."""

    def __init__(self, folder: Path, blender: str) -> None:
        self.folder = folder
        self.blender = blender

    def path(self, name: str, fingerprint: str) -> Path:
        """Return the file that a scene's reference is, or will be, in."""
        digest = hashlib.sha256(f"{fingerprint} {self.blender} {FIRST_SEED['CYCLES']}".encode())
        return self.folder / f"{name}-{digest.hexdigest()[:16]}.npz"

    def load(self, name: str, fingerprint: str) -> Estimate | None:
        """Return the reference of a scene as far as it is there."""
        path = self.path(name, fingerprint)
        if not path.exists():
            return None
        with np.load(path) as kept:
            chunks = list(kept["blocks"])
            seeds = int(kept["seeds"]) if "seeds" in kept else len(chunks)
            samples, seconds = int(kept["samples"]), float(kept["seconds"])
            return Estimate(samples, chunks, kept["total"], seconds, seeds)

    def save(self, name: str, fingerprint: str, reference: Estimate) -> None:
        """Keep a reference; whoever reads at this time gets the old one or the new one."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.path(name, fingerprint)
        partial = path.with_suffix(f".{os.getpid()}.partial.npz")
        assert reference.total is not None
        mean, se = reference.regions()
        np.savez_compressed(
            partial,
            samples=reference.samples,
            blocks=np.stack(reference.chunks),
            total=reference.total,
            seconds=reference.seconds,
            seeds=reference.seeds,
            mean=mean,  # of the blocks, and of the picture as the last
            variance=se**2,
            fingerprint=fingerprint,
            blender=self.blender,
        )
        partial.replace(path)

    def make(
        self, name: str, fingerprint: str, cycles: Worker, seconds: float, threads: int
    ) -> Estimate:
        """Return a scene's reference: from the folder if good enough, else rendered on.

        The scene must be open in `cycles`, or is opened. Raises WorkerError.
        """
        begun = self.load(name, fingerprint)
        enough = begun and begun.error() <= REFERENCE_ERROR
        if begun and (enough or seconds <= 0):
            return begun
        cycles.open(name)
        made, _ = estimate(cycles, "CYCLES", REFERENCE_ERROR, seconds, threads, begun)
        self.save(name, fingerprint, made)
        return made
