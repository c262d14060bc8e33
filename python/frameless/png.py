"""Pictures as files, without a library for them."""

import os
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray


def save_png(path: str | Path, image: NDArray[Any]) -> None:
    """Write a picture as PNG with 8 bits per channel; the file appears whole or not at all.

    ``image``: display-referred sRGB, shape (height, width, 3), floats in [0, 1] (what lies outside is clamped) or uint8.

    Raises ValueError for another shape or dtype, or NaN, TypeError for what is no array.
    """
    if not isinstance(image, np.ndarray):
        raise TypeError(f"image: wanted a numpy array, got {type(image).__name__}")
    if image.ndim != 3 or image.shape[2] != 3 or image.size == 0:
        raise ValueError(f"image: wanted shape (height, width, 3), got {image.shape}")
    if image.dtype.kind == "f":
        if np.isnan(image).any():
            raise ValueError("image: wanted numbers, got NaN")
        image = np.rint(np.clip(image, 0.0, 1.0) * 255.0).astype(np.uint8)
    if image.dtype != np.uint8:
        raise ValueError(f"image: wanted floats or uint8, got {image.dtype}")
    height, width, _ = image.shape
    # Every row begins with its filter: 0, none.
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = image.reshape(height, 3 * width)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes())), (b"IEND", b"")]
    path = Path(path)
    unfinished = path.with_name(path.name + f".{os.getpid()}.part")
    try:
        unfinished.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in chunks))
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
