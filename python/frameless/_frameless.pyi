"""The compiled half; what each thing does is in its docstring."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from os import PathLike
from types import TracebackType
from typing import Any, Protocol, TypeAlias, final
from typing_extensions import Self

import numpy as np
from numpy.typing import NDArray

from frameless.experiment import Row
from frameless.samples import Samples
from frameless.sampling import CanvasLike, Sampler

__all__ = [
    "Batch",
    "Batches",
    "BuiltinSampler",
    "Camera",
    "Canvas",
    "CanvasView",
    "Observed",
    "Scene",
    "Served",
    "Session",
    "__version__",
    "flip",
    "loop_without_python",
    "psnr",
    "rmse",
    "run_experiment",
    "ssim",
    "start_serving",
]
__version__: str

class _DLPack(Protocol):
    def __dlpack__(self, *args: Any, **kwargs: Any) -> Any: ...

_Array: TypeAlias = NDArray[Any] | _DLPack
_Floats32: TypeAlias = NDArray[np.float32]
_Triple: TypeAlias = Sequence[float] | NDArray[Any]

@final
class Camera:
    """A pinhole camera that looks at `target` from `eye`; immutable.

    Parameters:

    - `eye`, `target`: three numbers each, in the scene's unit of length (world coordinates)
    - `up`: direction that is upwards in the picture as far as it can be; default (0, 1, 0)
    - `fov`: angle between the top and the bottom of the picture in degrees, above 0 and below 180; default 45

    A camera that a renderer is given also knows the size of the picture, so that `rays` needs none.

    Raises ValueError if a number is not finite, or eye and target are the same point.
    """
    def __new__(cls, eye: _Triple, target: _Triple, up: _Triple | None = None, fov: float = 45.0) -> Self: ...
    @property
    def eye(self) -> tuple[float, float, float]:
        """Where it stands: (x, y, z) in world coordinates."""
    @property
    def target(self) -> tuple[float, float, float]:
        """What it looks at: (x, y, z) in world coordinates."""
    @property
    def up(self) -> tuple[float, float, float]:
        """What is upwards, as given."""
    @property
    def fov(self) -> float:
        """Vertical angle of view in degrees; of a parallel projection 0."""
    @property
    def size(self) -> tuple[int, int] | None:
        """(width, height) of the picture in pixels, or None if the camera belongs to none."""
    def with_size(self, size: tuple[int, int]) -> Camera:
        """The same camera for a picture of so many pixels, (width, height)."""
    def matrix(self) -> _Floats32:
        """World from camera: a float32 matrix of shape (4, 4); columns are right, up, backward and eye."""
    def rays(self, x: _Array, y: _Array, size: tuple[int, int] | None = None) -> tuple[_Floats32, _Floats32]:
        """Rays through places in the picture.

        Parameters:

        - `x`, `y`: float arrays of shape (n,), pixels from the picture's top-left corner: the centre of the first pixel is (0.5, 0.5)
        - `size`: (width, height) of the picture; may be left out if the camera knows it

        Returns:

        - (`origin`, `direction`): two float32 arrays of shape (n, 3) in world coordinates; directions have length 1

        Raises ValueError if the arrays are wrong or the size is not known.
        """
    def __eq__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    __hash__: None  # type: ignore[assignment]

@final
class Batch:
    """Places in the picture that want to be traced at one time; given out by `for batch in session`.

    Answer it with `submit`, whole or in parts, at once or later, from any thread, before or after other batches, or not at
    all: samples that do not come are chosen again. Arrays are made anew at each access; keep them if you need them twice.
    """
    @property
    def id(self) -> int:
        """Number of the batch, from 0."""
    @property
    def x(self) -> _Floats32:
        """Columns to be traced, in pixels from the picture's left border (the first pixel's centre is 0.5): float32, shape (n,)."""
    @property
    def y(self) -> _Floats32:
        """Rows to be traced, in pixels from the picture's upper border: float32, shape (n,)."""
    @property
    def pixel(self) -> NDArray[np.uint32]:
        """Row-major pixel numbers, y · width + x: uint32, shape (n,)."""
    @property
    def sample_index(self) -> NDArray[np.uint32]:
        """Number of each sample in its pixel's sequence: uint32, shape (n,)."""
    @property
    def seed(self) -> NDArray[np.uint32]:
        """A random number for each sample, the same whenever the same sample is asked for again: uint32, shape (n,). Another seed of the
        session makes others.

        A renderer with noise makes its random numbers from it alone; that is how noise is told from change.
        """
    @property
    def time(self) -> float:
        """The moment of the scene to be traced, in seconds of the scene's own time."""
    @property
    def now(self) -> float:
        """When the pixels were chosen, in seconds of the session's clock."""
    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the picture."""
    @property
    def camera(self) -> Camera | None:
        """The session's camera when the batch was chosen, with the picture's size; None if the session has none."""
    def submit(
        self,
        rgb: _Array,
        *,
        position: _Array | None = None,
        normal: _Array | None = None,
        object_id: _Array | None = None,
        where: _Array | None = None,
    ) -> int:
        """Give colours to the session; they are in the next picture.

        Parameters:

        - `rgb`: linear RGB radiance, shape (n, 3), float32 or float64, finite
        - `position`: where the ray hit first, in world coordinates, shape (n, 3); with it, samples move with surfaces and camera
        - `normal`: unit normals there in world coordinates, shape (n, 3)
        - `object_id`: which object was hit, integers of shape (n,), from 0, stable over time; -1 where nothing was. Default 0
        - `where`: which samples of the batch are answered: their numbers, shape (n,), or a mask of all. Default: all, in order

        Arrays may be numpy's, in any memory order, or have `__dlpack__` (torch and jax on the CPU). They are copied.

        Returns the number of samples kept: less than n if pixels have newer ones, or the picture another size.

        Raises ValueError for wrong shapes, dtypes, or values that are NaN or infinite; nothing is kept then, and the batch may be
        answered again.
        """
    def __len__(self) -> int: ...

@final
class Batches:
    """The batches of a session, one after the other."""
    def __iter__(self) -> Iterator[Batch]: ...
    def __next__(self) -> Batch: ...

@final
class Session:
    """A picture that is never finished: a canvas, a clock, and a sampler that says which pixels are worth tracing now.

        with frameless.Session((640, 480)) as session:
            for batch in session:
                batch.submit(render(batch.x, batch.y, batch.time))
                show(session.image())

    Parameters:

    - `size`: (width, height) in pixels
    - `sampler`: a name ("adaptive", "change", "permutation", "random"; see BuiltinSampler) or an object with methods of Sampler. What
        such an object raises arrives where the session was asked for a batch, or told of an answer, whose samples are kept all the same
    - `reconstruction`: "hold", "filter" or "reproject", the last with +relight, +deep, +antialias
    - `camera`: the Camera through which the renderer looks; needed if answers carry positions
    - `seed`: of all that is random
    - `batch`: samples per batch; default: learned, so that a batch lasts `batch_ms`, or longer if calls are expensive
    - `batch_ms`: milliseconds from choosing a batch to its answer that are aimed at. Feedback every 4 ms costs 8 to 15 % of the quality
        that 1 ms would have; a call of Python costs some ten microseconds
    - `budget`: samples per second at most; default: as many as the renderer can
    - `simulated`: samples per second of a simulated clock, on which sample n is traced at n / rate however long it takes: the same
        seed makes the same pictures. Default: the machine's clock
    - `noisy`: whether colours have noise, as path tracing's; the renderer then makes its random numbers from Batch.seed
    - `exposure`: stops (powers of two), from -64 to 64, by which radiance is multiplied before it is shown

    Any thread may use a session; calls wait for each other, not for the interpreter. As a context manager it is closed at the end.

    Raises ValueError for values that make no sense, TypeError for what is no sampler.
    """
    def __new__(
        cls,
        size: tuple[int, int],
        *,
        sampler: str | BuiltinSampler | Sampler | None = None,
        reconstruction: str = "reproject+antialias",
        camera: Camera | None = None,
        seed: int = 1,
        batch: int | None = None,
        batch_ms: float = 4.0,
        budget: float | None = None,
        simulated: float | None = None,
        noisy: bool = False,
        exposure: float = 0.0,
    ) -> Self: ...
    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
    @property
    def now(self) -> float:
        """Seconds on the session's clock since it began."""
    time: float
    """The moment of the scene that is shown, in seconds of the scene's own time; may be set, to jump there."""
    speed: float
    """Seconds of the scene per second of the clock; 0 stands still, negative runs backwards. May be set."""
    camera: Camera | None
    """The Camera through which the renderer looks, or None. Set it to move: samples with positions go along at once."""
    budget: float | None
    """Samples per second at most, or None; may be set. A simulated clock has its own rate and ignores it."""
    exposure: float
    """Stops (powers of two) by which radiance is multiplied before it is shown; may be set, and restarts nothing."""
    @property
    def counters(self) -> dict[str, int]:
        """What the loop has done: {"batches": chosen, "kept": samples in the picture, "dropped": samples that came too late}."""
    @property
    def closed(self) -> bool:
        """Whether `close` has been called."""
    def place(self, world_from_object: _Array) -> None:
        """Where objects are now, by object_id: world from object, shape (n, 4, 4). Objects beyond n stand where they were made.

        Samples of an object that was moved move along, in the next picture already. Positions in answers are the world's at the
        time of their batch.

        Raises ValueError for a wrong shape, values that are not finite, or a matrix that flattens its object.
        """
    def resize(self, size: tuple[int, int]) -> None:
        """Go on in another size, (width, height) in pixels, with the same picture. Answers to batches of the old size are dropped."""
    def set_sampler(self, sampler: str | BuiltinSampler | Sampler) -> None:
        """Let another sampler choose from now on, by name or as an object; the picture stays."""
    def set_reconstruction(self, name: str) -> None:
        """Make pictures in another way from now on; what the canvas holds stays."""
    def image(self, out: _Floats32 | None = None) -> _Floats32:
        """The picture now: display-referred sRGB in [0, 1], float32, shape (height, width, 3).

        The array is the caller's own, made without a copy. `out`: an array of that shape to write into instead; it is returned.
        """
    def rgb(self) -> _Floats32:
        """Newest sample of each pixel's centre: linear RGB radiance, float32, shape (height, width, 3). What is added to it while the picture
        rests is in `image` only.
        """
    def age(self) -> _Floats32:
        """Seconds since each pixel was last found to show what it shows, infinite where nothing is known: float32, shape (height, width)."""
    def change(self) -> _Floats32:
        """How far each pixel's last sample was from what the picture showed there: squared sRGB difference summed over channels, in
        [0, 3]; NaN where there is none. float32, shape (height, width).
        """
    def known(self) -> NDArray[np.bool_]:
        """Whether anything is known of what each pixel shows: bool, shape (height, width)."""
    def probability(self) -> _Floats32 | None:
        """Probability that the next draw is each pixel, float32, shape (height, width), sum 1; None if the sampler does not know."""
    def tile_probability(self) -> _Floats32 | None:
        """Probability that the next draw falls into each pixel's tile; otherwise as `probability`."""
    def batches(self, seconds: float | None = None) -> Batches:
        """Batches for so many seconds of the session's clock, or until it is closed."""
    def run(self, render: Callable[..., Any], seconds: float | None = None) -> int:
        """Let `render(x, y, time, camera)` answer batches for so many seconds of the session's clock, or until it is closed.

        Parameters:

        - `render`: returns linear RGB of shape (n, 3), or Samples with positions. x, y: float32 arrays of shape (n,), pixels from the
            top-left corner; time: seconds of the scene; camera: the session's Camera or None. A session of a noisy renderer calls
            render(x, y, time, camera, seed) with Batch.seed
        - `seconds`: how long; default: until `close` is called, by render or another thread

        Returns the number of samples kept. What render raises arrives as it is, and the session may be used on.
        """
    def close(self) -> None:
        """No more batches: loops over the session end. Pictures can still be asked for, and late answers given."""
    def __iter__(self) -> Iterator[Batch]: ...
    def __enter__(self) -> Self: ...
    def __exit__(
        self,
        *_exception: type[BaseException] | BaseException | TracebackType | None,
    ) -> None: ...

