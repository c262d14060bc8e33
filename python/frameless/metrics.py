"""How far one picture is from another: arrays of shape (height, width, 3), display-referred sRGB in [0, 1], float32 or float64."""

from ._frameless import flip, psnr, rmse, ssim

__all__ = ["flip", "psnr", "rmse", "ssim"]
