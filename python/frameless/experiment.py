"""Comparisons on the simulated clock: every algorithm against the picture of an ideal renderer that takes no time."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from ._frameless import run_experiment
from .sampling import Sampler

Row = TypedDict(
    "Row",
    {
        "scene": str,
        "algorithm": str,
        "samples_per_sec": float,
        "seed": int,
        "width": int,
        "height": int,
        "display_hz": int,
        "rmse": float,
        "rmse_p95": float,
        "rmse_changed": float,
        "psnr_db": float,
        "ssim": float,
        "flip": float,
        "age_secs": float,
        "oldest_secs": float,
        "rmse_over_time": NDArray[np.float64],
    },
)
"""One run. Means over the scored refreshes; NaN where something was not measured. ``pandas.DataFrame(rows)`` takes a list of
them."""

Algorithm = str | tuple[str, Callable[[int], Sampler]]
"""A name, or a name of your own and what makes a sampler of a seed."""

DEFAULT_ALGORITHMS = ("random", "change", "adaptive+reproject")


def compare(
    scenes: str | Path | Sequence[str | Path] = "sphere",
    algorithms: Sequence[Algorithm] = DEFAULT_ALGORITHMS,
    *,
    samples_per_sec: float | Sequence[float] = 900_000,
    size: tuple[int, int] = (512, 384),
    seconds: float = 2.5,
    unscored: float = 0.5,
    display_hz: int = 60,
    seeds: Sequence[int] = (1,),
    ssim_every: int = 0,
    flip_every: int = 0,
) -> list[Row]:
    """Run every algorithm in every scene at every rate with every seed, and measure it at every refresh of a display.

    Parameters:

    - `scenes`: names of built-in scenes (``Scene.names()``) or paths of glTF files
    - `algorithms`: names ("random", "change+filter", "framed", "lowres60", "progressive", "temporal", ...), or pairs of a name and
        what makes a sampler of a seed: ``("mine", MySampler)``. After a name +hold, +filter or +reproject says how samples are
        shown; without, it is +hold
    - `samples_per_sec`: how many samples may be traced per second of the simulated clock
    - `size`: (width, height) in pixels
    - `seconds`, `unscored`: how long a run lasts, and how much of its beginning does not count
    - `display_hz`: refreshes per second; each is compared with the ideal picture of that moment
    - `seeds`: of whatever is random; runs without randomness are made once
    - `ssim_every`, `flip_every`: measure these costly metrics at every so many-th refresh; 0: not at all

    Returns a list of dicts, one per run; see Row. The same arguments give the same numbers.

    Raises ValueError for what makes no sense; what a sampler of your own raises arrives as it is. Ctrl-C ends it at once.
    """
    given_scenes = [scenes] if isinstance(scenes, (str, Path)) else list(scenes)
    rates = [samples_per_sec] if isinstance(samples_per_sec, (int, float)) else list(samples_per_sec)
    named = [algorithm for algorithm in algorithms if isinstance(algorithm, str)]
    custom = [algorithm for algorithm in algorithms if not isinstance(algorithm, str)]
    if not algorithms:
        raise ValueError("algorithms: wanted at least one algorithm, got none")
    width, height = size
    lines = [
        'title = "compare"',
        # A file names at least one algorithm.
        f"algorithms = {_toml(named or ['random'])}",
        f"samples_per_sec = {_toml([float(rate) for rate in rates])}",
        f"seeds = {_toml([int(seed) for seed in seeds])}",
        f"width = {_toml(int(width))}",
        f"height = {_toml(int(height))}",
        f"display_hz = {_toml(int(display_hz))}",
        f"duration_secs = {_toml(float(seconds))}",
        f"unscored_secs = {_toml(float(unscored))}",
    ]
    for scene in given_scenes:
        lines += ["[[scenes]]", f"scene = {_toml(str(scene))}"]
    lines += ["[metrics]", f"ssim_every = {_toml(int(ssim_every))}", f"flip_every = {_toml(int(flip_every))}"]
    lines += ["[output]", "video = false"]
    return _run("\n".join(lines), Path.cwd(), bool(named), custom)


def compare_file(path: str | Path) -> list[Row]:
    """Run the experiment in a TOML file (see docs/evaluation.md) and return its runs as rows. Writes nothing.

    Raises OSError if the file cannot be read, ValueError if it is not what it should be.
    """
    path = Path(path)
    return _run(path.read_text(encoding="utf-8"), path.parent, True, [])


def _run(
    text: str, folder: Path, with_named: bool, custom: Sequence[tuple[str, Callable[[int], Sampler]]]
) -> list[Row]:
    split = []
    for name, factory in custom:
        if not callable(factory):
            raise TypeError(f"algorithm {name!r}: wanted what makes a sampler of a seed, got {factory!r}")
        shown = name.partition("+")[2] or "hold"
        split.append((name, shown, factory))
    return run_experiment(text, str(folder), with_named, split)


def _toml(value: Any) -> str:
    """Numbers, strings and lists look the same in TOML as in JSON."""
    return json.dumps(value, ensure_ascii=False)