@final
class Canvas:
    """The newest sample of every pixel, and a reconstruction that makes pictures of them: a session without clock and sampler.

    Parameters:

    - `size`: (width, height) in pixels
    - `reconstruction`: "hold", "filter" or "reproject", the last with +deep or +antialias
    - `camera`: from where samples with positions are seen; needed only for those

    Raises ValueError if there is no such reconstruction.
    """
    camera: Camera | None
    """From where samples with positions are seen."""
    def __new__(
        cls, size: tuple[int, int], *, reconstruction: str = "hold", camera: Camera | None = None
    ) -> Self: ...
    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
    @property
    def time(self) -> NDArray[np.float64]:
        """When each pixel was traced last, in seconds, rounded down to 16 µs, 0 if never: float64, shape (height · width,), a copy."""
    @property
    def rgb(self) -> _Floats32:
        """Newest sample of each pixel, linear RGB: float32, shape (height · width, 3), a copy."""
    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether anything is known of each pixel: bool, shape (height · width,), a copy."""
    @property
    def holes(self) -> NDArray[np.uint32]:
        """Pixels that wait to be traced, the most urgent first: uint32, shape (n,), a copy."""
    def keep(
        self,
        now: float,
        pixel: _Array,
        rgb: _Array,
        *,
        position: _Array | None = None,
        normal: _Array | None = None,
        object_id: _Array | None = None,
    ) -> Observed:
        """Keep samples of pixel centres, traced at `now` (seconds), and say what they changed.

        Parameters:

        - `now`: seconds, not before any sample kept so far
        - `pixel`: row-major numbers, integers of shape (n,)
        - `rgb`, `position`, `normal`, `object_id`: as in Batch.submit

        Raises ValueError as Batch.submit does.
        """
    def image(self, now: float, out: _Floats32 | None = None) -> _Floats32:
        """The picture at `now` (seconds): display-referred sRGB in [0, 1], float32, shape (height, width, 3).

        `out`: an array of that shape to write into; it is returned.
        """
    def age(self, now: float) -> _Floats32:
        """Seconds from when each pixel was traced to `now`, infinite if never: float32, shape (height, width)."""
    def change(self) -> _Floats32:
        """What each pixel's last sample changed, as Observed.change; NaN if nothing was known before: float32, shape (height, width)."""

