"""What several tests use."""

import os
from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
import pytest
from numpy.typing import NDArray

import frameless


def pattern(x: NDArray[Any], y: NDArray[Any], time: float, camera: object) -> NDArray[Any]:
    """A still picture whose every pixel differs from its neighbours; linear RGB in [0, 1]."""
    return np.stack([0.5 + 0.5 * np.sin(x), 0.5 + 0.5 * np.cos(y), (x + y) % 1.0], axis=1)


def pixel_centres(width: int, height: int) -> tuple[NDArray[Any], NDArray[Any]]:
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    return columns.ravel().astype(np.float32), rows.ravel().astype(np.float32)


def srgb(linear: NDArray[Any]) -> NDArray[Any]:
    """IEC 61966-2-1, clamped to [0, 1]."""
    x = np.clip(linear, 0.0, 1.0)
    encoded: NDArray[Any] = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return encoded


@pytest.fixture
def session() -> frameless.Session:
    return frameless.Session((40, 30), batch=100, reconstruction="hold", sampler="permutation")


@pytest.fixture
def report_skip() -> Callable[[str], NoReturn]:
    """Skips aloud; fails in CI, where nothing may be missing."""

    def skip(missing: str) -> NoReturn:
        if os.environ.get("CI") == "true":
            pytest.fail(missing)
        pytest.skip(missing)

    return skip
