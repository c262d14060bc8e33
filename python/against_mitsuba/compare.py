"""Path tracing, ours and Mitsuba 3's: mean radiance by region of the picture, of the same files.

What light does at surfaces is written here a second time (material.py), and so is what a glTF file says (gltf.py, translate.py).

Run it: python compare.py [--size 128x96] [--samples 4096] [--scenes ../../../shared/scenes]
"""

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba
import numpy as np

mi: Any = mitsuba
mi.set_variant("llvm_ad_rgb")

import frameless  # noqa: E402
import material  # noqa: E402, F401  (a plugin, once there is a variant)
import staging  # noqa: E402
import translate  # noqa: E402
from gltf import Array, Gltf  # noqa: E402

SCENES = Path(__file__).resolve().parents[3] / "shared/scenes"
GRID = (8, 6)
"""Columns and rows of regions."""
BATCHES = 8
"""Pictures whose spread tells how noisy their mean is."""
AGREES = 0.02
"""How far apart means may be, as a part of the larger one, beside their noise."""
SIGMAS = 4.0
"""Of hundreds of means one is 3 standard deviations off by chance."""


@dataclass
class Subject:
    """One file and what it takes to render it twice."""

    name: str
    file: Gltf
    materials: translate.Materials
    environment: Path | None = None
    max_depth: int | None = None
    """Of `frameless render`; None: until roulette ends a path."""


def subjects(scenes: Path) -> list[Subject]:
    """The box with Mitsuba's own material; with glTF's; and a bottle with every texture, under the sky."""
    matte = staging.cornell(scenes, "lamp")
    staging.make_matte(matte)
    box, sky = staging.cornell(scenes, "lamp"), scenes / "environment/aristea_wreck_puresky_1k.hdr"
    return [
        Subject("Cornell box, matte", matte, translate.matte),
        Subject("Cornell box, matte, two bounces", matte, translate.matte, max_depth=2),
        Subject("Cornell box", box, translate.metallic),
        Subject("bottle", staging.bottle(scenes), translate.metallic, sky),
    ]


Batches = list[Array]
"""Pictures of the same thing by different random numbers."""


def ours(subject: Subject, size: tuple[int, int], samples: int) -> Batches:
    with tempfile.TemporaryDirectory() as folder:
        scene = frameless.Scene.load(subject.file.save(Path(folder)), subject.environment)
    depth, each = 1000 if subject.max_depth is None else subject.max_depth, samples // BATCHES

    def picture(batch: int) -> Array:
        return scene.render(size, integrator="path", max_depth=depth, samples=each, first_sample=batch * each)

    return [picture(batch).astype(np.float64) for batch in range(BATCHES)]


def theirs(subject: Subject, size: tuple[int, int], samples: int) -> Batches:
    scene = translate.scene(subject.file, subject.materials, subject.environment)
    sensor = translate.sensor(subject.file, size)
    # Mitsuba counts the camera's ray and the one to the lamp as well.
    depth = -1 if subject.max_depth is None else subject.max_depth + 2
    integrator = mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 8})

    def picture(batch: int) -> Any:
        return mi.render(scene, sensor=sensor, integrator=integrator, spp=samples // BATCHES, seed=batch)

    return [translate.linear(picture(batch)) for batch in range(BATCHES)]


def regions(picture: Array) -> Array:
    """Means over the cells of the grid, shape (rows, columns, 3)."""
    height, width, _ = picture.shape
    columns, rows = GRID
    means: Array = picture.reshape(rows, height // rows, columns, width // columns, 3).mean(axis=(1, 3))
    return means


@dataclass
class Verdict:
    """What a comparison says; all of shape (rows, columns, 3)."""

    ours: Array
    theirs: Array
    noise: Array
    """Standard deviation of the difference of the means."""

    @property
    def apart(self) -> Array:
        """Part by which the means differ."""
        apart: Array = (self.ours - self.theirs) / np.maximum(np.maximum(self.ours, self.theirs), 1e-6)
        return apart

    @property
    def whole(self) -> Array:
        """The same of the whole picture, per channel."""
        apart: Array = self.ours.mean(axis=(0, 1)) / self.theirs.mean(axis=(0, 1)) - 1
        return apart

    @property
    def agree(self) -> Array:
        agree: Array = np.abs(self.ours - self.theirs) <= AGREES * np.maximum(self.ours, self.theirs) + SIGMAS * self.noise
        return agree


def compared(one: Callable[[], Batches], other: Callable[[], Batches]) -> Verdict:
    pairs = [np.array([regions(picture) for picture in batches()]) for batches in (one, other)]
    variances = [batches.var(axis=0, ddof=1) / len(batches) for batches in pairs]
    return Verdict(pairs[0].mean(axis=0), pairs[1].mean(axis=0), np.sqrt(sum(variances)))


def compare(subject: Subject, size: tuple[int, int], samples: int) -> Verdict:
    """`samples`: per pixel."""
    return compared(lambda: ours(subject, size, samples), lambda: theirs(subject, size, samples))


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--size", default="128x96")
    arguments.add_argument("--samples", type=int, default=4096, help="per pixel")
    arguments.add_argument("--scenes", type=Path, default=SCENES)
    given = arguments.parse_args()
    width, height = map(int, given.size.split("x"))
    print(f"{width}x{height}, {given.samples} samples per pixel, {GRID[0]}x{GRID[1]} regions, three channels each")
    print(f"{'':34}largest difference   median    all   noise (1 sd, median)   agree")
    left = Subject("Cornell box, the specification's k", staging.cornell(given.scenes, "lamp"), translate.as_specified)
    for subject in [*subjects(given.scenes), left]:
        verdict = compare(subject, (width, height), given.samples)
        part = np.abs(verdict.apart)
        noise = np.median(verdict.noise / np.maximum(verdict.theirs, 1e-6))
        whole = verdict.whole[np.argmax(np.abs(verdict.whole))]
        agree = f"{verdict.agree.sum()} of {verdict.agree.size}"
        print(f"{subject.name:34}{100 * part.max():16.2f} %{100 * np.median(part):9.2f} %{100 * whole:+7.2f} %{100 * noise:12.2f} %  {agree:>16}")


if __name__ == "__main__":
    main()
