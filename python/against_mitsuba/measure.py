"""How fast are samples of real scenes, beside Mitsuba 3; how soon is an edit right; how long and how much does loading take?

All of it in alternating rounds of one run, given as medians with the smallest and the largest round. Both renderers have the same files,
Lambertian surfaces, the same light, size, depth and roulette, all cores, and pictures long enough that starting does not count.

Run it: cargo xtask measure-scenes
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mitsuba
import numpy as np

mi: Any = mitsuba
mi.set_variant("scalar_rgb")

import staging  # noqa: E402
import translate  # noqa: E402
from gltf import Gltf  # noqa: E402

SIZE = (512, 384)
DEPTH = 4
"""Bounces after the first surface."""
SAMPLES = {"path": 8, "direct": 24}
"""Per pixel: seconds of work."""
SCENES: dict[str, Callable[[Path, str], Gltf]] = {
    "Cornell box": staging.cornell,
    "apartment": staging.apartment,
    "bathroom": staging.bathroom,
}
LIGHTS = {"path": "lamp", "direct": "point"}


def integrators() -> dict[str, Any]:
    """Mitsuba counts the camera's ray and the one to the light."""
    path = {"type": "path", "max_depth": DEPTH + 2, "rr_depth": 4}
    direct = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    return {"path": mi.load_dict(path), "direct": mi.load_dict(direct)}


def theirs(variant: str, gltf: Gltf, integrator: str) -> Callable[[], Any]:
    mi.set_variant(variant)
    scene, sensor = translate.scene(gltf, translate.matte), translate.sensor(gltf, SIZE)
    how, seeds = integrators()[integrator], iter(range(10**6))

    def render() -> Any:
        mi.set_variant(variant)
        return np.array(mi.render(scene, sensor=sensor, integrator=how, spp=SAMPLES[integrator], seed=next(seeds)))

    return render


def ours(program: Path, path: Path, integrator: str) -> tuple[float, float]:
    """Samples per second, and mean radiance."""
    command: list[Any] = [program, "bench", "still", "--scene", path, "--integrator", integrator, "--max-depth", str(DEPTH)]
    command += ["--size", f"{SIZE[0]}x{SIZE[1]}", "--samples", str(SAMPLES[integrator]), "--rounds", "1", "--json"]
    rate, mean = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["rows"]
    return rate["value"], mean["value"]


def timed(work: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def spread(values: list[float], digits: int = 2) -> str:
    return f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f}–{max(values):.{digits}f})"


def speeds(scenes: Path, rounds: int, program: Path, variants: list[str]) -> None:
    print(f"\nM samples/s, {SIZE[0]}x{SIZE[1]}, matte surfaces, {rounds} alternating rounds")
    print(f"{'':24}{'frameless':>20}" + "".join(f"{variant:>22}{'ratio':>20}" for variant in variants))
    for integrator, lit_by in LIGHTS.items():
        for name, stage in SCENES.items():
            gltf = stage(scenes, lit_by)
            staging.make_matte(gltf)
            with saved(gltf) as path:
                print(f"{integrator + ', ' + name:24}" + against(gltf, path, rounds, program, integrator, variants), flush=True)


def against(gltf: Gltf, path: Path, rounds: int, program: Path, integrator: str, variants: list[str]) -> str:
    """Who renders something else is not compared."""
    others = {variant: theirs(variant, gltf, integrator) for variant in variants}
    means = [ours(program, path, integrator)[1]] + [float(np.mean(render())) for render in others.values()]
    if max(means) > 1.03 * min(means) or not min(means) > 0.0:
        raise ValueError(f"{path}: mean radiances {means} are not those of one scene")
    own: list[float] = []
    rates: dict[str, list[float]] = {variant: [] for variant in variants}
    for _ in range(rounds):
        own.append(ours(program, path, integrator)[0] * 1e-6)
        for variant, render in others.items():
            rates[variant].append(SIZE[0] * SIZE[1] * SAMPLES[integrator] / timed(render) * 1e-6)
    line = f"{spread(own):>20}"
    for variant in variants:
        line += f"{spread(rates[variant]):>22}{spread([a / b for a, b in zip(own, rates[variant], strict=True)]):>20}"
    return line


