"""What comes in is checked: shape, dtype, values; and what is good comes in whatever its form."""

import importlib.util
from typing import Any

import numpy as np
import pytest

import frameless

N = 100


def batch() -> frameless.Batch:
    session = frameless.Session((40, 30), batch=N, sampler="permutation", camera=CAMERA)
    return next(iter(session))


CAMERA = frameless.Camera((0, 0, 5), (0, 0, 0))
RGB = np.linspace(0, 1, 3 * N).reshape(N, 3)


class Foreign:
    """An array of another library: only DLPack."""

    def __init__(self, array: np.ndarray, device: int = 1) -> None:
        self.array, self.device = array, device

    def __dlpack__(self, **options: Any) -> Any:
        if self.device != 1:
            raise BufferError("this array is on another device")
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self) -> tuple[int, int]:
        return (self.device, 0)


@pytest.mark.parametrize(
    "form",
    [
        lambda a: a.astype(np.float32),
        lambda a: a,
        np.asfortranarray,
        lambda a: np.repeat(a, 2, axis=0)[::2],
        lambda a: a[::-1][::-1],
        lambda a: np.broadcast_to(a, a.shape),
        Foreign,
        lambda a: Foreign(a.astype(np.float32)),
    ],
    ids=["float32", "float64", "Fortran", "strided", "negative strides", "read-only", "DLPack", "DLPack float32"],
)
def test_every_form_of_an_array_means_the_same(form: Any) -> None:
    session = frameless.Session((40, 30), batch=N, sampler="permutation", reconstruction="hold")
    asked = next(iter(session))
    assert asked.submit(form(RGB)) == N
    assert np.array_equal(session.rgb().reshape(-1, 3)[asked.pixel], RGB.astype(np.float32))


@pytest.mark.parametrize(
    ("rgb", "says"),
    [
        (np.zeros((N, 4)), "rgb: wanted shape (100, 3), got (100, 4)"),
        (np.zeros(N), "rgb: wanted shape (100, 3), got (100,)"),
        (np.zeros((N - 1, 3)), "got (99, 3)"),
        (np.zeros((3, N)), "got (3, 100)"),
        (np.float64(1), "numpy array"),
        (np.zeros((N, 3), int), "rgb: wanted dtype float32 or float64, got int64"),
        (np.zeros((N, 3), complex), "got complex128"),
        (np.zeros((N, 3), np.float16), "got float16"),
        (np.zeros((N, 3), ">f4"), "got >f4"),
        (np.zeros((N, 3), object), "got object"),
        (Foreign(RGB, device=2), "move it to the CPU"),
    ],
)
def test_wrong_arrays_are_refused_with_what_was_wanted_and_what_came(rgb: Any, says: str) -> None:
    with pytest.raises((ValueError, TypeError)) as refused:
        batch().submit(rgb)
    assert says in str(refused.value)
    if isinstance(rgb, (np.ndarray, Foreign)):
        assert isinstance(refused.value, ValueError)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.filterwarnings("ignore:overflow")
def test_values_that_are_not_finite_are_named_with_their_sample(value: float, dtype: Any) -> None:
    rgb = RGB.astype(dtype)
    rgb[17, 1] = value
    asked = batch()
    with pytest.raises(ValueError, match=r"finite .* at sample 17 \(x = [\d.]+, y = [\d.]+\) of batch 0"):
        asked.submit(rgb)
    assert asked.submit(RGB) == N, "nothing was kept of the wrong answer"


def test_lists_are_no_arrays() -> None:
    with pytest.raises(TypeError, match="wanted a numpy array .* got list"):
        batch().submit([[0.0, 0.0, 0.0]] * N)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        ({"position": np.zeros((N, 2))}, "position: wanted shape (100, 3), got (100, 2)"),
        ({"position": np.full((N, 3), np.nan)}, "position: wanted finite"),
        ({"normal": np.zeros((N, 3))}, "normal: wanted position with it"),
        ({"object_id": np.zeros(N, int)}, "object_id: wanted position with it"),
        ({"position": np.zeros((N, 3)), "object_id": np.zeros(N)}, "object_id: wanted dtype an integer type, got float64"),
        ({"position": np.zeros((N, 3)), "object_id": np.full(N, -2)}, "got -2 at sample 0"),
        ({"position": np.zeros((N, 3)), "object_id": np.full(N, 1 << 40)}, "got 1099511627776"),
        ({"position": np.zeros((N, 3)), "object_id": np.zeros(N - 1, int)}, "wanted shape (100,), got (99,)"),
        ({"position": np.zeros((N, 3)), "normal": np.zeros(N)}, "normal: wanted shape"),
        ({"where": np.array([N])}, "where: wanted numbers from 0 to 99, got 100 at index 0"),
        ({"where": np.array([-1])}, "got -1"),
        ({"where": np.ones(N - 1, bool)}, "where: wanted shape (100,), got (99,)"),
        ({"where": np.array([0.0])}, "an integer type"),
    ],
)
def test_surfaces_and_parts_are_checked_alike(extra: dict[str, Any], says: str) -> None:
    rgb = RGB if "where" not in extra else RGB[: len(extra["where"])]
    with pytest.raises(ValueError) as refused:
        batch().submit(rgb, **extra)
    assert says in str(refused.value)


