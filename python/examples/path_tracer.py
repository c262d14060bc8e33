"""A path tracer with noise, in numpy: a box with three balls and a lamp in its ceiling, which changes its colour every four seconds.

Noise looks like change, unless a renderer makes its random numbers from the seeds that it is given: then the same sample of an unchanged
scene has the same colour, whatever has another has changed, and everything else adds up to a picture without noise.

Run it: python examples/path_tracer.py            (--picture FILE saves a picture instead)
"""

import numpy as np

import frameless
from show import show

BALLS = np.array([[-0.45, -0.65, -0.3, 0.35], [0.45, -0.7, 0.25, 0.3], [0.0, -0.1, -0.6, 0.25]])
BALL_ALBEDO = np.array([[0.9, 0.7, 0.3], [0.3, 0.6, 0.9], [0.85, 0.85, 0.85]])
WALL_ALBEDO = np.array([[0.75, 0.2, 0.2], [0.2, 0.6, 0.25], [0.7, 0.7, 0.7], [0.7, 0.7, 0.7], [0.7, 0.7, 0.7]])
WALLS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float)
BOUNCES = 2
LAMP = 0.35


def random(seed, number):
    """Numbers in [0, 1), the same for the same seed: splitmix64 (Steele et al. 2014)."""
    z = (seed.astype(np.uint64) << np.uint64(16)) + np.uint64((number + 1) * 0x9E3779B97F4A7C15 % 2**64)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return ((z ^ (z >> np.uint64(31))) >> np.uint64(40)).astype(float) * 2.0**-24


def nearest(o, d):
    """Distance, normal, albedo and number of what each ray hits first; the box is open towards the camera."""
    t, which = np.full(len(o), np.inf), np.full(len(o), -1)
    for i, wall in enumerate(WALLS):
        with np.errstate(divide="ignore", invalid="ignore"):
            here = -(1.0 + o @ wall) / (d @ wall)
        p = o + np.where(np.isfinite(here), here, 0.0)[:, None] * d
        closer = (here > 1e-4) & (here < t) & (np.abs(p).max(axis=1) < 1.0001)
        t, which = np.where(closer, here, t), np.where(closer, i, which)
    for i, (*centre, radius) in enumerate(BALLS):
        to = o - centre
        b, c = np.sum(to * d, axis=1), np.sum(to * to, axis=1) - radius**2
        root = b * b - c
        here = -b - np.sqrt(np.maximum(root, 0.0))
        closer = (root > 0.0) & (here > 1e-4) & (here < t)
        t, which = np.where(closer, here, t), np.where(closer, 5 + i, which)
    p = o + np.where(which >= 0, t, 0.0)[:, None] * d
    centres = np.concatenate([np.zeros((5, 3)), BALLS[:, :3]])[which]
    normal = np.where((which < 5)[:, None], WALLS[np.minimum(which, 4)], p - centres)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True) + 1e-12
    return p, normal, np.concatenate([WALL_ALBEDO, BALL_ALBEDO])[which], which


def is_lamp(p, which):
    return (which == 3) & (np.abs(p[:, 0]) < LAMP) & (np.abs(p[:, 2]) < LAMP)


def from_lamp(p, normal, u, v):
    """What a point sees of the lamp: irradiance by one point of it, for radiance 1."""
    to = np.stack([LAMP * (2.0 * u - 1.0), np.full_like(u, 0.9999), LAMP * (2.0 * v - 1.0)], axis=1) - p
    away = np.linalg.norm(to, axis=1, keepdims=True)
    d = to / away
    at, _, _, which = nearest(p + 1e-4 * normal, d)
    cosines = np.maximum(np.sum(normal * d, axis=1), 0.0) * np.maximum(d[:, 1], 0.0)
    return is_lamp(at, which) * cosines * (2.0 * LAMP) ** 2 / away[:, 0] ** 2


def render(x, y, time, camera, seed):
    colour = np.array([[9.0, 8.0, 6.0], [3.0, 6.0, 9.0]])[int(time / 4.0) % 2]
    o, d = (a.astype(float) for a in camera.rays(x, y))
    weight = np.ones((len(x), 3))
    for bounce in range(BOUNCES):
        u, v, w, s = (random(seed, 4 * bounce + i) for i in range(4))
        p, normal, albedo, which = nearest(o, d)
        if bounce == 0:
            first = p, normal, which
            rgb = is_lamp(p, which)[:, None] * colour
        weight *= albedo * ((which >= 0) & ~is_lamp(p, which))[:, None]
        rgb += weight * from_lamp(p, normal, u, v)[:, None] / np.pi * colour
        # A direction by the cosine to the normal: a point on the unit sphere around the normal's tip.
        z, phi = 2.0 * w - 1.0, 2.0 * np.pi * s
        r = np.sqrt(1.0 - z * z)
        d = normal + 0.999 * np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)
        d /= np.linalg.norm(d, axis=1, keepdims=True) + 1e-12
        o = p + 1e-4 * normal
    p, normal, which = first
    return frameless.Samples(rgb, position=p, normal=normal, object_id=which)


if __name__ == "__main__":
    show(render, frameless.Camera(eye=(0, 0, 3.4), target=(0, 0, 0), fov=40), (160, 160), noisy=True, seconds=11.0)