def edits(scenes: Path, rounds: int, program: Path) -> None:
    """Of what covers from 1 % to 10 % of the picture the largest moves."""
    print("\nAn object moves by 10 cm while the scene plays (path): seconds until the changed pixels are within an RMSE of 0.05")
    for name, stage in SCENES.items():
        with saved(stage(scenes, "lamp")) as path:
            command: list[Any] = [program, "bench", "edit", "--scene", path, "--rounds", str(rounds), "--json"]
            rows = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)["rows"]
            moved = rows[0]["conditions"].split(", ")[1]
        told = ", ".join(f"{row['name'][5:]} {row['value']:.3g} ({row['min']:.3g}–{row['max']:.3g})" for row in rows)
        print(f"{name:14}{moved}: {told}", flush=True)


def loading(scenes: Path, rounds: int, program: Path) -> None:
    print("\nFrom starting the program to the first pixel, and the most memory that it takes")
    sizes = {name: content(stage(scenes, "point")) for name, stage in SCENES.items() if name != "Cornell box"}
    for name, held in sizes.items():
        with saved(SCENES[name](scenes, "point")) as path:
            runs = [traced(program, str(path)) for _ in range(rounds)]
            idle = [traced(program, "sphere")[1] for _ in range(rounds)]
        peak, base = (statistics.median(values) for values in ([run[1] for run in runs], idle))
        print(
            f"{name:14}{spread([run[0] for run in runs])} s; geometry and textures {held:.1f} MiB, peak {peak:.1f} MiB "
            f"({peak / held:.1f} times as much; less the {base:.1f} MiB of a scene without any: {(peak - base) / held:.1f})",
            flush=True,
        )


def traced(program: Path, scene: str) -> tuple[float, float]:
    """Seconds, and MiB at most, of one pixel."""
    begin = time.perf_counter()
    child = subprocess.Popen([program, "trace", scene, "--pixel", "256,192"], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    if status != 0:
        raise RuntimeError(f"{program} trace {scene}: {status}")
    return time.perf_counter() - begin, used.ru_maxrss / 1024


def content(gltf: Gltf) -> float:
    """MiB of vertices, indices and decoded pictures, each once."""
    used: set[int] = set()
    for mesh in gltf.json["meshes"]:
        for primitive in mesh["primitives"]:
            used |= {*primitive["attributes"].values(), primitive["indices"]}
    size = sum(gltf.accessor(index).nbytes for index in used)
    for image in gltf.json.get("images", []):
        width, height = translate.decoded(gltf.bytes_of(image)).size()
        size += 4 * int(width) * int(height)
    return size / 2**20


@contextmanager
def saved(gltf: Gltf) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        yield gltf.save(Path(folder))


def variants() -> list[str]:
    """LLVM's, too, where one loads."""
    try:
        mi.set_variant("llvm_ad_rgb")
        mi.load_dict({"type": "sphere"})
    except (ImportError, RuntimeError) as error:
        print(f"SKIPPED: llvm_ad_rgb: {error}", file=sys.stderr)
        return ["scalar_rgb"]
    return ["scalar_rgb", "llvm_ad_rgb"]


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program", type=Path, help="frameless, built in the release profile")
    arguments.add_argument("--scenes", type=Path, default=Path(__file__).resolve().parents[3] / "shared/scenes")
    arguments.add_argument("--rounds", type=int, default=7)
    arguments.add_argument("--only", choices=["speeds", "edits", "loading"], help="one part of it")
    given = arguments.parse_args()
    load = os.getloadavg()[0]
    print(f"{os.cpu_count()} processors, load before {load:.2f}, Mitsuba {mi.__version__}")
    if given.only in (None, "speeds"):
        speeds(given.scenes, given.rounds, given.program, variants())
    if given.only in (None, "loading"):
        loading(given.scenes, given.rounds, given.program)
    if given.only in (None, "edits"):
        edits(given.scenes, max(1, given.rounds // 2), given.program)


if __name__ == "__main__":
    main()
