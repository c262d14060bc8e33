"""What every example does at the end: look at it in the browser, or work for a while without and save a picture."""

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import frameless


def show(
    render: Callable[..., Any],
    camera: frameless.Camera,
    size: tuple[int, int] = (480, 360),
    noisy: bool = False,
    exposure: float = 0.0,
    seconds: float = 4.0,
) -> None:
    """``--picture FILE`` saves what there is after ``--seconds``; without, a page opens in the browser."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--picture", metavar="FILE", help="save a PNG instead of opening the browser")
    arguments.add_argument("--seconds", type=float, default=seconds, help="how long to work for it")
    given = arguments.parse_args()
    if given.picture is None:
        frameless.view(render, size, camera=camera, noisy=noisy, exposure=exposure)
        return
    session = frameless.Session(size, camera=camera, noisy=noisy, exposure=exposure)
    begin = time.perf_counter()
    kept = session.run(render, given.seconds)
    rate = kept / (time.perf_counter() - begin)
    frameless.save_png(given.picture, np.concatenate([session.image(), heat(session)], axis=1))
    print(f"{kept:,} samples, {rate:,.0f}/s, {kept / (size[0] * size[1]):.1f} per pixel -> {given.picture}")


def heat(session: frameless.Session) -> Any:
    """How long ago each pixel was traced, as a picture: black now, white the oldest."""
    age = session.age()
    known = np.isfinite(age)
    oldest = age[known].max(initial=1e-9)
    grey = np.where(known, age / oldest, 1.0)
    return np.repeat(grey[:, :, None], 3, axis=2).astype(np.float32)
