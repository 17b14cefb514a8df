"""The tables of the folder, from the plan, the pieces and the marks."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256

import numpy as np

from weavecore.fabricating.cut import Piece, Splice, stagger
from weavecore.fabricating.marks import OVER, UNDER, Mark, Ties, joint_name, size_of_tie
from weavecore.fabricating.nesting import Bar
from weavecore.fabricating.plan import SLEEVE, RodPlan, Workshop
from weavecore.geometry.arrays import Floats, Ints, rows_of
from weavecore.geometry.splines import cubic_points, span_ends
from weavecore.model import FAMILIES, BuildSequence, Weave
from weavecore.version import installed_version


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


# ----------------------------------------------------------------------
# Points along the axes, so near each other that straight lines between them keep within hundredths of a millimetre.

SAG = 0.02
"""How far an axis may bulge from the straight line between two points, in millimetres."""

_LONGEST = 50.0
_PROBES = 5


@dataclass(frozen=True, eq=False)
class AxisPoints:
    """Points along the axes, by rod and station; of a ring the first comes again at the end.

    Between nodes ``layer_offset`` goes evenly from that of one to that of the next.
    """

    rod: Ints
    station: Floats
    point: Floats
    layer_offset: Floats


def sample_axes(plan: RodPlan) -> AxisPoints:
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
    # Layers: from visit to visit, level beyond the outermost ones and back to the first around a ring.
    known = np.concatenate([visits, samples.offsets[:-1], ends])
    first, last = axes.offsets[:-1], axes.offsets[1:] - 1
    last = np.where(axes.closed, first, last)
    layers = axes.layer_offsets[np.concatenate([np.arange(len(visits)), first, last])]
    order = np.argsort(known, kind="stable")
    base = np.concatenate([[0.0], np.cumsum(axes.lengths + 1.0)])[:-1]
    place = base[rod] + stations
    heights = np.interp(place, place[known[order]], layers[order])
    return AxisPoints(rod, stations, samples.points, heights)


def _steps(plan: RodPlan) -> Floats:
    """(…,) for every cubic how far apart its points may be."""
    axes = plan.axes
    rows = axes.rows
    start, stop, width = span_ends(rows.parameters, rows.offsets, axes.closed, rows.ends)
    ends = (rows.points[start], rows.points[stop], rows.derivatives[start], rows.derivatives[stop])
    slopes = [cubic_points(*ends, width, np.full(len(start), t))[1] for t in np.linspace(0, 1, _PROBES)]
    unit = [slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), np.finfo(float).tiny) for slope in slopes]
    turn = np.max([np.linalg.norm(b - a, axis=1) for a, b in zip(unit, unit[1:])], axis=0)
    curvature = turn * (_PROBES - 1) / width
    steps: Floats = np.sqrt(8 * SAG / np.maximum(curvature, 8 * SAG / _LONGEST**2))
    return steps


# ----------------------------------------------------------------------
# The bill of materials.

LABELS_PER_PIECE = 2


def kilograms_per_mm(diameter: float, density: float) -> float:
    """Mass of a round rod by its length; not a number where the density is not known."""
    return np.pi / 4 * diameter**2 * density * 1e-9 if density > 0 else float("nan")


def bom_table(
    plan: RodPlan,
    workshop: Workshop,
    pieces: Sequence[Piece],
    splices: Sequence[Splice],
    bars: Sequence[Bar],
    ties: Ties,
) -> Table:
    """What to buy: one row, as all rods are of one material and diameter."""
    material = plan.weave.material
    per_mm = kilograms_per_mm(plan.diameter, material.density)
    cut = sum(piece.cut_length for piece in pieces)
    longest = float(ties.length.max(initial=0.0))
    columns = (
        "material,diameter,stock_count,ties,mass,stock_length,cut_length,stock_mass,tie_size,sleeves,sleeve_length,"
        "labels,density,kerf"
    )
    is_sleeve = workshop.splice == SLEEVE
    row = (
        material.name,
        mm(plan.diameter),
        len(bars),
        int(ties.count.sum()),
        number(cut * per_mm, 4),
        mm(workshop.stock),
        mm(cut),
        number(len(bars) * workshop.stock * per_mm, 4),
        mm(size_of_tie(longest)) if longest else "",
        len(splices) if is_sleeve else 0,
        mm(workshop.sleeve_length(plan.diameter)) if is_sleeve else "",
        LABELS_PER_PIECE * len(pieces),
        number(material.density, 1),
        mm(workshop.kerf),
    )
    return Table("bom", columns.split(","), [row])


# ----------------------------------------------------------------------
# `Table`: rows of texts under names of columns, as CSV files hold them.
#
# The first line of every file begins with ``#`` and states weavecore's version, the unit, the weave and a hash of the
# input; the second has the names of the columns.  Fields are parted by commas, numbers have a decimal point,
# several names in one field are parted by blanks.


@dataclass(frozen=True)
class Source:
    """What every file of the folder states.

    Parameters
    ----------
    version : str
        Of weavecore.
    sha256 : str
        Of the JSON result that the folder was made from.
    weave : str
        How rods go over and under.
    pattern : str
    """

    version: str
    sha256: str
    weave: str
    pattern: str

    @classmethod
    def of(cls, weave: Weave, content: bytes) -> Source:
        """The statement on a weave that was read from, or would be written as, a file with this content."""
        return cls(installed_version(), sha256(content).hexdigest(), weave.over_under, weave.lattice.pattern)

    def line(self, name: str) -> str:
        """The statement of one file."""
        return (
            f"weavecore {self.version}; table {name}; unit mm; weave {self.weave}; pattern {self.pattern}; "
            f"input sha256 {self.sha256}"
        )


@dataclass(frozen=True)
class Table:
    """A table.

    Parameters
    ----------
    name : str
        Of the file, without ending.
    columns : sequence of str
    rows : sequence of sequences
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]

    def encode(self, source: Source) -> bytes:
        """The bytes of the CSV file."""
        stream = io.StringIO()
        stream.write(f"# {source.line(self.name)}\n")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return stream.getvalue().encode()


def mm(length: float) -> str:
    """A length to a micrometre."""
    return number(length, 3)


def number(value: float, digits: int) -> str:
    """A number with so many digits after the point; nothing where it is not finite; 0 has no sign."""
    if not abs(value) < float("inf"):
        return ""
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def listed(names: Iterable[object]) -> str:
    """Several names in one field."""
    return " ".join(map(str, names))


def yes_no(value: bool) -> str:
    """A truth in a field."""
    return "yes" if value else "no"
