"""Creases inside a trimmed face run up to the trims."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import rhino_shapes as make
from weavecore.errors import WeaveError
from weavecore.geometry.halfedges import border_loops, check_manifold_vertices, find_twins
from weavecore.geometry.lawson_flips import least_angles
from weavecore.geometry.nurbs import NurbsCurve, surface_points
from weavecore.reading.nurbs_mesher.brep_mesh import mesh_brep
from weavecore.reading.nurbs_mesher.brep_shape import BrepShape, FaceShape, TrimCurve, brep_shape
from weavecore.reading.nurbs_mesher.objects import as_brep

r = pytest.importorskip("rhino3dm")

TURNS = np.linspace(0.0, 2 * np.pi, 721)


def shallow() -> Any:
    """Two flat strips that meet in a fold of 14 degrees at x = 1: less than what counts as a corner of an edge."""
    low = make.polyline((0, 0, 0), (1, 0, 0), (2, 0, 0.25)).ToNurbsCurve()
    high = make.polyline((0, 2, 0), (1, 2, 0), (2, 2, 0.25)).ToNurbsCurve()
    return r.NurbsSurface.CreateRuledSurface(low, high)


def folded_with_round_trim(turn: float, against: bool) -> BrepShape:
    """That surface, trimmed by an oval in its parameters; rhino3dm cannot make one."""
    whole = brep_shape(as_brep(shallow()))
    (face,) = whole.faces
    low, high = (np.array([face.surface.domain(way)[end] for way in (0, 1)]) for end in (0, 1))
    folds = np.unique(face.surface.knots[0])[1:-1]
    across = np.arccos((folds - (low + high)[0] / 2) / (0.42 * (high - low)[0]))
    # The edge has a corner on each fold, as it has where a program cuts the surface exactly.
    turns = np.unique(np.concatenate([TURNS, *((sign * across - turn) % (2 * np.pi) for sign in (1, -1))]))
    around = np.column_stack([np.cos(turns + turn), np.sin(turns + turn)])
    around[-1] = around[0]
    uv = (low + high) / 2 + 0.42 * (high - low) * around
    places = surface_points(face.surface, uv[::-1] if against else uv)
    knots = np.concatenate([[0.0], np.arange(len(places)), [len(places) - 1.0]])
    edge = NurbsCurve(1, knots, np.column_stack([places, np.ones(len(places))]))
    trim = TrimCurve(0, against, (0, 0), uv)
    oval = FaceShape(face.surface, face.is_reversed, ((trim,),))
    return BrepShape(places[:1], (edge,), np.array([[0, 0]]), np.array([1]), (oval,))


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.9])
@pytest.mark.parametrize("against", [False, True])
def test_no_triangle_cuts_across_a_fold_at_the_border(turn, against):
    mesh = mesh_brep(folded_with_round_trim(turn, against))
    x, _, z = mesh.vertices[mesh.faces].mean(1).T
    assert np.abs(z - 0.25 * np.maximum(x - 1, 0)).max() <= 1e-9


def test_a_trim_without_length_is_refused_as_damaged():
    shape = folded_with_round_trim(0.0, against=False)
    (trim,) = shape.faces[0].loops[0]
    point = replace(trim, uv=np.tile(trim.uv[:1], (len(trim.uv), 1)))
    with pytest.raises(WeaveError):
        mesh_brep(replace(shape, faces=(replace(shape.faces[0], loops=((point,),)),)))


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.9])
def test_the_mesh_stays_whole_and_well_shaped(turn):
    mesh = mesh_brep(folded_with_round_trim(turn, against=False))
    twins = find_twins(mesh.faces, len(mesh.vertices))
    check_manifold_vertices(mesh.faces, twins, len(mesh.vertices))
    assert len(border_loops(mesh.faces, twins)) == 1
    assert np.median(least_angles(mesh.vertices, mesh.faces)) >= 45
