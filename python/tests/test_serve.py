"""A renderer on a page: it answers, it stops, and what the renderer raises is not lost."""

import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from typing import Any

import numpy as np
import pytest

import frameless
from frameless import Samples, serve
from conftest import pattern


def get(url: str, then: str | None = None) -> tuple[int, str]:
    """What a browser gets at a URL, and at another one after it with the cookies of the first."""
    browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    try:
        with browser.open(url, timeout=10) as answer:
            found = answer.status, answer.read().decode()
        if then is not None:
            with browser.open(then, timeout=10) as answer:
                found = answer.status, answer.read().decode()
        return found
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode()


def wait_for(condition: Any) -> None:
    end = time.perf_counter() + 10.0
    while not condition():
        assert time.perf_counter() < end, "it did not happen within 10 s"
        time.sleep(0.01)


def test_a_page_is_served_to_who_knows_the_secret() -> None:
    calls = []

    def render(x: Any, y: Any, t: float, camera: frameless.Camera) -> Any:
        calls.append((len(x), camera.size))
        return pattern(x, y, t, camera)

    served = serve(render, (64, 48))
    try:
        assert served.running and served.size == (64, 48) and "127.0.0.1" in served.url
        plain = served.url.partition("?")[0]
        status, page = get(served.url, then=plain)
        assert status == 200 and "<canvas" in page
        assert get(plain)[0] in (401, 403), "without the secret"
        wait_for(lambda: sum(n for n, _ in calls) > 64 * 48)
        assert {size for _, size in calls} == {(64, 48)}
        # Notebooks are reached as localhost: as another host the page's cookie would be a stranger's.
        assert served.url.replace("127.0.0.1", "localhost") in served._repr_html_()
        with urllib.request.urlopen(served.url) as answer:
            assert "frame-ancestors http://localhost:*" in answer.headers["Content-Security-Policy"]
    finally:
        served.stop()
    assert not served.running and "stopped" in repr(served)
    with pytest.raises(OSError):
        urllib.request.urlopen(served.url, timeout=2)
    served.stop()


def test_batches_of_calls_that_have_a_price_grow() -> None:
    lengths = []

    def slow(x: Any, *_: object) -> Any:
        lengths.append(len(x))
        time.sleep(0.005)
        return np.zeros((len(x), 3))

    served = serve(slow, (200, 150))
    try:
        wait_for(lambda: lengths and max(lengths) > 2_000)
    finally:
        served.stop()
    assert lengths[0] < 50


def test_surfaces_and_seeds_are_asked_for_alike() -> None:
    seen = []

    def render(x: Any, y: Any, t: float, camera: frameless.Camera, seed: Any) -> Samples:
        seen.append(seed.dtype)
        origin, direction = camera.rays(x, y)
        return Samples(pattern(x, y, t, camera), origin + 5.0 * direction, object_id=np.zeros(len(x), int))

    served = serve(render, (64, 48), noisy=True, camera=frameless.Camera((0, 0, 5), (0, 0, 0)))
    wait_for(lambda: len(seen) > 20)
    served.stop()
    assert set(seen) == {np.dtype(np.uint32)}


def test_what_the_renderer_raises_arrives_and_another_goes_on() -> None:
    error = KeyError("lamp")

    def broken(*_: object) -> Any:
        raise error

    served = serve(broken, (32, 24))
    try:
        wait_for(lambda: served.failed)
        assert served.running
        with pytest.raises(KeyError) as caught:
            served.check()
        assert caught.value is error
        calls = []

        def mended(x: Any, *_: object) -> Any:
            calls.append(len(x))
            return np.zeros((len(x), 3))

        served.set_render(mended)
        wait_for(lambda: len(calls) > 10)
        served.check()
        served.set_render(lambda x, y, t, c: np.zeros(3))
        with pytest.raises(ValueError, match="rgb: wanted shape"):
            served.wait(10.0)
        assert not served.running, "waiting ends with the error"
    finally:
        served.stop()


def test_a_failure_that_nobody_waits_for_is_written_down(capfd: pytest.CaptureFixture[str]) -> None:
    def broken(*_: object) -> Any:
        raise LookupError("no lamp")

    served = serve(broken, (32, 24))
    wait_for(lambda: served.failed)
    time.sleep(0.1)
    said = capfd.readouterr().err
    assert "LookupError: no lamp" in said and "in broken" in said and "page.set_render" in said
    assert said.count("Traceback") == 1, "once"
    with pytest.raises(LookupError):
        served.stop()


def test_a_sampler_that_fails_on_a_page_is_written_down(capfd: pytest.CaptureFixture[str]) -> None:
    class Failing:
        def choose(self, now: float, canvas: frameless.CanvasLike, count: int) -> Any:
            raise LookupError("no pixels")

    served = serve(pattern, (32, 24), sampler=Failing())
    wait_for(lambda: served.failed)
    time.sleep(0.1)
    assert "LookupError: no pixels" in capfd.readouterr().err
    with pytest.raises(LookupError):
        served.stop()


