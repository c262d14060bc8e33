"""The page in Firefox: what browsers do each in their own way. The rest is checked in Chromium (check_page.py).

    check_firefox.py PROGRAM FOLDER

PROGRAM is `frameless`. FOLDER takes a screenshot, and what Firefox says. Exits with 1 if something is not as it must be.
"""

import base64
import sys
import time
from http.cookiejar import CookieJar
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import HTTPCookieProcessor, build_opener

import numpy as np

from firefox import Firefox
from serving import Server, image, psnr

SIZE = (320, 240)
CANVAS = "document.querySelector('#picture')"


class Looked(Server):
    """A server whose picture is asked for without a browser, too."""

    def __init__(self, program: Path):
        super().__init__(program, "sphere", "--size", "{}x{}".format(*SIZE))
        self.opener = build_opener(HTTPCookieProcessor(CookieJar()))
        self.opener.open(self.url).read()
        self.origin = "{0.scheme}://{0.netloc}".format(urlsplit(self.url))

    def pixels(self) -> np.ndarray:
        return image(self.opener.open(f"{self.origin}/picture.png").read())


def pixels(browser: Firefox) -> np.ndarray:
    return image(base64.b64decode(browser.evaluate(f"{CANVAS}.toDataURL('image/png')").split(",", 1)[1]))


def at_rest(browser: Firefox, server: Looked) -> np.ndarray:
    """Waits until the canvas is the server's picture, bit for bit."""
    end = time.monotonic() + 30
    while True:
        browser.wait(f"{CANVAS}.dataset.exact === 'true'", 30)
        ours, theirs = pixels(browser), server.pixels()
        if np.array_equal(ours, theirs):
            return ours
        differ = np.count_nonzero((ours != theirs).any(axis=2))
        assert time.monotonic() < end, f"{differ} pixels differ from the server's picture"


def check(browser: Firefox, server: Looked, folder: Path) -> str:
    browser.go(server.url)
    browser.wait("document.querySelector('#state')?.dataset.state === 'live'")
    browser.wait("!location.href.includes('key=')")
    browser.wait("!document.querySelector('#controls').disabled")
    browser.wait("Number(document.querySelector('#hud-samples').textContent.replaceAll(',', '')) > 1000")
    assert browser.evaluate(f"[{CANVAS}.width, {CANVAS}.height]") == list(SIZE)
    browser.screenshot(folder / "firefox.png")
    browser.evaluate("document.querySelector('#antialias').click()")
    browser.evaluate("document.querySelector('#play').click()")
    browser.wait("document.querySelector('#play').classList.contains('paused')")
    before = at_rest(browser, server)
    assert before.std() > 10, "there is nothing in the picture"
    box = browser.evaluate(f"((box) => [box.x + box.width / 2, box.y + box.height / 2])({CANVAS}.getBoundingClientRect())")
    browser.drag(box, (120, 30))
    browser.wait("document.querySelector('#camera').value === ''")
    browser.wait("document.querySelector('#hud-latency').textContent.endsWith('ms')")
    time.sleep(0.5)
    after = at_rest(browser, server)
    got = psnr(before, after)
    assert got < 35, f"orbiting changed nothing ({got:.1f} dB)"
    complaints = browser.complaints(server.origin)
    assert not complaints, f"the page complains: {complaints}"
    # That nobody complained means something only if it would have been heard: a module is no plain script.
    browser.evaluate("void document.head.append(Object.assign(document.createElement('script'), { src: '/main.js' }))")
    end = time.monotonic() + 10
    while not browser.complaints(server.origin):
        assert time.monotonic() < end, f"errors of the page are not seen in {folder}/firefox.log"
        time.sleep(0.1)
    return f"bit-exact twice; input to pixel {browser.evaluate('document.querySelector(`#hud-latency`).textContent')}"


def main() -> int:
    program, folder = Path(sys.argv[1]), Path(sys.argv[2]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with Looked(program) as server, Firefox(folder) as browser:
        try:
            print(f"passed in Firefox: {check(browser, server, folder)}")
        except Exception:
            browser.screenshot(folder / "failed.png")
            raise
    return 0


if __name__ == "__main__":
    sys.exit(main())
