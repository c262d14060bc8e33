"""How fast is it here? ``python -m frameless.bench`` prints the package's numbers; build it with optimisation for them.

The loop's own work is measured with answers that cost nothing: the same array again and again, so that what is left is choosing,
checking, keeping and observing. Each number is the median of some rounds, with the smallest and the largest.
"""

import argparse
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ._frameless import Session, loop_without_python

SIZE = (512, 384)
BATCH = 4_096


def python_loop(seconds: float, sampler: str, reconstruction: str) -> float:
    """Nanoseconds per sample of ``for batch in session: batch.submit(rgb)`` with an array that is there already."""
    session = Session(SIZE, batch=BATCH, sampler=sampler, reconstruction=reconstruction)
    # Batches of `adaptive` may be somewhat longer.
    rgb = np.full((2 * BATCH, 3), 0.5, np.float32)
    begin, kept = time.perf_counter(), 0
    for batch in session.batches(seconds):
        kept += batch.submit(rgb[: len(batch)])
    return 1e9 * (time.perf_counter() - begin) / kept


def rust_loop(seconds: float, sampler: str, reconstruction: str) -> float:
    """The same loop without Python in it."""
    kept, spent = loop_without_python(SIZE, sampler, reconstruction, BATCH, seconds)
    return 1e9 * spent / kept


def trivial(x: Any, y: Any, time: float, camera: object) -> Any:
    """A renderer that costs numpy next to nothing."""
    rgb = np.empty((len(x), 3), np.float32)
    rgb[:, 0] = x
    rgb[:, 1] = y
    rgb[:, 2] = time
    rgb *= 1.0 / 512.0
    return rgb


def trivial_renderer(seconds: float, sampler: str, reconstruction: str) -> float:
    """Samples per second of ``session.run(trivial)``, in millions."""
    session = Session(SIZE, sampler=sampler, reconstruction=reconstruction)
    begin = time.perf_counter()
    kept = session.run(trivial, seconds)
    return 1e-6 * kept / (time.perf_counter() - begin)


def import_seconds(code: str) -> float:
    """How long a fresh interpreter needs for an import."""
    timed = f"import time; t = time.perf_counter(); {code}; print(time.perf_counter() - t)"
    return float(subprocess.run([sys.executable, "-c", timed], capture_output=True, text=True, check=True).stdout)


def row(name: str, rounds: int, measure: Callable[[], float]) -> None:
    values = [measure() for _ in range(rounds)]
    print(f"| {name} | {statistics.median(values):.4g} | {min(values):.4g} | {max(values):.4g} |", flush=True)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--seconds", type=float, default=1.0, help="per round")
    given = arguments.parse_args()
    rounds, seconds = given.rounds, given.seconds
    print("| | median | min | max |\n|---|---|---|---|")
    for sampler, reconstruction in (("permutation", "hold"), ("adaptive", "hold"), ("adaptive", "reproject+antialias")):
        name = f"`{sampler}+{reconstruction}`"
        both: list[tuple[float, float]] = []

        def in_python(sampler: str = sampler, shown: str = reconstruction) -> float:
            both.append((python_loop(seconds, sampler, shown), rust_loop(seconds, sampler, shown)))
            return both[-1][0]

        row(f"{name}, loop in Python, ns/sample", rounds, in_python)
        rust = iter([in_rust for _, in_rust in both])
        row(f"{name}, the same in Rust, ns/sample", rounds, lambda: next(rust))
        added = iter([in_python - in_rust for in_python, in_rust in both])
        row(f"{name}, what Python adds, ns/sample", rounds, lambda: next(added))
    for sampler, reconstruction in (("permutation", "hold"), ("adaptive", "hold"), ("adaptive", "reproject+antialias")):
        row(
            f"trivial numpy renderer, `{sampler}+{reconstruction}`, M samples/s",
            rounds,
            lambda sampler=sampler, shown=reconstruction: trivial_renderer(seconds, sampler, shown),  # type: ignore[misc]
        )
    row("`import frameless`, s", rounds, lambda: import_seconds("import frameless"))
    row("of that numpy, s", rounds, lambda: import_seconds("import numpy"))


if __name__ == "__main__":
    main()
