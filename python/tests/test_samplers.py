"""Samplers of Python's own are samplers like any other."""

import subprocess
import sys
import threading
from functools import partial
from typing import Any

import numpy as np
import pytest

import frameless
from frameless import BuiltinSampler, Canvas, CanvasLike, Observed, Session, testing
from conftest import pattern, srgb

BUILTIN = ("random", "permutation", "change", "adaptive")


class Uniform:
    """Independent, evenly distributed pixels: `random`, in Python."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
        return self.rng.integers(0, canvas.time.size, count)


class Oldest:
    """Half of each batch to what has waited longest, half to where something changed last."""

    def __init__(self, seed: int) -> None:
        self.changed: Any = np.zeros(0, np.uint32)

    def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
        oldest = np.argsort(canvas.time, kind="stable")
        hot = self.changed[self.changed < oldest.size][: count // 2]
        return np.concatenate([hot, np.resize(oldest, count - len(hot))])

    def observe(self, canvas: CanvasLike, observed: Observed) -> None:
        self.changed = observed.pixel[observed.known & (observed.change > 0.01)]


class Delegating:
    """A built-in sampler, in disguise."""

    def __init__(self, seed: int, name: str = "adaptive") -> None:
        self.inner = BuiltinSampler(name, seed)

    def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
        assert count > 0
        return self.inner.choose(now, canvas, count)

    def observe(self, canvas: CanvasLike, observed: Observed) -> None:
        self.inner.observe(canvas, observed)

    def probability(self, now: float, canvas: CanvasLike) -> Any:
        return self.inner.probability(now, canvas)


FACTORIES: dict[str, testing.Factory] = {name: partial(BuiltinSampler, name) for name in BUILTIN}
FACTORIES |= {"Uniform": Uniform, "Oldest": Oldest, "Delegating": Delegating}


@pytest.mark.parametrize("name", FACTORIES)
def test_every_sampler_passes_the_same_tests(name: str) -> None:
    testing.check_sampler(FACTORIES[name], every_pixel_within=3.0)


class Corner:
    """No sampler: looks at one pixel only."""

    def __init__(self, seed: int) -> None:
        pass

    def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
        return np.zeros(count, np.int64)


class Moody(Uniform):
    """No sampler: its seed makes no difference."""

    moods = 0

    def __init__(self, seed: int) -> None:
        Moody.moods += 1
        super().__init__(Moody.moods)


@pytest.mark.parametrize(("wrong", "says"), [(Corner, "767 pixels were never traced"), (Moody, "other choices")])
def test_what_is_none_does_not(wrong: Any, says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        testing.check_sampler(wrong)


@pytest.mark.parametrize("name", FACTORIES)
def test_a_loop_of_parts(name: str) -> None:
    canvas, sampler = Canvas((40, 30)), FACTORIES[name](1)
    now = 0.0
    for turn in range(100):
        now = 1e-3 * (turn + 1)
        pixels = sampler.choose(now, canvas, 100)
        x, y = pixels % 40 + 0.5, pixels // 40 + 0.5
        observed = canvas.keep(now, pixels, pattern(x, y, 0.0, None))
        assert len(observed) == len(pixels) and np.array_equal(observed.pixel, pixels)
        # A canvas keeps times in units of 16 µs.
        assert (observed.now == pytest.approx(now, abs=2e-5)) and observed.change[observed.known].max(initial=0.0) == 0.0
        if hasattr(sampler, "observe"):
            sampler.observe(canvas, observed)
    assert canvas.image(now).shape == (30, 40, 3) and canvas.known.mean() > 0.99
    assert canvas.age(now).min() < 0.002 and canvas.time.max() == pytest.approx(now, abs=2e-5)
    assert canvas.rgb.shape == (1200, 3) and canvas.holes.dtype == np.uint32 and canvas.size == (40, 30)


def test_a_canvas_checks_what_it_keeps() -> None:
    canvas = Canvas((4, 3))
    for arguments, says in [
        ((0.1, np.array([12]), np.zeros((1, 3))), "from 0 to 11, got 12"),
        ((0.1, np.array([0]), np.full((1, 3), np.nan)), "sample 0 (pixel 0)"),
        ((float("nan"), np.array([0]), np.zeros((1, 3))), "now: wanted seconds"),
        ((-1.0, np.array([0]), np.zeros((1, 3))), "now: wanted seconds"),
        ((0.1, np.array([0]), np.zeros((2, 3))), "wanted shape (1, 3), got (2, 3)"),
    ]:
        with pytest.raises(ValueError) as refused:
            canvas.keep(*arguments)
        assert says in str(refused.value)
    assert not canvas.known.any()


def test_what_a_sampler_sees_is_the_canvas() -> None:
    class Looking(Uniform):
        seen = 0

        def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
            assert canvas.size == (40, 30) and (canvas.time <= now).all()
            Looking.seen = int(canvas.known.sum())
            with pytest.raises(ValueError, match="read-only"):
                canvas.rgb[0] = 1.0
            return super().choose(now, canvas, count)

        def observe(self, canvas: CanvasLike, observed: Observed) -> None:
            assert (canvas.time[observed.pixel] >= observed.now - 1e-9).all()
            wanted = pattern(observed.pixel % 40 + 0.5, observed.pixel // 40 + 0.5, 0.0, None)
            assert np.allclose(canvas.rgb[observed.pixel], wanted, atol=1e-5)

    for reconstruction in ("hold", "reproject"):
        session = Session((40, 30), sampler=Looking(1), simulated=20_000.0, reconstruction=reconstruction)
        session.run(pattern, 0.3)
        assert Looking.seen > 1100 and session.known().sum() >= Looking.seen


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (lambda count: np.zeros(count - 1, int), "choose: wanted shape"),
        (lambda count: np.zeros(count), "choose: wanted dtype an integer type"),
        (lambda count: np.full(count, 1200), "pixel numbers from 0 to 1199, got 1200"),
        (lambda count: np.full(count, -1), "got -1"),
    ],
)
def test_choices_are_checked(answer: Any, says: str) -> None:
    class Wrong:
        def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
            return answer(count)

    session = Session((40, 30), sampler=Wrong(), batch=100)
    with pytest.raises(ValueError) as refused:
        next(iter(session))
    assert says in str(refused.value)
    session.set_sampler("random")
    assert len(next(iter(session))) == 100, "the session is still usable"


class Failing(Uniform):
    def __init__(self, seed: int, where: str = "choose") -> None:
        super().__init__(seed)
        self.where, self.calls = where, 0

    def fail(self, where: str) -> None:
        self.calls += 1
        if where == self.where and self.calls > 5:
            raise LookupError(f"nothing to {where}")

    def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
        self.fail("choose")
        return super().choose(now, canvas, count)

    def observe(self, canvas: CanvasLike, observed: Observed) -> None:
        self.fail("observe")


@pytest.mark.parametrize("where", ["choose", "observe"])
def test_what_a_sampler_raises_arrives_as_it_is(where: str) -> None:
    session = Session((40, 30), sampler=Failing(1, where), batch=10)
    with pytest.raises(LookupError, match=f"nothing to {where}"):
        session.run(pattern, 1.0)
    session.set_sampler(Uniform(1))
    assert session.run(pattern, 0.1) > 0
    with pytest.raises(LookupError, match=f"nothing to {where}"):
        frameless.compare(
            algorithms=[("failing", lambda seed: Failing(seed, where))], size=(32, 24), samples_per_sec=9_000, seconds=1
        )


def test_a_sampler_must_not_use_its_own_session() -> None:
    class Curious(Uniform):
        def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
            session.image()

    session = Session((40, 30), sampler=Curious(1))
    with pytest.raises(RuntimeError, match="must not use a session"):
        next(iter(session))


@pytest.mark.parametrize("sampler", [7, object()])
def test_what_is_no_sampler_is_refused(sampler: Any) -> None:
    with pytest.raises(TypeError, match="wanted a name or an object with a method choose"):
        Session((4, 4), sampler=sampler)


def test_a_class_is_no_sampler_yet() -> None:
    forgotten: Any = Uniform
    with pytest.raises(TypeError, match="wanted a name or an object .* got <class"):
        Session((4, 4), sampler=forgotten)


def test_what_a_sampler_raises_goes_to_who_has_asked() -> None:
    asked, told = threading.Event(), threading.Event()

    class Late(Uniform):
        def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
            asked.set()
            told.wait(0.2)
            raise KeyError("late")

    session = Session((40, 30), sampler=Late(1), batch=10)
    others: list[BaseException] = []

    def look() -> None:
        asked.wait(10.0)
        try:
            for _ in range(200):
                session.now  # noqa: B018
        except BaseException as error:
            others.append(error)

    thread = threading.Thread(target=look)
    thread.start()
    with pytest.raises(KeyError, match="late"):
        session.run(pattern, 1.0)
    told.set()
    thread.join(10.0)
    assert not others


def test_probabilities_are_part_of_the_check() -> None:
    class Knowing(Uniform):
        def probability(self, now: float, canvas: CanvasLike) -> Any:
            return np.ones((3, 3))

    with pytest.raises(AssertionError, match="wanted shape"):
        testing.check_sampler(Knowing)


@pytest.mark.parametrize("name", BUILTIN)
def test_a_sampler_may_hand_its_calls_on(name: str) -> None:
    sessions = [
        Session((40, 30), sampler=sampler, simulated=20_000.0, reconstruction="hold")
        for sampler in (BuiltinSampler(name, 5), Delegating(5, name))
    ]
    for session in sessions:
        session.run(pattern, 0.2)
    ours, handed_on = (session.age() for session in sessions)
    # `adaptive` chooses one more or less now and then, which handed on is put right.
    assert np.array_equal(ours, handed_on) or name == "adaptive"
    known, told = (session.probability() for session in sessions)
    assert (known is None) == (told is None)
    if known is not None and told is not None:
        assert told.sum() == pytest.approx(1.0, abs=1e-4) and np.allclose(known, told, atol=0.3 * known.max())


def test_a_canvas_kept_is_no_canvas() -> None:
    class Keeping(Uniform):
        kept: Any = None

        def choose(self, now: float, canvas: CanvasLike, count: int) -> Any:
            Keeping.kept = canvas
            return super().choose(now, canvas, count)

    next(iter(Session((40, 30), sampler=Keeping(1))))
    canvases: list[tuple[Any, type[Exception]]] = [(Keeping.kept, ValueError), (object(), TypeError)]
    for canvas, error in canvases:
        with pytest.raises(error, match="canvas: "):
            BuiltinSampler("change").choose(0.0, canvas, 4)


@pytest.mark.parametrize("name", BUILTIN)
def test_a_canvas_of_another_size_is_begun_anew(name: str) -> None:
    sampler, small, large = BuiltinSampler(name), Canvas((8, 6)), Canvas((80, 60))
    for canvas, most in ((small, 48), (large, 4800), (small, 48)):
        pixels = sampler.choose(0.1, canvas, 500)
        assert pixels.max() < most
        observed = canvas.keep(0.1, pixels, np.zeros((len(pixels), 3)))
        sampler.observe(canvas, observed)
        other = large if canvas is small else small
        with pytest.raises(ValueError, match="observed: wanted samples of a canvas of"):
            sampler.observe(other, observed)


@pytest.mark.parametrize("now", [float("nan"), float("inf"), -1.0])
def test_a_time_that_is_none_is_refused(now: float) -> None:
    with pytest.raises(ValueError, match="now: wanted seconds"):
        BuiltinSampler("adaptive").choose(now, Canvas((8, 6)), 4)


@pytest.mark.parametrize(
    ("known", "says"),
    [
        (np.full((30, 40), 1.0), "whose sum is 1, got a sum of 1200"),
        (np.full((40, 30), 1.0 / 1200.0), r"wanted shape \(30, 40\)"),
        (np.full((30, 40), np.nan), "finite"),
        (1.0, "wanted a numpy array"),
    ],
)
def test_probabilities_are_checked(known: Any, says: str) -> None:
    class Knowing(Uniform):
        def probability(self, now: float, canvas: CanvasLike) -> Any:
            return known

    session = Session((40, 30), sampler=Knowing(1))
    with pytest.raises((ValueError, TypeError), match=says):
        session.probability()
    assert session.run(pattern, 0.1) > 0


def test_who_hands_on_to_adaptive_is_as_good() -> None:
    x, y = np.meshgrid(np.arange(64) + 0.5, np.arange(48) + 0.5)

    def jumping(x: Any, y: Any, time: float, camera: object) -> Any:
        near = np.hypot(x - (20.0 if time < 2.0 else 44.0), y - 24.0) < 10.0
        return np.where(near[:, None], 0.9, 0.1 + 0.05 * np.sin(x)[:, None] * np.ones(3))

    for sampler in (BuiltinSampler("adaptive", 5), Delegating(5)):
        session = Session((64, 48), sampler=sampler, simulated=20_000.0)
        # For two seconds nothing changes, and what rests is refined; then one sample per pixel and more.
        session.run(jumping, 2.2)
        ideal = srgb(jumping(x.ravel(), y.ravel(), session.time, None)).reshape(48, 64, 3)
        assert frameless.metrics.rmse(session.image(), ideal) < 0.03, sampler


def noise(x: Any, y: Any, time: float, camera: object, seed: Any) -> Any:
    return np.repeat((seed / 2.0**32)[:, None], 3, axis=1)


@pytest.mark.parametrize("name", FACTORIES)
def test_noise_is_averaged_whoever_chooses(name: str) -> None:
    camera = frameless.Camera((0, 0, 5), (0, 0, 0))
    session = Session((32, 24), sampler=FACTORIES[name](1), noisy=True, simulated=50_000.0, camera=camera)
    session.run(noise, 2.0)
    # 130 samples per pixel: 0.236 of one become 0.02, where pixels are looked at alike.
    assert session.image().std() < 0.05


def test_the_check_does_not_need_asserts() -> None:
    code = (
        "import numpy as np, frameless\n"
        "class Corner:\n"
        "    def __init__(self, seed): pass\n"
        "    def choose(self, now, canvas, count): return np.zeros(count, int)\n"
        "try: frameless.testing.check_sampler(Corner)\n"
        "except AssertionError: print('found')\n"
    )
    done = subprocess.run([sys.executable, "-O", "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout == "found\n", done.stderr
