"""The page in a browser, against a server of its own.

    check_page.py PROGRAM FOLDER [NAME …]

PROGRAM is `frameless`. FOLDER takes screenshots of what failed, and of the page in both themes at two sizes. With names, only
those checks run. Exits with 1 if a check fails.
"""

import os
import subprocess
import sys
import time
import traceback
from base64 import b64encode
from pathlib import Path

import numpy as np
from axe_playwright_python.sync_playwright import Axe
from PIL import Image
from playwright.sync_api import sync_playwright

import glb
from light_client import LightClient
from serving import Server, View, launch, psnr

# Few pixels come to rest soon, even on a busy machine.
SIZE = "320x240"
SCENE = ["sphere", "--size", SIZE]
PHONE = (390, 844)
WINDOW = (1280, 800)


class Bench:
    """What every check is given."""

    def __init__(self, program: Path, folder: Path, browser, server: Server):
        self.program, self.folder, self.browser, self.server = program, folder, browser, server
        self.views: list[View] = []

    def open(self, url: str | None = None, drives: bool = True, **options) -> View:
        view = View(self.browser, url or self.server.url, **options)
        self.views.append(view)
        return view.live(drives)

    def close(self) -> None:
        for view in self.views:
            view.context.close()
        self.views.clear()


def loads_without_complaints(bench: Bench) -> str:
    view = bench.open()
    view.wait("!document.querySelector('#hud').hidden")
    view.wait("Number(document.querySelector('#hud-samples').textContent.replaceAll(',', '')) > 1000")
    assert view.text("#scene-name") == "sphere", view.text("#scene-name")
    hosts = view.page.evaluate(
        "[...new Set(performance.getEntriesByType('resource').map((entry) => new URL(entry.name).host))]"
    )
    assert hosts == [f"127.0.0.1:{bench.server.port}"], hosts
    assert "key=" not in view.page.url, "the secret stays in the address bar"
    return f"{view.text('#hud-samples')} samples/s"


def shows_the_right_picture(bench: Bench) -> str:
    view = bench.open()
    view.page.check("[name=reconstruction][value=hold]", force=True)
    view.pause()
    view.scrub(0.5)
    wanted = bench.folder / "wanted.png"
    command = [bench.program, "render", "sphere", "--time", "0.5", "--size", SIZE, "-o", wanted]
    subprocess.run(command, check=True, capture_output=True)
    ideal = np.asarray(Image.open(wanted).convert("RGB"))
    begin, got = time.monotonic(), 0.0
    while got < 45 and time.monotonic() - begin < 20:
        view.page.wait_for_timeout(200)
        got = psnr(view.pixels(), ideal)
    Image.fromarray(view.pixels()).save(bench.folder / "got.png")
    assert got >= 45, f"{got:.1f} dB from what `frameless render` makes; see {bench.folder}"
    view.page.check("[name=reconstruction][value=reproject]", force=True)
    return f"{got:.0f} dB"


def is_bit_exact_at_rest(bench: Bench) -> str:
    view = bench.open()
    view.pause()
    view.after(view.drag)
    end, same = time.monotonic() + 20, False
    while not same and time.monotonic() < end:
        # While antialiasing goes on, the picture may have become another one between two looks at it.
        view.exact()
        ours, theirs = view.pixels(), view.server_pixels()
        same = np.array_equal(ours, theirs)
    assert same, f"{np.count_nonzero((ours != theirs).any(axis=2))} pixels differ"
    view.page.keyboard.press("Home")
    return f"{ours.shape[1]}×{ours.shape[0]} pixels"


