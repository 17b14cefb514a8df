"""The weave in a JSON result: rods, joints, axes and bending."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.geometry.splines import DEGREE, fit_splines
from weavecore.model import FAMILIES, Bending, Clashes, Joints, Lattice, Material, RodAxes, Strands, Weave
from weavecore.reading.result_part import ResultPart, damaged_result

_TINY = float(np.finfo(float).tiny)

_FROM_NODE = 1e-6
"""An axis may pass its visits this part of the size of the lattice away; else it is not theirs."""


def take_weave(document: ResultPart, lattice: Lattice) -> Weave:
    """The weave on a lattice that was read before."""
    part = document.part("weave")
    rows = list(document.parts("strands"))
    ids = tuple(row.text("id") for row in rows)
    places = {name: s for s, name in enumerate(ids)}
    if len(places) != len(ids):
        raise damaged_result("Two strands have one id")
    strands = _strands(rows, lattice)
    normals = part.floats("normals", (lattice.n_nodes, 3))
    return Weave(
        lattice=lattice,
        strands=strands,
        ids=ids,
        joints=_joints(document, strands, places, lattice.n_nodes),
        axes=_axes(rows, strands, lattice.nodes, normals),
        normals=normals,
        bending=_bending(rows, part),
        rod_diameter=part.number("rod_diameter", least=_TINY),
        material=_material(part.part("material")),
        over_under=part.text("over_under"),
        conflicts=_conflicts(part, places, lattice.n_nodes),
        clashes=_clashes(part, places),
    )


def _strands(rows: list[ResultPart], lattice: Lattice) -> Strands:
    nodes = [row.indices("nodes", (-1,), lattice.n_nodes) for row in rows]
    closed = np.array([row.flag("closed") for row in rows], bool)
    for row, path, is_closed in zip(rows, nodes, closed.tolist()):
        if len(path) < (3 if is_closed else 2):
            raise damaged_result(f"{row.where}.nodes has {len(path)} nodes, too few for a rod")
    families = {name: k for k, name in enumerate(FAMILIES)}
    return Strands(
        offsets_of([len(path) for path in nodes]),
        np.concatenate([*nodes, np.zeros(0, np.int64)]),
        np.array([row.name("family", families) for row in rows], np.int64),
        closed,
    )


def _joints(document: ResultPart, strands: Strands, places: dict[str, int], n_nodes: int) -> Joints:
    rows = list(document.parts("joints"))
    node = np.array([row.index("node", n_nodes) for row in rows], np.int64)
    if (np.diff(node) <= 0).any():
        raise damaged_result("The nodes of the joints do not rise")
    counts = np.diff(strands.offsets)
    visits: list[Ints] = []
    for row, at in zip(rows, node.tolist()):
        order = np.array([row.name_of(name, "order", places) for name in row.texts("order")], np.int64)
        place = row.indices("places", (len(order),), int(counts.max(initial=0)))
        if len(order) < 2 or (place >= counts[order]).any():
            raise damaged_result(f"{row.where} does not have two rods or more with a place on each")
        visit = strands.offsets[order] + place
        if (strands.nodes[visit] != at).any() or len(np.unique(visit)) < len(visit):
            raise damaged_result(f"{row.where} names rods that do not pass node {at}, or one twice")
        visits.append(visit)
    visit = np.concatenate([*visits, np.zeros(0, np.int64)])
    return Joints(node, offsets_of([len(v) for v in visits]), visit, rows_of(strands.offsets)[visit])


def _axes(rows: list[ResultPart], strands: Strands, nodes: Floats, normals: Floats) -> RodAxes:
    """The axes; what stands in the file once is not there twice: points and derivatives follow from the rest."""
    counts = np.diff(strands.offsets).tolist()
    knots, controls = _bsplines(rows, counts, strands)
    layer_offsets = _joined([row.floats("layer_offsets", (n,)) for row, n in zip(rows, counts)])
    stations = _joined([row.floats("stations", (n,)) for row, n in zip(rows, counts)])
    lengths = np.array([row.number("axis_length", least=_TINY) for row in rows], np.float64)
    owner = rows_of(strands.offsets)
    rises = np.diff(stations)[np.diff(owner) == 0] >= 0
    if not rises.all() or (stations < 0).any() or (stations > lengths[owner] * (1 + 1e-9)).any():
        raise damaged_result("The stations of a strand do not rise from 0 to its length")
    points = nodes[strands.nodes] + layer_offsets[:, None] * normals[strands.nodes]
    room = _FROM_NODE * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    fitted = fit_splines(points, strands.offsets, strands.closed)
    for s, row in enumerate(rows):
        part = slice(strands.offsets[s], strands.offsets[s + 1])
        spline: Any = BSpline(knots[s], controls[s], DEGREE)
        if not np.abs(spline(fitted.parameters[part]) - points[part]).max() <= room:
            raise damaged_result(f"{row.where}.axis does not pass through the places of its strand")
    return RodAxes(
        offsets=strands.offsets,
        closed=strands.closed,
        points=points,
        derivatives=fitted.derivatives,
        parameters=fitted.parameters,
        ends=fitted.ends,
        knot_offsets=offsets_of([len(one) for one in knots]),
        knots=_joined(knots),
        control_offsets=offsets_of([len(one) for one in controls]),
        controls=np.concatenate([*controls, np.zeros((0, 3))]),
        stations=stations,
        lengths=lengths,
        layer_offsets=layer_offsets,
    )


def _bsplines(rows: list[ResultPart], counts: list[int], strands: Strands) -> tuple[list[Floats], list[Floats]]:
    """Knots and control points of every strand, of which there are as many as its visits ask for."""
    knots, controls = [], []
    for row, n, is_closed in zip(rows, counts, strands.closed.tolist()):
        axis = row.part("axis")
        spans = n if is_closed else n - 1
        if axis.number("degree") != DEGREE:
            raise damaged_result(f"{axis.where} is not of degree {DEGREE}")
        found = axis.floats("knots", (spans + 1 + 2 * DEGREE,))
        if (np.diff(found) < 0).any() or not (np.diff(found[DEGREE:-DEGREE]) > 0).all():
            raise damaged_result(f"{axis.where}.knots do not rise")
        knots.append(found)
        controls.append(axis.floats("controls", (spans + DEGREE, 3)))
    return knots, controls


def _bending(rows: list[ResultPart], part: ResultPart) -> Bending:
    def or_infinite(row: ResultPart, key: str) -> float:
        value = row.number_or_none(key)
        return np.inf if value is None else value

    return Bending(
        window=part.number("bending_window", least=_TINY),
        min_radius=np.array([or_infinite(row, "min_radius") for row in rows]),
        station_at_min=np.array([row.number("station_at_min") for row in rows]),
        point_at_min=np.array([row.floats("point_at_min", (3,)) for row in rows]),
        utilisation=np.array([row.number("utilisation", least=0.0) for row in rows]),
        largest_diameter=np.array([or_infinite(row, "largest_diameter") for row in rows]),
    )


def _material(part: ResultPart) -> Material:
    return Material(
        part.text("name"),
        modulus=part.number("modulus"),
        strength=part.number("strength"),
        factor=part.number("factor"),
        density=part.number("density", least=0.0),
        source=part.text("source"),
    )


def _conflicts(part: ResultPart, places: dict[str, int], n_nodes: int) -> Ints:
    rows = [
        [row.name("strand", places), row.index("node", n_nodes), row.index("node_before", n_nodes)]
        for row in part.parts("conflicts")
    ]
    return np.array(rows, np.int64).reshape(-1, 3)


def _clashes(part: ResultPart, places: dict[str, int]) -> Clashes:
    rows = list(part.parts("clashes"))
    pairs = [[row.name_of(name, "strands", places) for name in row.texts("strands")] for row in rows]
    if any(len(pair) != 2 for pair in pairs):
        raise damaged_result("A clash is not of two strands")
    return Clashes(
        np.array(pairs, np.int64).reshape(-1, 2),
        np.array([row.number("distance", least=0.0) for row in rows]),
        np.array([row.floats("point", (3,)) for row in rows]).reshape(-1, 3),
    )


def _joined(arrays: list[Floats]) -> Floats:
    return np.concatenate([*arrays, np.zeros(0)])
