"""Is it a sampler? The same questions for the built-in ones and for yours."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._frameless import Session
from .sampling import Sampler

Factory = Callable[[int], Sampler]
"""Makes a sampler of a seed."""


def check_sampler(make: Factory, *, every_pixel_within: float = 2.0) -> None:
    """Run a sampler through what every sampler must do; raises AssertionError with what it did instead.

    Parameters:

    - `make`: makes a sampler of a seed
    - `every_pixel_within`: seconds in which every pixel of a still picture must be traced, at 13 samples per pixel and second
    """
    check_convergence(make, every_pixel_within)
    check_floor(make)
    check_seeds(make)
    check_resize(make)
    check_probability(make)


def still(x: NDArray[Any], y: NDArray[Any], time: float, camera: object) -> NDArray[Any]:
    """A picture that never changes, and differs from pixel to pixel."""
    return np.stack([x / 64.0, y / 48.0, np.full_like(x, 0.5)], axis=1)


def flickering(x: NDArray[Any], y: NDArray[Any], time: float, camera: object) -> NDArray[Any]:
    """The left half is still, the right half flickers for ever."""
    bright = (x >= 16.0) * float(int(time * 100.0) % 2)
    return np.repeat(bright[:, None], 3, axis=1)


def _require(holds: bool, otherwise: str) -> None:
    """As assert, but also with python -O."""
    if not holds:
        raise AssertionError(otherwise)


def _session(sampler: Sampler, rate: float, reconstruction: str = "hold") -> Session:
    return Session((32, 24), sampler=sampler, reconstruction=reconstruction, simulated=rate)


def check_convergence(make: Factory, seconds: float) -> None:
    """A still picture becomes the ideal one, pixel for pixel, in every reconstruction."""
    columns, rows = np.meshgrid(np.arange(32) + 0.5, np.arange(24) + 0.5)
    ideal = still(columns.ravel(), rows.ravel(), 0.0, None).reshape(24, 32, 3)
    for reconstruction in ("hold", "filter", "reproject"):
        session = _session(make(1), 10_000.0, reconstruction)
        session.run(still, seconds)
        missing = int((~session.known()).sum())
        _require(missing == 0, f"{missing} pixels were never traced within {seconds} s")
        error = float(np.abs(session.rgb() - ideal).max())
        _require(error < 1e-6, f"{reconstruction}: a still picture is off by {error}")


def check_floor(make: Factory) -> None:
    """However much something flickers, what is still is looked at now and then."""
    session = _session(make(1), 20_000.0)
    session.run(flickering, 4.0)
    old = float((session.age()[:, :16] > 2.0).mean())
    _require(old < 0.05, f"{100 * old:.0f} % of the pixels beside what flickers have not been traced for 2 s")


def check_seeds(make: Factory) -> None:
    """The same seed makes the same picture."""

    def ages(seed: int) -> NDArray[Any]:
        session = _session(make(seed), 5_000.0)
        session.run(flickering, 0.2)
        return session.age()

    _require(np.array_equal(ages(1), ages(1)), "the same seed made other choices")


def check_resize(make: Factory) -> None:
    """Another size is no end."""
    session = _session(make(1), 20_000.0)
    session.run(still, 0.1)
    for size in ((50, 7), (1, 1), (32, 24)):
        session.resize(size)
        kept = session.run(still, 0.3)
        _require(kept > 0, f"nothing was traced after a resize to {size}")


def check_probability(make: Factory) -> None:
    """If it tells probabilities, they are one per pixel, and sum to 1."""
    session = _session(make(1), 20_000.0)
    session.run(flickering, 0.2)
    try:
        session.probability()
    except (TypeError, ValueError) as error:
        raise AssertionError(str(error)) from error