def moves_with_the_hands(bench: Bench) -> str:
    view = bench.open()
    view.rest_at(0.5)
    seen = [view.pixels()]

    def changed(what: str, do) -> None:
        view.after(do)
        seen.append(view.pixels())
        got = psnr(seen[-2], seen[-1])
        assert got < 35, f"{what} changed nothing ({got:.1f} dB)"

    mouse, keyboard = view.page.mouse, view.page.keyboard
    changed("orbiting", view.drag)
    assert view.page.input_value("#camera") == "", "the scene's camera is still in use"
    changed("panning", lambda: view.drag(button="right"))
    changed("zooming", lambda: mouse.wheel(0, -300))
    changed("flying", lambda: (keyboard.down("w"), view.page.wait_for_timeout(300), keyboard.up("w")))
    changed("orbiting by keys", lambda: hold(view, "ArrowRight"))
    changed("panning by keys", lambda: hold(view, "Shift", "ArrowUp"))
    changed("zooming by keys", lambda: hold(view, "+"))
    # Chosen with the mouse: the next key is the picture's, and not the list's.
    view.page.locator("#size").click()
    view.page.keyboard.press("Escape")
    view.page.focus("#size")
    size = view.page.input_value("#size")
    changed("a key after a list", lambda: hold(view, "ArrowLeft"))
    assert view.page.input_value("#size") == size, "the list has taken the key"
    keyboard.press("Tab")
    view.page.focus("#size")
    keyboard.press("Home")
    assert view.page.evaluate("document.activeElement.id") == "size", "who came by the tab key stays at the list"
    view.page.select_option("#size", size)
    keyboard.press("Escape")
    changed("coming back", lambda: keyboard.press("Home"))
    assert view.page.input_value("#camera") == "0"
    back = psnr(seen[0], seen[-1])
    assert back > 25, f"Home is not where it began ({back:.1f} dB)"
    view.page.check("#antialias")
    latencies = view.page.evaluate("seen.latencies")
    assert latencies, "no latency was measured"
    return f"input to pixel {np.median(latencies):.0f} ms (median of {len(latencies)})"


def hold(view: View, *keys: str) -> None:
    for key in keys:
        view.page.keyboard.down(key)
    view.page.wait_for_timeout(300)
    for key in reversed(keys):
        view.page.keyboard.up(key)