@final
class CanvasView:
    """What is known of every pixel, for a sampler written in Python. Its arrays are read-only, and change from call to call."""
    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
    @property
    def time(self) -> NDArray[np.float64]:
        """When each pixel was traced last, in seconds, 0 if never: float64, shape (height · width,)."""
    @property
    def rgb(self) -> _Floats32:
        """Newest sample of each pixel, linear RGB: float32, shape (height · width, 3)."""
    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether anything is known of each pixel: bool, shape (height · width,)."""
    @property
    def holes(self) -> NDArray[np.uint32]:
        """Pixels that wait to be traced, the most urgent first: uint32, shape (n,)."""

@final
class Observed:
    """What became of the samples of one answer, one entry each; immutable."""
    @property
    def pixel(self) -> NDArray[np.uint32]:
        """Which pixels, row-major numbers: uint32, shape (n,)."""
    @property
    def now(self) -> NDArray[np.float64]:
        """When they were traced, in seconds: float64, shape (n,)."""
    @property
    def previous(self) -> NDArray[np.float64]:
        """When what they took the place of had been traced, in seconds, 0 if never: float64, shape (n,)."""
    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether anything was known of the pixel; if not, `change` says nothing: bool, shape (n,)."""
    @property
    def change(self) -> _Floats32:
        """Squared difference between the sample and what the picture showed there, summed over sRGB channels, in [0, 3]: float32, shape (n,)."""
    def __len__(self) -> int: ...

