"""A server under test, and pages in a browser that look at it."""

import base64
import io
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page, Playwright

BROWSERS = ["chromium", "chromium-browser", "google-chrome"]
# Nothing that talks to anybody but the server under test.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
STARTS_WITHIN_SECS = 30.0


class Server:
    """`frameless serve` on a port of its own, until closed."""

    def __init__(self, program: Path, *args: str, port: int = 0, key_file: Path | None = None):
        keep = ["--key-file", str(key_file)] if key_file else []
        command = [str(program), "serve", *args, "--port", str(port), *keep]
        self.log = tempfile.TemporaryFile(mode="w+")
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self.log, stdin=subprocess.DEVNULL, text=True
        )
        self.url = self._first_line(command)
        self.port = urlsplit(self.url).port

    def _first_line(self, command: list[str]) -> str:
        timer = threading.Timer(STARTS_WITHIN_SECS, self.process.kill)
        timer.start()
        line = self.process.stdout.readline().strip()
        timer.cancel()
        if not line.startswith("http"):
            self.close()
            self.log.seek(0)
            raise RuntimeError(f"{' '.join(command)} printed {line!r}, no address:\n{self.log.read()}")
        return line

    def stderr(self) -> str:
        self.log.seek(0)
        return self.log.read()

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()

    def __enter__(self) -> "Server":
        return self

    def __exit__(self, *_) -> None:
        self.close()


def launch(playwright: Playwright) -> Browser:
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        raise RuntimeError("no Chromium here; install it with: apt-get install chromium")
    return playwright.chromium.launch(executable_path=program, headless=True, args=FLAGS)


class View:
    """One page in a browser context of its own, with what its console says."""

    def __init__(self, browser: Browser, url: str, size=(1280, 800), theme="dark", before="", **options):
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]}, color_scheme=theme, **options
        )
        self.complaints: list[str] = []
        self.page: Page = self.context.new_page()
        self.page.on("console", self._console)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.add_init_script(LISTEN + before)
        self.page.goto(url)
        # The address with the secret leads on to one without.
        self.page.wait_for_url(lambda now: "key=" not in now)

    def _console(self, message) -> None:
        if message.type in ("error", "warning"):
            self.complaints.append(message.text)

    def __enter__(self) -> "View":
        return self

    def __exit__(self, *_) -> None:
        self.context.close()

    def wait(self, condition: str, timeout_secs: float = 15.0) -> None:
        """Until a JavaScript expression is true. Asked from outside: the page's own policy lets no text become a program in it."""
        end = time.monotonic() + timeout_secs
        while not self.page.evaluate(condition):
            assert time.monotonic() < end, f"after {timeout_secs:.0f} s this is still not so: {condition}"
            self.page.wait_for_timeout(20)

    def live(self, drives: bool = True) -> "View":
        """Until there is a picture, and this page drives it."""
        self.wait("document.querySelector('#state').dataset.state === 'live'")
        self.wait("window.seen.drawn > 0")
        if drives:
            self.wait("!document.querySelector('#controls').disabled")
        return self

    def text(self, selector: str) -> str:
        return self.page.locator(selector).inner_text()

    def exact(self, timeout_secs: float = 30.0) -> None:
        """Until the page has found its canvas equal to the server's picture, and that has rested for a moment."""
        rests = "performance.now() - seen.last > 250"
        self.wait(f"{rests} && document.querySelector('#picture').dataset.exact === 'true'", timeout_secs)

    def after(self, action) -> None:
        """Does something that changes the picture; until the page shows what came of it, exactly."""
        drawn = self.page.evaluate("seen.drawn")
        action()
        self.wait(f"seen.drawn > {drawn}")
        self.exact()

    def pixels(self) -> np.ndarray:
        """What the canvas holds: height × width × 3, bytes."""
        url = self.page.evaluate("document.querySelector('#picture').toDataURL('image/png')")
        return image(base64.b64decode(url.split(",", 1)[1]))

    def server_pixels(self) -> np.ndarray:
        """The server's newest picture."""
        origin = "{0.scheme}://{0.netloc}".format(urlsplit(self.page.url))
        answer = self.page.request.get(f"{origin}/picture.png")
        assert answer.ok, f"/picture.png: {answer.status}"
        return image(answer.body())

    def size(self) -> list[int]:
        return self.page.evaluate("(c => [c.width, c.height])(document.querySelector('#picture'))")

    def middle(self) -> tuple[float, float]:
        box = self.page.locator("#picture").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag(self, by=(120, 30), steps=10, button="left") -> None:
        x, y = self.middle()
        self.page.mouse.move(x, y)
        self.page.mouse.down(button=button)
        self.page.mouse.move(x + by[0], y + by[1], steps=steps)
        self.page.mouse.up(button=button)

    def pause(self) -> None:
        if self.page.locator("#play").get_attribute("aria-label") == "Pause":
            self.page.click("#play")
        self.wait("document.querySelector('#play').classList.contains('paused')")

    def rest_at(self, secs: float) -> None:
        """Paused at a time of the scene, without antialiasing, which would go on for seconds; until the page shows it exactly."""
        self.page.uncheck("#antialias")
        self.pause()
        # From another time, so that there is a change to wait for.
        self.after(lambda: self.scrub(secs + 0.3))
        self.after(lambda: self.scrub(secs))

    def scrub(self, secs: float) -> None:
        self.page.locator("#scrub").evaluate(
            "(slider, secs) => { slider.value = secs; slider.dispatchEvent(new Event('input')); }", secs
        )


# What the page tells of what it draws, counted from its beginning.
LISTEN = """
document.addEventListener("pointermove", () => (seen.acted = performance.now()), true);
window.seen = { drawn: 0, last: 0, acted: 0, pictures: 0, picture: 0, begun: 0, latencies: [] };
document.addEventListener("frameless:drawn", ({ detail }) => {
  seen.drawn++;
  seen.last = performance.now();
  if (detail.picture === seen.picture) return;
  seen.pictures++;
  seen.picture = detail.picture;
  seen.begun = seen.last;
});
document.addEventListener("frameless:latency", (event) => seen.latencies.push(event.detail));
"""


def image(png: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).copy()


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    """In dB, of bytes; infinite if both are the same."""
    mean = np.mean((a.astype(float) - b.astype(float)) ** 2)
    return float("inf") if mean == 0 else float(10 * np.log10(255**2 / mean))
