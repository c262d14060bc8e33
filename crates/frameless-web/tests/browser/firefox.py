"""Firefox, headless, driven by Marionette: the protocol that it speaks itself, over a socket of this machine.

A message is its length in decimal digits, a colon, and JSON: [0, number, command, parameters], answered by [1, number, error, result]
(https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html). Commands are WebDriver's.
"""

import base64
import json
import os
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path

PROGRAMS = ["firefox", "firefox-esr"]
STARTS_WITHIN_SECS = 60.0
SIZE = (1280, 860)
PREFERENCES = {
    "devtools.console.stdout.content": True,
    # Nothing that talks to anybody but the server under test.
    "app.update.enabled": False,
    "browser.safebrowsing.downloads.remote.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "extensions.update.enabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "network.dns.disablePrefetch": True,
    "network.prefetch-next": False,
    "services.settings.server": "data:,",
    "toolkit.telemetry.enabled": False,
}
# How errors of scripts, and of what a page's policy forbids, begin on standard output; the address of the page follows.
COMPLAINTS = ("JavaScript error: ", "JavaScript warning: ", "Content-Security-Policy: ")


class Firefox:
    """One window, until closed."""

    def __init__(self, folder: Path):
        program = next(filter(None, map(shutil.which, PROGRAMS)), None)
        if program is None:
            raise RuntimeError("no Firefox here; install it with: apt-get install firefox-esr")
        profile = Path(tempfile.mkdtemp(prefix="firefox-", dir=folder))
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        preferences = PREFERENCES | {"marionette.port": port}
        lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in preferences.items()]
        (profile / "user.js").write_text("".join(lines))
        self.profile, self.number = profile, 0
        self.output = (folder / "firefox.log").open("w+")
        command = [program, "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
        size = {"MOZ_HEADLESS_WIDTH": str(SIZE[0]), "MOZ_HEADLESS_HEIGHT": str(SIZE[1])}
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=self.output, stderr=subprocess.STDOUT, env=os.environ | size
        )
        self.stream = self._connect(port)
        self._read()  # who it is
        self.command("WebDriver:NewSession", capabilities={})

    def _connect(self, port: int):
        end = time.monotonic() + STARTS_WITHIN_SECS
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), timeout=60).makefile("rwb")
            except OSError:
                if time.monotonic() > end or self.process.poll() is not None:
                    self.close()
                    raise RuntimeError(f"Firefox does not start:\n{self.said()}") from None
                time.sleep(0.1)

    def _read(self):
        digits = b""
        while not digits.endswith(b":"):
            byte = self.stream.read(1)
            if not byte:
                raise RuntimeError(f"Firefox has ended:\n{self.said()}")
            digits += byte
        return json.loads(self.stream.read(int(digits[:-1])))

    def command(self, name: str, **parameters):
        self.number += 1
        message = json.dumps([0, self.number, name, parameters]).encode()
        self.stream.write(b"%d:%s" % (len(message), message))
        self.stream.flush()
        _, _, error, result = self._read()
        if error:
            raise RuntimeError(f"{name}: {error['message']}")
        return result

    def go(self, url: str) -> None:
        self.command("WebDriver:Navigate", url=url)

    def evaluate(self, expression: str):
        return self.command("WebDriver:ExecuteScript", script=f"return ({expression});", args=[])["value"]

    def wait(self, condition: str, timeout_secs: float = 20.0) -> None:
        end = time.monotonic() + timeout_secs
        while not self.evaluate(condition):
            assert time.monotonic() < end, f"after {timeout_secs:.0f} s this is still not so: {condition}"
            time.sleep(0.02)

    def drag(self, begin, by) -> None:
        """With the left button, in CSS pixels."""
        x, y = (round(side) for side in begin)
        steps = [
            {"type": "pointerMove", "x": x, "y": y, "duration": 0},
            {"type": "pointerDown", "button": 0},
            {"type": "pointerMove", "x": x + by[0], "y": y + by[1], "duration": 300},
            {"type": "pointerUp", "button": 0},
        ]
        mouse = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps}
        self.command("WebDriver:PerformActions", actions=[mouse])

    def screenshot(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self.command("WebDriver:TakeScreenshot", full=False)["value"]))

    def said(self) -> str:
        return Path(self.output.name).read_text(errors="replace")

    def complaints(self, origin: str) -> list[str]:
        """Errors in the scripts of an origin. Firefox has errors of its own, which say nothing of a page."""
        return [line for line in self.said().splitlines() if line.startswith(COMPLAINTS) and origin in line]

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(10)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        shutil.rmtree(self.profile, ignore_errors=True)

    def __enter__(self) -> "Firefox":
        return self

    def __exit__(self, *_) -> None:
        self.close()
