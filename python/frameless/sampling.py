"""The contract of samplers: who decides which pixels are traced next."""

from typing import Any, Protocol

from numpy.typing import NDArray

from ._frameless import Observed


class CanvasLike(Protocol):
    """The picture so far, as a sampler sees it; row-major, one entry per pixel. Not to be written."""

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels; may differ from call to call."""

    @property
    def time(self) -> NDArray[Any]:
        """When each pixel was traced last, in seconds, 0 if never: float64, shape (height · width,)."""

    @property
    def rgb(self) -> NDArray[Any]:
        """Newest sample of each pixel, linear RGB: float32, shape (height · width, 3)."""

    @property
    def known(self) -> NDArray[Any]:
        """Whether anything is known of each pixel: bool, shape (height · width,)."""

    @property
    def holes(self) -> NDArray[Any]:
        """Pixels that wait to be traced, the most urgent first: uint32, shape (n,)."""


class Sampler(Protocol):
    """Chooses the pixels that are traced next.

    A class with this method is a sampler, and is accepted wherever a name is: by ``Session``, by ``compare``, and by
    ``frameless.testing.check_sampler``. It may also have a method ``observe(canvas, observed)``, which is called with what became
    of samples once they are on the canvas, in a fixed order. Between choosing and observing any number of other batches may have
    been chosen, and some samples are never observed: those that are added to others of a pixel at rest, since they say nothing of change.
    Both are called by one thread at a time. A method ``probability(now, canvas)`` may return what ``Session.probability`` is to tell:
    shape (height, width), sum 1.

    ``canvas`` may be handed on to a :class:`BuiltinSampler`, whose choices the sampler then changes.

    The same calls must give the same choices: make all randomness from a seed given at construction.
    """

    def choose(self, now: float, canvas: CanvasLike, count: int) -> NDArray[Any]:
        """``count`` row-major pixel numbers, any integer type, shape (count,); a pixel may occur twice.

        ``now`` is in seconds, never before any time on the canvas.
        """


class ObservingSampler(Sampler, Protocol):
    """A sampler that learns."""

    def observe(self, canvas: CanvasLike, observed: Observed) -> None:
        """Learn from samples that have just been written to ``canvas``."""
