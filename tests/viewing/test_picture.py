"""Pictures of results: what they show, from where, and that they are PNG."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest

from weavecore.errors import Unsupported
from weavecore.model import LONGITUDINAL, SurfaceMesh
from weavecore.viewing.camera import choose_view
from weavecore.viewing.picture import draw_pixels, encode_picture, encode_png
from woven_tube import tube_latitudes, tube_lattice, tube_surface

SMALL = (160, 120)


def decoded(content: bytes) -> np.ndarray:
    """The pixels of a PNG of eight-bit colours, each row filtered by the one above it."""
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    at, body = 8, b""
    while at < len(content):
        (length,) = struct.unpack_from(">I", content, at)
        kind, data = content[at + 4 : at + 8], content[at + 8 : at + 8 + length]
        assert struct.unpack_from(">I", content, at + 8 + length)[0] == zlib.crc32(kind + data)
        if kind == b"IHDR":
            width, height, depth, colours, *_ = struct.unpack(">IIBBBBB", data)
            assert (depth, colours) == (8, 2)
        if kind == b"IDAT":
            body += data
        at += 12 + length
    rows = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 2).all()
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(height, width, 3)


def test_png_keeps_every_pixel() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (13, 17, 3)).astype(np.uint8)
    assert np.array_equal(decoded(encode_png(pixels)), pixels)


def share_of(pixels: np.ndarray, colour: str) -> float:
    """Part of the pixels in which that colour stands out."""
    red, green, blue = np.moveaxis(pixels.astype(int), 2, 0)
    stands_out = {
        "amber": (red > green + 40) & (green > blue + 40),
        "crimson": (red > green + 80) & (blue > green),
        "blue": (blue > red + 40) & (blue > green),
    }[colour]
    return float(stands_out.mean())


def test_each_result_shows_its_families() -> None:
    surface, latitudes, lattice = (
        draw_pixels(value, size=SMALL) for value in (tube_surface(), tube_latitudes(), tube_lattice())
    )
    assert share_of(surface, "amber") == share_of(latitudes, "amber") == 0
    assert share_of(lattice, "amber") > 0.02
    assert share_of(lattice, "crimson") > 0.005
    assert share_of(surface, "crimson") == share_of(latitudes, "crimson") == 0
    assert share_of(latitudes, "blue") > share_of(surface, "blue") > 0


def test_what_lies_behind_the_surface_is_not_drawn() -> None:
    """A lid over the rods: from below they are seen, from above they are not."""
    lattice = tube_lattice()
    nodes = np.array(lattice.nodes)
    lid = [[-9.0, -9, 9], [9, -9, 9], [9, 9, 9], [-9, 9, 9]]
    n = len(nodes)
    covered = replace(
        lattice,
        nodes=np.concatenate([nodes, lid]),
        face_offsets=np.append(lattice.face_offsets, lattice.face_offsets[-1] + 4),
        face_nodes=np.append(lattice.face_nodes, n + np.arange(4)),
        node_latitude=np.append(lattice.node_latitude, [-1] * 4),
        node_station=np.append(lattice.node_station, [0.0] * 4),
    )
    above, below = (draw_pixels(covered, size=SMALL, view=[0.4, 0, z]) for z in (1, -1))
    assert share_of(above, "amber") == 0
    assert share_of(below, "amber") > 0


def test_the_same_value_gives_the_same_bytes() -> None:
    assert encode_picture(tube_lattice(), size=SMALL) == encode_picture(tube_lattice(), size=SMALL)


def test_a_picture_has_the_size_that_was_asked_for() -> None:
    assert decoded(encode_picture(tube_surface(), size=(321, 123))).shape == (123, 321, 3)


@pytest.mark.parametrize("size", [(0, 100), (100, 100_000)])
def test_sizes_that_cannot_be_drawn_are_refused(size: tuple[int, int]) -> None:
    with pytest.raises(Unsupported, match="pixels"):
        encode_picture(tube_surface(), size=size)


@pytest.mark.parametrize("view", [[0, 0, 0], [1, 2], [1, float("nan"), 0]])
def test_views_that_are_no_direction_are_refused(view: list[float]) -> None:
    with pytest.raises(Unsupported, match="direction"):
        encode_picture(tube_surface(), size=SMALL, view=view)


def test_a_surface_without_borders_and_one_far_away_are_drawn() -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    closed = SurfaceMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    assert np.ptp(draw_pixels(closed, size=SMALL)) > 50
    far = replace(tube_surface(), vertices=tube_surface().vertices + 1e6)
    near = draw_pixels(tube_surface(), size=SMALL)
    assert np.abs(draw_pixels(far, size=SMALL).astype(int) - near).mean() < 1


def grid(n: int = 12) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A square in the plane: places (x, y), faces, and the vertices of its border."""
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    v = np.arange(n * n).reshape(n, n)
    a, b, c, d = v[:-1, :-1].ravel(), v[:-1, 1:].ravel(), v[1:, 1:].ravel(), v[1:, :-1].ravel()
    border = np.unique(np.concatenate([v[0], v[-1], v[:, 0], v[:, -1]]))
    return np.c_[x.ravel(), y.ravel()], np.concatenate([np.c_[a, b, c], np.c_[a, c, d]]), border


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_flat_surface_is_not_looked_at_along_its_plane(axis: int) -> None:
    place, faces, border = grid()
    vertices = np.insert(place, axis, 0.0, axis=1)
    assert abs(choose_view(vertices, faces, vertices[border])[axis]) > 0.35


def test_a_bowl_is_looked_into_and_a_dome_at() -> None:
    place, faces, border = grid()
    height = (place**2).sum(1)
    for sign in (1, -1):
        vertices = np.c_[place, sign * height]
        direction = choose_view(vertices, faces, vertices[border])
        assert np.degrees(np.arcsin(direction[2])) > 15


def test_the_side_with_the_opening_is_shown() -> None:
    """A tube that lies, of which one end counts as an opening."""
    surface = tube_surface()
    lying = surface.vertices[:, [2, 0, 1]]  # The tube's axis along x.
    rim = lying[lying[:, 0] == lying[:, 0].max()]
    assert choose_view(lying, surface.faces, rim)[0] > 0.2
    assert choose_view(lying * [-1, 1, 1], surface.faces, rim * [-1, 1, 1])[0] < -0.2


def test_longitudes_are_thinner_than_rings_and_the_border_is_thickest() -> None:
    from weavecore.viewing.scene import scene_of

    lattice = tube_lattice()
    scene = scene_of(lattice)
    on_border = (lattice.edge_family == 0) & (
        lattice.latitudes.generation[lattice.node_latitude[lattice.edges[:, 0]]] == 0
    )
    ring = (lattice.edge_family == 0) & ~on_border
    longitudes = lattice.edge_family == LONGITUDINAL
    assert scene.radius[on_border].min() > scene.radius[ring].max() > scene.radius[longitudes].max()
