"""Scenes, metrics, comparisons, plots, pictures as files."""

import copy
import pickle
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frameless
from conftest import pixel_centres, srgb
from frameless import BuiltinSampler, Scene, compare, compare_file, metrics, plot, save_png

SHARED = Path(__file__).resolve().parents[2] / "../shared/scenes"


def test_metrics_by_hand() -> None:
    black, white = np.zeros((12, 16, 3)), np.ones((12, 16, 3))
    grey = np.full((12, 16, 3), 0.1)
    assert metrics.rmse(black, grey) == pytest.approx(0.1) and metrics.psnr(black, grey) == pytest.approx(20.0)
    assert metrics.rmse(white, white) == 0.0 and metrics.psnr(white, white) == np.inf
    assert metrics.ssim(white, white) == pytest.approx(1.0) and metrics.flip(white, white) == 0.0
    assert metrics.flip(black, white) > 0.9 and metrics.ssim(black, white) < 0.01


@pytest.mark.parametrize(
    ("b", "says"),
    [
        (np.zeros((16, 12, 3)), "b: wanted a picture of 16×12 like a, got 12×16"),
        (np.zeros((12, 16)), "b: wanted shape (height, width, 3), got (12, 16)"),
        (np.full((12, 16, 3), np.nan), "row 0, column 0"),
        (np.zeros((0, 16, 3)), "at least 1"),
    ],
)
def test_metrics_check_their_pictures(b: Any, says: str) -> None:
    for metric in (metrics.rmse, metrics.psnr, metrics.ssim, metrics.flip):
        with pytest.raises(ValueError) as refused:
            metric(np.zeros((12, 16, 3)), b)
        assert says in str(refused.value)
    with pytest.raises(ValueError, match="11 pixels"):
        metrics.ssim(np.zeros((4, 4, 3)), np.zeros((4, 4, 3)))


@pytest.mark.parametrize("name", Scene.names())
def test_a_scene_is_a_renderer_like_any_other(name: str) -> None:
    scene, size = Scene.builtin(name), (64, 48)
    camera = scene.camera(0, time=0.5).with_size(size)
    x, y = pixel_centres(*size)
    samples = scene(x, y, 0.5, camera)
    assert np.allclose(samples.rgb.reshape(48, 64, 3), scene.render(size, time=0.5, camera=camera), atol=1e-5)
    hit = samples.object_id >= 0
    assert hit.any() and samples.object_id.max() < 1 << 20
    assert np.allclose(np.linalg.norm(samples.normal[samples.object_id >= 0], axis=1).max(), 1.0, atol=1e-4)
    # Hits lie on their rays.
    origin, direction = camera.rays(x, y)
    along = ((samples.position - origin) * direction).sum(axis=1, keepdims=True)
    assert np.allclose((origin + along * direction)[hit], samples.position[hit], atol=1e-3 * np.abs(along).max())


def test_a_loop_in_python_is_as_good_as_the_engines_own() -> None:
    scene, size, rate = Scene.builtin("orbit"), (96, 72), 60_000.0
    (row,) = compare("orbit", ["adaptive+reproject"], size=size, samples_per_sec=rate, seconds=1.0)
    session = frameless.Session(size, simulated=rate, camera=scene.camera(0), reconstruction="reproject")

    def now_in_the_scene(time: float) -> None:
        session.camera = scene.camera(0, time)
        session.place(scene.transforms(time))

    errors = []
    for batch in session.batches(1.0):
        now_in_the_scene(batch.time)
        samples = scene(batch.x, batch.y, batch.time, session.camera.with_size(size))  # type: ignore[union-attr]
        batch.submit(samples.rgb, position=samples.position, normal=samples.normal, object_id=samples.object_id)
        if batch.id % 16 == 15:
            now_in_the_scene(session.time)
            errors.append(metrics.rmse(session.image(), srgb(scene.render(size, time=session.time))))
    assert np.mean(errors[30:]) == pytest.approx(row["rmse"], rel=0.05)


def test_scenes_are_checked() -> None:
    with pytest.raises(ValueError, match="name: wanted one of .*sphere.* got .nowhere."):
        Scene.builtin("nowhere")
    with pytest.raises(OSError, match="no-such-file.glb"):
        Scene.load("no-such-file.glb")
    scene = Scene.builtin("sphere")
    for wrong in (
        lambda: scene.render((8, 8), time=float("nan")),
        lambda: scene.render((8, 8), camera=99),
        lambda: scene.camera(99),
        lambda: scene(np.zeros(2), np.zeros(1), 0.0, scene.camera().with_size((8, 8))),
        lambda: scene(np.zeros(2), np.zeros(2), 0.0, scene.camera()),
    ):
        with pytest.raises(ValueError, match="wanted"):
            wrong()


