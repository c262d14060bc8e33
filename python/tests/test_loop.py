"""The explicit loop: whole, late, partial and lost answers, errors, size, time."""

import threading
import time
from typing import Any

import numpy as np
import pytest

import frameless
from conftest import pattern, pixel_centres, srgb


def ideal(width: int, height: int) -> np.ndarray:
    x, y = pixel_centres(width, height)
    return srgb(pattern(x, y, 0.0, None)).reshape(height, width, 3)


def test_a_still_picture_converges_to_the_ideal() -> None:
    for sampler in ("random", "permutation", "change", "adaptive"):
        session = frameless.Session((40, 30), sampler=sampler, reconstruction="hold", simulated=20_000.0)
        for batch in session.batches(2.0):
            assert batch.submit(pattern(batch.x, batch.y, batch.time, None)) == len(batch)
        assert np.abs(session.image() - ideal(40, 30)).max() < 1e-4, sampler


def test_run_is_the_loop() -> None:
    def made(by_run: bool) -> np.ndarray:
        session = frameless.Session((40, 30), simulated=20_000.0, seed=3)
        if by_run:
            session.run(pattern, 0.1)
        else:
            for batch in session.batches(0.1):
                batch.submit(pattern(batch.x, batch.y, batch.time, None))
        return session.image()

    assert np.array_equal(made(True), made(False))


def test_places_are_pixels_from_the_corner(session: frameless.Session) -> None:
    batch = next(iter(session))
    columns, rows = batch.pixel % 40, batch.pixel // 40
    assert len(batch) == 100 == len(batch.x) == len(batch.seed)
    assert np.array_equal(batch.x, columns + 0.5) and np.array_equal(batch.y, rows + 0.5)
    assert batch.size == session.size == (40, 30)
    assert [a.dtype.name for a in (batch.x, batch.pixel, batch.sample_index)] == ["float32", "uint32", "uint32"]


def test_late_partial_and_out_of_order_answers() -> None:
    session = frameless.Session((40, 30), batch=400, sampler="permutation", reconstruction="hold")
    taken = [batch for batch, _ in zip(session, range(3))]
    colours = [pattern(batch.x, batch.y, 0.0, None) for batch in taken]
    # Last batch first; the first in two parts, by mask and by number; of the middle one only some ever.
    assert taken[2].submit(colours[2]) == 400
    odd = np.arange(400) % 2 == 1
    assert taken[0].submit(colours[0][odd], where=odd) == 200
    even = np.flatnonzero(~odd)
    assert taken[0].submit(colours[0][even][::-1], where=even[::-1]) == 200
    assert taken[1].submit(colours[1][:7], where=np.arange(7, dtype=np.uint8)) == 7
    known = session.known().ravel()
    assert known.sum() == 807 and known[taken[0].pixel].all() and not known[taken[1].pixel[7:]].any()
    assert np.abs(session.image() - ideal(40, 30))[session.known()].max() < 1e-4


def test_an_answer_that_comes_after_a_newer_one_is_dropped() -> None:
    session = frameless.Session((1, 1), batch=1)
    batches = iter(session)
    old = next(batches)
    # Times are kept in units of 16 µs: of what is nearer to each other nobody knows which came first.
    time.sleep(0.001)
    new = next(batches)
    assert new.submit(np.ones((1, 3))) == 1
    assert old.submit(np.zeros((1, 3))) == 0
    assert session.rgb().max() == 1.0 and session.counters["dropped"] == 1


def test_no_sample_is_answered_twice(session: frameless.Session) -> None:
    batch = next(iter(session))
    batch.submit(np.ones((2, 3)), where=np.array([5, 7]))
    with pytest.raises(ValueError, match=r"sample 5 of batch 0 has been answered already"):
        batch.submit(np.ones((100, 3)))
    with pytest.raises(ValueError, match="where: wanted each sample once, got sample 9 twice"):
        batch.submit(np.ones((2, 3)), where=np.array([9, 9]))
    assert batch.submit(np.ones((98, 3)), where=np.delete(np.arange(100), [5, 7])) == 98


