"""What a renderer returns if it knows more than colours."""

from typing import Any, NamedTuple


class Samples(NamedTuple):
    """Colours with the surfaces that were hit, one row per sample. Return it from a `render` function.

    Arrays may be numpy's (float32 or float64, any memory order) or have `__dlpack__`.
    """

    rgb: Any
    """Linear RGB radiance, shape (n, 3)."""

    position: Any = None
    """Where rays hit first, in world coordinates, shape (n, 3); with it, samples move with surfaces and camera."""

    normal: Any = None
    """Unit normals there, in world coordinates, shape (n, 3). Checked and kept; pictures do not depend on them yet."""

    object_id: Any = None
    """Which object was hit: integers from 0, shape (n,), stable over time; -1 where nothing was. Default: all 0."""
