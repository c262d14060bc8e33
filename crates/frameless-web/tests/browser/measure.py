"""The web page's numbers, through headless Chromium on loopback.

    measure.py PROGRAM FOLDER [--only NAME,…] [--short]

Prints a table, and writes FOLDER/web.json. --short takes a sixth of the time, for trying. The machine should do nothing else.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

from serving import Server, View, launch

SIZE = "512x384"
HERE = Path(__file__).parent


class Bench:
    """What every measurement is given."""

    def __init__(self, program: Path, folder: Path, browser, patience: float):
        self.program, self.folder, self.browser, self.patience = program, folder, browser, patience

    def secs(self, full: float) -> float:
        return full * self.patience

    def server(self, *args: str, **options) -> Server:
        return Server(self.program, "sphere", "--size", SIZE, *args, **options)

    def view(self, server: Server) -> View:
        view = View(self.browser, server.url).live()
        view.wait("document.querySelector('#picture').width === 512")
        return view


def percentiles(values, *which) -> list[float]:
    return [round(float(np.percentile(values, q)), 1) for q in which]


class Traffic:
    """Bytes of WebSocket messages, as the browser's own tools count them."""

    def __init__(self, view: View):
        self.bytes = self.messages = 0
        self.devtools = view.context.new_cdp_session(view.page)
        self.devtools.on("Network.webSocketFrameReceived", self._received)
        self.devtools.send("Network.enable")

    def _received(self, event: dict) -> None:
        frame = event["response"]
        text = frame["payloadData"]
        size = len(text.encode()) if frame["opcode"] == 1 else len(text) * 3 // 4 - text[-2:].count("=")
        self.bytes += size + (2 if size < 126 else 4 if size < 65536 else 10)
        self.messages += 1

    def per_sec(self, view: View, secs: float) -> float:
        self.bytes = self.messages = 0
        begin = time.monotonic()
        view.page.wait_for_timeout(1000 * secs)
        return self.bytes / (time.monotonic() - begin)


def latency(bench: Bench) -> dict:
    """Dragging across the moving sphere: from each of the browser's pointer events to the first tiles drawn that show it."""
    with bench.server() as server, bench.view(server) as view:
        _drag_for(view, bench.secs(2))
        view.page.evaluate("seen.latencies.length = 0")
        _drag_for(view, bench.secs(30))
        measured = view.page.evaluate("seen.latencies")
    p50, p99 = percentiles(measured, 50, 99)
    return {"latency_p50_ms": p50, "latency_p99_ms": p99, "latency_inputs": len(measured)}


def _drag_for(view: View, secs: float) -> None:
    x, y = view.middle()
    view.page.mouse.move(x, y)
    view.page.mouse.down()
    end, step = time.monotonic() + secs, 0
    while time.monotonic() < end:
        step += 1
        # Not in step with the display or the server.
        view.page.wait_for_timeout(43 + step * 7 % 31)
        view.page.mouse.move(x + 60 * np.sin(step / 9), y + 30 * np.cos(step / 13))
    view.page.mouse.up()


def latency_at_rest(bench: Bench) -> dict:
    """The first tiles of any kind that are drawn after an input while nothing else moves: counts on no number in a message."""
    measured = []
    with bench.server() as server, bench.view(server) as view:
        view.pause()
        for turn in range(max(5, int(bench.secs(15)))):
            view.exact(60)
            measured.append(view.page.evaluate(FIRST_PIXEL, [1 if turn % 2 else -1]))
    p50, p99 = percentiles(measured, 50, 99)
    return {"latency_at_rest_p50_ms": p50, "latency_at_rest_p99_ms": p99, "latency_at_rest_inputs": len(measured)}


# A notch of the wheel, and the time until the canvas has changed.
FIRST_PIXEL = """([way]) => new Promise((done) => {
  const canvas = document.querySelector("#picture");
  const begin = performance.now();
  document.addEventListener("frameless:drawn", () => done(performance.now() - begin), { once: true });
  canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: 40 * way, bubbles: true, cancelable: true }));
})"""


def moving(bench: Bench) -> dict:
    """The sphere rolls by itself: traffic, and how far the canvas is from the picture that its newest tiles are of."""
    with bench.server() as server, bench.view(server) as view:
        view.page.wait_for_timeout(1500)
        traffic = Traffic(view)
        before = view.page.evaluate("[seen.pictures, performance.now()]")
        bytes_per_sec = traffic.per_sec(view, bench.secs(20))
        after = view.page.evaluate("[seen.pictures, performance.now()]")
        pictures_per_sec = 1000 * (after[0] - before[0]) / (after[1] - before[1])
        compared = view.page.evaluate(ON_SCREEN, [max(6, int(bench.secs(40)))])
        frames = _frames(bench, view)
    errors = [pair for pair in compared if pair is not None]
    mean_square = float(np.mean(errors))
    return {
        "moving_bytes_per_sec": round(bytes_per_sec),
        "moving_pictures_per_sec": round(pictures_per_sec, 1),
        "moving_psnr_db": round(10 * np.log10(255**2 / mean_square), 1),
        "moving_psnr_worst_db": round(10 * np.log10(255**2 / max(errors)), 1),
        "moving_pictures_compared": len(errors),
        "jpeg_frame_bytes": round(frames),
        "jpeg_frames_bytes_per_sec": round(frames * pictures_per_sec),
        "share_of_jpeg_frames": round(bytes_per_sec / (frames * pictures_per_sec), 3),
    }


