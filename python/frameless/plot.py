"""Figures with matplotlib, which the package does not need otherwise: ``pip install frameless[plot]``.

Every function draws into ``ax``, or into a new figure, and returns the axes.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .experiment import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _axes(ax: "Axes | None") -> "Axes":
    if ax is not None:
        return ax
    try:
        from matplotlib.figure import Figure
        from matplotlib.backends.backend_agg import FigureCanvasAgg
    except ImportError as error:
        raise ImportError("frameless.plot needs matplotlib: pip install frameless[plot]") from error
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.subplots()


def error_over_time(rows: Sequence[Row], ax: "Axes | None" = None) -> "Axes":
    """RMSE of every run at every refresh, on a logarithmic axis: what ``compare`` returned."""
    ax = _axes(ax)
    for row in rows:
        errors = row["rmse_over_time"]
        seconds = (np.arange(len(errors)) + 1) / row["display_hz"]
        ax.plot(seconds, errors, label=_label(row, rows), linewidth=1.2)
    ax.set(xlabel="time (s)", ylabel="RMSE against the ideal (sRGB)", yscale="log")
    ax.grid(True, which="both", alpha=0.2)
    if rows:
        ax.legend(fontsize="small")
    return ax


def _label(row: Row, rows: Sequence[Row]) -> str:
    """The algorithm, and what else tells this run from the others."""
    label = [row["algorithm"]]
    if len({other["scene"] for other in rows}) > 1:
        label.append(row["scene"])
    if len({other["samples_per_sec"] for other in rows}) > 1:
        label.append(f"{row['samples_per_sec']:,.0f}/s")
    if len({other["seed"] for other in rows}) > 1:
        label.append(f"seed {row['seed']}")
    return ", ".join(label)


def picture(image: NDArray[Any], ax: "Axes | None" = None, title: str = "") -> "Axes":
    """A picture: sRGB in [0, 1], shape (height, width, 3)."""
    ax = _axes(ax)
    ax.imshow(np.clip(image, 0.0, 1.0), interpolation="nearest")
    ax.set(xticks=[], yticks=[], title=title)
    return ax


def age(seconds: NDArray[Any], ax: "Axes | None" = None) -> "Axes":
    """``Session.age()`` as a map; grey where nothing is known."""
    return _map(np.where(np.isfinite(seconds), seconds, np.nan), "age (s)", ax)


def change(d: NDArray[Any], ax: "Axes | None" = None) -> "Axes":
    """``Session.change()`` as a map of log10 d; grey where nothing is known."""
    with np.errstate(divide="ignore"):
        return _map(np.log10(np.maximum(d, 1e-6)), "log10 of change d", ax)


def probability(p: NDArray[Any] | None, ax: "Axes | None" = None) -> "Axes":
    """``Session.probability()`` or ``tile_probability()`` as a map. Raises ValueError if the sampler knows none."""
    if p is None:
        raise ValueError("probability: wanted an array, got None: this sampler does not know its probabilities")
    return _map(p, "probability per draw", ax)


def _map(values: NDArray[Any], label: str, ax: "Axes | None") -> "Axes":
    ax = _axes(ax)
    ax.set_facecolor("0.6")
    shown = ax.imshow(values, cmap="inferno", interpolation="nearest")
    figure = ax.get_figure()
    if figure is not None:
        figure.colorbar(shown, ax=ax, label=label)
    ax.set(xticks=[], yticks=[])
    return ax
