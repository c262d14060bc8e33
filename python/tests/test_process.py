"""What concerns the whole process: threads, Ctrl-C, memory, the time that an import takes."""

import base64
import gc
import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import frameless
from conftest import pattern


def run(code: str, *arguments: str) -> str:
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_importing_is_quick_and_needs_only_numpy() -> None:
    # The processor's time, and the best of some: a machine that does other things can only make it slower.
    code = "import time; t = time.process_time(); import frameless; print(time.process_time() - t)"
    assert min(float(run(code)) for _ in range(5)) <= 0.3
    foreign = "import sys, frameless; print({m.split('.')[0] for m in sys.modules if 'site-packages' in str(getattr(sys.modules[m], '__file__', ''))})"
    assert eval(run(foreign)) <= {"numpy", "frameless", "_distutils_hack"}


def test_threads_may_share_a_session() -> None:
    session = frameless.Session((64, 48), sampler="change")
    errors: list[BaseException] = []
    stop = threading.Event()

    def guarded(work: object) -> None:
        try:
            while not stop.is_set():
                work()  # type: ignore[operator]
        except BaseException as error:
            errors.append(error)

    def trace() -> None:
        batch = next(iter(session))
        batch.submit(pattern(batch.x, batch.y, batch.time, None))

    def look() -> None:
        assert np.isfinite(session.image()).all() and session.age().shape == session.change().shape

    def steer() -> None:
        session.exposure = -session.exposure
        session.speed = 1.0
        assert session.probability() is not None

    threads = [threading.Thread(target=guarded, args=[work]) for work in (trace, trace, trace, look, steer)]
    for thread in threads:
        thread.start()
    time.sleep(1.0)
    stop.set()
    for thread in threads:
        thread.join(10.0)
    assert not errors and not any(thread.is_alive() for thread in threads), errors
    counters = session.counters
    assert counters["kept"] > 1_000 and session.known().all()


