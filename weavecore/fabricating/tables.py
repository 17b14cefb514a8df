"""The tables of the folder, from the plan, the pieces and the marks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weavecore.fabricating.axes import sample_axes
from weavecore.fabricating.marks import OVER, UNDER, Mark, joint_name
from weavecore.fabricating.nesting import Bar
from weavecore.fabricating.pieces import Piece, Splice
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.splice_candidates import stagger
from weavecore.fabricating.table import Table, listed, mm, number, yes_no
from weavecore.fabricating.ties import Ties
from weavecore.model import FAMILIES, BuildSequence


def rods_table(plan: RodPlan) -> Table:
    """One row a rod."""
    weave, axes = plan.weave, plan.axes
    bending = weave.bending
    crossings = np.bincount(weave.joints.strand, minlength=len(weave))
    columns = (
        "rod_id,family,generation,closed,length,n_crossings,min_radius,station_at_min,utilisation,material,diameter"
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
            mm(plan.diameter),
        )
        for s in range(len(weave))
    ]
    return Table("rods", columns.split(","), rows)


def pieces_table(plan: RodPlan, pieces: Sequence[Piece], bars: Sequence[Bar]) -> Table:
    """One row a piece."""
    stock = {piece.id: bar.id for bar in bars for piece in bar.pieces}
    columns = "piece_id,rod_id,seq,from,to,cut_length,splice_start,splice_end,stock_id"
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
        )
        for piece in pieces
    ]
    return Table("pieces", columns.split(","), rows)


def splices_table(plan: RodPlan, splices: Sequence[Splice]) -> Table:
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


def nesting_table(bars: Sequence[Bar]) -> Table:
    """One row a bar."""
    rows = [(bar.id, listed(piece.id for piece in bar.pieces), mm(bar.used), mm(bar.offcut)) for bar in bars]
    return Table("nesting", ("stock_id", "pieces", "used", "offcut"), rows)


def marks_table(plan: RodPlan, marks: Sequence[Mark]) -> Table:
    """One row for each other rod at each mark; one without another rod where a piece passes a node alone."""
    columns = "piece_id,no,station,other_rod,other_station,joint_id,over_under,side,from_start,rod_id"
    rows: list[tuple[object, ...]] = []
    for mark in marks:
        joint = joint_name(mark.node, mark.joint, len(plan.nodes))
        head, tail = (mark.piece.id, mark.number, mm(mark.station)), (mm(mark.at), plan.ids[mark.piece.rod])
        for other in mark.crossings:
            side = OVER if other.is_over else UNDER
            rows.append((*head, plan.ids[other.rod], mm(other.station), joint, side, other.side, *tail))
        if not mark.crossings:
            rows.append((*head, "", "", joint, "", "", *tail))
    return Table("marks", columns.split(","), rows)


def joints_table(plan: RodPlan, ties: Ties) -> Table:
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


def axes_table(plan: RodPlan) -> Table:
    """Points along every axis, those at nodes among them."""
    points = sample_axes(plan)
    rows = [
        (plan.ids[rod], mm(station), mm(x), mm(y), mm(z), number(offset, 4))
        for rod, station, (x, y, z), offset in zip(
            points.rod.tolist(), points.station.tolist(), points.point.tolist(), points.layer_offset.tolist()
        )
    ]
    return Table("axes", ("rod_id", "station", "x", "y", "z", "layer_offset"), rows)


def sequence_table(plan: RodPlan, sequence: BuildSequence) -> Table:
    """One row a step; what the others bind is set, closed or from selvedge to selvedge."""
    joints = plan.weave.joints
    rows = []
    for k, (rod, is_ring) in enumerate(zip(sequence.strand.tolist(), sequence.is_ring.tolist())):
        tied = [joint_name(int(joints.node[j]), j, len(plan.nodes)) for j in sequence.tied_at(k).tolist()]
        after = (sequence.needed_by(k) + 1).tolist()
        action = "weave in" if not is_ring else "set ring" if plan.axes.closed[rod] else "set rod"
        rows.append((k + 1, action, plan.ids[rod], listed(tied), listed(after)))
    return Table("sequence", ("step", "action", "rod", "joints_to_tie", "after"), rows)
