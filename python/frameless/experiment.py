"""Comparisons on the simulated clock: every algorithm against the picture of an ideal renderer that takes no time."""

import json
import math
import operator
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypedDict, TypeVar

import numpy as np
from numpy.typing import NDArray

from ._frameless import run_experiment
from .sampling import Sampler

class Row(TypedDict):
    """One run. Means over the scored refreshes; NaN where something was not measured. ``pandas.DataFrame(rows)`` takes a list of
    them."""

    scene: str
    algorithm: str
    samples_per_sec: float
    seed: int
    width: int
    height: int
    display_hz: int
    rmse: float
    """Root mean squared error over all pixels and channels, display-referred sRGB in [0, 1]."""
    rmse_p95: float
    """95th percentile of the refreshes' RMSE."""
    rmse_changed: float
    """RMSE of the pixels that changed in the last 100 ms, alone."""
    psnr_db: float
    ssim: float
    flip: float
    age_secs: float
    """Mean age of what pixels show."""
    oldest_secs: float
    rmse_over_time: NDArray[np.float64]
    """RMSE at every refresh, unscored ones included."""


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

    Raises ValueError for what makes no sense, TypeError for what is no number, name or factory; what a sampler of your own raises arrives as it is. Ctrl-C ends it at once.
    """
    width, height = _pair("size", size)
    if isinstance(algorithms, str):
        raise TypeError(f"algorithms: wanted a list of names and pairs, got {algorithms!r}; write [{algorithms!r}]")
    named, custom = _split(list(algorithms))
    last, first = _positive("seconds", seconds), _number("unscored", unscored)
    if last <= first:
        raise ValueError(f"seconds: wanted more than the {first} s of unscored, got {last}")
    lines = [
        'title = "compare"',
        # A file names at least one algorithm.
        f"algorithms = {_toml(named or ['random'])}",
        f"samples_per_sec = {_toml(_several('samples_per_sec', samples_per_sec, _positive))}",
        f"seeds = {_toml(_several('seeds', seeds, _whole))}",
        f"width = {width}",
        f"height = {height}",
        f"display_hz = {_whole('display_hz', display_hz, least=1)}",
        f"duration_secs = {_toml(last)}",
        f"unscored_secs = {_toml(first)}",
    ]
    for scene in _several("scenes", scenes, _scene):
        lines += ["[[scenes]]", f"scene = {_toml(scene)}"]
    lines += [
        "[metrics]",
        f"ssim_every = {_whole('ssim_every', ssim_every)}",
        f"flip_every = {_whole('flip_every', flip_every)}",
        "[output]",
        "video = false",
    ]
    return run_experiment("\n".join(lines), str(Path.cwd()), bool(named), custom)


def compare_file(path: str | Path) -> list[Row]:
    """Run the experiment in a TOML file (see docs/evaluation.md) and return its runs as rows. Writes nothing.

    Raises OSError if the file cannot be read, ValueError if it is not what it should be.
    """
    path = Path(path)
    return run_experiment(path.read_text(encoding="utf-8"), str(path.parent), True, [])


_Custom = tuple[str, str, Callable[[int], Sampler]]
"""A name, how samples are shown, and what makes a sampler of a seed."""


def _split(algorithms: list[Algorithm]) -> tuple[list[str], list[_Custom]]:
    """Those that have a name only, and the others."""
    if not algorithms:
        raise ValueError("algorithms: wanted at least one algorithm, got none")
    named: list[str] = []
    custom: list[_Custom] = []
    for algorithm in algorithms:
        if isinstance(algorithm, str):
            named.append(algorithm)
            continue
        if not isinstance(algorithm, tuple) or len(algorithm) != 2 or not isinstance(algorithm[0], str):
            raise TypeError(f"algorithms: wanted names and pairs of a name and a factory, got {algorithm!r}")
        name, factory = algorithm
        if not callable(factory):
            raise TypeError(f"algorithm {name!r}: wanted what makes a sampler of a seed, got {factory!r}")
        custom.append((name, name.partition("+")[2] or "hold", factory))
    names = named + [name for name, _, _ in custom]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"algorithms: wanted each name once, got {twice!r} twice")
    return named, custom


_T = TypeVar("_T")


def _several(name: str, given: Any, check: Callable[[str, Any], _T]) -> list[_T]:
    """One or a sequence of them, each checked."""
    if isinstance(given, (str, Path)) or not isinstance(given, Iterable):
        return [check(name, given)]
    several = [check(name, one) for one in given]
    if not several:
        raise ValueError(f"{name}: wanted at least one, got none")
    return several


def _scene(name: str, given: Any) -> str:
    if not isinstance(given, (str, Path)):
        raise TypeError(f"{name}: wanted names or paths, got {given!r}")
    scene = str(given)
    if not scene.isprintable():
        raise ValueError(f"{name}: wanted a name or path of printable characters, got {scene!r}")
    return scene


def _whole(name: str, given: Any, least: int = 0) -> int:
    try:
        number = operator.index(given)
    except TypeError:
        raise TypeError(f"{name}: wanted a whole number, got {given!r}") from None
    if not least <= number < 2**63:
        raise ValueError(f"{name}: wanted a whole number of at least {least}, got {number}")
    return number


def _float(name: str, given: Any) -> float:
    try:
        return float(given)
    except (TypeError, ValueError):
        raise TypeError(f"{name}: wanted a number, got {given!r}") from None


def _number(name: str, given: Any) -> float:
    number = _float(name, given)
    if not 0.0 <= number < math.inf:
        raise ValueError(f"{name}: wanted a finite number of at least 0, got {number}")
    return number


def _positive(name: str, given: Any) -> float:
    number = _float(name, given)
    if not 0.0 < number < math.inf:
        raise ValueError(f"{name}: wanted a finite number above 0, got {number}")
    return number


def _pair(name: str, given: Any) -> tuple[int, int]:
    try:
        width, height = given
    except (TypeError, ValueError):
        raise TypeError(f"{name}: wanted (width, height) in pixels, got {given!r}") from None
    return _whole(f"{name}: width", width, least=1), _whole(f"{name}: height", height, least=1)


def _toml(value: Any) -> str:
    """Numbers, strings and lists look the same in TOML as in JSON."""
    return json.dumps(value, ensure_ascii=False)