def test_what_the_renderer_raises_arrives_as_it_is_and_the_session_goes_on() -> None:
    session = frameless.Session((40, 30), simulated=20_000.0)

    class Mine(Exception):
        pass

    error = Mine("lamp broken")

    def broken(*_: object) -> None:
        raise error

    with pytest.raises(Mine) as caught:
        session.run(broken, 1.0)
    assert caught.value is error
    assert session.run(pattern, 1.0) > 10_000
    assert session.known().all()


def test_a_closed_session_gives_no_more_batches() -> None:
    with frameless.Session((40, 30)) as session:
        batch = next(iter(session))
        assert not session.closed
    assert session.closed and list(session) == []
    with pytest.raises(StopIteration):
        next(iter(session))
    assert batch.submit(pattern(batch.x, batch.y, 0.0, None)) == len(batch), "late answers are welcome"
    assert session.image().shape == (30, 40, 3)


def test_render_may_end_its_own_run() -> None:
    session = frameless.Session((40, 30))

    def once(x: np.ndarray, *_: object) -> np.ndarray:
        session.close()
        return np.zeros((len(x), 3))

    assert session.run(once) > 0 and session.run(once) == 0


def test_time_can_be_set_and_stopped() -> None:
    session = frameless.Session((8, 8), simulated=960.0)
    session.time = 5.0
    session.speed = 0.0
    assert [batch.time for batch in session.batches(0.01)] == [5.0] * 10
    session.speed = -2.0
    times = [batch.time for batch in session.batches(0.01)]
    assert times[0] == pytest.approx(5.0) and np.diff(times) == pytest.approx([-2 / 960] * 9)
    assert session.time == pytest.approx(5.0 - 0.02, abs=0.003) and session.speed == -2.0


def test_another_size_keeps_the_picture() -> None:
    session = frameless.Session((40, 30), simulated=20_000.0, reconstruction="hold")
    early = next(iter(session))
    session.run(lambda x, y, t, c: np.full((len(x), 3), 0.25), 1.0)
    before = session.image().mean()
    session.resize((80, 45))
    assert session.size == (80, 45) and session.image().shape == (45, 80, 3)
    assert session.image().mean() == pytest.approx(before, abs=1e-6)
    assert session.age().shape == session.change().shape == session.known().shape == (45, 80)
    assert early.submit(np.zeros((len(early), 3))) == 0, "it was for another size"


def test_a_budget_is_kept() -> None:
    session = frameless.Session((40, 30), budget=5_000.0, batch=50)
    kept = session.run(pattern, 0.5)
    assert 500 < kept < 2_700
    session.budget = None
    assert session.budget is None and session.run(pattern, 0.2) > kept


def test_a_budget_does_not_starve_calls_that_take_long() -> None:
    def slow(x: Any, *_: object) -> Any:
        time.sleep(0.02)
        return np.zeros((len(x), 3))

    session = frameless.Session((200, 150), budget=50_000.0)
    session.run(slow, 0.5)
    begin, before = session.now, session.counters["kept"]
    session.run(slow, 1.0)
    per_second = (session.counters["kept"] - before) / (session.now - begin)
    assert 25_000 < per_second <= 52_000


def test_nobody_is_asked_for_nothing() -> None:
    counts = []

    class Asked:
        def choose(self, now: float, canvas: frameless.CanvasLike, count: int) -> Any:
            counts.append(count)
            return np.zeros(count, int)

    session = frameless.Session((40, 30), sampler=Asked(), simulated=100.0)
    session.run(pattern, 0.3)
    assert min(counts) > 0 and session.counters["batches"] == len(counts)


