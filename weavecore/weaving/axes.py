"""Rod axes: smooth curves through the joints, one layer apart where rods cross.

A rod that is held at its joints and free between them takes the shape of a cubic spline.  At a joint
the rods are shifted along the direction that is normal to all of them, so that the distance of
their axes is the shift.  The shifts tilt the rods, which brings them nearer again where they cross
at a sharp angle, or where one ends and its overhang is to pass the other.  So first the normals, and then the shifts,
are corrected by the splines that they lead to, in a few rounds; later rounds only near what has moved::

      ____o____    upper rod           n   common normal of the two rods at the joint
          |  n     distance d          d   shift: half of both diameters, and more where the gap would be less
      ----o----    lower rod

The common normal of the tangents t at a joint is the eigenvector of the least eigenvalue of Σ t tᵀ - ε s sᵀ, with s the
normal of the surface.  Source: splines through joints, de Boor 1978.  Linear in the visits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, ranges, rows_of, unit_vectors
from weavecore.geometry.eigenvectors import least_eigenvectors
from weavecore.geometry.splines import SplineRows, arc_stations, as_b_splines, fit_splines
from weavecore.model.joints import Joints
from weavecore.model.lattice import Lattice
from weavecore.model.rod_axes import RodAxes, extend_to_tips
from weavecore.model.strands import Strands
from weavecore.weaving.joint_gaps import gaps_at_joints
from weavecore.weaving.layers import layer_offsets

_SHIFT_ROUNDS = 5
"""Rounds of the shifts at most: they end once all gaps are within `_ENOUGH`."""

_VISITS_MOVED = 4
"""A change at a visit is felt along its rod: each visit further by 2 - √3 of the one before (de Boor 1978), so that
after so many the rest of a shift is below `_ENOUGH`."""

_TOWARDS_SURFACE = 0.02
"""Weight ε of the surface normal beside the tangents: it decides where rods run nearly parallel."""

_MOST_SHIFT = 1.6
"""Layers are no more than this many mean diameters of their rods apart; rods that still cut into each other are
reported as clashes."""

_ENOUGH = 0.005
"""Gaps are right when they are within this part of a diameter."""

OVERHANG_DIAMETERS = 10.0
"""A cable tie within five diameters of the end of a rod slips off; twice that leaves room to trim."""

_MOST_OF_EDGE = 0.4
"""An overhang is no longer than this part of the edge beside it, so that it ends before the next rods."""

_STEP = 0.25
"""Arc length is summed in steps of this part of an edge."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Splines through the joints, before anything is drawn of them.

    Parameters
    ----------
    points : (M, 3) float64
        Of the axes at the visits.
    rows : SplineRows
        Through the points.
    layer_offsets : (M,) float64
        Distance of the points from the surface, along the normals.
    normals : (N, 3) float64
        Unit normal at each node, common to the rods that pass it.
    shift_ratios : (C,) float64
        Shift at each contact of the joints over the mean diameter of its two rods.
    """

    points: Floats
    rows: SplineRows
    layer_offsets: Floats
    normals: Floats
    shift_ratios: Floats


def fit_axes(
    lattice: Lattice,
    strands: Strands,
    joints: Joints,
    diameters: Floats,
    outward: Floats,
    *,
    centred_on_rings: bool,
    counts_overhangs: Bools,
    start: tuple[Floats, Floats],
    changed: Optional[Bools] = None,
) -> Fit:
    """Fit the axes of the rods, which `draw_axes` makes `RodAxes` of.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    joints : Joints
    diameters : (S,) float64
        Of the rods.
    centred_on_rings : bool
        Whether a ring stays on the surface, with the others below and above it; else all layers of a
        joint lie evenly about it.
    outward : (N, 3) float64
        From `surface_normals`.
    counts_overhangs : (C,) bool
        At which contacts of the joints the overhangs of rods that end there must pass the other rod too.
    start : tuple
        Shift ratios (C,) and normals (N, 3) to begin with: of a fit of like rods, or 1 and `normals_of_rods`.
    changed : (N,) bool, optional
        Nodes at which rods differ from those of ``start``; they are of the same diameters.  By default all.

    Returns
    -------
    Fit
    """
    apart = diameters[joints.strand[joints.contacts]].mean(axis=1)
    shifts, normals = start[0] * apart, start[1]
    offsets = layer_offsets(joints, strands, shifts, centred_on_rings=centred_on_rings)
    near = np.ones(lattice.n_nodes, bool) if changed is None else nodes_around(strands, changed, _VISITS_MOVED)
    axes = _Axes(lattice.nodes, strands, offsets, normals)
    axes.turn_normals(near, outward)
    gaps, node = apart.copy(), joints.node[joints.joint[joints.contacts[:, 0]]]
    for _ in range(_SHIFT_ROUNDS):
        measured = np.flatnonzero(near[node])
        gaps[measured] = gaps_at_joints(axes.points, axes.rows, strands, joints, apart, counts_overhangs, measured)
        wrong = np.zeros(len(gaps), bool)
        wrong[measured] = np.abs(gaps[measured] / apart[measured] - 1.0) > _ENOUGH
        # Shifts that are at their bounds stay there.
        wanted = np.clip(shifts * apart / np.maximum(gaps, apart / 2.0), apart, _MOST_SHIFT * apart)
        moved = wrong & (wanted != shifts)
        if not moved.any():
            break
        shifts = np.where(moved, wanted, shifts)
        near = np.zeros(lattice.n_nodes, bool)
        near[node[moved]] = True
        axes.shift(near, layer_offsets(joints, strands, shifts, centred_on_rings=centred_on_rings))
        near = nodes_around(strands, near, _VISITS_MOVED)
        axes.turn_normals(near, outward)
    return Fit(axes.points, axes.rows, axes.offsets, axes.normals, shifts / apart)


def refit_axes(
    lattice: Lattice, strands: Strands, joints: Joints, diameters: Floats, *, layer_offsets: Floats, normals: Floats
) -> Fit:
    """Fit the axes of rods whose nodes have moved a little, in the layers in which they lie.

    Parameters
    ----------
    lattice, strands, joints, diameters
        As of `fit_axes`.
    layer_offsets : (M,) float64
        Of the axes before.
    normals : (N, 3) float64
        Of the axes before.

    Returns
    -------
    Fit
        Shifts are as before, with the room for overhangs where they have it.
    """
    axes = _Axes(lattice.nodes, strands, layer_offsets, normals)
    axes.turn_normals(np.ones(lattice.n_nodes, bool), surface_normals(lattice))
    lower, upper = joints.visit[joints.contacts].reshape(-1, 2).T
    apart = diameters[joints.strand[joints.contacts]].mean(axis=1)
    return Fit(
        axes.points, axes.rows, layer_offsets, axes.normals, (layer_offsets[upper] - layer_offsets[lower]) / apart
    )


def nodes_around(strands: Strands, nodes: Bools, visits: int) -> Bools:
    """The given nodes (N,), and those that a rod through one of them passes up to so many visits before or after it.

    Parameters
    ----------
    strands : Strands
    nodes : (N,) bool
    visits : int
    """
    # The last entry stands for what is beyond the ends of open rods.
    felt = np.append(nodes[strands.nodes], False)
    for _ in range(visits):
        felt[:-1] |= felt[strands.following] | felt[strands.preceding]
    found = nodes.copy()
    found[strands.nodes[felt[:-1]]] = True
    return found


class _Axes:
    """Rods in their layers: points of the visits, the splines through them, and normals at the nodes.

    All are renewed near what has changed, splines from one end of a rod to the other.
    """

    def __init__(self, nodes: Floats, strands: Strands, offsets: Floats, normals: Floats) -> None:
        self._nodes, self._strands = nodes, strands
        self.offsets, self.normals = offsets, normals.copy()
        self.points = nodes[strands.nodes] + offsets[:, None] * normals[strands.nodes]
        self.rows = fit_splines(self.points, strands.offsets, strands.closed)

    def shift(self, near: Bools, offsets: Floats) -> None:
        """Move the rods to other layers (M,) at some nodes (N,)."""
        self.offsets = offsets
        self._place(np.flatnonzero(near[self._strands.nodes]))

    def turn_normals(self, near: Bools, outward: Floats) -> None:
        """Make the normals of some nodes (N,) common to the rods as they run there."""
        visits, renewed = np.flatnonzero(near[self._strands.nodes]), np.flatnonzero(near)
        index = np.cumsum(near) - 1
        at = index[self._strands.nodes[visits]]
        self.normals[renewed] = _common_normals(self.rows.derivatives[visits], at, outward[renewed])
        self._place(visits)

    def _place(self, visits: Ints) -> None:
        """Renew the points of some visits, and the splines of their rods."""
        strands = self._strands
        node = strands.nodes[visits]
        self.points[visits] = self._nodes[node] + self.offsets[visits, None] * self.normals[node]
        moved = np.zeros(len(strands), bool)
        moved[strands.owner[visits]] = True
        rods, sizes = np.flatnonzero(moved), np.diff(strands.offsets)
        at = ranges(strands.offsets[rods], sizes[rods])
        renewed = fit_splines(self.points[at], offsets_of(sizes[rods]), strands.closed[rods])
        self.rows.derivatives[at], self.rows.parameters[at] = renewed.derivatives, renewed.parameters
        self.rows.ends[rods] = renewed.ends


def draw_axes(lattice: Lattice, strands: Strands, fit: Fit, overhangs: Floats) -> RodAxes:
    """The axes of a fit, with overhangs, B-splines and arc lengths.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    fit : Fit
    overhangs : (S, 2) float64
        How far rods run on straight beyond their outermost ties; 0 of rings.

    Returns
    -------
    RodAxes
    """
    rows, offsets, closed = fit.rows, strands.offsets, strands.closed
    tipped = extend_to_tips(fit.points, rows, offsets, closed, overhangs)
    drawn = as_b_splines(
        SplineRows(tipped.derivatives, tipped.parameters, tipped.ends), tipped.points, tipped.offsets, closed
    )
    step = _STEP * min(lattice.edge_length, lattice.latitudes.spacing)
    stations, lengths = arc_stations(
        tipped.points, tipped.derivatives, tipped.parameters, tipped.offsets, closed, tipped.ends, step=step
    )
    return RodAxes(
        offsets=offsets,
        closed=closed,
        points=fit.points,
        derivatives=rows.derivatives,
        parameters=tipped.parameters[tipped.visits],
        ends=tipped.ends,
        overhangs=overhangs,
        knot_offsets=drawn.knot_offsets,
        knots=drawn.knots,
        control_offsets=drawn.control_offsets,
        controls=drawn.controls,
        stations=stations[tipped.visits],
        lengths=lengths,
        layer_offsets=fit.layer_offsets,
    )


def usual_overhangs(strands: Strands, fit: Fit, diameters: Floats) -> Floats:
    """How far rods run on beyond their outermost ties: `OVERHANG_DIAMETERS` where there is room, rings not at all.

    Parameters
    ----------
    strands : Strands
    fit : Fit
    diameters : (S,) float64

    Returns
    -------
    (S, 2) float64
        At the start and the end of each rod.
    """
    points, first, last = fit.points, strands.offsets[:-1], strands.offsets[1:] - 1
    ends = np.stack([points[first + 1] - points[first], points[last] - points[last - 1]], axis=1)
    room = _MOST_OF_EDGE * np.linalg.norm(ends, axis=2)
    longest = OVERHANG_DIAMETERS * diameters[:, None]
    overhangs: Floats = np.where(strands.closed[:, None], 0.0, np.minimum(room, longest))
    return overhangs


def _common_normals(tangents: Floats, nodes: Ints, outward: Floats) -> Floats:
    """Unit vectors (N, 3) most nearly normal to all tangents at each node, on the surface's outer side."""
    unit = np.ascontiguousarray(unit_vectors(tangents).T)
    form = np.empty((len(outward), 3, 3))
    for i in range(3):
        for j in range(i + 1):
            form[:, i, j] = np.bincount(nodes, unit[i] * unit[j], len(outward))
            form[:, i, j] -= _TOWARDS_SURFACE * outward[:, i] * outward[:, j]
            form[:, j, i] = form[:, i, j]
    normal = least_eigenvectors(form)
    facing = np.where((normal * outward).sum(1, keepdims=True) < 0, -1.0, 1.0)
    unit_normals: Floats = normal * facing
    return unit_normals


