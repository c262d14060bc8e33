"""How long after an edit is the view right? Frameless against what viewers do today, with one renderer on one machine.

After the ball of mitsuba_scene has been moved, the time is taken until the picture is within an RMSE of 0.05 and 0.02 (sRGB) of the
converged one, of the whole picture and of the pixels that the edit changes by more than 0.04:

- frameless: samples go where something changes; what does not, stays;
- restart: the picture is cleared, whole frames of one sample per pixel add up;
- low resolution first: a frame of a quarter of the resolution, one of half, then as restart.

Run it: python examples/mitsuba_edit.py [--seconds 12] [--reference 1024] [--picture FILE]
"""

import argparse
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import frameless
from mitsuba_scene import CAMERA, Renderer, room

Shown = list[tuple[float, Any]]
"""Seconds since the edit, and the picture from then on."""

THRESHOLDS = (0.05, 0.02)


def srgb(linear: Any) -> Any:
    x = np.clip(linear, 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def frames(renderer: Renderer, size: tuple[int, int], seed: int) -> Iterator[Any]:
    """Whole pictures of one sample per pixel at random places in it, linear."""
    rng = np.random.default_rng(seed)
    width, height = size
    columns, rows = (plane.ravel() for plane in np.meshgrid(np.arange(width), np.arange(height)))
    camera = CAMERA.with_size(size)
    while True:
        x, y = ((plane + rng.random(plane.size)).astype(np.float32) for plane in (columns, rows))
        seeds = rng.integers(0, 2**32, columns.size, dtype=np.uint32)
        yield renderer(x, y, 0.0, camera, seeds).rgb.reshape(height, width, 3)


def converged(renderer: Renderer, size: tuple[int, int], samples: int) -> Any:
    source, total = frames(renderer, size, 1), np.zeros((size[1], size[0], 3))
    for _ in range(samples):
        total += next(source)
    return srgb(total / samples)


def frameless_edit(renderer: Renderer, size: tuple[int, int], edit: Callable[[], None], before: float, seconds: float) -> Shown:
    session = frameless.Session(size, camera=CAMERA, noisy=True)
    session.run(renderer, before)
    shown: Shown = []
    begin = time.perf_counter()
    edit()
    for batch in session.batches(seconds):
        samples = renderer(batch.x, batch.y, batch.time, batch.camera or CAMERA, batch.seed)
        batch.submit(samples.rgb, position=samples.position, object_id=samples.object_id)
        if not shown or time.perf_counter() - begin - shown[-1][0] > 1 / 30:
            shown.append((time.perf_counter() - begin, session.image()))
    return shown


def restart_edit(renderer: Renderer, size: tuple[int, int], edit: Callable[[], None], coarse: tuple[int, ...], seconds: float) -> Shown:
    begin, shown = time.perf_counter(), []
    edit()

    def show(linear: Any) -> None:
        shown.append((time.perf_counter() - begin, srgb(linear)))

    for divisor in coarse:
        small = next(frames(renderer, (size[0] // divisor, size[1] // divisor), 2))
        show(small.repeat(divisor, axis=0).repeat(divisor, axis=1))
    source, total, count = frames(renderer, size, 3), np.zeros((size[1], size[0], 3)), 0
    while time.perf_counter() - begin < seconds:
        total, count = total + next(source), count + 1
        show(total / count)
    return shown


def until(shown: Shown, ideal: Any, threshold: float, where: Any) -> float:
    """When the picture has come within the threshold to stay; infinite if never."""
    error = [np.sqrt(np.mean((picture - ideal)[where] ** 2)) for _, picture in shown]
    late = [i for i, rmse in enumerate(error) if rmse > threshold]
    first = late[-1] + 1 if late else 0
    return shown[first][0] if first < len(shown) else np.inf


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--size", default="320x240")
    arguments.add_argument("--before", type=float, default=20.0, help="seconds that frameless works before the edit")
    arguments.add_argument("--seconds", type=float, default=12.0, help="seconds that everybody works after it")
    arguments.add_argument("--reference", type=int, default=1024, help="samples per pixel of the converged picture")
    arguments.add_argument("--picture", metavar="FILE", help="save what everybody shows half a second after the edit")
    given = arguments.parse_args()
    width, height = map(int, given.size.split("x"))
    size, renderer = (width, height), Renderer(room())

    was = converged(renderer, size, max(16, given.reference // 4))
    renderer.move_ball(True)
    ideal = converged(renderer, size, given.reference)
    renderer.move_ball(False)

    def edit() -> None:
        renderer.move_ball(True)

    contenders: dict[str, Callable[[], Shown]] = {
        "frameless": lambda: frameless_edit(renderer, size, edit, given.before, given.seconds),
        "restart": lambda: restart_edit(renderer, size, edit, (), given.seconds),
        "low resolution first": lambda: restart_edit(renderer, size, edit, (4, 2), given.seconds),
    }
    everywhere, changed = np.ones((height, width), bool), np.abs(ideal - was).max(axis=2) > 0.04
    print(f"{width}x{height}; the edit changes {100 * changed.mean():.1f} % of the pixels")
    print("seconds until RMSE <=        0.05    0.02   of what changed: 0.05    0.02   first picture")
    pictures = []
    for name, contend in contenders.items():
        renderer.move_ball(False)
        shown = contend()
        times = [until(shown, ideal, threshold, where) for where in (everywhere, changed) for threshold in THRESHOLDS]
        print(f"{name:24} {times[0]:8.2f}{times[1]:8.2f}{times[2]:23.2f}{times[3]:8.2f}{shown[0][0]:12.2f}")
        pictures.append(next(picture for at, picture in reversed(shown) if at <= 0.5 or at == shown[0][0]))
    if given.picture:
        frameless.save_png(given.picture, np.concatenate([*pictures, ideal], axis=1))


if __name__ == "__main__":
    main()
