"""Mitsuba 3 as the renderer: any of its scenes, path-traced sample by sample where frameless wants samples.

Mitsuba's vectorised variants need LLVM 16 or newer at run time (Debian: libllvm19; else set DRJIT_LIBLLVM_PATH).
"""

from typing import Any

import mitsuba as mi
import numpy as np

import frameless

mi.set_variant("llvm_ad_rgb")

import drjit as dr  # noqa: E402  (Mitsuba says first which of its variants is used)

CAMERA = frameless.Camera(eye=(0, 1.6, 5.2), target=(0, 0.75, 0), fov=38)
BALL = {False: (-0.55, 0.3, 1.0), True: (0.15, 0.3, 1.1)}


def room() -> Any:
    """Five balls in a room with a lamp; the one called `ball` is there to be moved."""
    T = mi.ScalarTransform4f

    def matte(*rgb: float) -> dict[str, Any]:
        return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(rgb)}}

    def ball(centre: tuple[float, float, float], radius: float, bsdf: dict[str, Any]) -> dict[str, Any]:
        return {"type": "sphere", "to_world": T().translate(list(centre)).scale(radius), "bsdf": bsdf}

    def wall(place: Any, *rgb: float) -> dict[str, Any]:
        return {"type": "rectangle", "to_world": place, "bsdf": matte(*rgb)}

    gold = {"type": "roughconductor", "alpha": 0.25, "specular_reflectance": {"type": "rgb", "value": [0.95, 0.75, 0.4]}}
    return mi.load_dict(
        {
            "type": "scene",
            "floor": wall(T().rotate([1, 0, 0], -90).scale(3), 0.6, 0.58, 0.55),
            "ceiling": wall(T().translate([0, 3, 0]).rotate([1, 0, 0], 90).scale(3), 0.7, 0.7, 0.7),
            "back": wall(T().translate([0, 0, -2]).scale(3), 0.65, 0.65, 0.7),
            "left": wall(T().translate([-2.4, 0, 0]).rotate([0, 1, 0], 90).scale(3), 0.7, 0.25, 0.2),
            "right": wall(T().translate([2.4, 0, 0]).rotate([0, 1, 0], -90).scale(3), 0.2, 0.4, 0.65),
            "lamp": {
                "type": "rectangle",
                "to_world": T().translate([0, 2.95, 0.5]).rotate([1, 0, 0], 90).scale(0.8),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [11, 10, 9]}},
            },
            "white": ball((-1.2, 0.7, -0.6), 0.7, matte(0.85, 0.85, 0.85)),
            "gold": ball((1.1, 0.8, -0.7), 0.8, gold),
            "blue": ball((0.15, 0.45, -1.0), 0.45, matte(0.2, 0.35, 0.8)),
            "green": ball((1.2, 0.25, 0.9), 0.25, matte(0.3, 0.65, 0.25)),
            "ball": ball(BALL[False], 0.3, matte(0.9, 0.35, 0.1)),
        }
    )


class Seeded(mi.Sampler):  # type: ignore[misc]
    """Random numbers of each sample's own seed, so that the same sample of an unchanged scene has the same colour."""

    def __init__(self, props: Any) -> None:
        super().__init__(props)
        self.rng: Any = mi.PCG32()  # type: ignore[operator]

    def seed_each(self, seeds: Any) -> None:
        self.rng = mi.PCG32(initstate=mi.UInt64(seeds), initseq=mi.UInt64(seeds) + 1)  # type: ignore[operator]

    def next_1d(self, active: Any = True) -> Any:
        return self.rng.next_float32(active)

    def next_2d(self, active: Any = True) -> Any:
        first = self.rng.next_float32(active)
        return mi.Point2f(first, self.rng.next_float32(active))

    def schedule_state(self) -> None:
        dr.schedule(self.rng)


mi.register_sampler("seeded", Seeded)


class Renderer:
    """Calls Mitsuba's path tracer for any places in the picture."""

    def __init__(self, scene: Any, max_depth: int = 4) -> None:
        self.scene = scene
        self.parameters = mi.traverse(scene)
        self.integrator = mi.load_dict({"type": "path", "max_depth": max_depth})
        self.sampler = mi.load_dict({"type": "seeded"})
        self.shapes = {shape.id(): number for number, shape in enumerate(scene.shapes())}

    def move_ball(self, there: bool) -> None:
        """An edit: the ball is at one of its two places."""
        self.parameters["ball.to_world"] = mi.ScalarTransform4f().translate(list(BALL[there])).scale(0.3)
        self.parameters.update()

    def __call__(self, x: Any, y: Any, time: float, camera: frameless.Camera, seed: Any) -> frameless.Samples:
        origin, direction = camera.rays(x, y)
        ray = mi.RayDifferential3f(mi.Point3f(*columns(origin)), mi.Vector3f(*columns(direction)))
        self.sampler.seed_each(mi.UInt32(aligned(seed)))
        rgb, _, _ = self.integrator.sample(self.scene, self.sampler, ray)
        hit = self.scene.ray_intersect_preliminary(mi.Ray3f(ray), coherent=False)
        shape = dr.reinterpret_array(mi.UInt32, hit.shape)
        dr.eval(rgb, hit.t, shape)
        distance = np.array(hit.t)
        # Mitsuba numbers shapes from 1; 0 is nothing.
        number = np.array(shape).astype(np.int64) - 1
        position = origin + np.where(number >= 0, distance, 0.0)[:, None].astype(np.float32) * direction
        return frameless.Samples(np.stack([np.array(c) for c in rgb], axis=1), position=position, object_id=number)


def columns(rows: Any) -> list[Any]:
    """One array per component. (Of one array of three rows Mitsuba would compile the length into its kernel, and compile anew for
    every other.)"""
    return [mi.Float(aligned(column)) for column in rows.T]


def aligned(values: Any) -> Any:
    """The same numbers at a multiple of 64 bytes. (Where they lie is compiled into Mitsuba's kernel, too.)"""
    memory = np.empty(values.size + 16, values.dtype)
    start = -memory.ctypes.data // values.itemsize % 16
    memory[start : start + values.size] = values
    return memory[start : start + values.size]
