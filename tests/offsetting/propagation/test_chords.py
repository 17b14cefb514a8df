"""Chords embedded in the mesh."""

import numpy as np

from drawn_curves import place, square_domain
from flat_fields import flat_surface
from planar_meshes import circle, rectangle
from weavecore.offsetting.propagation.chords import embed_chords, measure_chords
from weavecore.offsetting.propagation.domain import Domain


def chords_between(domain, a, b):
    (fa, wa), (fb, wb) = place(domain, a), place(domain, b)
    return embed_chords(domain, fa, wa, fb, wb), measure_chords(domain, fa, wa, fb, wb)


def some_pairs(domain, n=40):
    rng = np.random.default_rng(5)
    reach = 0.45 * np.ptp(domain.vertices[:, 0])
    return rng.uniform(-reach, reach, (n, 3)), rng.uniform(-reach, reach, (n, 3))


def test_on_a_plane_a_chord_is_the_straight_line_cut_at_the_edges():
    domain = square_domain()
    a, b = some_pairs(domain)
    (chord, face, start, end), length = chords_between(domain, a, b)
    np.testing.assert_allclose(length, np.linalg.norm((b - a)[:, :2], axis=1), rtol=1e-3)
    p, q = domain.points(face, start), domain.points(face, end)
    along = (b - a)[chord][:, :2]
    for x in (p, q):
        off = np.cross(np.c_[along, 0 * along[:, 0]], x - np.c_[a[chord][:, :2], 0 * along[:, 0]])[:, 2]
        assert np.abs(off / np.linalg.norm(along, axis=1)).max() < 1e-3  # held off the corners of the mesh
    np.testing.assert_allclose(np.bincount(chord, np.linalg.norm(q - p, axis=1)), length, rtol=1e-9)


def test_each_segment_goes_on_where_the_one_before_ended_across_an_edge():
    domain = square_domain()
    (chord, face, start, end), _ = chords_between(domain, *some_pairs(domain))
    inner = np.flatnonzero(chord[1:] == chord[:-1])
    np.testing.assert_allclose(
        domain.points(face[inner], end[inner]), domain.points(face[inner + 1], start[inner + 1]), atol=1e-9
    )
    assert (end[inner].min(1) == 0).all()
    assert (start[inner + 1].min(1) == 0).all()
    twin_faces = domain.twins.reshape(-1, 3)[face[inner]] // 3
    assert (twin_faces == face[inner + 1][:, None]).any(1).all()


def test_a_chord_goes_around_a_hole_that_is_in_its_way():
    domain = Domain(flat_surface([rectangle(10, 10), circle(2.0, n=40)], 0.4))
    unit = 1 / domain.scale
    a, b = np.array([[-3.0, 0.3, 0]]) * unit, np.array([[3.0, 0.3, 0]]) * unit
    (_, face, start, end), length = chords_between(domain, a, b)
    assert np.isinf(length[0])
    p, q = domain.points(face, start), domain.points(face, end)
    np.testing.assert_allclose(p[1:], q[:-1], atol=1e-9)
    np.testing.assert_allclose([p[0], q[-1]], [a[0], b[0]], atol=1e-9)
    assert np.linalg.norm(p[:, :2], axis=1).min() > 1.99 * unit
