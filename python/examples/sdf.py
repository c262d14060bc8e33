"""A signed distance field in numpy: spheres that melt into each other above a floor, under a lamp that circles.

Run it: python examples/sdf.py            (--picture FILE saves a picture instead)
"""

import numpy as np

import frameless
from show import show


def distance(p, time):
    """How far the nearest surface is, and whether that is the floor."""
    near = np.full(len(p), 1e-20, np.float32)
    for i, speed in enumerate((1.0, 1.3, 0.7)):
        to = p - np.array([1.4 * np.sin(speed * time), 0.6 + 0.5 * i, 0.9 * i - 0.9], np.float32)
        near += np.exp(3.6 - 6.0 * np.sqrt(np.einsum("ij,ij->i", to, to)))
    blob = -np.log(near) / np.float32(6.0)
    return np.minimum(blob, p[:, 1]), p[:, 1] < blob


def march(origin, direction, time, steps):
    """Sphere tracing: how far each ray gets."""
    t = np.full(len(origin), 0.02, np.float32)
    for _ in range(steps):
        t += distance(origin + t[:, None] * direction, time)[0]
    return np.minimum(t, 60.0)


def render(x, y, time, camera):
    """Linear RGB, and where it was seen, so that samples go along with the camera."""
    origin, direction = camera.rays(x, y)
    t = march(origin, direction, time, 32)
    p = origin + t[:, None] * direction
    hit = t < 50.0
    here, is_floor = distance(p, time)
    normal = np.stack([distance(p + step, time)[0] - here for step in np.eye(3, dtype=np.float32) / 200], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    lamp = np.array([4.0 * np.cos(0.5 * time), 5.0, 4.0 * np.sin(0.5 * time)], np.float32) - p
    away = np.linalg.norm(lamp, axis=1, keepdims=True)
    lit = march(p + 0.01 * normal, lamp / away, time, 16) > 0.9 * away[:, 0]
    light = 0.05 + 25.0 * (lit * np.maximum(np.sum(normal * lamp, axis=1), 0.0)) / away[:, 0] ** 3
    checks = 0.3 + 0.4 * ((np.floor(p[:, 0]) + np.floor(p[:, 2])) % 2)
    albedo = np.where(is_floor[:, None], checks[:, None], [0.9, 0.35, 0.15])
    sky = 0.2 + 0.4 * np.maximum(direction[:, 1:2], 0.0) * [0.6, 0.8, 1.0]
    rgb = np.where(hit[:, None], albedo * light[:, None], sky)
    return frameless.Samples(rgb, position=p, object_id=np.where(hit, is_floor.astype(int), -1))


if __name__ == "__main__":
    show(render, frameless.Camera(eye=(0, 2.5, 6), target=(0, 0.8, 0)), (320, 240))
