"""Trims read from the bytes of a Brep, whole and damaged; NURBS evaluated as rhino3dm does."""

from __future__ import annotations

import base64
from dataclasses import replace

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.errors import Unreadable, WeaveError
from weavecore.geometry.nurbs import curve_points, surface_points
from weavecore.reading.nurbs_mesher import brep_shape as shapes
from weavecore.reading.nurbs_mesher.brep_archive import SINGULAR, read_brep_archive
from weavecore.reading.nurbs_mesher.brep_shape import NO_EDGE, brep_shape, nurbs_curve, nurbs_surface
from weavecore.reading.nurbs_mesher.objects import as_brep

r = pytest.importorskip("rhino3dm")


@pytest.mark.parametrize("name", ["box", "sphere", "can", "punched", "disc", "beam", "torus"])
def test_trims_run_around_their_faces_along_their_edges(name):
    shape = brep_shape(as_brep(getattr(make, name)()))
    for face in shape.faces:
        for loop in face.loops:
            for trim, after in zip(loop, loop[1:] + loop[:1]):
                assert trim.vertices[1] == after.vertices[0]
                lifted = surface_points(face.surface, trim.uv)
                assert lifted[0] == pytest.approx(shape.vertices[trim.vertices[0]], abs=1e-9)
                if trim.edge == NO_EDGE:
                    assert np.ptp(lifted, axis=0).max() <= 1e-9
                    continue
                edge = shape.edges[trim.edge]
                ends = curve_points(edge, np.array(edge.domain))
                assert lifted[[0, -1]] == pytest.approx(ends[::-1] if trim.against_edge else ends, abs=1e-9)


def test_records_say_what_rhino3dm_says():
    brep = make.can()
    archive = read_brep_archive(brep.Encode())
    assert [f.reversed for f in archive.faces] == [face.OrientationIsReversed for face in brep.Faces]
    assert len(archive.edges) == len(brep.Edges)
    assert sorted(len(e.trims) for e in archive.edges) == [2, 2, 2]


def test_a_pole_is_a_singular_trim():
    archive = read_brep_archive(make.sphere().Encode())
    assert [t.kind for t in archive.trims].count(SINGULAR) == 2


@pytest.mark.parametrize("name", ["saddle", "hourglass", "torus", "bowl", "folded"])
def test_surfaces_are_evaluated_as_rhino3dm_does(name):
    form = getattr(make, name)().ToNurbsSurface()
    surface = nurbs_surface(form)
    ways = [np.linspace(*surface.domain(way), 7) for way in (0, 1)]
    uv = np.column_stack([axis.ravel() for axis in np.meshgrid(*ways)])
    own = np.array([(p.X, p.Y, p.Z) for p in (form.PointAt(u, v) for u, v in uv.tolist())])
    assert surface_points(surface, uv) == pytest.approx(own, abs=1e-13)


def test_curves_are_evaluated_as_rhino3dm_does():
    form = make.circle(2.0)
    curve = nurbs_curve(form)
    t = np.linspace(*curve.domain, 23)
    own = np.array([(p.X, p.Y, p.Z) for p in map(form.PointAt, t.tolist())])
    assert curve_points(curve, t) == pytest.approx(own, abs=1e-13)


def test_every_cut_of_the_bytes_is_refused():
    encoded = make.can().Encode()
    raw = base64.b64decode(encoded["data"])
    for length in range(0, len(raw), 97):
        cut = {**encoded, "data": base64.b64encode(raw[:length]).decode()}
        with pytest.raises(Unreadable):
            read_brep_archive(cut)


def test_flipped_bytes_are_read_or_refused_but_nothing_else():
    encoded = make.can().Encode()
    raw = base64.b64decode(encoded["data"])
    draw = np.random.default_rng(7)
    refused = 0
    for _ in range(300):
        damaged = bytearray(raw)
        for at in draw.integers(0, len(raw), 3):
            damaged[at] = draw.integers(0, 256)
        try:
            read_brep_archive({**encoded, "data": base64.b64encode(bytes(damaged)).decode()})
        except WeaveError:
            refused += 1
    assert refused > 10


def test_records_that_name_what_is_not_there_are_refused(monkeypatch):
    def with_a_wrong_loop(encoded):
        archive = read_brep_archive(encoded)
        return replace(archive, faces=(replace(archive.faces[0], loops=(99,)), *archive.faces[1:]))

    monkeypatch.setattr(shapes, "read_brep_archive", with_a_wrong_loop)
    with pytest.raises(Unreadable, match="does not have"):
        brep_shape(make.can())


def test_parts_that_are_missing_or_out_of_order_make_a_brep_unreadable(monkeypatch):
    brep = make.can()
    for damage in (lambda _: None, lambda knots: knots[::-1], lambda knots: knots[:-1]):
        with monkeypatch.context() as patched:
            plain = shapes._padded
            patched.setattr(shapes, "_padded", lambda knots, n, p, d=damage, f=plain: f(d(knots), n, p))
            with pytest.raises(Unreadable):
                brep_shape(brep)


class PartsMissing:
    """A Brep in which one part is None, as rhino3dm gives what is damaged."""

    def __init__(self, brep, missing: str) -> None:
        self._brep, self._missing = brep, missing

    def __getattr__(self, name: str):
        parts = getattr(self._brep, name)
        return [None, *list(parts)[1:]] if name == self._missing else parts


@pytest.mark.parametrize("missing", ["Vertices", "Edges", "Faces"])
def test_a_part_that_rhino3dm_does_not_give_is_a_damaged_file(missing):
    with pytest.raises(Unreadable, match=r"missing|no NURBS form"):
        brep_shape(PartsMissing(make.can(), missing))


@pytest.mark.parametrize("function", ["fine_parameters", "curve_points", "_padded", "_check_indices"])
def test_an_error_of_this_package_is_not_called_a_damaged_file(monkeypatch, function):
    def wrong(*_args):
        raise TypeError("a fault of ours")

    monkeypatch.setattr(shapes, function, wrong)
    with pytest.raises(TypeError, match="a fault of ours"):
        brep_shape(make.can())
