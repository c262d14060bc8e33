"""A function in Python, looked at: in the browser, or inline in a notebook."""

import atexit
from collections.abc import Callable
from typing import Any

from ._frameless import BuiltinSampler, Camera, Served, start_serving
from .sampling import Sampler

DEFAULT_CAMERA = Camera(eye=(0.0, 0.0, 5.0), target=(0.0, 0.0, 0.0))

Render = Callable[..., Any]
"""See :func:`serve`."""

_served: list[Served] = []
"""All that have been started. Kept, so that who forgets a page can still be stopped at exit: its thread calls into the interpreter."""


def serve(
    render: Render,
    size: tuple[int, int] = (640, 480),
    *,
    camera: Camera = DEFAULT_CAMERA,
    sampler: str | BuiltinSampler | Sampler = "adaptive",
    reconstruction: str = "reproject+antialias",
    batch_ms: float = 4.0,
    budget: float | None = None,
    exposure: float = 0.0,
    noisy: bool = False,
    port: int = 0,
    allow_frame: str | None = "http://localhost:*",
) -> Served:
    """Show a renderer on a web page of this machine, and return at once. The last line of a notebook's cell shows it inline.

    The page is there until its `stop` is called, or the program ends; while nobody looks at it nothing is traced.

    Parameters:

    - `render`: a function `render(x, y, time, camera)`, called in a thread of its own, with the interpreter held, about every `batch_ms`.
        x and y are float32 arrays of shape (n,), pixels from the picture's top-left corner; time is in seconds; `camera.rays(x, y)` are the rays
        through them. It returns linear RGB of shape (n, 3), or Samples
    - `size`: (width, height) of the picture in pixels, at most 3840 · 2160 of them
    - `camera`: from where it is looked at first; dragging on the page moves it
    - `sampler`, `reconstruction`: as in Session. On the page another may be chosen; a sampler that is no name is there called `own`
    - `batch_ms`: milliseconds that a call of `render` should take; longer if calls are expensive
    - `budget`: samples per second at most
    - `exposure`: stops (powers of two), from -64 to 64, by which radiance is multiplied before it is shown
    - `noisy`: whether colours have noise; it is then called as `render(x, y, time, camera, seed)`, seed being uint32 of shape (n,), and
        makes its random numbers from that alone
    - `port`: where the page listens, on this machine only; default: any free port
    - `allow_frame`: origin of the pages that may show this one inside them, as notebooks do; None: no page may. Default: those that are reached under the
        name localhost, at any port. A notebook opened as 127.0.0.1 or elsewhere shows no page inline; open `url` then

    Raises OSError if the port is taken, ValueError for values that make no sense, TypeError for what is no function or no sampler.
    """
    _served[:] = [page for page in _served if page.running]
    served = start_serving(
        render,
        size,
        camera,
        sampler,
        reconstruction,
        batch_ms,
        budget,
        exposure,
        noisy,
        port,
        allow_frame,
    )
    _served.append(served)
    return served


def view(
    render: Render,
    size: tuple[int, int] = (640, 480),
    *,
    camera: Camera = DEFAULT_CAMERA,
    sampler: str | BuiltinSampler | Sampler = "adaptive",
    reconstruction: str = "reproject+antialias",
    batch_ms: float = 4.0,
    budget: float | None = None,
    exposure: float = 0.0,
    noisy: bool = False,
    port: int = 0,
    open_browser: bool = True,
) -> None:
    """Look at a renderer in the browser until Ctrl-C.

    As `serve`, whose parameters these are, but opens the page (if `open_browser`), and waits. What render raises is raised here.
    """
    served = serve(
        render,
        size,
        camera=camera,
        sampler=sampler,
        reconstruction=reconstruction,
        batch_ms=batch_ms,
        budget=budget,
        exposure=exposure,
        noisy=noisy,
        port=port,
        allow_frame=None,
    )
    print(f"look at it here: {served.url}    (Ctrl-C ends it)", flush=True)
    if open_browser:
        import webbrowser

        webbrowser.open(served.url)
    try:
        # Ctrl-C, and what render raises, have stopped the page when they arrive here.
        served.wait()
    except KeyboardInterrupt:
        return
    served.stop()


@atexit.register
def _stop_all() -> None:
    for served in list(_served):
        try:
            served.stop()
        except BaseException:
            # Nobody is left to be told.
            continue
