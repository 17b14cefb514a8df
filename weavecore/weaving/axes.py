"""Rod axes: smooth curves through the joints, one layer apart where rods cross.

A rod that is held at its joints and free between them takes the shape of a cubic spline.  At a joint
the rods are shifted along the direction that is normal to all of them, so that the distance of
their axes is the shift.  As the shift tilts the rods, a few rounds settle it.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.splines import fit_splines, sample_curves
from weavecore.model.lattice import Lattice
from weavecore.model.rod_axes import RodAxes
from weavecore.model.strands import Strands

_ROUNDS = 4
_TOWARDS_SURFACE = 0.02
"""How much the normal of the surface counts beside the rods: it decides where these run nearly alongside."""

_STEP = 0.25
"""Arc length is summed in steps of this part of an edge."""


def lay_axes(lattice: Lattice, strands: Strands, offsets: Floats) -> tuple[RodAxes, Floats]:
    """Fit the axes of rods shifted by ``offsets`` (M,), and give the normals (N, 3) they were shifted along."""
    outward = surface_normals(lattice)
    normals = outward
    nodes = strands.nodes
    for _ in range(_ROUNDS):
        points = lattice.nodes[nodes] + offsets[:, None] * normals[nodes]
        rows = fit_splines(points, strands.offsets, strands.closed)
        normals = _common_normals(rows.derivatives, nodes, outward)
    points = lattice.nodes[nodes] + offsets[:, None] * normals[nodes]
    rows = fit_splines(points, strands.offsets, strands.closed)
    step = _STEP * min(lattice.edge_length, lattice.latitudes.spacing)
    samples = sample_curves(
        points, rows.derivatives, rows.parameters, strands.offsets, strands.closed, rows.ends, step=step
    )
    axes = RodAxes(
        offsets=strands.offsets,
        closed=strands.closed,
        points=points,
        derivatives=rows.derivatives,
        parameters=rows.parameters,
        ends=rows.ends,
        knot_offsets=rows.knot_offsets,
        knots=rows.knots,
        control_offsets=rows.control_offsets,
        controls=rows.controls,
        stations=samples.stations[samples.is_given],
        lengths=samples.stations[samples.offsets[1:] - 1],
        layer_offsets=offsets,
    )
    return axes, normals


def _common_normals(tangents: Floats, nodes: Ints, outward: Floats) -> Floats:
    """Unit vectors (N, 3) most nearly normal to all tangents at each node, on the surface's outer side."""
    unit = tangents / np.maximum(np.linalg.norm(tangents, axis=1, keepdims=True), np.finfo(float).tiny)
    form = np.zeros((len(outward), 3, 3))
    np.add.at(form, nodes, unit[:, :, None] * unit[:, None, :])
    form -= _TOWARDS_SURFACE * outward[:, :, None] * outward[:, None, :]
    normal = np.linalg.eigh(form)[1][:, :, 0]
    facing = np.where((normal * outward).sum(1, keepdims=True) < 0, -1.0, 1.0)
    unit_normals: Floats = normal * facing
    return unit_normals


def surface_normals(lattice: Lattice) -> Floats:
    """(N, 3) unit normal of the lattice at each node, out of the surface: the mean of its faces, by area."""
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
