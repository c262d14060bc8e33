"""Mitsuba 3, interactive: a path-traced room in which a ball jumps every four seconds; drag to look around.

Run it: python examples/mitsuba_viewer.py            (--picture FILE saves a picture instead)
"""

from typing import Any

import frameless
from mitsuba_scene import CAMERA, Renderer, room
from show import show

renderer = Renderer(room())
is_there = False


def render(x: Any, y: Any, time: float, camera: frameless.Camera, seed: Any) -> frameless.Samples:
    global is_there
    if is_there != bool(int(time / 4.0) % 2):
        is_there = not is_there
        renderer.move_ball(is_there)
    return renderer(x, y, time, camera, seed)


if __name__ == "__main__":
    show(render, CAMERA, (320, 240), noisy=True, seconds=7.0)
