"""Free borders in the way of rays: where children end, and the rays that go on behind corners."""

import numpy as np
import pytest

from flat_fields import flat_surface
from planar_meshes import circle, rectangle
from starting_places import left_of, starting_where
from weavecore.errors import Degenerate
from weavecore.geometry.geodesics import walk_far
from weavecore.offsetting.propagation import obstacle_shadows
from weavecore.offsetting.propagation.diffraction import diffract, fan_angles
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.obstacle_shadows import (
    ARRIVES,
    ENDS_ON_BORDER,
    OBSTRUCTED,
    resolve_obstacles,
)
from weavecore.offsetting.propagation.offset_vertices import cast_rays
from weavecore.offsetting.propagation.ray_directions import FAN_ANGLE, start_on_boundary

BOX = rectangle(1, 1.2, (-1.4, 0.1))


@pytest.fixture(scope="module")
def domain():
    """A plate with a box in it, offset from the left side."""
    return Domain(starting_where(flat_surface([rectangle(6, 4), BOX], 0.25), left_of(-3 + 1e-9)))


def resolve(domain, step):
    starts = start_on_boundary(domain, step=step / 10)
    reach = np.full(len(starts.halfedge), step)
    walks = walk_far(domain.frames, starts.halfedge, starts.px, starts.py, starts.ux, starts.uy, 1.2 * reach)
    return starts, walks, *resolve_obstacles(domain, starts, walks, reach, step=step, ahead=0.2 * step)


def test_rays_of_an_open_source_begin_and_end_where_free_borders_do(domain):
    starts = start_on_boundary(domain, step=0.3)
    assert starts.curves.closed.tolist() == [False]
    assert starts.offsets.tolist() == [0, len(starts.halfedge)]
    assert starts.station[[0, -1]] == pytest.approx([0.0, 4.0 / domain.scale])
    assert np.diff(starts.station).max() <= 0.3 * 1.001
    assert not domain.is_free_border[starts.pivot[0]]
    assert domain.is_free_border[starts.pivot[-1]]
    # At both ends the ray leaves at right angles to the source, not along the free border.
    np.testing.assert_allclose(starts.angle[[0, -1]] % np.pi, [np.pi / 2, 0.0], atol=1e-9)


def test_rays_around_an_obstacle_are_in_the_order_of_the_front_and_no_neighbours_part(domain):
    _, given_walks, targets, walks = resolve(domain, 2.2 / domain.scale)
    assert len(targets) == len(walks) > len(given_walks)
    assert (np.diff(targets.station) >= -1e-9).all()
    states = set(zip(targets.state[:-1].tolist(), targets.state[1:].tolist()))
    assert not states & {(ARRIVES, OBSTRUCTED), (OBSTRUCTED, ARRIVES)}
    assert (targets.state == ENDS_ON_BORDER).sum() == 4  # at both sides of the plate, and behind the box
    assert np.array_equal(targets.end_border >= 0, targets.state == ENDS_ON_BORDER)


def test_behind_a_corner_leave_rays_as_long_as_what_is_left_of_the_step(domain):
    _, _, targets, _ = resolve(domain, 2.2 / domain.scale)
    diffracted = (targets.lead > 0) & (targets.state == ARRIVES)
    assert diffracted.sum() >= 2 * 10
    np.testing.assert_allclose((targets.lead + targets.reach)[diffracted], 2.2 / domain.scale, rtol=1e-6)


def test_given_rays_are_not_changed(domain):
    starts = start_on_boundary(domain, step=0.2)
    before = {name: getattr(starts, name).copy() for name in ("station", "pivot", "place", "angle", "ux", "uy")}
    cast_rays(domain, starts, spacing=2.0 / domain.scale)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(starts, name), values)


def test_corners_that_are_never_settled_are_refused_with_the_faces_of_the_front(domain, monkeypatch):
    monkeypatch.setattr(obstacle_shadows, "_MOST_ROUNDS", 0)
    with pytest.raises(Degenerate, match="levels") as caught:
        resolve(domain, 2.2 / domain.scale)
    assert caught.value.kind == "face"
    assert len(caught.value.ids) > 0


def test_a_creeping_ray_goes_around_a_box_and_leaves_a_fan_at_every_corner(domain):
    # With the surface on its left and the box on its right a ray creeps around it clockwise, along the halfedges.
    loops = np.split(domain.boundary.halfedges, domain.boundary.offsets[1:-1])
    box = next(loop for loop in loops if domain.is_free_border[loop].all())
    start = int(box[0])
    around = float(domain.frames.length[box].sum())
    for on_right, place in ((True, 0.0), (False, float(domain.frames.length[start]))):
        rays = diffract(domain, halfedge=start, place=place, on_right=on_right, reach=around * 0.99)
        assert rays.ends_on_border
        assert len(np.unique(rays.pivot)) == 4
        assert (np.diff(rays.lead) >= 0).all()
        assert len(rays.pivot) == 4 * np.ceil(np.pi / 2 / FAN_ANGLE)
    crept = np.abs(rays.end - rays.start) * domain.frames.length[rays.halfedge]
    assert crept.sum() == pytest.approx(around * 0.99)


def test_a_border_that_turns_in_ends_the_creeping_ray():
    domain = Domain(starting_where(flat_surface([rectangle(6, 4)], 0.3), left_of(-3 + 1e-9)))
    free = domain.boundary.halfedges[domain.is_free_border[domain.boundary.halfedges]]
    rays = diffract(domain, halfedge=int(free[0]), place=0.0, on_right=True, reach=1e3)
    assert not rays.ends_on_border
    assert len(rays.pivot) == 0


def test_a_fan_leaves_out_the_border_and_has_no_gap_wider_than_its_angle():
    for wedge in (0.01, 0.1, 1.0, 3.0):
        angles = fan_angles(wedge)
        assert angles[0] == wedge
        assert angles[-1] > 0
        assert np.abs(np.diff(np.append(angles, 0.0))).max() <= FAN_ANGLE + 1e-12


@pytest.mark.parametrize(("n", "n_corners"), [(40, 40), (200, 100)])
def test_around_a_round_hole_rays_leave_wherever_it_has_turned_by_more_than_a_straight_border(n, n_corners):
    surface = flat_surface([rectangle(8, 6), circle(1.3, n=n)], 0.25)
    domain = Domain(starting_where(surface, left_of(-4 + 1e-9)))
    loops = np.split(domain.boundary.halfedges, domain.boundary.offsets[1:-1])
    hole = next(loop for loop in loops if domain.is_free_border[loop].all())
    around = float(domain.frames.length[hole].sum())
    rays = diffract(domain, halfedge=int(hole[0]), place=0.0, on_right=True, reach=around * 0.99)
    assert len(np.unique(rays.pivot)) == pytest.approx(n_corners, abs=2)
    assert rays.ends_on_border


def test_where_a_border_slants_into_the_way_the_last_step_ends_on_it():
    slanted = np.array([[-3.0, -2], [3, -1], [3, 1], [-3, 2]])
    domain = Domain(starting_where(flat_surface([slanted], 0.25), left_of(-3 + 1e-9)))
    _, _, targets, walks = resolve(domain, 1.0 / domain.scale)
    ended = np.flatnonzero(targets.state == ENDS_ON_BORDER)
    assert len(ended) == 2
    assert domain.is_free_border[targets.end_border[ended]].all()
    assert np.array_equal(walks.stopped_at[ended], targets.end_border[ended])
    # Beyond those that end on the borders lie only obstructed ones.
    assert (targets.state[: ended[0]] == OBSTRUCTED).all()
    assert (targets.state[ended[1] + 1 :] == OBSTRUCTED).all()
