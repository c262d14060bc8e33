"""Frameless rendering: any renderer becomes interactive.

Instead of whole pictures, one after the other, single pixels are traced where it matters now, and shown at once. Three levels,
smallest first:

- a function ``render(x, y, time, camera)`` over arrays, looked at with :func:`view` (a page in the browser) or :func:`serve`
  (inline in a notebook);
- a loop of your own: ``for batch in Session(size): batch.submit(rgb)``, with the picture, ages, changes and probabilities as
  arrays at any time;
- the parts: :class:`BuiltinSampler` and samplers of your own (:class:`Sampler`), :class:`Canvas`, :mod:`frameless.metrics`,
  :class:`Scene`, :func:`compare`, :mod:`frameless.plot`.

Pictures are arrays of shape (height, width, 3). Positions in them are pixels from the top-left corner, x to the right, y down; the
centre of the first pixel is (0.5, 0.5). Colours that come from a renderer are linear RGB radiance; pictures are display-referred
sRGB in [0, 1]. Times are seconds.
"""

from ._frameless import (
    Batch,
    Batches,
    BuiltinSampler,
    Camera,
    Canvas,
    CanvasView,
    Observed,
    Scene,
    Served,
    Session,
    __version__,
)
from . import metrics, plot, testing
from .experiment import Row, compare, compare_file
from .png import save_png
from .samples import Samples
from .sampling import CanvasLike, Sampler
from .serving import serve, view

__all__ = [
    "Batch",
    "Batches",
    "BuiltinSampler",
    "Camera",
    "Canvas",
    "CanvasLike",
    "CanvasView",
    "Observed",
    "Row",
    "Sampler",
    "Samples",
    "Scene",
    "Served",
    "Session",
    "__version__",
    "compare",
    "compare_file",
    "metrics",
    "plot",
    "save_png",
    "serve",
    "testing",
    "view",
]
