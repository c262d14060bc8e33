"""Samples with positions move with surfaces and camera."""

from typing import Any

import numpy as np
import pytest

import frameless
from conftest import pixel_centres, srgb
from frameless import Camera, Samples, Session

SIZE = (96, 72)


def textured_wall(x: np.ndarray, y: np.ndarray, time: float, camera: Camera) -> Samples:
    """The plane z = 0, with a pattern in world coordinates."""
    origin, direction = camera.rays(x, y)
    position = origin - direction * (origin[:, 2:] / direction[:, 2:])
    rgb = 0.5 + 0.5 * np.sin(6.0 * position[:, [0, 1, 0]])
    return Samples(rgb, position, object_id=np.zeros(len(x), np.int32))


def ideal(camera: Camera, render: Any = textured_wall) -> np.ndarray:
    x, y = pixel_centres(*SIZE)
    return srgb(render(x, y, 0.0, camera.with_size(SIZE)).rgb).reshape(SIZE[1], SIZE[0], 3)


def settled(**options: Any) -> Session:
    session = Session(SIZE, simulated=100_000.0, camera=Camera((0, 0, 5), (0, 0, 0)), **options)
    session.run(textured_wall, 0.5)
    assert frameless.metrics.rmse(session.image(), ideal(session.camera)) < 0.02  # type: ignore[arg-type]
    return session


def test_samples_go_along_with_the_camera_at_once() -> None:
    moved = Camera((0.4, 0.2, 5), (0.4, 0.2, 0))
    with_positions, held = settled(), settled(reconstruction="hold")
    for session in (with_positions, held):
        session.camera = moved
    error = frameless.metrics.rmse(with_positions.image(), ideal(moved))
    assert error < 0.35 * frameless.metrics.rmse(held.image(), ideal(moved))


def test_samples_go_along_with_objects() -> None:
    session = settled()
    moved = np.eye(4)[None].repeat(2, axis=0)
    moved[0, :3, 3] = [0.5, -0.25, 0.0]
    session.place(moved)

    def shifted(x: np.ndarray, y: np.ndarray, time: float, camera: Camera) -> Samples:
        origin, direction = camera.rays(x, y)
        position = origin - direction * (origin[:, 2:] / direction[:, 2:])
        return Samples(0.5 + 0.5 * np.sin(6.0 * (position - moved[0, :3, 3])[:, [0, 1, 0]]), position)

    camera = session.camera
    assert camera is not None
    assert frameless.metrics.rmse(session.image(), ideal(camera, shifted)) < 0.1
    # And what is traced now is in the world as it is now.
    session.run(shifted, 0.5)
    assert frameless.metrics.rmse(session.image(), ideal(camera, shifted)) < 0.02
    session.place(np.eye(4)[None])
    assert frameless.metrics.rmse(session.image(), ideal(camera)) < 0.1


@pytest.mark.parametrize(
    ("matrices", "says"),
    [
        (np.eye(4), "wanted shape (n, 4, 4), got (4, 4)"),
        (np.diag([0, 0, 0, 1.0])[None].repeat(2, 0), "got one for object 0 that has none"),
        (np.zeros((2, 4, 4)), "wanted last rows of (0, 0, 0, 1)"),
        (np.full((1, 4, 4), np.nan), "finite"),
        (np.eye(4, dtype=int)[None], "dtype"),
    ],
)
def test_places_are_checked(matrices: np.ndarray, says: str) -> None:
    with pytest.raises(ValueError) as refused:
        Session(SIZE).place(matrices)
    assert says in str(refused.value)


def test_rays_by_hand() -> None:
    camera = Camera((1, 2, 8), (1, 2, 0), fov=90)
    origin, direction = camera.rays(np.array([2.0, 4.0, 0.0]), np.array([1.0, 1.0, 0.0]), size=(4, 2))
    assert np.array_equal(origin, [[1, 2, 8]] * 3) and origin.dtype == direction.dtype == np.float32
    wanted = np.array([[0, 0, -1], [2, 0, -1], [-2, 1, -1]], float)
    assert np.allclose(direction, wanted / np.linalg.norm(wanted, axis=1, keepdims=True), atol=1e-6)
    assert camera.size is None and camera.with_size((4, 2)).size == (4, 2)
    assert np.allclose(camera.matrix()[:3, 3], (1, 2, 8)) and camera.target == pytest.approx((1, 2, 0))
    with pytest.raises(ValueError, match="belongs to no picture"):
        camera.rays(np.zeros(1), np.zeros(1))
    with pytest.raises(ValueError, match=r"y: wanted shape \(1,\) like x, got \(2,\)"):
        camera.rays(np.zeros(1), np.zeros(2), (4, 2))


@pytest.mark.parametrize(
    "arguments", [((0, 0, 0), (0, 0, 0)), ((0, 0, np.nan), (0, 0, 1)), ((0, 0, 0), (0, 0, 1), (0, 1, 0), 180.0)]
)
def test_cameras_that_see_nothing_are_refused(arguments: tuple[Any, ...]) -> None:
    with pytest.raises(ValueError, match="wanted"):
        Camera(*arguments)


def test_cameras_are_values() -> None:
    a, b = Camera((0, 0, 1), (0, 0, 0)), Camera((0, 0, 1), (0, 0, 0))
    assert a == b and a != Camera((0, 0, 2), (0, 0, 0)) and "eye=(0.0, 0.0, 1.0)" in repr(a)