def normals_of_rods(lattice: Lattice, strands: Strands, outward: Floats) -> Floats:
    """Unit normals common to the rods that pass each node, for rods without thickness.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    outward : (N, 3) float64
        From `surface_normals`.

    Returns
    -------
    (N, 3) float64
    """
    rows = fit_splines(lattice.nodes[strands.nodes], strands.offsets, strands.closed)
    return _common_normals(rows.derivatives, strands.nodes, outward)


def surface_normals(lattice: Lattice) -> Floats:
    """Unit normals of a lattice at its nodes: the mean of the faces about each, weighted by area.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    (N, 3) float64
        Out of the surface; (0, 0, 1) at a node whose faces have no area.
    """
    after = next_in_loop(lattice.face_offsets)
    face = rows_of(lattice.face_offsets)
    corner, following = lattice.nodes[lattice.face_nodes], lattice.nodes[lattice.face_nodes[after]]
    origin = corner[lattice.face_offsets[:-1]][face]
    area = np.add.reduceat(np.cross(corner - origin, following - origin), lattice.face_offsets[:-1], axis=0)
    total = np.zeros((lattice.n_nodes, 3))
    np.add.at(total, lattice.face_nodes, area[face])
    size = np.linalg.norm(total, axis=1, keepdims=True)
    normals: Floats = np.divide(total, size, out=np.tile([0.0, 0.0, 1.0], (len(total), 1)), where=size > 0)
    return normals