def test_where_nothing_was_hit_positions_may_be_anything() -> None:
    position = np.zeros((N, 3))
    position[::2] = np.inf
    assert batch().submit(RGB, position=position, object_id=-(np.arange(N) % 2 == 0).astype(int)) == N


def test_positions_need_a_camera() -> None:
    session = frameless.Session((40, 30), batch=N)
    with pytest.raises(ValueError, match="set session.camera"):
        next(iter(session)).submit(RGB, position=np.zeros((N, 3)))


# Too large to be installed for this alone; DLPack itself is tested above.
if importlib.util.find_spec("torch") is not None:

    def test_torch_tensors_come_in() -> None:
        import torch  # type: ignore[import-not-found]

        assert batch().submit(torch.tensor(RGB)) == N


def test_fields_of_packed_structured_arrays_are_read_as_they_are() -> None:
    n = 100
    packed = np.zeros(n, [("flag", "u1"), ("rgb", "f4", 3), ("x", "f4")])
    packed["rgb"], packed["x"] = 0.25, np.arange(n)
    with frameless.Session((10, 10), batch=n, sampler="permutation", reconstruction="hold") as session:
        for batch in session:
            assert batch.submit(packed["rgb"][: len(batch)]) == len(batch)
            break
        assert np.ptp(session.image()[session.known()]) == 0
    picture = np.zeros((4, 5), [("rgb", "f4", 3), ("flag", "u1")])
    assert frameless.metrics.rmse(picture["rgb"], picture["rgb"].copy()) == 0


def test_a_field_of_a_packed_structured_array_takes_no_picture() -> None:
    packed = np.zeros((6, 8), [("rgb", "f4", 3), ("flag", "u1")])
    with frameless.Session((8, 6)) as session, pytest.raises(ValueError, match="packed"):
        session.image(out=packed["rgb"])
    assert not packed["flag"].any()


def test_a_picture_of_one_pixel() -> None:
    with frameless.Session((1, 1)) as session:
        for count, batch in enumerate(session):
            batch.submit(np.full((len(batch), 3), 0.5, np.float32))
            if count == 5:
                break
        assert session.image().shape == (1, 1, 3)


def test_numbers_that_no_sample_can_have_do_not_wrap() -> None:
    huge = np.full(N, 2**64 - 1, np.uint64)
    for arguments in ({"position": np.zeros((N, 3)), "object_id": huge}, {"where": huge}):
        with pytest.raises(ValueError, match="18446744073709551615"):
            batch().submit(RGB, **arguments)


def test_ctrl_c_in_another_library_is_no_value_error() -> None:
    class Interrupted(Foreign):
        def __dlpack__(self, *args: Any, **kwargs: Any) -> Any:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        batch().submit(Interrupted(RGB))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"eye": (1, 2)}, r"eye: wanted three finite numbers, got \(1, 2\)"),
        ({"target": "abc"}, "target: wanted three finite numbers, got 'abc'"),
        ({"up": (0, np.inf, 0)}, "up: wanted three finite numbers"),
    ],
)
def test_points_are_checked(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        frameless.Camera(**{"eye": np.zeros(3), "target": [0, 0, 1], **arguments})


def test_a_camera_says_all_that_it_is() -> None:
    camera = frameless.Camera((0, 0, 5), (0, 0, 0), up=(1, 0, 0), fov=30).with_size((64, 48))
    assert eval(repr(camera), {"Camera": frameless.Camera}).rays(RGB[:, 0], RGB[:, 1])[1] == pytest.approx(
        camera.rays(RGB[:, 0], RGB[:, 1])[1], abs=1e-6
    )


def test_a_scene_without_a_camera_says_what_to_do() -> None:
    with pytest.raises(ValueError, match=r"Session\(size, camera=scene.camera\(\)\)"):
        frameless.Session((8, 6)).run(frameless.Scene.builtin("sphere"), 0.1)
