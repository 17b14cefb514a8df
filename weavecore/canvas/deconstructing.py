"""*Deconstruct Lattice* and *Deconstruct Weave*: what a result holds, in trees whose branches match::

lattice {family}        edges, and the nodes at their starts and ends; latitudinal, longitudinal, pocket
        {face}          nodes around each face
weave   {family}        rods, names, diameters, lengths; in the order L, A, B, P
        {family; place} joints and stations along each rod
        {joint}         names of the rods that cross there, from the innermost to the outermost
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from weavecore.canvas.results import family_branches, places_in_branches
from weavecore.canvas.simulating import unit_of
from weavecore.canvas.solve import Run
from weavecore.canvas.trees import grouped
from weavecore.geometry.polygon_mesh import nodes_on_border
from weavecore.model import Lattice, Weave
from weavecore.model.lattice import node_generations
from weavecore.model.springs import springs_of
from weavecore.polling import each
from weavecore.units import METRES


class LatticeParts(NamedTuple):
    """Nodes with their generations, edges by family, faces, and the nodes on borders."""

    nodes: list[Any]
    generation: list[float]
    edges: Any
    starts: Any
    ends: Any
    faces: Any
    border: list[int]
    supports: list[Any]


class WeaveParts(NamedTuple):
    """Rods by family, their joints, which rod lies over which, and the weave as lines for other programs."""

    rods: Any
    names: Any
    diameters: Any
    lengths: Any
    along: Any
    stations: Any
    joints: list[Any]
    normals: list[Any]
    order: Any
    supports: list[Any]
    lines: Any
    rest: Any
    ties: list[Any]


def draw_lattice_parts(run: Run, lattice: Lattice) -> LatticeParts:
    """Take a lattice apart.

    Parameters
    ----------
    run : Run
    lattice : Lattice

    Returns
    -------
    LatticeParts
    """
    run.progress(0.0, "drawing")
    family, edges = lattice.edge_family.tolist(), lattice.edges
    lines = run.drawing.lines(lattice.nodes[edges[:, 0]], lattice.nodes[edges[:, 1]])
    ends, corners = lattice.face_offsets.tolist(), lattice.face_nodes.tolist()
    border = np.flatnonzero(nodes_on_border(lattice.face_offsets, lattice.face_nodes, lattice.n_nodes))
    return LatticeParts(
        nodes=list(run.drawing.points(lattice.nodes)),
        generation=node_generations(lattice).tolist(),
        edges=run.tree(grouped(family, lines)),
        starts=run.tree(grouped(family, edges[:, 0].tolist())),
        ends=run.tree(grouped(family, edges[:, 1].tolist())),
        faces=run.tree(((f,), corners[ends[f] : ends[f + 1]]) for f in range(lattice.n_faces)),
        border=border.tolist(),
        supports=list(run.drawing.points(lattice.nodes[border])),
    )


def draw_weave_parts(run: Run, weave: Weave) -> WeaveParts:
    """Take a weave apart.

    Parameters
    ----------
    run : Run
    weave : Weave

    Returns
    -------
    WeaveParts
    """
    run.progress(0.0, "drawing")
    lattice, axes, joints = weave.lattice, weave.axes, weave.joints
    branch = family_branches(weave)
    paths = list(zip(branch, places_in_branches(branch).tolist()))
    joint_of_visit = np.full(len(weave.strands.nodes), -1, np.int64)
    joint_of_visit[joints.visit] = joints.joint
    along, stations = [], []
    for s, path in each(sorted(enumerate(paths), key=lambda part: part[1])):
        visits = np.arange(weave.strands.offsets[s], weave.strands.offsets[s + 1])
        visits = visits[joint_of_visit[visits] >= 0]
        along.append((path, joint_of_visit[visits].tolist()))
        stations.append((path, axes.stations[visits].tolist()))
    order = grouped(joints.joint.tolist(), [weave.ids[s] for s in joints.strand.tolist()])
    is_border = nodes_on_border(lattice.face_offsets, lattice.face_nodes, lattice.n_nodes)[joints.node]
    unit = unit_of(run, weave) or lattice.latitudes.surface.unit
    springs = springs_of(weave, metres=METRES.get(unit, 1.0))
    rod = springs.rod.tolist()
    curves = [run.drawing.spline(*axes.bspline(s)) for s in range(len(weave))]
    return WeaveParts(
        rods=run.tree(grouped(branch, curves)),
        names=run.tree(grouped(branch, weave.ids)),
        diameters=run.tree(grouped(branch, weave.diameters.tolist())),
        lengths=run.tree(grouped(branch, axes.lengths.tolist())),
        along=run.tree(along),
        stations=run.tree(stations),
        joints=list(run.drawing.points(lattice.nodes[joints.node])),
        normals=run.drawing.vectors(weave.normals[joints.node]),
        order=run.tree(order),
        supports=list(run.drawing.points(lattice.nodes[joints.node[is_border]])),
        lines=run.tree(grouped(rod, run.drawing.lines(springs.starts, springs.ends))),
        rest=run.tree(grouped(rod, springs.rest_length.tolist())),
        ties=run.drawing.lines(springs.tie_starts, springs.tie_ends),
    )
