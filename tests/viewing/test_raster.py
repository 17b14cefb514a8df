"""The z-buffer: which samples a triangle and a rod cover, and which of them is seen."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.viewing import raster
from weavecore.viewing.camera import Camera, look_at, view_axes
from weavecore.viewing.raster import (
    NOTHING,
    DepthBuffer,
    SeenTriangles,
    draw_rods,
    draw_triangles,
    planes_over,
    see_rods,
)

SIZE = (40, 30)


def image(buffer: DepthBuffer) -> np.ndarray:
    return buffer.shape.reshape(buffer.height, buffer.width)


def inside(triangle: np.ndarray) -> np.ndarray:
    """Which samples lie in a triangle, by the sign of three areas."""
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5, np.arange(SIZE[1]) + 0.5)
    signs = []
    for k in range(3):
        (ax, ay), (bx, by) = triangle[k], triangle[(k + 1) % 3]
        signs.append((bx - ax) * (y - ay) - (by - ay) * (x - ax))
    return (np.min(signs, 0) > 0) | (np.max(signs, 0) < 0)


def test_a_triangle_covers_the_samples_inside_it() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        triangle = rng.uniform(-10, 50, (3, 2))
        buffer = DepthBuffer(SIZE)
        draw_triangles(buffer, SeenTriangles(triangle[None], np.ones((1, 3)), SIZE))
        assert np.array_equal(image(buffer) == 0, inside(triangle))


def test_triangles_that_share_edges_leave_no_gap() -> None:
    """A fan about a point, each of whose edges two triangles share, covers all."""
    rng = np.random.default_rng(2)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 60))
    rim = np.array([20, 15]) + 200 * np.c_[np.cos(angle), np.sin(angle)]
    hub = np.broadcast_to([20.5, 14.5], rim.shape)  # On a sample: all triangles touch it.
    buffer = DepthBuffer(SIZE)
    draw_triangles(buffer, SeenTriangles(np.stack([rim, np.roll(rim, -1, 0), hub], axis=1), np.ones((60, 3)), SIZE))
    assert (image(buffer) != NOTHING).all()


def test_what_is_nearer_is_seen_in_either_order() -> None:
    whole = np.array([[-50, -50], [150, -50], [-50, 150]], float)
    tilted = np.array([1.0, 3.0, 1.0])  # Nearer on the right.
    for order in ([0, 1], [1, 0]):
        buffer = DepthBuffer(SIZE)
        nearness = np.array([tilted, np.full(3, 1.75)])[order]
        draw_triangles(buffer, SeenTriangles(np.stack([whole, whole]), nearness, SIZE))
        flat_is_seen = image(buffer) == order.index(1)
        x = np.arange(SIZE[0]) + 0.5
        assert np.array_equal(flat_is_seen, np.broadcast_to(1 + (x + 50) / 100 < 1.75, flat_is_seen.shape))


def test_triangles_without_area_cover_nothing() -> None:
    buffer = DepthBuffer(SIZE)
    draw_triangles(
        buffer,
        SeenTriangles(
            np.array([[[1, 2], [30, 20], [15.5, 11]], [[5, 5], [5, 5], [5, 5]]], float), np.ones((2, 3)), SIZE
        ),
    )
    assert (image(buffer) == NOTHING).all()


def test_planes_take_their_values_at_the_corners() -> None:
    rng = np.random.default_rng(3)
    place, values = rng.normal(size=(20, 3, 2)), rng.normal(size=(20, 3))
    a, b, c = planes_over(place, values)
    assert np.allclose(a[:, None] * place[..., 0] + b[:, None] * place[..., 1] + c[:, None], values)


def flat_camera() -> Camera:
    """Looks down on the xy plane from far away, a unit a sample, the origin in the middle."""
    return Camera(np.eye(3), np.array([0, 0, 1e5]), 1e5, np.array(SIZE) / 2)


@pytest.mark.parametrize("angle", np.radians([0, 30, 45, 90, 160]))
def test_a_rod_covers_what_lies_within_its_radius(angle: float) -> None:
    start, end = (
        -np.array([9 * np.cos(angle), 9 * np.sin(angle), 0]),
        np.array([9 * np.cos(angle), 9 * np.sin(angle), 0]),
    )
    rods = see_rods(flat_camera(), start[None], end[None], np.array([2.3]), SIZE)
    buffer = DepthBuffer(SIZE)
    draw_rods(buffer, rods)
    x, y = np.meshgrid(np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2, SIZE[1] / 2 - np.arange(SIZE[1]) - 0.5)
    along = np.clip(x * np.cos(angle) + y * np.sin(angle), -9, 9)
    distance = np.hypot(x - along * np.cos(angle), y - along * np.sin(angle))
    clear = np.abs(distance - 2.3) > 1e-3
    assert np.array_equal((image(buffer) == 0)[clear], (distance < 2.3)[clear])


def test_rods_that_are_drawn_in_parts_give_the_same_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    places = np.random.default_rng(0).uniform(-12, 12, (2, 9, 3))
    buffers = []
    for rods_at_once in (100, 4):
        monkeypatch.setattr(raster, "_RODS_AT_ONCE", rods_at_once)
        buffers.append(DepthBuffer(SIZE))
        draw_rods(buffers[-1], see_rods(flat_camera(), *places, np.full(9, 1.5), SIZE))
    assert np.array_equal(image(buffers[0]), image(buffers[1]))
    assert len(np.unique(buffers[1].shape)) > 8


def test_a_picture_is_the_same_in_bands_and_in_chunks_of_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    places = np.random.default_rng(0).uniform(-12, 12, (2, 9, 3))
    rods = see_rods(flat_camera(), *places, np.full(9, 1.5), SIZE)
    triangles = SeenTriangles(np.random.default_rng(1).uniform(-5, 45, (20, 3, 2)), np.full((20, 3), 1e-5), SIZE)
    whole = DepthBuffer(SIZE)
    monkeypatch.setattr(raster, "_CHUNK", 50)
    bands = [DepthBuffer((SIZE[0], 6), first_row=first) for first in range(0, SIZE[1], 6)]
    for buffer in (whole, *bands):
        draw_triangles(buffer, triangles)
        buffer.forget_shapes()
        draw_rods(buffer, rods)
    for kind in ("shape", "nearness"):
        assert np.array_equal(getattr(whole, kind), np.concatenate([getattr(band, kind) for band in bands]))


def test_what_is_seen_is_told_in_runs_of_samples() -> None:
    buffer = DepthBuffer((4, 3), first_row=7)
    buffer.shape[:] = [5, 5, NOTHING, 5, 5, 2, 2, 2, NOTHING, NOTHING, NOTHING, NOTHING]
    seen = buffer.seen()
    assert np.column_stack([seen.shape, seen.row, seen.first, seen.count]).tolist() == [
        [5, 7, 0, 2],
        [5, 7, 3, 1],
        [5, 8, 0, 1],
        [2, 8, 1, 3],
    ]
    assert np.array_equal(seen.samples(buffer), np.flatnonzero(buffer.shape != NOTHING))


def test_a_rod_is_seen_on_a_surface_and_not_behind_it() -> None:
    camera = flat_camera()
    corners = np.array([[-100, -100, 0], [100, -100, 0], [0, 200, 0]], float)
    place, nearness = camera.project(corners)
    buffer = DepthBuffer(SIZE)
    draw_triangles(buffer, SeenTriangles(place[None], nearness[None], SIZE))
    buffer.forget_shapes()
    starts, ends = np.array([[-5, 4, 0], [-5, -4, -20]], float), np.array([[5, 4, 0], [5, -4, -20]], float)
    draw_rods(buffer, see_rods(camera, starts, ends, np.array([2.0, 2.0]), SIZE))
    assert set(np.unique(buffer.shape)) == {NOTHING, 0}


def test_the_camera_shows_every_point_and_fills_the_picture() -> None:
    rng = np.random.default_rng(4)
    points = rng.normal(size=(500, 3)) * [1, 5, 2] + 100
    camera = look_at(points, np.array([1.0, -2, 0.5]), (800, 600), margin=0.1)
    place, nearness = camera.project(points)
    low, high = place.min(0), place.max(0)
    assert (nearness > 0).all()
    assert (low >= [80 - 1e-6, 60 - 1e-6]).all()
    assert (high <= [720 + 1e-6, 540 + 1e-6]).all()
    assert np.isclose(high[0] - low[0], 640) or np.isclose(high[1] - low[1], 480)


def test_up_is_up_and_nearer_is_nearer() -> None:
    points = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0.0]])
    place, nearness = look_at(points, np.array([3.0, 0, 1]), (100, 100), margin=0.1).project(points)
    assert place[1, 1] < place[0, 1]
    assert nearness[2] > nearness[0]
    for direction in ([0.0, 0, 1], [0.0, 0, -2], [1.0, 1, 0]):
        axes = view_axes(np.array(direction))
        assert np.allclose(axes @ axes.T, np.eye(3))
        assert np.linalg.det(axes) == pytest.approx(1)