def is_touched_with_fingers(bench: Bench) -> str:
    view = bench.open(size=PHONE, has_touch=True, device_scale_factor=2, is_mobile=True)
    view.rest_at(0.5)
    before = view.pixels()
    x, y = view.middle()
    devtools = view.context.new_cdp_session(view.page)

    def touch(kind: str, *points) -> None:
        points = [{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(points)]
        devtools.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def pinch() -> None:
        touch("touchStart", (x - 40, y), (x + 40, y))
        for step in range(1, 6):
            touch("touchMove", (x - 40 - 8 * step, y), (x + 40 + 8 * step, y))
        touch("touchEnd")

    def drag() -> None:
        touch("touchStart", (x, y))
        for step in range(1, 6):
            touch("touchMove", (x + 15 * step, y))
        touch("touchEnd")

    view.after(pinch)
    pinched = view.pixels()
    assert psnr(before, pinched) < 35, "pinching changed nothing"
    view.after(drag)
    assert psnr(pinched, view.pixels()) < 35, "one finger changed nothing"
    view.page.click("#home")
    view.page.check("#antialias")
    return "pinch and drag"


def shows_overlays_with_legends(bench: Bench) -> str:
    view = bench.open()
    titles = []
    for digit in "123456":
        view.page.keyboard.press(digit)
        view.wait(
            "!document.querySelector('#legend').hidden"
            f" && document.querySelector('#legend-title').textContent !== {titles[-1] if titles else ''!r}"
        )
        titles.append(view.text("#legend-title"))
        chosen = view.page.locator("[name=overlay]:checked").get_attribute("value")
        assert chosen != "none", f"key {digit} chose {chosen}"
    view.page.keyboard.press("0")
    view.wait("document.querySelector('#legend').hidden")
    assert len(set(titles)) == 6, titles
    view.page.select_option("#sampler", "random")
    view.page.keyboard.press("5")
    view.wait("!document.querySelector('#no-overlay').hidden")
    said = view.text("#no-overlay")
    assert "random" in said and "learned rate" in said, said
    view.page.select_option("#sampler", "adaptive")
    view.wait("document.querySelector('#no-overlay').hidden")
    view.page.keyboard.press("0")
    view.wait("document.querySelector('#legend').hidden")
    return "six, and one that a sampler has not got"


def plays_and_scrubs(bench: Bench) -> str:
    view = bench.open()
    clock = "Number.parseFloat(document.querySelector('#clock').textContent)"
    view.page.click("#play") if view.page.locator("#play.paused").count() else None
    view.wait("!document.querySelector('#play').classList.contains('paused')")
    first = view.page.evaluate(clock)
    view.wait(f"{clock} !== {first}")
    view.page.focus("#picture")
    view.page.keyboard.press("Space")
    view.wait("document.querySelector('#play').classList.contains('paused')")
    for secs in (0.25, 1.0):
        view.scrub(secs)
        view.page.wait_for_timeout(800)
        assert abs(view.page.evaluate(clock) - secs) < 0.02, view.text("#clock")
    view.page.fill("#speed", "-2")
    view.page.keyboard.press("Enter")
    view.page.click("#play")
    view.wait("!document.querySelector('#play').classList.contains('paused')")
    view.wait(f"{clock} < 0.8 || {clock} > 1.2")
    view.page.fill("#speed", "1")
    view.page.keyboard.press("Enter")
    return "forth, back, and to a time"


def follows_the_window(bench: Bench) -> str:
    view = bench.open()
    view.page.select_option("#size", "whole-window")
    sizes = []
    for width, height in [(900, 700), (1100, 640)]:
        view.page.set_viewport_size({"width": width, "height": height})
        place = view.page.locator("#stage").bounding_box()
        wanted = [round(place["width"]), round(place["height"])]
        view.wait(f"document.querySelector('#picture').width === {wanted[0]}")
        sizes.append(view.size())
        assert sizes[-1] == wanted, (sizes[-1], wanted)
    view.page.select_option("#size", "window")
    view.wait(f"document.querySelector('#picture').width < {sizes[-1][0]}")
    box, size = view.page.locator("#picture").bounding_box(), view.size()
    scale = box["width"] / size[0]
    assert scale == round(scale), f"one pixel is drawn {scale} wide"
    view.page.select_option("#size", SIZE)
    return " and ".join(f"{width}×{height}" for width, height in sizes)


def sets_what_the_panel_offers(bench: Bench) -> str:
    view = bench.open()
    page = view.page
    other = bench.open(drives=False)
    page.select_option("#sampler", "change")
    other.wait("document.querySelector('#sampler').value === 'change'")
    other.wait("!document.querySelector('#w_d-row').hidden && document.querySelector('#temporal-row').hidden")
    page.check("[name=reconstruction][value=filter]", force=True)
    other.wait("document.querySelector('[value=filter]').checked")
    for slider, value, written in [("#exposure", "1.5", "1.50"), ("#w_d", "0.5", "0.50"), ("#tile", "8", "8 px")]:
        page.locator(slider).fill(value)
        other.wait(f"document.querySelector('output[for={slider[1:]}]').textContent === {written!r}")
    page.check("#limited")
    page.locator("#rate").fill("5")
    other.wait("document.querySelector('output[for=rate]').textContent === '100 k'")
    other.wait("Number(document.querySelector('#hud-samples').textContent.replaceAll(',', '')) < 115000")
    page.uncheck("#limited")
    page.locator("#exposure").fill("0")
    page.select_option("#tone-map", "agx")
    other.wait("document.querySelector('#tone-map').value === 'agx'")
    page.select_option("#tone-map", "neutral")
    page.check("[name=reconstruction][value=reproject]", force=True)
    page.uncheck("#antialias")
    page.select_option("#sampler", "adaptive")
    page.locator("#temporal").fill("0.8")
    other.wait("document.querySelector('#temporal').value === '0.8'")
    other.wait("!document.querySelector('#antialias').checked")
    page.locator("#temporal").fill("0.5")
    page.check("#antialias")
    other.wait("document.querySelector('#antialias').checked")
    # Whoever has used the mouse goes on with the picture: the keys are its own again.
    page.keyboard.press("Space")
    other.wait("document.querySelector('#play').classList.contains('paused')")
    assert page.is_checked("#antialias"), "the space bar was the box's"
    page.locator("#theme").click()
    page.keyboard.press("Space")
    other.wait("!document.querySelector('#play').classList.contains('paused')")
    page.locator("#theme").click()
    return "on this page and on another; keys after clicks"


def hands_the_helm_over(bench: Bench) -> str:
    first = bench.open()
    second = bench.open(drives=False)
    second.wait("document.querySelector('#driver-text').textContent.includes('Somebody else')")
    second.wait("document.querySelector('#controls').disabled")
    second.drag()
    second.wait("document.querySelector('#messages').textContent.includes('take the controls')")
    for key in ("Space", "2", "w"):
        second.page.keyboard.press("Escape")
        second.wait("document.querySelector('#messages').children.length === 0")
        second.page.keyboard.press(key, delay=60)
        second.wait("document.querySelector('#messages').textContent.includes('take the controls')")
    second.page.click("#drive")
    second.wait("!document.querySelector('#controls').disabled")
    first.wait("document.querySelector('#controls').disabled")
    second.drag()
    first.wait("document.querySelector('#camera').value === ''")
    second.page.keyboard.press("Home")
    first.wait("document.querySelector('#camera').value === '0'")
    second.context.close()
    first.wait("document.querySelector('#driver-text').textContent.includes('Nobody')")
    first.page.click("#drive")
    first.wait("!document.querySelector('#controls').disabled")
    return "taken, and released by leaving"


# R G B A of the picture's middle.
MIDDLE = """((canvas) => {
  const [x, y] = [canvas.width >> 1, canvas.height >> 1];
  return canvas.getContext("2d").getImageData(x, y, 1, 1).data;
})(document.querySelector("#picture"))"""


def uploads_scenes(bench: Bench) -> str:
    view = bench.open()
    page = view.page

    def upload(name: str, content: bytes) -> None:
        file = {"name": name, "mimeType": "model/gltf-binary", "buffer": content}
        page.set_input_files("#file", files=[file])

    def refused(name: str, content: bytes) -> None:
        page.keyboard.press("Escape")
        upload(name, content)
        view.wait("document.querySelector('.message.error') !== null")
        assert view.text("#scene-name") == "sphere", f"{name} was opened"

    refused("cut.glb", glb.triangle()[:-20])
    refused("reaches-out.glb", glb.reaches_out())
    refused("model.gltf", b"{}")
    page.keyboard.press("Escape")
    upload("triangle.glb", glb.triangle())
    view.wait("document.querySelector('#scene-name').textContent !== 'sphere'")
    view.wait("!document.querySelector('#timeless').hidden")
    view.wait(f"(([red, green, blue]) => red > 2 * Math.max(green, blue))({MIDDLE})")
    name = view.text("#scene-name")
    page.select_option("#scenes", "sphere")
    view.wait("document.querySelector('#scene-name').textContent === 'sphere'")
    complaints = [text for text in view.complaints if "422" not in text]
    assert len(view.complaints) <= 2 and not complaints, view.complaints
    view.complaints.clear()  # the browser itself says that uploads were answered 422
    return f"{name}; three bad ones refused"


def saves_and_records(bench: Bench) -> str:
    view = bench.open()
    view.rest_at(0.9)
    shown = view.pixels()
    with view.page.expect_download() as download:
        view.page.keyboard.press("i")
    path = bench.folder / download.value.suggested_filename
    download.value.save_as(path)
    saved = np.asarray(Image.open(path).convert("RGB"))
    assert saved.shape == shown.shape and psnr(saved, shown) > 45, f"the PNG is another picture ({psnr(saved, shown):.1f} dB)"
    assert np.array_equal(saved, view.server_pixels()), "the PNG is not the server's picture"
    view.page.check("#antialias")
    view.page.click("#play")
    own = recorded(bench, view)
    without = bench.open(drives=False, before="delete globalThis.MediaRecorder;")
    return f"{own} by the browser, {recorded(bench, without)} by the server"


def recorded(bench: Bench, view: View) -> str:
    view.page.keyboard.press("r")
    view.wait("document.querySelector('#record').getAttribute('aria-pressed') === 'true'")
    view.page.wait_for_timeout(2000)
    with view.page.expect_download() as download:
        view.page.keyboard.press("r")
    path = bench.folder / download.value.suggested_filename
    download.value.save_as(path)
    assert path.suffix == ".mp4", path.name
    blank = view.context.new_page()  # the page's own policy lets no video in
    width, secs = blank.evaluate(PLAY, b64encode(path.read_bytes()).decode())
    assert width == view.size()[0] and 1.5 < secs < 4, f"{path.name}: {width} pixels wide, {secs} s"
    return f"{secs:.1f} s"


# What a video element makes of these bytes: its width in pixels, and for how many seconds it plays.
PLAY = """async (base64) => {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const video = document.createElement("video");
  video.src = URL.createObjectURL(new Blob([bytes], { type: "video/mp4" }));
  video.muted = true;
  video.playbackRate = 8;
  const ended = new Promise((done, failed) => { video.onended = done; video.onerror = failed; });
  const late = new Promise((_, failed) => setTimeout(() => failed(new Error("it does not play to its end")), 15_000));
  await Promise.race([video.play().then(() => ended), late]);
  return [video.videoWidth, video.currentTime];
}"""


def comes_back_by_itself(bench: Bench) -> str:
    key = bench.folder / "key"
    with Server(bench.program, *SCENE, key_file=key) as first:
        view = bench.open(first.url)
        port = first.port
    view.wait("!document.querySelector('#banner').hidden")
    banner = view.text("#banner-text")
    assert "lost" in banner.lower(), banner
    view.page.evaluate("seen.drawn = 0")
    with Server(bench.program, *SCENE, port=port, key_file=key):
        begin = time.monotonic()
        view.wait("seen.drawn > 0", 10)
        secs = time.monotonic() - begin
        view.live()
        assert view.page.locator("#banner").is_hidden()
        view.context.close()
    # The browser itself says that nobody answered, or hung up.
    view.complaints[:] = [text for text in view.complaints if "net::ERR_CONNECTION" not in text]
    assert secs <= 5, f"{secs:.1f} s"
    return f"{secs:.1f} s after the server was there again"


def says_why_it_cannot_come_back(bench: Bench) -> str:
    with Server(bench.program, *SCENE) as first:
        view = bench.open(first.url)
        port = first.port
    view.wait("!document.querySelector('#banner').hidden")
    texts = "window.texts = [...(window.texts ?? []), document.querySelector('#banner-text').textContent]"
    with Server(bench.program, *SCENE, port=port) as other:
        view.wait("document.querySelector('#banner-text').textContent.includes('open the address')")
        assert view.page.locator("#banner-spinner").is_hidden()
        for _ in range(12):
            view.page.evaluate(texts)
            view.page.wait_for_timeout(250)
        said = set(view.page.evaluate("texts"))
        assert len(said) == 1, said
        view.page.goto(other.url)
        view.page.wait_for_url(lambda now: "key=" not in now)
        view.live()
        refusals = other.stderr().count("was turned away")
    # One that has no room: whatever the page's WebSocket is told, the page is not.
    view.page.route("**/clients", lambda route: route.fulfill(json={"clients": 64, "most": 64}))
    view.wait("document.querySelector('#banner-text').textContent.includes('full')")
    view.context.close()
    view.complaints[:] = [text for text in view.complaints if not any(sign in text for sign in ("net::ERR_", "403"))]
    assert refusals in (1, 2), f"{refusals} lines about requests that were turned away"
    return "another secret, no room"


def waits_without_work_for_who_says_nothing(bench: Bench) -> str:
    if not Path("/proc/self/task").exists():
        return "SKIPPED: the threads' times are told in /proc, on Linux only"
    with Server(bench.program, *SCENE) as server:
        client = LightClient(server.url)
        time.sleep(3)
        before = _network_secs(server)
        time.sleep(3)
        secs = _network_secs(server) - before
        client.socket.close()
    assert secs < 0.5, f"{secs:.2f} s of work in 3 s for a client that has no room"
    return f"{secs:.2f} s of work in 3 s"


def _network_secs(server: Server) -> float:
    """What the server's network threads have worked."""
    ticks = 0
    for thread in Path(f"/proc/{server.process.pid}/task").iterdir():
        name, fields = (thread / "stat").read_text().split("(", 1)[1].rsplit(")", 1)
        if name == "web":
            ticks += sum(int(field) for field in fields.split()[11:13])
    return ticks / os.sysconf("SC_CLK_TCK")


def is_accessible(bench: Bench) -> str:
    checked = 0
    for theme in ("dark", "light"):
        for name, size in (("wide", WINDOW), ("phone", PHONE)):
            # The checker is a script of its own, which the page's policy would not let in.
            view = bench.open(theme=theme, size=size, bypass_csp=True)
            view.pause()
            view.scrub(0.9)
            view.page.wait_for_timeout(500)
            view.page.screenshot(path=bench.folder / f"{name}-{theme}.png")
            view.page.keyboard.press("2")
            view.wait("!document.querySelector('#legend').hidden")
            results = [Axe().run(view.page)]
            if name == "phone":
                view.page.keyboard.press("h")
                view.wait("document.querySelector('#keys').open")
                results.append(Axe().run(view.page))
                view.page.keyboard.press("Escape")
            for result in results:
                assert result.violations_count == 0, result.generate_report()
                checked += 1
            view.page.keyboard.press("0")
            overflow = view.page.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert overflow <= 0, f"{name} is {overflow} pixels too wide"
            view.context.close()
    return f"{checked} states of the page"


def refuses_broken_messages(bench: Bench) -> str:
    view = bench.open()
    outcome = view.page.evaluate(MANGLE)
    assert outcome["accepted"] == [], outcome
    assert outcome["crc"] == 0x352441C2, hex(outcome["crc"])
    return f"{outcome['refused']} truncated or mutated"


# Every truncation of the header, and what cannot be; CRC-32 of "abc" is 0x352441c2 (any table has it).
MANGLE = """async () => {
  const { read } = await import("/protocol.js");
  const { ofColours } = await import("/crc.js");
  const tiles = new DataView(new ArrayBuffer(40));
  const put = { 0: 1, 1: 1, 2: 2 };
  for (const [at, value] of Object.entries(put)) tiles.setUint8(at, value);
  for (const [at, value] of [[12, 64], [14, 32], [16, 32], [18, 1], [28, 1]]) tiles.setUint16(at, value, true);
  if (read(tiles.buffer).tiles.length !== 1) throw new Error("the whole message was not read");
  const mutated = [];
  for (let size = 0; size <= 34; size++) mutated.push(tiles.buffer.slice(0, size));
  for (const [at, value] of [[0, 9], [1, 2], [2, 0], [12, 0], [16, 0], [18, 0], [18, 200], [28, 0], [32, 2]]) {
    const copy = new DataView(tiles.buffer.slice());
    copy.setUint8(at, value);
    mutated.push(copy.buffer);
  }
  const accepted = [];
  mutated.forEach((bytes, k) => {
    try {
      read(bytes);
      accepted.push(k);
    } catch {}
  });
  return { accepted, refused: mutated.length, crc: ofColours([97, 98, 99, 255]) };
}"""

CHECKS = [
    loads_without_complaints,
    shows_the_right_picture,
    is_bit_exact_at_rest,
    moves_with_the_hands,
    is_touched_with_fingers,
    shows_overlays_with_legends,
    plays_and_scrubs,
    follows_the_window,
    sets_what_the_panel_offers,
    hands_the_helm_over,
    uploads_scenes,
    saves_and_records,
    comes_back_by_itself,
    says_why_it_cannot_come_back,
    waits_without_work_for_who_says_nothing,
    is_accessible,
    refuses_broken_messages,
]


def check(bench: Bench, work) -> bool:
    begin = time.monotonic()
    try:
        remark = work(bench)
        complaints = [text for view in bench.views for text in view.complaints]
        assert not complaints, f"the page complains: {complaints}"
    except Exception as error:
        ours = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == __file__]
        where = ", ".join(f"line {frame.lineno}" for frame in ours)
        print(f"FAILED  {work.__name__} ({where}): {error}", flush=True)
        for number, view in enumerate(bench.views):
            try:
                view.page.screenshot(path=bench.folder / f"failed-{work.__name__}-{number}.png")
            except Exception as error:
                print(f"        no screenshot of page {number}: {error}")
        return False
    finally:
        bench.close()
    print(f"passed  {time.monotonic() - begin:5.1f} s  {work.__name__}: {remark}", flush=True)
    return True


def main() -> int:
    program, folder, names = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:]
    folder.mkdir(parents=True, exist_ok=True)
    chosen = [work for work in CHECKS if not names or work.__name__ in names]
    with sync_playwright() as playwright, launch(playwright) as browser, Server(program, *SCENE) as server:
        bench = Bench(program, folder, browser, server)
        passed = [check(bench, work) for work in chosen]
    print(f"{sum(passed)} of {len(passed)} checks of the page passed")
    return 0 if all(passed) and passed else 1


if __name__ == "__main__":
    sys.exit(main())