def test_parts_of_a_batch_from_many_threads_are_kept_once() -> None:
    # Each sample once, whoever comes first.
    session = frameless.Session((64, 48), batch=3_000, sampler="permutation")
    batch = next(iter(session))
    rgb = pattern(batch.x, batch.y, 0.0, None)
    refused = []

    def answer(first: int) -> None:
        for start in range(first, first + 1_500, 100):
            which = np.arange(start, start + 100)
            try:
                batch.submit(rgb[which], where=which)
            except ValueError:
                refused.append(start)

    threads = [threading.Thread(target=answer, args=[first]) for first in (0, 500, 1_000, 1_500)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert session.counters["kept"] == 3_000 and len(refused) == 4 * 15 - 30


def test_the_interpreter_is_free_while_rust_works() -> None:
    scene = frameless.Scene.builtin("many")
    ticks = 0
    done = threading.Event()

    def count() -> None:
        nonlocal ticks
        while not done.wait(0.001):
            ticks += 1

    thread = threading.Thread(target=count)
    thread.start()
    begin = time.perf_counter()
    while time.perf_counter() - begin < 0.5:
        scene.render((640, 480))
    done.set()
    thread.join()
    assert ticks > 50, f"{ticks} ticks of a millisecond in half a second"


# Each of these takes more than the 4 s in which it is to be interrupted.
LONG = {
    "compare": "frameless.compare(['mix', 'many'], size=(512, 384), seconds=30.0)",
    "a budget": "list(frameless.Session((8, 8), budget=1e-3).batches())",
    "run": "frameless.Session((64, 48)).run(lambda x, y, t, c: numpy.zeros((len(x), 3)))",
    "render": "frameless.Scene.builtin('many').render((8000, 8000))",
    "wait": "frameless.serve(lambda x, y, t, c: numpy.zeros((len(x), 3)), (32, 24), port=0).wait()",
    "waiting for a long call": "frameless.serve(lambda x, y, t, c: time.sleep(9), (32, 24)).wait()",
    "stopping in a long call": "page = frameless.serve(lambda x, y, t, c: time.sleep(9), (32, 24)); time.sleep(0.3); page.stop()",
    "many places": (
        "scene = frameless.Scene.builtin('many'); x = numpy.full(20_000_000, 9.0, numpy.float32); "
        "scene(x, x, 0.0, scene.camera().with_size((640, 480)))"
    ),
    "a large picture": "session = frameless.Session((8000, 4000)); [session.image() for _ in range(99)]",
    "a large picture, with": "with frameless.Session((8000, 4000)) as session:\n        while True: session.image()",
    "batches of a large picture, with": (
        "with frameless.Session((8000, 4000)) as session:\n"
        "        for batch in session: batch.submit(numpy.zeros((len(batch), 3)))"
    ),
    "the first batch of a large picture": "[list(frameless.Session((8000, 8000)).batches(0.1)) for _ in range(99)]",
}


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for single processes")
@pytest.mark.parametrize("what", LONG)
def test_ctrl_c_stops_within_half_a_second(what: str) -> None:
    code = (
        "import os, signal, time, numpy, frameless\n"
        # Who is started in the background is started deaf to Ctrl-C.
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "print('ready', flush=True)\n"
        f"try:\n    {LONG[what]}\n"
        "except KeyboardInterrupt:\n    print('stopped', time.time(), flush=True)\n    os._exit(0)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        time.sleep(1.0)
        assert process.poll() is None, "it ended by itself"
        sent = time.time()
        process.send_signal(signal.SIGINT)
        word, _, at = process.stdout.readline().partition(" ")
        assert word == "stopped" and float(at) - sent < 0.5


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for single processes")
def test_after_ctrl_c_nothing_keeps_the_program_alive() -> None:
    code = (
        "import signal, time, frameless\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "print('ready', flush=True)\n"
        "frameless.view(lambda x, y, t, c: time.sleep(20), (32, 24), open_browser=False)\n"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        assert "look at it here" in process.stdout.readline()
        time.sleep(0.5)
        sent = time.time()
        process.send_signal(signal.SIGINT)
        assert process.wait(15.0) == 0 and time.time() - sent < 2.0


def test_samplers_that_know_their_session_are_collected() -> None:
    class Knowing:
        def choose(self, now: float, canvas: frameless.CanvasLike, count: int) -> NDArray[Any]:
            return np.arange(count) % canvas.time.size

    def ring() -> list[weakref.ref[Any]]:
        one, other, of_page = Knowing(), Knowing(), Knowing()
        session = frameless.Session((8, 6), sampler=one, batch=10)
        one.session, other.batches = session, iter(session)  # type: ignore[attr-defined]
        batch = next(iter(session))
        session.set_sampler(other)
        one.session = None  # type: ignore[attr-defined]
        page = frameless.serve(lambda x, y, t, c: pattern(x, y, t, (c, page)[0]), (8, 6), sampler=of_page)
        of_page.page = page  # type: ignore[attr-defined]
        page.stop()
        assert batch.submit(np.zeros((10, 3))) == 10
        return [weakref.ref(one), weakref.ref(other), weakref.ref(of_page), weakref.ref(page)]

    known = ring()
    frameless.serve(pattern, (8, 6)).stop()
    frameless.serve(pattern, (8, 6)).stop()
    gc.collect()
    assert [ref() for ref in known] == [None] * 4


TRIANGLE = """{
  "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
  "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
  "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}],
  "bufferViews": [{"buffer": 0, "byteLength": 36}],
  "buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,%s"}]
}""" % base64.b64encode(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4").tobytes()).decode()

GROWTH = """
import sys, numpy, frameless
from pathlib import Path

def resident_mib():
    lines = Path("/proc/self/status").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("VmRSS")).split()[1]) / 1024

def session():
    session = frameless.Session((64, 48), sampler=frameless.BuiltinSampler("change"))
    batch = next(iter(session))
    batch.submit(numpy.zeros((len(batch), 3)))
    session.image(), session.age(), session.change()

def scene():
    scene = frameless.Scene.load(sys.argv[1])
    scene.render((16, 12))
    scene(numpy.full(4, 8.0), numpy.full(4, 6.0), 0.0, scene.camera().with_size((16, 12)))

for make in (session, scene):
    for _ in range(100):
        make()
    before = resident_mib()
    for _ in range(1000):
        make()
    print(resident_mib() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads Linux's /proc")
def test_a_thousand_sessions_and_scenes_leave_nothing_behind(tmp_path: Path) -> None:
    triangle = tmp_path / "triangle.gltf"
    triangle.write_text(TRIANGLE)
    growth = [float(line) for line in run(GROWTH, str(triangle)).split()]
    assert len(growth) == 2 and max(growth) <= 10.0, f"MiB for sessions, for scenes: {growth}"