def test_a_renderer_may_stop_another_page_and_waits_for_it() -> None:
    other = serve(pattern, (32, 24))
    seen: list[bool] = []

    def render(x: Any, *_: object) -> Any:
        if not seen:
            other.stop()
            seen.append(other.running)
        return np.zeros((len(x), 3))

    served = serve(render, (32, 24))
    wait_for(lambda: seen)
    served.stop()
    assert seen == [False]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")
def test_a_forked_process_does_not_wait_for_pages_that_it_has_not() -> None:
    code = (
        "import os, sys, numpy as np, frameless\n"
        "page = frameless.serve(lambda x, y, t, c: np.zeros((len(x), 3)), (32, 24))\n"
        "child = os.fork()\n"
        "if child == 0:\n"
        "    page.stop()\n"
        "    sys.exit(7)\n"
        "status = os.waitpid(child, 0)[1]\n"
        "sys.exit(os.waitstatus_to_exitcode(status))\n"
    )
    assert subprocess.run([sys.executable, "-W", "ignore", "-c", code], timeout=60).returncode == 7


def test_a_page_takes_samplers_of_all_kinds(capfd: pytest.CaptureFixture[str]) -> None:
    asked = []

    class Rows:
        def choose(self, now: float, canvas: frameless.CanvasLike, count: int) -> Any:
            asked.append(count)
            if len(asked) > 50:
                raise LookupError("no more rows")
            return np.arange(count) % canvas.time.size

    for sampler in ("change", frameless.BuiltinSampler("random", 3)):
        calls: list[int] = []
        served = serve(lambda x, *_, calls=calls: (calls.append(1), np.zeros((len(x), 3)))[1], (32, 24), sampler=sampler)
        wait_for(lambda calls=calls: len(calls) > 10)
        served.stop()
    served = serve(lambda x, *_: np.zeros((len(x), 3)), (32, 24), sampler=Rows())
    with pytest.raises(LookupError, match="no more rows"):
        served.wait(10.0)
    assert len(asked) > 50 and not served.running


def test_waiting_ends_in_time() -> None:
    served = serve(pattern, (32, 24))
    begin = time.perf_counter()
    served.wait(0.3)
    assert 0.25 < time.perf_counter() - begin < 2.0 and served.running
    served.stop()
    served.wait()


def test_view_raises_what_render_raises(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)

    def broken(*_: object) -> Any:
        raise ZeroDivisionError("nothing there")

    with pytest.raises(ZeroDivisionError, match="nothing there"):
        frameless.view(broken, (32, 24))
    assert len(opened) == 1 and opened[0] in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"size": (0, 1)}, "at least 1"),
        ({"sampler": "chance"}, "chance"),
        ({"reconstruction": "bogus"}, "bogus"),
        ({"batch_ms": 0.0}, "batch_ms"),
        ({"budget": -1.0}, "budget"),
        ({"exposure": float("nan")}, "exposure"),
        ({"exposure": 65.0}, "from -64 to 64 stops, got 65"),
        ({"port": 70_000}, "port: wanted a whole number from 0 to 65535"),
        ({"port": -1}, "port"),
        ({"size": (5000, 3000)}, "at most 8294400 pixels on a page, got 5000×3000"),
        ({"allow_frame": "*"}, "allow_frame: \\*: wanted one origin"),
    ],
)
def test_nonsense_is_refused(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        serve(**{"render": pattern, "size": (32, 24), **arguments})


@pytest.mark.parametrize(
    ("arguments", "says"), [({"render": 7}, "render: wanted a function"), ({"sampler": 7}, "sampler: wanted a name or")]
)
def test_what_is_none_is_refused(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(TypeError, match=says):
        serve(**{"render": pattern, "size": (32, 24), **arguments})


def test_a_port_that_is_taken_is_said() -> None:
    served = serve(pattern, (32, 24))
    port = int(served.url.split(":")[2].split("/")[0])
    with pytest.raises(OSError, match=f"port {port} is taken"):
        serve(pattern, (32, 24), port=port)
    served.stop()


def test_a_page_that_is_forgotten_ends_with_the_interpreter() -> None:
    code = (
        "import numpy as np, frameless, time\n"
        "render = lambda x, y, t, camera: np.zeros((len(x), 3), np.float32)\n"
        "page = frameless.serve(render, (64, 48)); page = frameless.serve(render, (64, 48))\n"
        "frameless.serve(render, (64, 48)); time.sleep(0.3)\n"
    )
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_a_renderer_may_stop_its_own_page() -> None:
    pages: list[frameless.Served] = []

    def render(x: Any, y: Any, t: float, camera: frameless.Camera) -> Any:
        if pages:
            pages[0].stop()
        return np.zeros((len(x), 3), np.float32)

    pages.append(serve(render, (64, 48)))
    wait_for(lambda: not pages[0].running)
    pages[0].stop()
