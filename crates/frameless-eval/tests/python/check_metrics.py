"""Our metrics against scikit-image and FLIP's own Python package.

    check_metrics.py FOLDER

FOLDER holds what the example `metric_pairs` wrote: pairs of PNG files and metrics.json. Exits with 1 if a value is
farther off than the tolerance.
"""

import json
import math
import sys
from pathlib import Path

import flip_evaluator
import numpy as np
from PIL import Image
from skimage.metrics import mean_squared_error, structural_similarity

# RMSE: single against double precision. SSIM: single precision in the variances, over tens of thousands of windows.
# FLIP: version 1.7 of the authors' program against the older one inside the crate nv-flip, which filters in another order.
TOLERANCES = {"rmse": 1e-6, "psnr_db": 1e-3, "ssim": 1e-5, "flip": 1e-4}


def read(path: Path) -> np.ndarray:
    """Height × width × 3, sRGB in [0, 1]."""
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.float64) / 255.0


def luma(picture: np.ndarray) -> np.ndarray:
    return picture @ np.array([0.299, 0.587, 0.114])


def independent(reference: np.ndarray, test: np.ndarray) -> dict:
    rmse = math.sqrt(mean_squared_error(reference, test))
    ssim = structural_similarity(
        luma(reference),
        luma(test),
        data_range=1.0,
        gaussian_weights=True,
        sigma=1.5,
        use_sample_covariance=False,
    )
    _, flip, _ = flip_evaluator.evaluate(
        reference.astype(np.float32), test.astype(np.float32), "LDR", applyMagma=False
    )
    psnr_db = -20 * math.log10(rmse) if rmse > 0 else None
    return {"rmse": rmse, "psnr_db": psnr_db, "ssim": float(ssim), "flip": float(flip)}


def differs(ours: float | None, theirs: float | None, tolerance: float) -> bool:
    if ours is None or theirs is None:
        return ours is not theirs
    return not abs(ours - theirs) <= tolerance


def main() -> int:
    folder = Path(sys.argv[1])
    rows = json.loads((folder / "metrics.json").read_text())
    wrong = 0
    for row in rows:
        pair = row["pair"]
        theirs = independent(read(folder / f"{pair}-reference.png"), read(folder / f"{pair}-test.png"))
        for metric, tolerance in TOLERANCES.items():
            is_wrong = differs(row[metric], theirs[metric], tolerance)
            wrong += is_wrong
            mark = "WRONG" if is_wrong else "ok"
            print(f"{mark:5} {pair:18} {metric:8} ours {row[metric]}  theirs {theirs[metric]}")
    print(f"{len(rows)} pairs, {wrong} values off")
    return 1 if wrong or not rows else 0


if __name__ == "__main__":
    sys.exit(main())
