r"""Nodes on the cut locus (the medial axis of the origins), where two fronts meet inside an edge.

On such an edge the distance rises from both ends to a peak::

      distance     .  peak = d_a + rise · share             With the slopes at both ends, times the edge's length,
                 /   \                                         share = (d_b + fall − d_a) / (rise + fall)
         rise  /       \  fall
        d_a  a           b  d_b

Where a level passes between the ends and the peak, linear interpolation along the edge does not see it, and the level
falls into islets along the cut locus.  So the edge gets a node at its peak, and the faces beside it are split.

Work: linear in the edges.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, blocks
from weavecore.geometry.bisection import NOT_SPLIT, split_edges
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.offsetting.isolines.crossings import KINK, slope_along
from weavecore.offsetting.isolines.cut_mesh import CutMesh
from weavecore.offsetting.spacing import LevelSchedule

_MIN_SHARE = 0.01
"""Of an edge: a peak nearer to an end than this is represented by that end."""


def insert_cut_locus(mesh: CutMesh, edge_lengths: Floats, *, schedule: LevelSchedule) -> CutMesh:
    """Insert a node wherever an edge has a peak less than its length beyond a level.

    Parameters
    ----------
    mesh : CutMesh
    edge_lengths : (3F,) float64
        Length of every halfedge of the faces.
    schedule : LevelSchedule

    Returns
    -------
    CutMesh
        The mesh itself where there is no such edge.
    """
    halfedge, share, peak = _find_cut_locus(mesh, edge_lengths, schedule)
    if len(halfedge) == 0:
        return mesh
    a, b = mesh.tail[halfedge], mesh.head[halfedge]
    points = np.concatenate([mesh.points, mesh.points[a] + (mesh.points[b] - mesh.points[a]) * share[:, None]])
    middle = np.full(len(mesh.tail), NOT_SPLIT, np.int64)
    middle[halfedge] = middle[mesh.opposite[halfedge]] = mesh.n_nodes + np.arange(len(halfedge))
    faces, part_of, twins = split_edges(points, mesh.faces, mesh.twins, middle[: len(mesh.twins)])
    ridge_slope = 0.5 * np.linalg.norm(mesh.gradient[a] + mesh.gradient[b], axis=1)
    return replace(
        mesh,
        points=points,
        faces=faces,
        twins=twins,
        distance=np.concatenate([mesh.distance, peak]),
        gradient=np.concatenate([mesh.gradient, np.zeros((len(peak), 3))]),
        face_of=part_of,
        edge_of=np.concatenate([mesh.edge_of, np.stack([a, b], axis=1)]),
        share=np.concatenate([mesh.share, share]),
        ridge_slope=np.concatenate([mesh.ridge_slope, ridge_slope]),
    )


def _find_cut_locus(mesh: CutMesh, edge_lengths: Floats, schedule: LevelSchedule) -> tuple[Ints, Floats, Floats]:
    """Halfedges with a peak near a level, the part of them at which it lies, and its distance."""
    found = [_peaks_on(mesh.edges[k], mesh, edge_lengths, schedule) for k in blocks(len(mesh.edges))]
    halfedge, share, peak = (np.concatenate(parts) for parts in zip(*found))
    return halfedge, share, peak


def _peaks_on(h: Ints, mesh: CutMesh, edge_lengths: Floats, schedule: LevelSchedule) -> tuple[Ints, Floats, Floats]:
    h = h[(mesh.twins[h] != NO_TWIN) | (mesh.distance[mesh.tail[h]] != 0) | (mesh.distance[mesh.head[h]] != 0)]
    a, b = mesh.tail[h], mesh.head[h]
    higher = np.maximum(mesh.distance[a], mesh.distance[b])
    # The slope of a distance is at most 1: this bounds the peak.
    most = 0.5 * (mesh.distance[a] + mesh.distance[b] + edge_lengths[h])
    h = h[_level_at(most, schedule) > higher - edge_lengths[h]]
    h = h[_rises_from_both_ends(mesh, h)]
    a, b = mesh.tail[h], mesh.head[h]
    along, normal = mesh.points[b] - mesh.points[a], mesh.edge_normals(h)
    rise, is_rise = slope_along(mesh.gradient[a], along, normal)
    fall, is_fall = slope_along(-mesh.gradient[b], along, normal)
    is_ridge = is_rise & is_fall & (rise + fall > KINK * edge_lengths[h])
    h, a, b, rise, fall = h[is_ridge], a[is_ridge], b[is_ridge], rise[is_ridge], fall[is_ridge]
    share = (mesh.distance[b] + fall - mesh.distance[a]) / (rise + fall)
    peak = mesh.distance[a] + rise * share
    level = _level_at(peak, schedule)
    is_near = (level > 0) & (peak - level < edge_lengths[h]) & (share > _MIN_SHARE) & (share < 1 - _MIN_SHARE)
    return h[is_near], share[is_near], peak[is_near]


def _rises_from_both_ends(mesh: CutMesh, h: Ints) -> Bools:
    a, b = mesh.tail[h], mesh.head[h]
    along = mesh.points[b] - mesh.points[a]
    rise = np.einsum("ij,ij->i", mesh.gradient[a], along)
    fall = -np.einsum("ij,ij->i", mesh.gradient[b], along)
    return np.asarray((rise > 0) & (fall > 0))


def _level_at(distance: Floats, schedule: LevelSchedule) -> Floats:
    """The highest level at or below each distance."""
    return schedule.distance_of(schedule.levels_below(distance).astype(np.float64))
