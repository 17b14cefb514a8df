"""Embedding a curve in a triangle mesh, so that it becomes a path of edges while the surface stays the same.

1.  `sampling`: the curve is simplified to the points that define its shape, and divided again to about the length of
the edges
   below it.
2.  `local_refinement`: where the mesh is too coarse for its bends, faces along it are bisected. 3.  `along_border`:
ends near a border are put on it; a curve along a border becomes a stretch of it. 4.  `path`: the points are put into
the mesh (`growing_mesh`) one after the other, and joined by straight legs that split the
   edges they cross.  What comes near a vertex goes through it, so that no slivers are left; kinks and ends stay in
   place.

Work: linear in the faces below the curve, apart from the search for these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.curve_embedding.along_border import curve_beside_border, stretch_of_border
from weavecore.geometry.curve_embedding.growing_mesh import GrowingMesh
from weavecore.geometry.curve_embedding.local_refinement import refine_along
from weavecore.geometry.curve_embedding.path import PathDrawing
from weavecore.geometry.curve_embedding.sampling import CurveOnMesh, curve_on_mesh, segments_of
from weavecore.geometry.halfedges import check_manifold_vertices, find_twins

_FINE, _ROUGH = (0.02, 2e-6), (0.1, 0.1)
"""Of the edges below a curve: the accuracy of its shape, and the accuracy where it comes back to itself.  The rough
pair is tried if the fine one fails: a line drawn with a trembling hand crosses itself at a fine scale."""

_MAX_EDGE_PER_STEP = 2.5
"""Steps between two points of a curve that an edge below it may be long; more could not follow its bends."""

_MIN_EDGE = 1e-4  # of the edges below the curve: no shorter ones are made for its sake
_MAX_DEVIATION = 0.3  # of the edges below the curve


@dataclass(frozen=True, eq=False)
class Embedding:
    """A mesh with a curve in it.

    Parameters
    ----------
    vertices : (V', 3) float64
        The old vertices first, bit for bit.
    faces : (F', 3) int64
        Of the same surface.
    path : (k,) int64
        Vertices along the curve, an edge between each and the next; the first of a closed one is not repeated.
        Along a border the surface is on its left.
    is_closed : bool
    deviation : float
        Greatest distance of the path from the place of the curve on the surface.
    """

    vertices: Floats
    faces: Ints
    path: Ints
    is_closed: bool
    deviation: float


def embed_curve(
    vertices: Floats, faces: Ints, curve: Floats, *, tolerance: float = 0.0, fixed: Ints | None = None
) -> Embedding:
    """Embed a curve that lies on or near a mesh.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Manifold and consistently oriented.
    curve : (n, 3) float64
        Points along it; a closed one comes back to its first.
    tolerance : float
        The model's: ends that are no further from a border than this are put on it, as are those within a tenth of
        the edges there.
    fixed : (m, 2) int64, optional
        Edges of other paths, which are not split and not crossed.

    Returns
    -------
    Embedding
        A curve that runs along a border becomes that stretch of its edges, split at both ends; of one that does not,
        only the ends may lie on a border.

    Raises
    ------
    BadCurve
        If it lies too far off, crosses or touches itself, another path or a border, runs along a border in part, or is
        too short.
    NonFinite, TooMuchWork
    """
    points = np.asarray(curve, np.float64)
    kept = np.zeros((0, 2), np.int64) if fixed is None else fixed
    try:
        return _embed(vertices, faces, points, tolerance, kept, *_FINE)
    except BadCurve:
        return _embed(vertices, faces, points, tolerance, kept, *_ROUGH)


def _embed(
    vertices: Floats, faces: Ints, curve: Floats, tolerance: float, kept: Ints, slack: float, least: float
) -> Embedding:
    """Embed a curve that is simplified to one accuracy; see `embed_curve`."""
    sampled = curve_on_mesh(vertices, faces, curve, tolerance=tolerance, slack=slack, least=least)
    twins = find_twins(faces, len(vertices))
    beside = curve_beside_border(vertices, faces, twins, sampled, tolerance)
    if beside is None:
        inner, on_border = sampled, np.zeros(len(sampled.places), bool)
    elif beside.runs_along:
        mesh = GrowingMesh(vertices, faces, twins)
        path, is_whole = stretch_of_border(mesh, beside.border, sampled.is_closed, kept)
        return _checked(mesh, path, is_whole, sampled)
    else:
        beside.refuse_in_part()
        inner, on_border = beside.with_ends_on_border()
    mesh, path = _draw_across(vertices, faces, inner, on_border, kept)
    return _checked(mesh, path, sampled.is_closed, sampled)


def _draw_across(
    vertices: Floats, faces: Ints, curve: CurveOnMesh, on_border: Bools, fixed: Ints
) -> tuple[GrowingMesh, Ints]:
    """Draw a curve inside the surface; the mesh with it, and the path."""
    start, end = segments_of(curve.places, curve.is_closed)
    step = np.linalg.norm(end - start, axis=1)
    wider = np.maximum(step, np.roll(step, 1)) if curve.is_closed else np.maximum(np.r_[step, 0], np.r_[0, step])
    longest = np.maximum(_MAX_EDGE_PER_STEP * wider, _MIN_EDGE * curve.edge)
    vertices, faces, twins, below = refine_along(vertices, faces, curve.places, curve.face, longest, fixed)
    mesh = GrowingMesh(vertices, faces, twins)
    path = PathDrawing(mesh, fixed).draw(
        curve.places, below, is_exact=curve.is_exact, room=curve.room, on_border=on_border, is_closed=curve.is_closed
    )
    return mesh, path


def _checked(mesh: GrowingMesh, path: Ints, is_closed: bool, sampled: CurveOnMesh) -> Embedding:
    """The mesh and the path, if they are valid.

    Raises
    ------
    NonManifold
    BadCurve
        Where the path has become too short to be one, or is not where the curve is.
    """
    vertices, faces = mesh.vertices.copy(), mesh.faces.copy()
    check_manifold_vertices(faces, find_twins(faces, len(vertices)), len(vertices))
    if len(path) < (3 if is_closed else 2):
        raise BadCurve("A curve shorter than the edges of the mesh", remedy="Give a longer one.")
    deviation = _distance_from(sampled.places, vertices[path], is_closed)
    back = _distance_from(vertices[path], sampled.places, sampled.is_closed)
    most = float(max(deviation.max(), back.max()))
    if (deviation > _MAX_DEVIATION * sampled.edge).any() or back.max() > sampled.edge.max():
        raise BadCurve(
            f"The path on the mesh departs from the curve by {most:.4g}",
            remedy="Pull it onto the surface, or give a finer mesh.",
        )
    return Embedding(vertices, faces, path, is_closed, most)


def _distance_from(points: Floats, line: Floats, is_closed: bool) -> Floats:
    """Distance of points from a line through others."""
    start = np.arange(len(line) if is_closed else len(line) - 1)
    after = (start + 1) % len(line)
    nearest = closest_faces(points, line, np.stack([start, after, after], axis=1))[1]
    distance: Floats = np.linalg.norm(points - nearest, axis=1)
    return distance
