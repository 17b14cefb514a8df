"""Refinement makes a mesh finer and leaves the surface, its borders and its orientation as they are."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.errors import TooFarFromOrigin, TooMuchWork
from weavecore.geometry import refine
from weavecore.geometry.halfedges import NO_TWIN, border_loops, check_manifold_vertices, find_twins, halfedge_ends
from weavecore.geometry.refine import refine_faces

ONE_TRIANGLE = (np.array([[0.0, 0, 0], [10, 0, 0], [3, 8, 0]]), np.array([[0, 1, 2]]))


def half_square(width, height):
    """Two triangles."""
    corners = np.array([[0.0, 0, 0], [width, 0, 0], [width, height, 0], [0, height, 0]])
    return corners, np.array([[0, 1, 2], [0, 2, 3]])


def cube_with_hole():
    """A cube of edge 2 open at the top, with one of five faces fanned about a square hole: 16 triangles."""
    corners = np.array([[x, y, z] for z in (-1.0, 1) for y in (-1.0, 1) for x in (-1.0, 1)])
    hole = np.array([[1.0, -0.5, -0.5], [1, 0.5, -0.5], [1, 0.5, 0.5], [1, -0.5, 0.5]])
    faces = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
    ]
    outer = [1, 3, 7, 5]
    for k in range(4):
        a, b, c, d = outer[k], outer[(k + 1) % 4], 8 + k, 8 + (k + 1) % 4
        faces += [[a, b, d], [a, d, c]]
    return np.concatenate([corners, hole]), np.array(faces)


def fan(n):
    """An ellipse of n triangles about a point that is not its centre: spokes of ever other lengths."""
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rim = np.stack([10 * np.cos(angle), 6 * np.sin(angle), np.sin(3 * angle)], axis=1)
    spokes = np.arange(n)
    return np.concatenate([rim, [[1.0, 1.0, 0.5]]]), np.stack([spokes, np.roll(spokes, -1), np.full(n, n)], axis=1)


def bumpy_grid(n, seed=0):
    """A rough square of 2 n² triangles of very different sizes."""
    rng = np.random.default_rng(seed)
    ticks = np.cumsum(rng.uniform(0.1, 2.0, n + 1))
    x, y = np.meshgrid(ticks, ticks, indexing="ij")
    vertices = np.stack([x, y, rng.uniform(-0.5, 0.5, x.shape)], axis=-1).reshape(-1, 3)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    a, b, c, d = corner, corner + n + 1, corner + n + 2, corner + 1
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def needles():
    """A strip of needles, a thousand times longer than wide."""
    n = 12
    bottom = np.stack([np.arange(n) * 0.01, np.zeros(n), np.zeros(n)], axis=1)
    top = bottom + np.array([0.0, 10.0, 1.0])
    k = np.arange(n - 1)
    return np.concatenate([bottom, top]), np.concatenate(
        [np.stack([k, k + 1, n + k], 1), np.stack([k + 1, n + k + 1, n + k], 1)]
    )


MESHES = {
    "one triangle": (*ONE_TRIANGLE, 0.7),
    "two triangles": (np.array([[0.0, 0, 0], [9, 0, 0], [9, 5, 1], [0, 5, 0]]), np.array([[0, 1, 2], [0, 2, 3]]), 0.8),
    "cube with a hole": (*cube_with_hole(), 0.15),
    "fan": (*fan(40), 0.6),
    "bumpy grid": (*bumpy_grid(12), 0.35),
    "needles": (*needles(), 0.5),
    "closed tetrahedron": (
        np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]),
        0.09,
    ),
}
every_mesh = pytest.mark.parametrize("name", sorted(MESHES))


def area_vectors(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2


def edge_lengths(vertices, faces):
    tail, head = halfedge_ends(faces)
    return np.linalg.norm(vertices[head] - vertices[tail], axis=1)


@every_mesh
def test_the_result_is_manifold_and_of_the_same_topology(name):
    vertices, faces, longest = MESHES[name]
    fine = refine_faces(vertices, faces, longest=longest)
    twins = find_twins(fine.faces, len(fine.vertices))
    check_manifold_vertices(fine.faces, twins, len(fine.vertices))

    def euler(n_vertices, faces, twins):
        return n_vertices - (len(twins) + (twins == NO_TWIN).sum()) // 2 + len(faces)

    coarse = euler(len(vertices), faces, find_twins(faces, len(vertices)))
    assert euler(len(fine.vertices), fine.faces, twins) == coarse
    assert np.array_equal(np.unique(fine.faces), np.arange(len(fine.vertices)))


@every_mesh
def test_old_vertices_and_border_loops_stay_bit_for_bit(name):
    vertices, faces, longest = MESHES[name]
    fine = refine_faces(vertices, faces, longest=longest)
    assert fine.vertices[: len(vertices)].tobytes() == vertices.tobytes()
    before = border_loops(faces, find_twins(faces, len(vertices)))
    after = border_loops(fine.faces, find_twins(fine.faces, len(fine.vertices)))
    assert [loop.tolist() for loop in after] == [loop.tolist() for loop in before]


@every_mesh
def test_every_old_face_is_covered_by_its_parts_looking_the_same_way(name):
    vertices, faces, longest = MESHES[name]
    fine = refine_faces(vertices, faces, longest=longest)
    whole = area_vectors(vertices, faces)
    parts = area_vectors(fine.vertices, fine.faces)
    size = np.linalg.norm(whole, axis=1)
    normal = whole / size[:, None]
    upwards = (parts * normal[fine.parent_face]).sum(1)
    assert (upwards > 0).all()
    assert np.allclose(np.bincount(fine.parent_face, upwards), size, rtol=1e-9)
    from_plane = (
        (fine.vertices[fine.faces] - vertices[faces[fine.parent_face, 0]][:, None]) * normal[fine.parent_face][:, None]
    ).sum(2)
    assert np.abs(from_plane).max() < 1e-14 * np.ptp(vertices, axis=0).max()


@every_mesh
def test_edges_are_short_but_beside_long_border_edges(name):
    vertices, faces, longest = MESHES[name]
    fine = refine_faces(vertices, faces, longest=longest)
    length = edge_lengths(fine.vertices, fine.faces)
    twins = find_twins(fine.faces, len(fine.vertices))
    loops = border_loops(faces, find_twins(faces, len(vertices)))
    long_border = length[twins == NO_TWIN]
    assert (length[twins != NO_TWIN] < max([longest * (1 + 1e-12), *long_border.tolist()])).all()
    # The triangles that hold a long edge lie along the border, little more than half a longest edge deep.
    long_faces = np.flatnonzero((length > longest * (1 + 1e-12)).reshape(-1, 3).any(1))
    ends = [(vertices[loop], vertices[np.roll(loop, -1)]) for loop in loops]
    if not ends:
        assert len(long_faces) == 0
        return
    a, b = (np.concatenate(side) for side in zip(*ends))
    corners = fine.vertices[fine.faces[long_faces]].reshape(-1, 1, 3)
    along = (b - a) / ((b - a) ** 2).sum(1, keepdims=True)
    part = np.clip(((corners - a) * along).sum(2), 0, 1)[..., None]
    from_border = np.linalg.norm(corners - a - part * (b - a), axis=2).min(1)
    assert from_border.max(initial=0.0) < 0.6 * longest


def test_a_mesh_without_long_edges_is_given_back():
    vertices, faces = bumpy_grid(5)
    fine = refine_faces(vertices, faces, longest=100.0)
    assert fine.vertices is vertices
    assert fine.faces is faces
    assert fine.parent_face.tolist() == list(range(len(faces)))


def test_faces_without_a_long_edge_are_left_alone():
    vertices, faces = bumpy_grid(12)
    longest = 1.2
    fine = refine_faces(vertices, faces, longest=longest)
    kept = edge_lengths(vertices, faces).reshape(-1, 3).max(1) <= longest
    assert 0.1 < kept.mean() < 0.9
    assert np.array_equal(fine.faces[: len(faces)][kept], faces[kept])
    assert np.array_equal(fine.parent_face[: len(faces)], np.arange(len(faces)))


def test_well_shaped_faces_keep_half_of_their_angles():
    vertices, faces = fan(6)
    vertices[:, 1] *= 10 / 6
    twins = find_twins(faces, len(vertices))
    fine = refine_faces(vertices, faces, longest=0.4)
    corners = fine.vertices[fine.faces]

    def angle(k):
        u, w = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        return np.degrees(np.arctan2(np.linalg.norm(np.cross(u, w), axis=1), (u * w).sum(1)))

    least = np.min([angle(k) for k in range(3)], axis=0)
    assert (twins == NO_TWIN).sum() == 6
    assert np.median(least) > 33
    assert (least < 20).mean() < 0.05


def test_protected_edges_are_not_cut():
    vertices, faces = bumpy_grid(8)
    tail, head = halfedge_ends(faces)
    middle_row = 4 * 9 + np.arange(9)
    on_row = np.isin(tail, middle_row) & np.isin(head, middle_row)
    one_side = on_row & (tail < head)
    assert one_side.sum() == 8
    fine = refine_faces(vertices, faces, longest=0.3, protected=one_side)
    new_tail, new_head = halfedge_ends(fine.faces)
    pairs = set(zip(new_tail.tolist(), new_head.tolist()))
    assert all((a, b) in pairs and (b, a) in pairs for a, b in zip(middle_row.tolist(), middle_row[1:].tolist()))
    assert np.isclose(edge_lengths(vertices, faces)[one_side].max(), 1.9, atol=0.4)
    assert not one_side[find_twins(faces, len(vertices))[one_side]].any()


@pytest.mark.parametrize("mesh", [ONE_TRIANGLE, cube_with_hole(), bumpy_grid(6)], ids=["triangle", "cube", "grid"])
@pytest.mark.parametrize("longest", [0.4, 100.0])
def test_the_twins_are_those_of_the_refined_faces(mesh, longest):
    vertices, faces = mesh
    shut = np.zeros(faces.size, bool)
    shut[::5] = find_twins(faces, len(vertices))[::5] != NO_TWIN
    open_ = find_twins(faces, len(vertices)) == NO_TWIN
    open_[1::2] = False
    fine = refine_faces(vertices, faces, longest=longest, protected=shut, splittable=open_)
    assert fine.twins.tolist() == find_twins(fine.faces, len(fine.vertices)).tolist()


def test_the_input_is_not_changed_and_the_result_is_the_same_each_time():
    vertices, faces = bumpy_grid(10)
    copies = vertices.copy(), faces.copy()
    vertices.flags.writeable = faces.flags.writeable = False
    first, second = (refine_faces(vertices, faces, longest=0.2) for _ in range(2))
    assert np.array_equal(vertices, copies[0])
    assert np.array_equal(faces, copies[1])
    for name in ("vertices", "faces", "parent_face"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


@pytest.mark.parametrize("scale", [1e-160, 1e-6, 1e6, 1e160])
def test_scale_changes_nothing_but_the_coordinates(scale):
    vertices, faces, longest = MESHES["cube with a hole"]
    plain, scaled = (
        refine_faces(vertices, faces, longest=longest),
        refine_faces(vertices * scale, faces, longest=longest * scale),
    )
    assert abs(len(plain.faces) - len(scaled.faces)) < 0.05 * len(plain.faces)
    assert np.ptp(scaled.vertices, axis=0) / scale == pytest.approx(np.ptp(plain.vertices, axis=0))


@pytest.mark.parametrize("name", ["cube with a hole", "fan", "bumpy grid"])
def test_motion_changes_nothing_but_the_coordinates(name):
    vertices, faces, longest = MESHES[name]
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    still = refine_faces(vertices, faces, longest=longest)
    moved = refine_faces(vertices @ turn + [3.0, -1.0, 7.0], faces, longest=longest)
    assert np.array_equal(moved.faces, still.faces)
    assert np.allclose(moved.vertices, still.vertices @ turn + [3.0, -1.0, 7.0], atol=1e-12)


def test_rounds_do_not_grow_with_the_length_of_a_run_of_ever_longer_edges(monkeypatch):
    rounds = []
    split = refine._Bisection.split
    monkeypatch.setattr(refine._Bisection, "split", lambda self, queue: rounds.append(0) or split(self, queue))
    fine = refine_faces(*fan(4000), longest=2.0)
    assert len(fine.faces) > 20_000
    assert len(rounds) < 60


@pytest.mark.parametrize("longest", [1e-4, 0.0, -1.0, float("nan")])
def test_too_many_faces_are_refused_before_they_are_made(longest):
    with pytest.raises(TooMuchWork):
        refine_faces(*ONE_TRIANGLE, longest=longest)


def test_lengths_below_rounding_are_refused():
    vertices, faces = ONE_TRIANGLE
    with pytest.raises(TooFarFromOrigin):
        refine_faces(vertices + 1e14, faces, longest=0.5)


@pytest.mark.parametrize("width", [2.0, 4.0, 8.0, 16.0])
@pytest.mark.parametrize("longest", [0.25, 0.5])
def test_edges_of_just_the_longest_length_do_not_stall_it(width, longest):
    vertices, faces = half_square(width, 4.0)
    every = np.ones(6, bool)
    fine = refine_faces(vertices, faces, longest=longest, splittable=every)
    tail, head = halfedge_ends(fine.faces)
    assert np.linalg.norm(fine.vertices[head] - fine.vertices[tail], axis=1).max() <= longest


def test_splittable_edges_of_the_border_are_cut_and_stay_straight_and_others_stay_whole():
    vertices, faces = half_square(8.0, 4.0)
    splittable = np.array([True, True, False, False, True, False])  # all of the border but the left side
    fine = refine_faces(vertices, faces, longest=0.3, splittable=splittable)
    loop = border_loops(fine.faces, find_twins(fine.faces, len(fine.vertices)))[0]
    rim = fine.vertices[loop]
    on_rectangle = (np.abs(rim[:, 0]) < 1e-12) | (rim[:, 0] == 8) | (rim[:, 1] == 0) | (rim[:, 1] == 4)
    assert on_rectangle.all()
    assert (rim[:, 0] == 0).sum() == 2
    steps = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
    assert np.sort(steps)[-2:].tolist()[0] <= 0.3
    assert steps.max() == 4.0


@pytest.mark.parametrize("part", [1.2, 1.0, 0.5, 0.2])
def test_the_work_that_is_expected_is_that_of_the_refined_faces_and_little_more(part: float) -> None:
    points, faces = bumpy_grid(20)
    sides = np.linalg.norm(points[faces] - points[np.roll(faces, 1, axis=1)], axis=2)
    longest = part * float(sides.mean())
    made = len(refine_faces(points, faces, longest=longest).faces)
    refine_faces(points, faces, longest=longest, most_faces=2 * made)
    with pytest.raises(TooMuchWork):
        refine_faces(points, faces, longest=longest, most_faces=made // 3)
