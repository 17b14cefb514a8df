"""The tables of the workshop folder: what a row is, and its columns, see docs/fabrication.md.

Points along the axes are so near each other that the straight line between two stays within `_SAG` of the curve: a
chord of length s on a curve of curvature κ departs from it by κ s² / 8, so the step of each cubic is √(8 · sag / κ).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from weavecore.fabricating.csv_tables import LENGTH_DIGITS, Table, listed, mm, number, yes_no
from weavecore.fabricating.marks import OVER, UNDER, Mark, joint_name
from weavecore.fabricating.nesting import Bar
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.splices import Piece, Splice, stagger
from weavecore.fabricating.steps import Step
from weavecore.fabricating.ties import Ties, size_of_tie
from weavecore.fabricating.workshop import KG_PER_MM3, LABELS_PER_PIECE, SLEEVE, Workshop
from weavecore.fabricating.written_axes import AXIS_DIGITS
from weavecore.geometry.arrays import Floats, Ints, rows_of, unit_vectors
from weavecore.geometry.splines import cubic_points, span_ends
from weavecore.model import FAMILIES

START, CUT, SPLICE, ALONE, BETWEEN = "start", "cut", "splice", "alone", "between"
"""Flags of machine.csv, beside over and under: ends of a piece, the end of a splice on it, a node that it passes alone,
and a joint where it lies over one rod and under another."""

_SAG = 0.02
"""How far an axis may depart from the straight line between two points of axes.csv, in millimetres: a fifth of the
tolerance that lengths are checked with."""

_OFFSET_DIGITS = 4
"""Of layer offsets: a normal is measured on two of them, which differ by a diameter."""

_LONGEST_STEP = 50.0
"""Points of an axis are at most so many millimetres apart, also where it is straight."""

_PROBES = 5
"""Directions of each cubic that its curvature is estimated from."""


@dataclass(frozen=True)
class CutList:
    """Everything that is cut and tied, as the tables list it.

    Parameters
    ----------
    pieces : sequence of Piece
    splices : sequence of Splice
    bars : sequence of Bar
    marks : sequence of Mark
    ties : Ties
    steps : sequence of Step
    """

    pieces: Sequence[Piece]
    splices: Sequence[Splice]
    bars: Sequence[Bar]
    marks: Sequence[Mark]
    ties: Ties
    steps: Sequence[Step]


def build_tables(plan: RodPlan, workshop: Workshop, cut_list: CutList) -> list[Table]:
    """Build all tables of the folder but the report.

    Parameters
    ----------
    plan : RodPlan
    workshop : Workshop
    cut_list : CutList

    Returns
    -------
    list of Table
    """
    return [
        _rods_table(plan),
        _pieces_table(plan, cut_list),
        _splices_table(plan, cut_list.splices),
        _nesting_table(cut_list.bars),
        _marks_table(plan, cut_list.marks),
        _joints_table(plan, cut_list.ties),
        _axes_table(plan),
        _clashes_table(plan),
        _sequence_table(plan, cut_list),
        _machine_table(cut_list),
        _bom_table(plan, workshop, cut_list),
    ]


def _rods_table(plan: RodPlan) -> Table:
    """One row a rod."""
    weave, axes = plan.weave, plan.axes
    bending = weave.bending
    crossings = np.bincount(weave.joints.strand, minlength=len(weave))
    columns = (
        "rod_id,family,generation,closed,length,n_crossings,min_radius,station_at_min,utilisation,material,diameter,"
        "allowed_radius"
    )
    rows = [
        (
            plan.ids[s],
            FAMILIES[weave.strands.family[s]],
            plan.generation[s],
            yes_no(bool(axes.closed[s])),
            mm(axes.lengths[s]),
            crossings[s],
            mm(bending.min_radius[s] * plan.scale),
            mm(bending.station_at_min[s] * plan.scale),
            number(bending.utilisation[s], 4),
            weave.material.name,
            mm(plan.diameters[s]),
            mm(weave.material.least_bend * plan.diameters[s]),
        )
        for s in range(len(weave))
    ]
    return Table("rods", columns.split(","), rows)


def _pieces_table(plan: RodPlan, cut_list: CutList) -> Table:
    """One row a piece."""
    stock = {piece.id: bar.id for bar in cut_list.bars for piece in bar.pieces}
    codes: dict[str, list[str]] = {piece.id: [] for piece in cut_list.pieces}
    for mark in cut_list.marks:
        codes[mark.piece.id].append(mark.code)
    columns = "piece_id,rod_id,seq,from,to,cut_length,splice_start,splice_end,stock_id,codes"
    rows = [
        (
            piece.id,
            plan.ids[piece.rod],
            piece.seq,
            mm(piece.start),
            mm(piece.end),
            mm(piece.cut_length),
            piece.splice_start.id if piece.splice_start else "",
            piece.splice_end.id if piece.splice_end else "",
            stock[piece.id],
            listed(codes[piece.id]),
        )
        for piece in cut_list.pieces
    ]
    return Table("pieces", columns.split(","), rows)


def _splices_table(plan: RodPlan, splices: Sequence[Splice]) -> Table:
    """One row a splice."""
    columns = "splice_id,rod_id,kind,from,to,length,n_crossings,utilisation,nearest_splice,wanted_apart"
    rows = [
        (
            one.id,
            plan.ids[one.rod],
            one.kind,
            mm(one.low),
            mm(one.high),
            mm(one.high - one.low),
            one.n_crossings,
            number(one.utilisation, 4),
            mm(one.nearest),
            mm(stagger(plan)),
        )
        for one in splices
    ]
    return Table("splices", columns.split(","), rows)


def _nesting_table(bars: Sequence[Bar]) -> Table:
    """One row a bar."""
    rows = [(bar.id, listed(piece.id for piece in bar.pieces), mm(bar.used), mm(bar.offcut)) for bar in bars]
    return Table("nesting", ("stock_id", "pieces", "used", "offcut"), rows)


def _marks_table(plan: RodPlan, marks: Sequence[Mark]) -> Table:
    """One row for each other rod at each mark; one without another rod where a piece passes a node alone."""
    columns = "piece_id,no,station,other_rod,other_station,joint_id,over_under,side,from_start,rod_id,code"
    rows: list[tuple[object, ...]] = []
    for mark in marks:
        joint = joint_name(mark.node, mark.joint, len(plan.nodes))
        head, tail = (mark.piece.id, mark.number, mm(mark.station)), (mm(mark.at), plan.ids[mark.piece.rod], mark.code)
        for other in mark.crossings:
            side = OVER if other.is_over else UNDER
            rows.append((*head, plan.ids[other.rod], mm(other.station), joint, side, other.side, *tail))
        if not mark.crossings:
            rows.append((*head, "", "", joint, "", "", *tail))
    return Table("marks", columns.split(","), rows)


def _joints_table(plan: RodPlan, ties: Ties) -> Table:
    """One row a joint."""
    weave, joints = plan.weave, plan.weave.joints
    conflicts: dict[int, list[str]] = {}
    for strand, node, _ in weave.conflicts.tolist():
        conflicts.setdefault(node, []).append(plan.ids[strand])
    columns = "joint_id,x,y,z,nx,ny,nz,rods,order,angle,ties,tie_length,conflicts"
    rows = []
    for j, (a, b) in enumerate(zip(joints.offsets.tolist(), joints.offsets[1:].tolist())):
        node = int(joints.node[j])
        order = [plan.ids[s] for s in joints.strand[a:b].tolist()]
        rows.append(
            (
                joint_name(node, j, len(plan.nodes)),
                *(mm(x) for x in plan.nodes[node].tolist()),
                *(number(x, 6) for x in weave.normals[node].tolist()),
                listed(sorted(order)),
                listed(order),
                number(ties.angle[j], 2),
                ties.count[j],
                number(ties.length[j], 1),
                listed(conflicts.get(node, [])),
            )
        )
    return Table("joints", columns.split(","), rows)


def _axes_table(plan: RodPlan) -> Table:
    """Points along every axis, those at nodes among them."""
    points = _sample_axes(plan)
    names = np.array(plan.ids, object)[points.rod].tolist()
    columns = (points.stations.tolist(), *points.points.T.tolist(), points.layer_offsets.tolist())
    # Adding 0.0 leaves no negative zero; rounding first leaves none that is only written so.
    digits = (LENGTH_DIGITS, AXIS_DIGITS, AXIS_DIGITS, AXIS_DIGITS, _OFFSET_DIGITS)
    texts = [[f"{value:.{n}f}" for value in (np.round(column, n) + 0.0).tolist()] for column, n in zip(columns, digits)]
    rows = list(zip(names, *texts))
    return Table("axes", ("rod_id", "station", "x", "y", "z", "layer_offset"), rows)


def _clashes_table(plan: RodPlan) -> Table:
    """One row for each pair of rods that are nearer than their diameter, the nearest pair first."""
    clashes = plan.weave.clashes
    rows = [
        (plan.ids[one], plan.ids[other], number(gap * plan.scale, 4), *(mm(x * plan.scale) for x in point))
        for (one, other), gap, point in zip(clashes.strands.tolist(), clashes.distance.tolist(), clashes.point.tolist())
    ]
    return Table("clashes", ("rod_id", "other_rod", "distance", "x", "y", "z"), rows)


def _sequence_table(plan: RodPlan, cut_list: CutList) -> Table:
    """One row a step."""
    joints, ties = plan.weave.joints, cut_list.ties
    columns = "step,action,rod,joints_to_tie,after,piece,from,to,ties"
    rows = [
        (
            step.number,
            step.action,
            plan.ids[step.piece.rod],
            listed(joint_name(int(joints.node[j]), j, len(plan.nodes)) for j in step.joints),
            listed(step.after),
            step.piece.id,
            mm(step.low),
            mm(step.high),
            int(sum(ties.count[j] for j in step.joints)),
        )
        for step in cut_list.steps
    ]
    return Table("sequence", columns.split(","), rows)


def _machine_table(cut_list: CutList) -> Table:
    """One row for everything that a machine draws or cuts, along each piece, bar by bar in the order of cutting."""
    of_piece: dict[str, list[tuple[float, str, str]]] = {piece.id: [] for piece in cut_list.pieces}
    for mark in cut_list.marks:
        sides = {one.is_over for one in mark.crossings}
        flag = ALONE if not sides else BETWEEN if len(sides) > 1 else OVER if True in sides else UNDER
        of_piece[mark.piece.id].append((mark.at, mark.code, flag))
    rows = []
    for bar in cut_list.bars:
        for piece in bar.pieces:
            found = of_piece[piece.id]
            if piece.splice_start:
                found.append((piece.splice_start.reach, piece.splice_start.id, SPLICE))
            if piece.splice_end:
                found.append((piece.cut_length - piece.splice_end.reach, piece.splice_end.id, SPLICE))
            rows.append((piece.id, mm(0.0), bar.id, START))
            rows += [(piece.id, mm(at), code, flag) for at, code, flag in sorted(found)]
            rows.append((piece.id, mm(piece.cut_length), bar.id, CUT))
    return Table("machine", ("piece", "millimetres", "code", "flag"), rows)


@dataclass(frozen=True, eq=False)
class _AxisPoints:
    """Points along the axes (n,), by rod and station; of a ring the first comes again at the end.

    Between nodes the layer offset is interpolated linearly.
    """

    rod: Ints
    stations: Floats
    points: Floats
    layer_offsets: Floats


def _sample_axes(plan: RodPlan) -> _AxisPoints:
    """Sample all axes; the visits are among the points."""
    axes = plan.axes
    samples = axes.samples(_steps(plan))
    rod = rows_of(samples.offsets)
    visits = np.flatnonzero(samples.is_given)
    # The visits keep the stations that the marks have, to the last bit.
    stations = samples.stations.copy()
    stations[visits] = axes.stations
    ends = samples.offsets[1:] - 1
    stations[ends] = axes.lengths
    # Layers: from visit to visit, level beyond the outermost ones, and back to the first around a ring.
    known = np.concatenate([visits, samples.offsets[:-1], ends])
    first, last = axes.offsets[:-1], axes.offsets[1:] - 1
    layers = axes.layer_offsets[np.concatenate([np.arange(len(visits)), first, np.where(axes.closed, first, last)])]
    order = np.argsort(known, kind="stable")
    base = np.concatenate([[0.0], np.cumsum(axes.lengths + 1.0)])[:-1]
    place = base[rod] + stations
    heights = np.interp(place, place[known[order]], layers[order])
    return _AxisPoints(rod, stations, samples.points, heights)


def _steps(plan: RodPlan) -> Floats:
    """(n,) for each cubic of `span_ends`, how far apart its points may be."""
    axes = plan.axes
    rows = axes.rows
    start, stop, width = span_ends(rows.parameters, rows.offsets, axes.closed, rows.ends)
    ends = (rows.points[start], rows.points[stop], rows.derivatives[start], rows.derivatives[stop])
    slopes = [cubic_points(*ends, width, np.full(len(start), t))[1] for t in np.linspace(0, 1, _PROBES)]
    unit = [unit_vectors(slope) for slope in slopes]
    turn = np.max([np.linalg.norm(b - a, axis=1) for a, b in zip(unit, unit[1:])], axis=0)
    curvature = turn * (_PROBES - 1) / width
    steps: Floats = np.sqrt(8 * _SAG / np.maximum(curvature, 8 * _SAG / _LONGEST_STEP**2))
    return steps


def _bom_table(plan: RodPlan, workshop: Workshop, cut_list: CutList) -> Table:
    """What to buy: one row a diameter, the thickest first; the ties stand in the first row."""
    columns = (
        "material,diameter,stock_count,ties,mass,stock_length,cut_length,stock_mass,tie_size,sleeves,sleeve_length,"
        "labels,density,kerf"
    )
    thickness = np.unique(plan.diameters)[::-1].tolist()
    rows = [_bom_row(plan, workshop, cut_list, d, has_ties=d == thickness[0]) for d in thickness]
    return Table("bom", columns.split(","), rows)


def _bom_row(
    plan: RodPlan, workshop: Workshop, cut_list: CutList, diameter: float, *, has_ties: bool
) -> tuple[object, ...]:
    material, ties = plan.weave.material, cut_list.ties
    pieces = [piece for piece in cut_list.pieces if plan.diameters[piece.rod] == diameter]
    n_bars = sum(plan.diameters[bar.pieces[0].rod] == diameter for bar in cut_list.bars)
    n_splices = sum(plan.diameters[splice.rod] == diameter for splice in cut_list.splices)
    per_mm = _kilograms_per_mm(diameter, material.density)
    cut = sum(piece.cut_length for piece in pieces)
    longest = float(ties.length.max(initial=0.0)) if has_ties else 0.0
    is_sleeve = workshop.splice == SLEEVE
    return (
        material.name,
        mm(diameter),
        n_bars,
        int(ties.count.sum()) if has_ties else 0,
        number(cut * per_mm, 4),
        mm(workshop.stock),
        mm(cut),
        number(n_bars * workshop.stock * per_mm, 4),
        mm(size_of_tie(longest)) if longest else "",
        n_splices if is_sleeve else 0,
        mm(workshop.sleeve_length(diameter)) if is_sleeve else "",
        LABELS_PER_PIECE * len(pieces),
        number(material.density, 1),
        mm(workshop.kerf),
    )


def _kilograms_per_mm(diameter: float, density: float) -> float:
    """Mass of a round rod by its length; NaN where the density is not known."""
    return np.pi / 4 * diameter**2 * density * KG_PER_MM3 if density > 0 else float("nan")