@pytest.mark.parametrize(
    ("out", "error", "says"),
    [
        (np.empty((30, 40, 3)), ValueError, "wanted dtype float32, got float64"),
        (np.empty((30, 40), np.float32), ValueError, r"wanted shape \(30, 40, 3\), got \(30, 40\)"),
        (np.broadcast_to(np.float32(0), (30, 40, 3)), ValueError, "may be written"),
        (np.empty((30, 40), [("rgb", "<f4", 3), ("flag", "u1")])["rgb"], ValueError, "packed"),
        ([1.0], TypeError, "wanted a numpy array, got list"),
    ],
)
def test_what_no_picture_fits_into_is_refused(session: frameless.Session, out: Any, error: Any, says: str) -> None:
    with pytest.raises(error, match=says):
        session.image(out=out)


def test_planes_say_what_happened() -> None:
    session = frameless.Session((40, 30), sampler="permutation", reconstruction="hold", simulated=12_000.0)
    assert np.isinf(session.age()).all() and np.isnan(session.change()).all() and not session.known().any()
    session.run(lambda x, y, t, c: np.zeros((len(x), 3)), 0.2)
    session.run(lambda x, y, t, c: np.ones((len(x), 3)) * (x < 20)[:, None], 0.2)
    change = session.change()
    assert change.dtype == np.float32 and change.shape == (30, 40)
    # White where black was known before; a permutation comes by every tenth of a second, so nothing has changed since.
    assert session.age().max() < 0.21 and np.nanmax(change[:, 20:]) == 0.0
    assert set(np.unique(change)) <= {0.0, 3.0}


def test_probabilities_sum_to_one_where_they_are_known() -> None:
    known = frameless.Session((40, 30), sampler="change", simulated=20_000.0)
    known.run(pattern, 0.1)
    probability = known.probability()
    assert probability is not None and probability.sum() == pytest.approx(1.0, abs=1e-3)
    assert frameless.Session((40, 30), sampler="permutation").probability() is None


def test_arrays_handed_out_do_not_change() -> None:
    session = frameless.Session((40, 30), simulated=20_000.0)
    session.run(pattern, 0.5)
    out = np.empty((30, 40, 3), np.float32)
    image, age, rgb = session.image(), session.age(), session.rgb()
    assert session.image(out=out) is out and np.array_equal(out, image)
    columns_first = np.empty((30, 40, 3), np.float32, order="F")
    assert np.array_equal(session.image(out=columns_first), image)
    copies = image.copy(), age.copy(), rgb.copy()
    session.run(lambda x, y, t, c: np.zeros((len(x), 3)), 0.5)
    session.image()
    assert all(map(np.array_equal, (image, age, rgb), copies))
    assert session.image().max() == 0.0
    del session
    assert image.sum() == copies[0].sum(), "they own their memory"
    image[:] = 0.0


def test_wrong_out_is_refused(session: frameless.Session) -> None:
    with pytest.raises(ValueError, match=r"out: wanted shape \(30, 40, 3\), got \(40, 30, 3\)"):
        session.image(out=np.empty((40, 30, 3), np.float32))


def test_a_noisy_renderer_gets_seeds_that_repeat() -> None:
    session = frameless.Session((16, 12), simulated=20_000.0, noisy=True)
    seen: dict[tuple[float, float], int] = {}
    repeated = 0

    def noisy(x: np.ndarray, y: np.ndarray, time: float, camera: object, seed: np.ndarray) -> np.ndarray:
        nonlocal repeated
        for place, number in zip(zip(x.tolist(), y.tolist()), seed.tolist()):
            repeated += place in seen
            assert seen.setdefault(place, number) == number
        return np.repeat((seed / 2.0**32)[:, None], 3, axis=1)

    session.run(noisy, 0.5)
    assert repeated > 100 and len(set(seen.values())) > 0.99 * len(seen)


def test_batches_last_as_long_as_they_should() -> None:
    session = frameless.Session((64, 48), batch_ms=5.0)
    lengths = []

    def slow(x: np.ndarray, *_: object) -> np.ndarray:
        lengths.append(len(x))
        threading.Event().wait(10e-6 * len(x))
        return np.zeros((len(x), 3))

    session.run(slow, 1.0)
    # 10 µs per sample and the wait's own price make some hundreds in 5 ms; the first call asks for a few.
    assert lengths[0] <= 20 and 100 < np.median(lengths[-10:]) < 900, lengths