@final
class BuiltinSampler:
    """One of the samplers that come with the package.

    Parameters:

    - `name`: "random", "permutation", "change" or "adaptive", with parameters in brackets: "adaptive(temporal=0.5)"
    - `seed`: the same seed makes the same choices

    A sampler of your own may hand its calls on to one: `canvas` is a Canvas, or what a sampler is given by a session. It learns of one
    canvas; with one of another size it begins anew.

    Raises ValueError if there is no such sampler.
    """
    def __new__(cls, name: str, seed: int = 1) -> Self: ...
    @property
    def name(self) -> str:
        """As given."""
    # The package's own canvases only: others lack what the built-in samplers look at.
    def choose(self, now: float, canvas: CanvasLike, count: int) -> NDArray[np.uint32]:
        """Pixels to be traced next: `count` row-major numbers, uint32, shape (count,).

        `now` is the time in seconds, never before any sample on the canvas.
        """
    def observe(self, canvas: CanvasLike, observed: Observed) -> None:
        """Learn from samples that have just been written to the canvas.

        Raises ValueError if they were written to one of another size.
        """
    def probability(self, now: float, canvas: CanvasLike) -> _Floats32 | None:
        """Probability that the next draw is each pixel: float32, shape (height, width), sum 1; None if the sampler does not know."""

