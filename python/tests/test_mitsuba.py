"""Paths against another renderer, which shares no code with ours: see ../against_mitsuba."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[1] / "against_mitsuba"
SIZE, SAMPLES = (64, 48), 1024


@pytest.fixture(scope="module")
def compare() -> Any:
    sys.path.insert(0, str(FOLDER))
    try:
        return __import__("compare")
    except (ImportError, RuntimeError) as error:
        return str(error)
    finally:
        sys.path.remove(str(FOLDER))


@pytest.mark.parametrize("number", range(4))
def test_means_by_region_agree_with_mitsuba(compare: Any, number: int, report_skip: Any) -> None:
    if isinstance(compare, str):
        report_skip(f"Mitsuba with an LLVM is missing: {compare}")
    if not compare.SCENES.is_dir():
        report_skip("../shared/scenes with glTF files is missing")
    subject = compare.subjects(compare.SCENES)[number]
    verdict = compare.compare(subject, SIZE, SAMPLES)
    # Else the test would see nothing.
    assert np.median(verdict.noise / verdict.theirs) < 0.012
    assert np.abs(verdict.whole).max() < 0.01, f"{subject.name}: {verdict.whole}"
    apart = [f"region {place}: {100 * verdict.apart[place]:.1f} %" for place in zip(*np.nonzero(~verdict.agree), strict=True)]
    assert not apart, f"{subject.name}: {apart}"