def test_a_broken_file_says_what_is_wrong(tmp_path: Path) -> None:
    broken = tmp_path / "broken.gltf"
    broken.write_text("{")
    with pytest.raises(ValueError, match="broken.gltf"):
        Scene.load(broken)


def test_real_files_load(report_skip: Any) -> None:
    files = sorted(SHARED.rglob("*.glb"))[:1] if SHARED.is_dir() else []
    if not files:
        report_skip("../shared/scenes with glTF files is missing")
    scene = Scene.load(files[0])
    assert scene.objects > 0 and scene.render((32, 24)).max() > 0.0


def test_compare_returns_rows_that_repeat() -> None:
    arguments: dict[str, Any] = {"size": (64, 48), "samples_per_sec": [9_000, 36_000], "seconds": 1.0, "seeds": (1, 2)}
    rows = compare("sphere", ["random", "change", "framed"], **arguments)
    assert [(row["algorithm"], row["samples_per_sec"], row["seed"]) for row in rows] == [
        (algorithm, rate, seed)
        for rate in (9_000.0, 36_000.0)
        for algorithm, seeds in (("random", (1, 2)), ("change", (1, 2)), ("framed", (1,)))
        for seed in seeds
    ]
    assert all(row["scene"] == "sphere" and 0 < row["rmse"] < 0.3 and np.isnan(row["ssim"]) for row in rows)
    assert len(rows[0]["rmse_over_time"]) == 60 and rows[0]["rmse"] > rows[5]["rmse"], "more samples, less error"
    assert rows[0]["rmse"] == pytest.approx(rows[0]["rmse_over_time"][30:].mean())
    again = compare("sphere", ["random", "change", "framed"], **arguments)
    assert [row["rmse"] for row in again] == [row["rmse"] for row in rows]


def test_compare_takes_built_in_samplers_made_from_a_seed() -> None:
    made: Any = [("mine", lambda seed: BuiltinSampler("random", seed)), "random"]
    rows = compare("sphere", made, size=(32, 24), samples_per_sec=20_000, seconds=1.0)
    assert {row["algorithm"] for row in rows} == {"mine", "random"}
    assert rows[0]["rmse"] == rows[1]["rmse"]


