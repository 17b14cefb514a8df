"""The paper's method where distances start at chosen places, and the other borders cut the fronts open."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from comparing import compare
from drawn_curves import draw_open, signed_areas, square_domain
from flat_fields import flat_surface
from planar_meshes import circle, rectangle
from starting_places import left_of, starting_where
from tough_register import grid
from weavecore import pipeline
from weavecore.errors import Degenerate, SpacingTooLarge
from weavecore.model import SurfaceMesh
from weavecore.model.surface import Origins
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.intersections import find_intersections
from weavecore.offsetting.propagation.method import offset_fronts, refuse_loose_ends
from weavecore.offsetting.propagation.ray_directions import start_on_curves
from weavecore.offsetting.propagation.uncrossing import reconnect_at_crossings
from weavecore.validating import validate

FOLDER = Path(__file__).resolve().parents[2] / "sample_files"


def held(latitudes):
    report = validate(latitudes)
    assert report.holds, f"\n{report}"
    return latitudes


def errors(latitudes, distance):
    """How far all points of the children are from their distance, given as a function of x and y, in spacings."""
    owner = latitudes.polylines.owner
    children = latitudes.generation[owner] > 0
    x, y, _ = latitudes.polylines.points[children].T
    return np.abs(distance(x, y) - latitudes.distance[owner[children]]) / latitudes.spacing


def n_open(latitudes):
    return np.bincount(latitudes.generation, ~latitudes.polylines.closed).astype(int).tolist()


def test_from_one_side_of_a_rectangle_go_straight_lines_between_the_free_borders():
    surface = starting_where(flat_surface([rectangle(6, 4)], 0.3), left_of(-3 + 1e-9))
    latitudes = held(offset_fronts(surface, spacing=0.55))
    lines = latitudes.polylines
    assert n_open(latitudes) == [1] * 11
    assert errors(latitudes, lambda x, _: x + 3).max() < 1e-4
    for p in range(1, len(lines)):
        # With the unexplored side on their left they run downwards.
        assert lines.polyline(p)[[0, -1], 1] == pytest.approx([2.0, -2.0])
    first, last = lines.offsets[:-1], lines.offsets[1:] - 1
    assert (lines.barycentric[np.r_[first[1:], last[1:]]].min(1) == 0).all()
    assert latitudes.bands.euler.tolist() == [1] * 11


def test_fronts_bend_around_a_corner_of_a_free_border():
    ell = np.array([[0, 0], [6, 0], [6, 2.2], [2.5, 2.2], [2.5, 6], [0, 6]])
    surface = starting_where(flat_surface([ell], 0.25), lambda points: points[:, 0] > 6 - 1e-9)
    latitudes = offset_fronts(surface, spacing=0.4)

    def distance(x, y):
        bent = (x < 2.5 + 1e-6) & (y > 2.2)
        return np.where(bent, 3.5 + np.hypot(x - 2.5, y - 2.2), 6 - x)

    assert n_open(latitudes)[:20] == [1] * 20
    assert errors(latitudes, distance).max() < 0.01


def test_a_hole_cuts_fronts_in_two_that_join_again_in_its_shadow():
    radius, middle = 1.3, np.array([-0.5, 0.4])
    surface = flat_surface([rectangle(8, 6), circle(radius, middle, n=100)], 0.25)
    latitudes = held(offset_fronts(starting_where(surface, left_of(-4 + 1e-9)), spacing=0.46))

    def distance(x, y):
        x, y = x - middle[0], np.abs(y - middle[1])
        far = np.hypot(x, y)
        around = np.pi / 2 - np.arctan2(y, x) - np.arccos(np.minimum(radius / far, 1))
        bent = 3.5 + radius * around + np.sqrt(np.maximum(far**2 - radius**2, 0))
        return np.where((x > 0) & (around > 0), bent, x + middle[0] + 4)

    assert n_open(latitudes)[4:14] == [1, 2, 2, 2, 2, 2, 2, 2, 2, 1]
    assert errors(latitudes, distance).mean() < 0.003
    assert errors(latitudes, distance).max() < 0.02


@pytest.mark.parametrize("spacing", [0.37, 1.33, 1.4, 1.5])
def test_a_box_that_is_passed_within_one_step_has_arcs_about_its_corners_behind_it(spacing):
    box = rectangle(1, 1.2, (-0.3, 0.1))
    surface = starting_where(flat_surface([rectangle(8, 6), box], 0.25), left_of(-4 + 1e-9))
    latitudes = offset_fronts(surface, spacing=spacing)

    def distance(x, y):
        y = np.abs(y - 0.1)
        return np.where((x > 0.2 - 1e-6) & (y < 0.6), 4.2 + np.hypot(x - 0.2, y - 0.6), x + 4)

    assert 2 in n_open(latitudes)
    assert errors(latitudes, distance).max() < 0.01


def test_rings_from_the_outer_border_open_when_they_come_to_the_inner_one():
    surface = flat_surface([circle(5.0, n=200), circle(1.5, (1.0, 0.3), n=60)], 0.25)
    latitudes = held(offset_fronts(starting_where(surface, lambda p: np.hypot(*p[:, :2].T) > 4.9), spacing=0.6))
    assert n_open(latitudes)[:7] == [0, 0, 0, 0, 0, 1, 1]
    assert errors(latitudes, lambda x, y: 5 - np.hypot(x, y)).max() < 0.02


def test_rings_from_a_hole_are_cut_by_the_outer_border_and_end_in_its_corners():
    surface = flat_surface([rectangle(8, 8), circle(1.5, n=120)], 0.25)
    latitudes = held(offset_fronts(starting_where(surface, lambda p: np.hypot(*p[:, :2].T) < 1.6), spacing=0.6))
    assert n_open(latitudes)[:7] == [0, 0, 0, 0, 0, 4, 4]
    assert errors(latitudes, lambda x, y: np.hypot(x, y) - 1.5).max() < 0.01


@pytest.mark.parametrize(("base", "top", "n_fronts"), [(2.0, 0.4, 10), (2.0, 0.05, 10), (0.6, 0.02, 10), (4.0, 0.0, 8)])
def test_fronts_are_offset_to_the_tip_that_two_free_borders_enclose(base, top, n_fronts):
    wedge = np.array([[-top, 5], [-base, 0], [base, 0], [top, 5]]) / [2, 1]
    wedge = wedge[: 4 if top else 3]
    surface = starting_where(flat_surface([wedge], 0.25), lambda points: points[:, 1] < 1e-9)
    latitudes = held(offset_fronts(surface, spacing=5 / (n_fronts + 0.4)))
    assert n_open(latitudes) == [1] * (n_fronts + 1)
    left = 0.4 / (n_fronts + 0.4)
    assert latitudes.polylines.lengths[-1] == pytest.approx(top + (base - top) * left, rel=0.1)


def test_a_curve_inside_the_surface_is_offset_on_both_sides_and_around_its_ends():
    surface = grid_plate(41, 0.25)
    row = 20 * 41 + np.arange(14, 27)
    surface = replace(surface, starts=Origins((row,), np.array([False])))
    latitudes = held(offset_fronts(surface, spacing=0.58))
    a, b = surface.vertices[row[0], 0], surface.vertices[row[-1], 0]
    # The borders are 3.5 away at the ends of the curve, and 5 beside it.
    assert n_open(latitudes)[:10] == [1, 0, 0, 0, 0, 0, 0, 2, 2, 4]
    assert errors(latitudes, lambda x, y: np.hypot(x - np.clip(x, a, b), y)).max() < 0.01


def grid_plate(n, edge):
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    points = (np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) - [(n - 1) / 2, (n - 1) / 2, 0]) * edge
    k = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.stack([k, k + 1, k + n + 1], 1), np.stack([k, k + n + 1, k + n], 1)])
    return SurfaceMesh(points, faces)


@pytest.mark.parametrize("x", [0, 3])
def test_a_curve_from_border_to_border_is_offset_to_both_its_sides(x):
    surface = grid_plate(21, 0.2)
    column = 21 * np.arange(21) + 10 + x
    latitudes = held(offset_fronts(replace(surface, starts=Origins((column,), np.array([False]))), spacing=0.3))
    assert n_open(latitudes)[:5] == [1, 2, 2, 2, 2]
    assert errors(latitudes, lambda at, _: np.abs(at - 0.2 * x)).max() < 1e-4


def test_a_free_border_cuts_fronts_also_where_the_surface_folds_at_the_end_of_its_origin():
    # Unfolded, the corner at the origin of the plane is one of 86 degrees; a fold of 120 goes through it.
    fold, corner, apart = np.radians([120.0, 86.0, 30.0])
    far = 4.0 * np.array([np.cos(corner), np.sin(corner)])
    # Turned about the fold, which leaves the corner at 30 degrees, the far side is lifted.
    along = np.array([np.cos(apart), np.sin(apart)])
    across = far - (far @ along) * along
    lifted = np.array([*((far @ along) * along + across * np.cos(fold)), np.linalg.norm(across) * np.sin(fold)])
    vertices = np.array([[0, 0, 0], [6, 0, 0], [*(4.0 * along), 0], lifted])
    surface = SurfaceMesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    surface = replace(surface, starts=Origins((np.array([0, 1]),), np.array([False])))
    latitudes = held(offset_fronts(surface, spacing=0.4))
    first = latitudes.polylines.polyline(int(np.flatnonzero(latitudes.generation == 1)[0]))
    # It ends on the lifted edge, as high over the origin as its distance.
    end = first[np.argmax(first[:, 2])]
    assert np.linalg.norm(end) == pytest.approx(0.4 / np.sin(corner), rel=1e-6)


@pytest.mark.parametrize("length", [2.3, 3.1, 3.95])
def test_open_fronts_that_pass_each_other_have_no_child(length):
    surface = flat_surface([rectangle(length, 2)], 0.2)
    surface = starting_where(surface, left_of(1e-9 - length / 2), lambda points: points[:, 0] > length / 2 - 1e-9)
    latitudes = held(offset_fronts(surface, spacing=0.99))
    assert n_open(latitudes) == [2, 2]
    assert sorted(latitudes.bands.euler.tolist()) == [1, 1, 1]


def test_a_child_hardly_before_a_free_border_is_dropped():
    surface = starting_where(flat_surface([rectangle(1.02, 5)], 0.2), left_of(1e-9 - 0.51))
    with pytest.raises(SpacingTooLarge):
        offset_fronts(surface, spacing=1.0)
    assert n_open(offset_fronts(surface, spacing=0.9)) == [1, 1]


def test_from_one_end_of_a_tube_go_closed_rings_to_the_other():
    angle, z = np.meshgrid(2 * np.pi * np.arange(60) / 60, np.linspace(0, 3.3, 30), indexing="ij")
    points = np.stack([np.cos(angle), np.sin(angle), z], axis=-1).reshape(-1, 3)
    tube = SurfaceMesh(points, grid(60, 30, wrap_u=True))
    latitudes = held(offset_fronts(starting_where(tube, lambda points: points[:, 2] < 1e-9), spacing=0.5))
    assert np.bincount(latitudes.generation).tolist() == [1] * 7
    assert n_open(latitudes) == [0] * 7
    for p in range(7):
        np.testing.assert_allclose(latitudes.polylines.polyline(p)[:, 2], 0.5 * p, atol=1e-3)


@pytest.mark.parametrize(("x", "width"), [(0.18, 0.02), (0.213, 0.006), (0.45, 0.003), (0.317, 0.0005)])
def test_a_slot_thinner_than_the_gap_between_two_rays_cuts_fronts(x, width):
    slot = [[-3, -2], [3, -2], [3, 2], [x + width, 2], [x + width, 0.41], [x, 0.41], [x, 2], [-3, 2]]
    surface = starting_where(flat_surface([np.array(slot)], 0.25), lambda points: points[:, 1] < 1e-9 - 2)
    latitudes = offset_fronts(surface, spacing=0.7)
    assert n_open(latitudes)[:6] == [1, 1, 1, 1, 2, 2]
    assert errors(latitudes, lambda _, y: y + 2).max() < 1e-4


def test_starting_at_all_borders_gives_the_same_bytes_as_starting_anywhere():
    surface = flat_surface([rectangle(6, 6), circle(1.5, (0.2, 0.1), n=40)], 0.4)
    chosen = replace(surface, starts=Origins(surface.borders, np.ones(2, bool)))
    one, other = offset_fronts(surface, spacing=0.5), offset_fronts(chosen, spacing=0.5)
    assert one.polylines.points.tobytes() == other.polylines.points.tobytes()
    assert one.vertex_distance.tobytes() == other.vertex_distance.tobytes()


def test_two_open_fronts_that_cross_exchange_their_tails():
    domain = square_domain()
    raw = draw_open(domain, [[-6, -3.1], [6.1, 3.3]], [[5.9, -4.2], [-6.2, 4]])
    uncrossed = reconnect_at_crossings(domain, raw, find_intersections(domain, raw))
    curves = uncrossed.curves
    assert curves.closed.tolist() == [False, False]
    ends = curves.points[np.concatenate(curves.ends)][:, :2]
    np.testing.assert_allclose(ends, [[-6, -3.1], [5.9, -4.2], [-6.2, 4], [6.1, 3.3]], atol=1e-9)
    assert curves.curve_lengths.sum() == pytest.approx(raw.curve_lengths.sum())
    assert len(find_intersections(domain, curves)) == 0
    # The branch that turns left has a winding number higher by one.
    assert abs(uncrossed.winding[0] - uncrossed.winding[1]) == 1


def test_an_open_front_that_crosses_itself_leaves_a_ring():
    domain = square_domain()
    raw = draw_open(domain, [[-6, -1.1], [5.1, 3.1], [4.9, -3.2], [-6.1, 2.2]])
    curves = reconnect_at_crossings(domain, raw, find_intersections(domain, raw)).curves
    assert sorted(curves.closed.tolist()) == [False, True]
    ring = curves.take(curves.closed)
    assert signed_areas(ring)[0] < 0
    np.testing.assert_allclose(curves.take(~curves.closed).points[[0, -1], :2], [[-6, -1.1], [-6.1, 2.2]], atol=1e-9)


def test_seeds_of_an_open_front_begin_and_end_with_it():
    domain = Domain(starting_where(flat_surface([rectangle(6, 4)], 0.3), left_of(-3 + 1e-9)))
    x = np.linspace(-6.0, 6.0, 300)
    front = draw_open(domain, np.stack([x, 0.3 * np.sin(x)], axis=1))
    starts = start_on_curves(domain, front, step=0.5)
    assert starts.station[[0, -1]] == pytest.approx([0.0, front.curve_lengths[0]])
    gaps = np.diff(starts.station)
    assert gaps.min() > 0.2
    assert gaps.max() < 0.5 * 1.31


def test_an_open_front_that_ends_inside_the_surface_is_refused():
    surface = starting_where(flat_surface([rectangle(6, 4)], 0.3), left_of(-3 + 1e-9))
    domain = Domain(surface)
    with pytest.raises(Degenerate, match="levels"):
        refuse_loose_ends(domain, draw_open(domain, [[-3.0, -2.0], [3.0, 2.0]]))
    # A source is not a free border: no front may end there.
    ends = np.flatnonzero(surface.is_origin)[:2]
    front = draw_open(domain, [[-3.0, -2.0], [3.0, 2.0]])
    start = np.zeros_like(front.start)
    start[:, 0] = start[:, 1] = 0.5
    with pytest.raises(Degenerate, match="levels"):
        refuse_loose_ends(domain, replace(front, face=np.resize(ends // 3, len(front.face)), start=start))


@cache
def offset_sample(name, borders, method):
    surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
    return pipeline.offset(surface, spacing=pipeline.suggest_spacing(surface), borders=borders, method=method)


@pytest.mark.parametrize(
    ("name", "borders"),
    [
        ("hourglass", (0,)),
        pytest.param("minimal_surface", (1,), marks=pytest.mark.slow),
        pytest.param("six_way_joint", (0,), marks=pytest.mark.slow),
        pytest.param("six_way_joint", (0, 1), marks=pytest.mark.slow),
    ],
)
def test_both_methods_agree_on_samples_from_chosen_borders(name, borders):
    levels, fronts = (offset_sample(name, borders, method) for method in ("levels", "fronts"))
    comparison = compare(levels, fronts)
    assert comparison.same_counts, comparison.counts
    assert comparison.same_parents
    assert comparison.mean < 0.003
    assert comparison.apart < 0.01
    assert np.bincount(fronts.bands.euler + 9).tolist() == np.bincount(levels.bands.euler + 9).tolist()
    assert fronts.polylines.closed.sum() == levels.polylines.closed.sum()
    assert validate(fronts).holds == validate(levels).holds


def path_along_edges(surface, start, goal):
    """A short path that touches no border but at its ends."""
    tail, head = surface.faces.ravel(), surface.faces[:, [1, 2, 0]].ravel()
    on_border = np.isin(np.arange(surface.n_vertices), np.concatenate(surface.borders))
    cost = surface.edge_lengths * np.where(on_border[tail] | on_border[head], 50, 1)
    edges = csr_matrix((cost, (tail, head)), shape=(surface.n_vertices,) * 2)
    _, before = dijkstra(edges.maximum(edges.T), indices=start, return_predecessors=True)
    path = [goal]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    return np.array(path[::-1])


@pytest.mark.parametrize("name", ["hemisphere", pytest.param("narrow_neck", marks=pytest.mark.slow)])
def test_curves_on_samples_are_offset_as_by_the_other_method(name):
    surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
    border = surface.borders[0]
    path = path_along_edges(surface, border[0], border[len(border) // 2])
    surface = replace(surface, starts=Origins((path,), np.array([False])))
    spacing = pipeline.suggest_spacing(replace(surface, starts=None))
    levels, fronts = (pipeline.offset(surface, spacing=spacing, method=method) for method in ("levels", "fronts"))
    comparison = compare(levels, fronts)
    assert comparison.same_counts, comparison.counts
    assert comparison.same_parents
    assert comparison.mean < 0.01