# Asks for the server's picture again and again. The answer bears its number; canvases after the tiles of each picture are kept a
# while, so that both are of the same moment. Returns mean squared errors in squares of bytes.
ON_SCREEN = """async ([wanted]) => {
  const canvas = document.querySelector("#picture");
  const context = canvas.getContext("2d");
  const grab = () => context.getImageData(0, 0, canvas.width, canvas.height).data;
  const kept = new Map();
  document.addEventListener("frameless:drawn", ({ detail }) => {
    kept.set(detail.picture, grab());
    if (kept.size > 60) kept.delete(kept.keys().next().value);
  });
  const errors = [];
  for (let k = 0; k < wanted; k++) {
    await new Promise((done) => setTimeout(done, 150 + 37 * (k % 5)));
    const answer = await fetch("/picture.png", { cache: "no-store" });
    const number = Number(answer.headers.get("x-picture"));
    const bitmap = await createImageBitmap(await answer.blob(), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    await new Promise((done) => setTimeout(done, 100));
    const before = [...kept.keys()].filter((picture) => picture <= number);
    if (!number || before.length === 0) continue;
    const other = new OffscreenCanvas(bitmap.width, bitmap.height).getContext("2d", { alpha: false });
    other.drawImage(bitmap, 0, 0);
    const [a, b] = [kept.get(Math.max(...before)), other.getImageData(0, 0, bitmap.width, bitmap.height).data];
    let sum = 0;
    for (let i = 0; i < a.length; i++) if (i % 4 < 3) sum += (a[i] - b[i]) ** 2;
    errors.push(sum / (a.length * 0.75));
  }
  return errors;
}"""


def _frames(bench: Bench, view: View) -> float:
    """Bytes of the same pictures as whole JPEG frames of quality 75 by the server's own encoder, in the mean."""
    paths = []
    for number in range(8):
        view.page.wait_for_timeout(220)
        paths.append(bench.folder / f"frame-{number}.png")
        Image.fromarray(view.server_pixels()).save(paths[-1])
    command = [bench.program.with_name("examples") / "jpeg_frames", *paths]
    sizes = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    return float(np.mean([int(size) for size in sizes]))


def rest(bench: Bench) -> dict:
    """How long after motion the canvas is the server's picture, and the traffic once nothing changes any longer."""
    refined, plain = [], []
    with bench.server() as server, bench.view(server) as view:
        view.pause()
        for turn in range(max(3, int(bench.secs(20)))):
            refined.append(_drag_and_wait(view, turn))
        view.page.uncheck("#antialias")
        for turn in range(max(3, int(bench.secs(20)))):
            plain.append(_drag_and_wait(view, turn))
        view.page.check("#antialias")
        view.page.wait_for_timeout(1000)
        shares = view.page.evaluate(SHARE_EXACT, [bench.secs(10)])
        view.page.wait_for_timeout(bench.secs(30_000))
        view.exact(60)
        traffic = Traffic(view)
        bytes_per_sec = traffic.per_sec(view, bench.secs(30))
        same = np.array_equal(view.pixels(), view.server_pixels())
    return {
        "rest_bytes_per_sec": round(bytes_per_sec, 1),
        "rest_messages": traffic.messages,
        "rest_is_bit_exact": bool(same),
        "exact_after_last_input_ms": percentiles(refined, 50, 100),
        "exact_without_antialias_ms": percentiles(plain, 50, 100),
        "share_of_time_exact_while_refined": round(shares, 2),
    }


def _drag_and_wait(view: View, turn: int) -> float:
    view.page.wait_for_timeout(300 + 61 * (turn % 7))
    view.drag(by=(40 if turn % 2 else -40, 10), steps=6)
    return view.page.evaluate(FIRST_EXACT)


# Milliseconds from the last of the pointer's events until the page has found its canvas equal to the server's newest picture.
FIRST_EXACT = """() => new Promise((done) => {
  const canvas = document.querySelector("#picture");
  const look = () => {
    if (canvas.dataset.exact === "true" && seen.last > seen.acted) done(performance.now() - seen.acted);
    else setTimeout(look, 2);
  };
  look();
})"""

# Of some seconds, in which share the canvas was.
SHARE_EXACT = """([secs]) => new Promise((done) => {
  const canvas = document.querySelector("#picture");
  const end = performance.now() + 1000 * secs;
  let [looks, exact] = [0, 0];
  const look = () => {
    looks++;
    exact += canvas.dataset.exact === "true";
    if (performance.now() > end) done(exact / looks);
    else setTimeout(look, 2);
  };
  look();
})"""


