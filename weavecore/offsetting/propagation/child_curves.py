r"""The child of a front: chords between the ends of its rays, embedded in the mesh (Yan et al. 2016, §4.2).

Where free borders obstruct rays, a front has several children, one for each run of rays between two obstacles.  Where
two neighbouring steps diverge at a sharp feature, the chord between their ends may lead behind the feature and across
the parent.  There the child goes back along the one ray and forth along the other, inside what the step has swept, and
is taken out with all else that lies there (`child_filter.find_uncovered_loops`)::

     end ----- chord ----- end             end              end
      |                     |               |  back    forth ^
      |        /\           |               v______/\______|
    --+------ spike --------+-- parent    --+------ spike ----+-- parent
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, offsets_of, ranks_in_rows, rows_of
from weavecore.geometry.geodesics import place_along
from weavecore.offsetting.propagation.chords import embed_chords
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.intersections import find_intersections_with
from weavecore.offsetting.propagation.offset_vertices import ChildVertices, FrontRays
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves, next_along

_BACK = (0.8, 0.6, 0.4, 0.22, 0.06)
"""Parts of its step at which a child goes back along the first of two neighbouring rays."""

_FORTH = (0.05, 0.2, 0.41, 0.61, 0.81)
"""The same forth along the second; they differ, so that where both rays nearly coincide no vertices do."""


def embed_children(
    domain: Domain, rays: FrontRays, vertices: ChildVertices, parents: SurfaceCurves | None = None
) -> tuple[SurfaceCurves, Ints]:
    """The children of some fronts, before anything is reconnected.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
    vertices : ChildVertices
        The ends of the rays' steps.
    parents : SurfaceCurves, optional
        The fronts, where chords that cross them are to be led along the rays.

    Returns
    -------
    children : SurfaceCurves
    front : (C,) int64
        The front of each child.
    """
    runs = _find_runs(rays)
    front = rays.owner[runs.ray[runs.offsets[:-1]]]
    children = _connect_ends(domain, rays, vertices, runs, np.zeros(len(runs.ray), bool))
    if parents is None:
        return children, front
    crossing = find_intersections_with(domain, children, parents).first
    if len(crossing) == 0:
        return children, front
    diverges = np.zeros(len(runs.ray), bool)
    diverges[np.cumsum(children.is_vertex)[crossing] - 1] = True
    return _connect_ends(domain, rays, vertices, runs, diverges), front


@dataclass(frozen=True, eq=False)
class _RayRuns:
    """The rays whose ends make up each child: all of a front, or those between two obstacles.

    Parameters
    ----------
    offsets : (R+1,) int64
    closed : (R,) bool
    ray : (k,) int64
    """

    offsets: Ints
    closed: Bools
    ray: Ints


def _find_runs(rays: FrontRays) -> _RayRuns:
    """Runs of rays that are not obstructed; of closed fronts around their ends as well."""
    if not rays.is_obstructed.any() and rays.closed.all():
        return _RayRuns(rays.offsets, rays.closed, np.arange(len(rays)))
    counts = np.diff(rays.offsets)
    row = np.arange(len(rays))
    rank = row - rays.offsets[rays.owner]
    # Closed fronts are turned to begin behind an obstructed ray.
    shift = np.zeros(len(counts), np.int64)
    out = np.flatnonzero(rays.is_obstructed & rays.closed[rays.owner])
    shift[rays.owner[out]] = rank[out]
    order = np.lexsort(((rank - shift[rays.owner]) % np.maximum(counts, 1)[rays.owner], rays.owner))
    is_open = ~rays.closed
    is_open[rays.owner[out]] = True
    is_out = rays.is_obstructed[order]
    begins = is_out.copy()
    begins[1:] |= is_out[:-1]
    begins[rays.offsets[:-1][counts > 0]] = True
    ray, run = order[~is_out], np.cumsum(begins)[~is_out]
    if len(ray) == 0:
        return _RayRuns(np.zeros(1, np.int64), np.zeros(0, bool), ray)
    heads = np.flatnonzero(np.r_[True, run[1:] != run[:-1]])
    length = np.diff(np.append(heads, len(ray)))
    is_curve = length > 1
    kept = np.repeat(is_curve, length)
    return _RayRuns(offsets_of(length[is_curve]), ~is_open[rays.owner[ray[heads]]][is_curve], ray[kept])


def _connect_ends(
    domain: Domain, rays: FrontRays, vertices: ChildVertices, runs: _RayRuns, diverges: Bools
) -> SurfaceCurves:
    """The curves through the ends, by way of the rays where the chord to the next end (k,) is not embedded."""
    faces, weights = [vertices.face[runs.ray]], [vertices.weights[runs.ray]]
    if diverges.any():
        after = next_along(runs.offsets, runs.closed)
        for parts, at in ((_BACK, np.arange(len(runs.ray))), (_FORTH, after)):
            for part in parts:
                face, weight = place_along(rays.walks, part * vertices.far)
                faces.append(face[runs.ray[at]])
                weights.append(weight[runs.ray[at]])
    counts = np.where(diverges, len(faces), 1)
    offsets = offsets_of(counts)
    row, rank = rows_of(offsets), ranks_in_rows(counts)
    face, weight = np.stack(faces, axis=1)[row, rank], np.stack(weights, axis=1)[row, rank]
    run = rows_of(runs.offsets)
    per_run = np.bincount(run[row], minlength=len(runs.closed))
    onward = next_along(offsets_of(per_run), runs.closed)
    chord, face, start, end = embed_chords(domain, face, weight, face[onward], weight[onward])
    is_vertex = np.ones(len(chord), bool)
    is_vertex[1:] = chord[1:] != chord[:-1]
    return SurfaceCurves(
        offsets=offsets_of(np.bincount(run[row[chord]], minlength=len(runs.closed))),
        closed=runs.closed,
        face=face,
        start=start,
        end=end,
        is_vertex=is_vertex,
        is_corner=np.zeros(len(chord), bool),
        points=domain.points(face, start),
    )
