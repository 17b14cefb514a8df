"""Laying the children on the mesh: curves of chords between the ends of the steps (Yan et al. 2016, §4.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, offsets_of, rows_of
from weavecore.geometry.geodesics import place_along
from weavecore.offsetting.propagation.chords import lay_chords
from weavecore.offsetting.propagation.curves import Curves, Ground, next_along
from weavecore.offsetting.propagation.intersections import curves_meet
from weavecore.offsetting.propagation.steps import Ends, Rays

_BACK = (0.8, 0.6, 0.4, 0.22, 0.06)
_FORTH = (0.05, 0.2, 0.41, 0.61, 0.81)
"""Parts of two neighbouring steps by which a child goes back along the one and forth along the other."""


@dataclass(frozen=True, eq=False)
class Runs:
    """The rays whose ends make up each child: all of a front, or those between two selvedges that are in the way.

    Parameters
    ----------
    offsets : (R+1,) int64
    closed : (R,) bool
    ray : (k,) int64
    """

    offsets: Ints
    closed: Bools
    ray: Ints


def find_runs(rays: Rays) -> Runs:
    """The children that each front will have before anything is regrouped."""
    if not rays.is_out.any() and rays.closed.all():
        return Runs(rays.offsets, rays.closed, np.arange(len(rays)))
    counts = np.diff(rays.offsets)
    row = np.arange(len(rays))
    rank = row - rays.offsets[rays.owner]
    # Closed fronts are turned until they begin behind a place where a selvedge is in the way.
    shift = np.zeros(len(counts), np.int64)
    out = np.flatnonzero(rays.is_out & rays.closed[rays.owner])
    shift[rays.owner[out]] = rank[out]
    order = np.lexsort(((rank - shift[rays.owner]) % np.maximum(counts, 1)[rays.owner], rays.owner))
    is_open = ~rays.closed
    is_open[rays.owner[out]] = True
    ray, begins = order[~rays.is_out[order]], np.zeros(len(rays), bool)
    begins[1:] = rays.is_out[order[:-1]]
    begins[rays.offsets[:-1][counts > 0]] = True
    run = np.cumsum(begins | rays.is_out[order])[~rays.is_out[order]]
    if len(ray) == 0:
        return Runs(np.zeros(1, np.int64), np.zeros(0, bool), ray)
    heads = np.flatnonzero(np.r_[True, run[1:] != run[:-1]])
    length = np.diff(np.append(heads, len(ray)))
    enough = length > 1
    kept = np.repeat(enough, length)
    return Runs(offsets_of(length[enough]), ~is_open[rays.owner[ray[heads]]][enough], ray[kept])


def lay_children(ground: Ground, rays: Rays, ends: Ends, parents: Curves | None = None) -> tuple[Curves, Ints]:
    """The curves through the ends of the rays of each front, before anything is taken out, and the front of each.

    Where two neighbours part at a sharp feature of the surface, the chord between their ends may lead behind
    the feature and across the parent.  There the child goes back along one ray and forth along the other,
    inside what the step has covered: what is too much is taken out with all else that lies there.
    """
    runs = find_runs(rays)
    front = rays.owner[runs.ray[runs.offsets[:-1]]]
    children = _through(ground, rays, ends, runs, np.zeros(len(runs.ray), bool))
    if parents is None:
        return children, front
    crossing = curves_meet(ground, children, parents).first
    if len(crossing) == 0:
        return children, front
    lost = np.zeros(len(runs.ray), bool)
    lost[np.cumsum(children.is_vertex)[crossing] - 1] = True
    return _through(ground, rays, ends, runs, lost), front


def _through(ground: Ground, rays: Rays, ends: Ends, runs: Runs, lost: Bools) -> Curves:
    """The curves through the ends, by way of the places along the rays where a chord is lost."""
    faces, weights = [ends.face[runs.ray]], [ends.weights[runs.ray]]
    if lost.any():
        after = next_along(runs.offsets, runs.closed)
        for parts, at in ((_BACK, np.arange(len(runs.ray))), (_FORTH, after)):
            for part in parts:
                face, weight = place_along(rays.walks, part * ends.far)
                faces.append(face[runs.ray[at]])
                weights.append(weight[runs.ray[at]])
    counts = np.where(lost, len(faces), 1)
    offsets = offsets_of(counts)
    row = rows_of(offsets)
    rank = np.arange(len(row)) - offsets[row]
    face, weight = np.stack(faces, axis=1)[row, rank], np.stack(weights, axis=1)[row, rank]
    run = rows_of(runs.offsets)
    per_run = np.bincount(run[row], minlength=len(runs.closed))
    onward = next_along(offsets_of(per_run), runs.closed)
    chord, at, start, end = lay_chords(ground, face, weight, face[onward], weight[onward])
    is_vertex = np.ones(len(chord), bool)
    is_vertex[1:] = chord[1:] != chord[:-1]
    counts = np.bincount(run[row[chord]], minlength=len(runs.closed))
    is_corner = np.zeros(len(chord), bool)
    return Curves(offsets_of(counts), runs.closed, at, start, end, is_vertex, is_corner, ground.points(at, start))