def samples_lost(bench: Bench) -> dict:
    """Samples per second while nobody looks against one client: one that only acknowledges, and a browser on the same cores."""
    alone, light, browser = [], [], []
    with bench.server() as server:
        _light(server.url, 2)  # before the first picture there is nothing to count from
        time.sleep(3)
        for _ in range(max(4, int(bench.secs(8)))):
            result = _light(server.url, 4)
            alone.extend(filter(None, [result["samples_per_sec_before"]]))
            light.append(result["samples_per_sec"])
            with bench.view(server) as view:
                view.page.wait_for_timeout(4000)
                browser.append(float(view.text("#hud-samples").replace(",", "")))
            time.sleep(3)
    base = float(np.median(alone))
    return {
        "samples_per_sec_alone": round(base),
        "samples_per_sec_light_client": round(float(np.median(light))),
        "samples_per_sec_browser": round(float(np.median(browser))),
        "lost_to_a_light_client": round(1 - float(np.median(light)) / base, 3),
        "lost_to_a_browser": round(1 - float(np.median(browser)) / base, 3),
    }


def _light(url: str, secs: float) -> dict:
    return LightProcess(url, secs).result()


class LightProcess(subprocess.Popen):
    """light_client.py. What it prints goes to a file: it is more than a pipe holds that nobody reads meanwhile."""

    def __init__(self, url: str, secs: float, *args: str):
        self.printed = tempfile.TemporaryFile("w+")
        super().__init__([sys.executable, str(HERE / "light_client.py"), url, str(secs), *args], stdout=self.printed)

    def result(self) -> dict:
        self.wait()
        self.printed.seek(0)
        return json.load(self.printed)


def stopped_client(bench: Bench) -> dict:
    """Eight clients, one of them stopped: the server's memory, and the others' waiting."""
    secs = bench.secs(120)
    with bench.server() as server:
        def others_wait(stop_one: bool) -> tuple[list, list, int]:
            driver = LightProcess(server.url, secs, "--drive")
            watching = [LightProcess(server.url, secs) for _ in range(6)]
            last = LightProcess(server.url, secs + 600 if stop_one else secs)
            time.sleep(4)
            memory = [_resident_kib(server.process.pid)]
            if stop_one:
                os.kill(last.pid, signal.SIGSTOP)
            while driver.poll() is None:
                time.sleep(min(1, secs / 10))
                memory.append(_resident_kib(server.process.pid))
            results = [process.result() for process in [driver, *watching]]
            last.kill()
            last.wait()
            gaps = [gap for result in results for gap in result["gaps_secs"]]
            return gaps, results[0]["latencies_ms"], max(memory) - memory[0]

        gaps, latencies, _ = others_wait(stop_one=False)
        time.sleep(3)
        gaps_beside, latencies_beside, grown = others_wait(stop_one=True)
    before, beside = percentiles(latencies, 95)[0], percentiles(latencies_beside, 95)[0]
    return {
        "stopped_client_memory_mib": round(grown / 1024, 1),
        "driver_latency_p95_ms": [before, beside],
        "driver_latency_p95_change": round(beside / before - 1, 3),
        "gap_between_messages_p95_ms": [percentiles(1000 * np.array(each), 95)[0] for each in (gaps, gaps_beside)],
    }


def _resident_kib(pid: int) -> int:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


def restart(bench: Bench) -> dict:
    """From the start of another server to the first tiles on the page that was left alone meanwhile."""
    key, secs = bench.folder / "key", []
    server = bench.server(key_file=key)
    port = server.port
    view = bench.view(server)
    for turn in range(max(2, int(bench.secs(8)))):
        server.close()
        view.wait("!document.querySelector('#banner').hidden")
        view.page.wait_for_timeout(500 + 700 * turn)
        view.page.evaluate("seen.drawn = 0")
        begin = time.monotonic()
        server = bench.server(port=port, key_file=key)
        view.wait("seen.drawn > 0")
        secs.append(time.monotonic() - begin)
    server.close()
    view.context.close()
    return {"restart_secs": [round(float(np.median(secs)), 2), round(max(secs), 2)]}


MEASURED = [latency, latency_at_rest, moving, rest, samples_lost, stopped_client, restart]


def main() -> int:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program", type=Path)
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--only", default="")
    arguments.add_argument("--short", action="store_true")
    given = arguments.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    names = [name for name in given.only.split(",") if name]
    results = {"size": SIZE, "cores": os.cpu_count(), "load_before": os.getloadavg()[0]}
    with sync_playwright() as playwright, launch(playwright) as browser:
        bench = Bench(given.program.resolve(), given.folder, browser, 1 / 6 if given.short else 1.0)
        for measure in MEASURED:
            if names and measure.__name__ not in names:
                continue
            for name, value in measure(bench).items():
                results[name] = value
                print(f"{name:32} {value}", flush=True)
    (given.folder / "web.json").write_text(json.dumps(results, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