def test_compare_measures_what_is_asked_for() -> None:
    (row,) = compare(
        "shadow", ["adaptive+reproject"], size=(48, 36), samples_per_sec=20_000, seconds=0.6, ssim_every=6, flip_every=12
    )
    assert 0.3 < row["ssim"] <= 1.0 and 0.0 < row["flip"] < 0.5 and row["psnr_db"] > 10.0 and row["age_secs"] < 0.6


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"algorithms": ["chance"]}, "chance"),
        ({"algorithms": []}, "at least one algorithm"),
        ({"scenes": "nowhere"}, "nowhere"),
        ({"algorithms": [("mine+bogus", object)]}, "bogus"),
        ({"samples_per_sec": -1}, "samples_per_sec"),
        ({"size": (0, 4)}, "size: width: wanted a whole number of at least 1, got 0"),
        ({"samples_per_sec": float("nan")}, "samples_per_sec: wanted a finite number"),
        ({"samples_per_sec": 1e300}, "at most"),
        ({"samples_per_sec": 0.0}, "samples_per_sec: wanted a finite number above 0"),
        ({"seconds": float("inf")}, "seconds: wanted a finite number"),
        ({"seconds": 0.2}, "seconds: wanted more than the 0.5 s of unscored, got 0.2"),
        ({"algorithms": ["random", ("random", BuiltinSampler)]}, "algorithms: wanted each name once, got 'random' twice"),
        ({"seeds": (-1,)}, "seeds: wanted a whole number of at least 0, got -1"),
        ({"seeds": ()}, "seeds: wanted at least one"),
        ({"scenes": []}, "scenes: wanted at least one"),
        ({"scenes": "a\x7fb.glb"}, "printable"),
        ({"scenes": "a\udc80b.glb"}, "printable"),
    ],
)
def test_compare_refuses_nonsense(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError) as refused:
        compare(**{"seconds": 0.6, **arguments})
    assert says in str(refused.value)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"algorithms": [("mine", 7)]}, "wanted what makes a sampler"),
        ({"algorithms": [("mine", object, 1)]}, "wanted names and pairs"),
        ({"algorithms": "change"}, r"write \['change'\]"),
        ({"size": (32.5, 24)}, "size: width: wanted a whole number, got 32.5"),
        ({"size": 32}, r"size: wanted \(width, height\)"),
        ({"display_hz": 59.9}, "display_hz: wanted a whole number"),
        ({"samples_per_sec": "fast"}, "samples_per_sec: wanted a number"),
        ({"scenes": 7}, "scenes: wanted names or paths"),
    ],
)
def test_what_is_none_of_it_is_a_type_error(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(TypeError, match=says):
        compare(**{"seconds": 0.6, **arguments})


def test_numbers_may_be_numpys() -> None:
    rate: Any = np.int64(9000)
    seeds: Any = np.arange(1, 2)
    (row,) = compare("sphere", ["random"], samples_per_sec=rate, size=tuple(np.array([32, 24])), seconds=0.6, seeds=seeds)
    assert row["width"] == 32 and row["samples_per_sec"] == 9000.0


def test_a_camera_can_be_copied_and_sent() -> None:
    camera = frameless.Camera((1, 2, 5), (0.1, 0, 0), up=(0, 0, 1), fov=30).with_size((64, 48))
    for other in (pickle.loads(pickle.dumps(camera)), copy.copy(camera), copy.deepcopy(camera)):
        assert other == camera and other.size == (64, 48) and np.array_equal(other.matrix(), camera.matrix())
    parallel = Scene.builtin("sphere").camera()
    assert pickle.loads(pickle.dumps(parallel)) == parallel


def test_experiments_in_files_run(tmp_path: Path) -> None:
    file = tmp_path / "small.toml"
    file.write_text(
        'title = "small"\nalgorithms = ["random"]\nsamples_per_sec = [9000]\nwidth = 32\nheight = 24\n'
        'duration_secs = 0.6\n[[scenes]]\nscene = "sphere"\n[output]\nvideo = false\n'
    )
    (row,) = compare_file(file)
    assert (row["algorithm"], row["width"]) == ("random", 32) and list(tmp_path.iterdir()) == [file], "nothing is written"
    file.write_text("title = 3")
    with pytest.raises(ValueError, match="line 1"):
        compare_file(file)


def test_plots_show_the_numbers() -> None:
    pytest.importorskip("matplotlib")
    rows = compare("sphere", ["random", "change"], size=(32, 24), samples_per_sec=9_000, seconds=0.6)
    axes = plot.error_over_time(rows)
    assert [line.get_label() for line in axes.get_lines()] == ["random", "change"]
    assert np.array_equal(axes.get_lines()[1].get_ydata(), rows[1]["rmse_over_time"])
    session = frameless.Session((32, 24), sampler="change", simulated=9_000.0)
    session.run(lambda x, y, t, c: np.stack([x, y, x], 1) / 32, 0.1)
    for drawn, values in [
        (plot.age(session.age()), session.age()),
        (plot.probability(session.tile_probability()), session.tile_probability()),
    ]:
        shown: Any = drawn.get_images()[0].get_array()
        assert values is not None and np.allclose(np.ma.filled(shown, np.inf)[session.known()], values[session.known()])
    figure: Any = plot.change(session.change()).figure
    figure.draw_without_rendering()
    assert plot.picture(session.image(), title="now").get_title() == "now"
    with pytest.raises(ValueError, match="does not know"):
        plot.probability(None)


def test_a_png_is_what_was_given(tmp_path: Path) -> None:
    image = np.linspace(-0.2, 1.2, 5 * 7 * 3).reshape(5, 7, 3).astype(np.float32)
    save_png(tmp_path / "picture.png", image)
    data = (tmp_path / "picture.png").read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n" and struct.unpack(">II", data[16:24]) == (7, 5)
    start = data.index(b"IDAT") + 4
    length = struct.unpack(">I", data[start - 8 : start - 4])[0]
    rows = np.frombuffer(zlib.decompress(data[start : start + length]), np.uint8).reshape(5, 22)
    assert np.array_equal(rows[:, 1:].reshape(5, 7, 3), np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8))
    for wrong in (np.zeros((5, 7)), np.full((1, 1, 3), np.nan), np.zeros((1, 1, 3), int), np.zeros((0, 1, 3))):
        with pytest.raises(ValueError, match="image: wanted"):
            save_png(tmp_path / "wrong.png", wrong)
    assert [path.name for path in tmp_path.iterdir()] == ["picture.png"], "nothing half-written"