@final
class Scene:
    """A scene that changes with time, and the renderer for it, on all cores: direct light, hard shadows, mirrors; whole pictures by random
    paths, too.

    Made by `Scene.builtin(name)` or `Scene.load(path)`. Any thread may use it.
    """
    @staticmethod
    def builtin(name: str) -> Scene:
        """A scene that comes with the package; Scene.names() lists them."""
    @staticmethod
    def load(path: str | PathLike[str], environment: str | PathLike[str] | None = None) -> Scene:
        """A glTF 2.0 file (.gltf or .glb), lit by a Radiance picture (.hdr) of all that is far away, if one is given: latitude and longitude,
        +x in its middle column. Raises OSError if a file cannot be read, ValueError if it is not what it should be.
        """
    @staticmethod
    def names() -> list[str]:
        """The scenes that come with the package."""
    @property
    def name(self) -> str:
        """File name, or the name of the built-in scene."""
    @property
    def duration(self) -> float:
        """Seconds until the animation repeats or ends; 0 if nothing moves."""
    @property
    def cameras(self) -> int:
        """How many cameras there are; at least 1."""
    @property
    def objects(self) -> int:
        """How many objects there are; their numbers are those in Samples.object_id."""
    @property
    def warnings(self) -> list[str]:
        """What was ignored or replaced while loading."""
    def camera(self, index: int = 0, time: float = 0.0) -> Camera:
        """One of the scene's cameras as it is at a time (seconds)."""
    def transforms(self, time: float) -> _Floats32:
        """Where every object is at a time (seconds): world from object, float32, shape (objects, 4, 4). For Session.place."""
    def render(
        self,
        size: tuple[int, int],
        time: float = 0.0,
        camera: Camera | int | None = None,
        integrator: str = "direct",
        samples: int = 1,
        max_depth: int = 4,
        first_sample: int = 0,
    ) -> _Floats32:
        """The whole picture at one moment: linear RGB radiance, float32, shape (height, width, 3).

        Parameters:

        - `size`: (width, height) in pixels
        - `time`: seconds of the scene
        - `camera`: a Camera, or the number of one of the scene's; default 0
        - `integrator`: "direct" (lights and mirrors, without noise) or "path" (light that has bounced any number of times, noisy)
        - `samples`: per pixel; 1: at its centre, more: spread over it, always the same ones
        - `first_sample`: which of the sequence of samples comes first, so that pictures can be added up
        - `max_depth`: after how many surfaces besides the first a way of light ends, up to 1000
        """
    def __call__(self, x: _Array, y: _Array, time: float, camera: Camera | None) -> Samples: ...

@final
class Served:
    """A page that shows a renderer while it works; made by `frameless.serve`. In a notebook, the last line of a cell shows it inline.

    What the renderer raises stops the picture, and is said on the page; `wait`, `stop` and `check` raise it as it is, and after that, or
    with `set_render`, the picture goes on. If nobody waits for it, it is written to stderr, too.
    """
    @property
    def url(self) -> str:
        """The one address to open in a browser on this machine. It holds the secret that lets one in."""
    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the picture in pixels."""
    @property
    def running(self) -> bool:
        """Whether the page is still served."""
    @property
    def failed(self) -> bool:
        """Whether the renderer has raised something that nobody has been told of yet."""
    def check(self) -> None:
        """Raises what the renderer has raised, if anything; the picture goes on."""
    def set_render(self, render: Callable[..., Any]) -> None:
        """Let another function render from now on; the picture stays until it is traced anew. Forgets what the old one raised."""
    def wait(self, seconds: float | None = None) -> None:
        """Wait until the page is stopped, the renderer raises something, which is raised here and stops the page, or so many seconds
        have passed. Ctrl-C stops it, too.
        """
    def stop(self) -> None:
        """Serve no longer. Raises what the renderer has raised that nobody has been told of."""
    def _repr_html_(self) -> str:
        """The page inline in a notebook."""

def start_serving(
    render: Callable[..., Any],
    size: tuple[int, int],
    camera: Camera,
    sampler: str | BuiltinSampler | Sampler,
    reconstruction: str,
    batch_ms: float,
    budget: float | None,
    exposure: float,
    noisy: bool,
    port: int,
    allow_frame: str | None,
) -> Served:
    """See `frameless.serve`."""
def loop_without_python(
    size: tuple[int, int], sampler: str, reconstruction: str, batch: int, seconds: float
) -> tuple[int, float]:
    """What a session does with answers that cost nothing, for so many seconds: samples kept, and seconds."""
def run_experiment(
    text: str,
    folder: str,
    with_named: bool,
    custom: Sequence[tuple[str, str, Callable[[int], Sampler]]],
) -> list[Row]:
    """Runs an experiment (TOML text, its folder) and returns one dict per run. Without `with_named` only custom samplers run."""
def rmse(a: _Array, b: _Array) -> float:
    """Root mean squared difference of two pictures over all pixels and channels; 0 if they are equal.

    - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1]
    """
def psnr(a: _Array, b: _Array) -> float:
    """Peak signal-to-noise ratio of two pictures in dB, -20 log10(RMSE); infinite if they are equal.

    - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1]
    """
def ssim(a: _Array, b: _Array) -> float:
    """Structural similarity of two pictures (Wang et al. 2004) over luma, in [-1, 1]; 1 if they are equal.

    - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1], each side at least 11 pixels
    """
def flip(a: _Array, b: _Array) -> float:
    """Mean FLIP difference of a picture `b` from a reference `a` (Andersson et al. 2020), in [0, 1]; 0 if they are equal.

    - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1]
    """