def test_simulated_clocks_repeat_and_refuse_what_contradicts_them() -> None:
    def made(seed: int) -> np.ndarray:
        session = frameless.Session((40, 30), simulated=10_000.0, seed=seed)
        session.run(lambda x, y, t, c: pattern(x + 100 * t, y, t, c), 0.3)
        return session.image()

    assert np.array_equal(made(1), made(1)) and not np.array_equal(made(1), made(2))
    with pytest.raises(ValueError, match="leave out batch and budget"):
        frameless.Session((4, 4), simulated=1000.0, batch=3)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"size": (0, 4)}, "at least 1"),
        ({"size": (1 << 20, 1 << 20)}, "67108864 pixels"),
        ({"size": (-1, -1)}, "got (-1, -1)"),
        ({"sampler": "chance"}, "chance"),
        ({"sampler": "adaptive(temporal=7)"}, "[0, 1]"),
        ({"reconstruction": "bogus"}, "bogus"),
        ({"batch": 0}, "batch: wanted a whole number from 1"),
        ({"batch": -1}, "got -1"),
        ({"seed": -1}, "seed: wanted a whole number from 0"),
        ({"seed": 2**64}, "seed"),
        ({"seed": -(2**200)}, "seed"),
        ({"batch": 2**127}, "batch"),
        ({"sampler": "framed"}, "sampler: wanted one of random, permutation, change, adaptive; got"),
        ({"sampler": "change+filter"}, "sampler: wanted one of"),
        ({"sampler": "change(tile=0)"}, "tile at least 1"),
        ({"exposure": 65.0}, "from -64 to 64 stops"),
        ({"batch_ms": float("nan")}, "batch_ms"),
        ({"budget": -1.0}, "budget"),
        ({"simulated": 0.0}, "simulated"),
        ({"exposure": float("inf")}, "exposure"),
    ],
)
def test_nonsense_is_refused_with_what_came(arguments: dict[str, object], says: str) -> None:
    with pytest.raises(ValueError) as refused:
        frameless.Session(**{"size": (4, 4), **arguments})  # type: ignore[arg-type]
    assert says in str(refused.value)


@pytest.mark.parametrize("sampler", ["change", "adaptive", "permutation", "random"])
def test_answers_to_a_canvas_that_had_the_same_size_are_dropped(sampler: str) -> None:
    session = frameless.Session((30, 20), sampler=sampler, batch=50)
    first = next(iter(session))
    session.resize((10, 10))
    next(iter(session))
    session.resize((30, 20))
    assert first.submit(np.ones((len(first), 3))) == 0 and session.counters["dropped"] == len(first)
    assert session.run(pattern, 0.05) > 0


def test_parts_name_a_sample_once(session: frameless.Session) -> None:
    batch = next(iter(session))
    with pytest.raises(ValueError, match="where: wanted each sample once, got sample 3 twice"):
        batch.submit(np.zeros((2, 3)), where=np.array([3, 3]))
    assert batch.submit(np.zeros((len(batch), 3))) == len(batch)


def test_another_seed_makes_another_noise() -> None:
    def seeds(seed: int) -> dict[int, int]:
        batch = next(iter(frameless.Session((40, 30), seed=seed, batch=200, sampler="permutation", noisy=True)))
        return dict(zip(batch.pixel.tolist(), batch.seed.tolist()))

    one, again, other = seeds(1), seeds(1), seeds(2)
    assert one == again
    both = one.keys() & other.keys()
    assert both and all(one[pixel] != other[pixel] for pixel in both)


@pytest.mark.parametrize("size", [[40, 30], np.array([40, 30])])
def test_sizes_may_be_any_pair(size: Any) -> None:
    assert frameless.Session(size).size == (40, 30)


@pytest.mark.parametrize("size", [7, (1, 2, 3), ("4", "4"), (4.5, 4)])
def test_sizes_that_are_none_are_type_errors(size: object) -> None:
    with pytest.raises(TypeError, match="wanted \\(width, height\\)"):
        frameless.Session(size)  # type: ignore[arg-type]
