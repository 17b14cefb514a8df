"""What the report checks of rods, pieces, bars and splices."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from weavecore.fabricating.nesting import least_bars
from weavecore.fabricating.plan import MOST_UTILISED, OVERLAP, OVERLAP_DIAMETERS
from weavecore.fabricating.written_folder import Finding, Folder, ReadTable, count, worst
from weavecore.geometry.arrays import Floats

LENGTH_LIMIT = 0.1
_ROUNDING = 0.002
"""Numbers are written to a micrometre: the difference of two may be off by so much."""

_GAUSS = np.polynomial.legendre.leggauss(3)


def check_rods(folder: Folder) -> Iterator[Finding]:
    """Lengths against the axes, and bending."""
    rods, axes = folder.table("rods"), folder.axes
    yield count("rods_without_axis", [rod for rod in rods["rod_id"] if rod not in axes.rod_of])
    lengths = np.array([_arc_length(axes.station[axes.rod(k)], axes.point[axes.rod(k)]) for k in range(len(axes.ids))])
    told = dict(zip(rods["rod_id"], rods.floats("length").tolist()))
    off = np.abs(lengths - np.array([told.get(rod, np.nan) for rod in axes.ids]))
    yield worst("rod_length_off_its_axis_mm", off, LENGTH_LIMIT, axes.ids)
    yield worst("rod_bending_utilisation", rods.floats("utilisation"), 1.0, rods["rod_id"])


def check_pieces(folder: Folder) -> Iterator[Finding]:
    """Pieces cover their rods and fit the stock."""
    pieces, rods = folder.table("pieces"), folder.table("rods")
    low, high, cut = (pieces.floats(name) for name in ("from", "to", "cut_length"))
    yield worst("piece_cut_length_off_mm", np.abs(high - low - cut), _ROUNDING, pieces["piece_id"])
    stock = folder.table("bom").floats("stock_length").min(initial=np.inf)
    yield worst("piece_longest_mm", cut, float(stock), pieces["piece_id"])
    of_rod: dict[str, list[int]] = {}
    for k, rod in enumerate(pieces["rod_id"]):
        of_rod.setdefault(rod, []).append(k)
    gaps = [
        _widest_gap(low[of_rod.get(rod, [])], high[of_rod.get(rod, [])], length, closed == "yes")
        for rod, length, closed in zip(rods["rod_id"], rods.floats("length").tolist(), rods["closed"])
    ]
    yield worst("rod_not_covered_by_pieces_mm", np.array(gaps), _ROUNDING, rods["rod_id"])


def check_nesting(folder: Folder) -> Iterator[Finding]:
    """Each piece is cut once, from bars that are long enough and few."""
    pieces, nesting, bom = folder.table("pieces"), folder.table("nesting"), folder.table("bom")
    named = [piece for row in nesting.lists("pieces") for piece in row]
    wrong = (
        [piece for piece in {*named, *pieces["piece_id"]} if named.count(piece) != 1] if _differ(named, pieces) else []
    )
    yield count("piece_not_cut_once", wrong)
    bar_of = {piece: bar for bar, row in zip(nesting["stock_id"], nesting.lists("pieces")) for piece in row}
    told = dict(zip(pieces["piece_id"], pieces["stock_id"]))
    yield count("piece_on_another_bar_than_told", [piece for piece in told if bar_of.get(piece) != told[piece]])
    cut = dict(zip(pieces["piece_id"], pieces.floats("cut_length").tolist()))
    kerf, stock = float(bom.floats("kerf")[0]), float(bom.floats("stock_length")[0])
    used = np.array([sum(cut.get(piece, np.nan) + kerf for piece in row) for row in nesting.lists("pieces")])
    room = _ROUNDING * (1 + max((len(row) for row in nesting.lists("pieces")), default=0))
    off = np.maximum(np.abs(used - nesting.floats("used")), np.abs(stock - used - nesting.floats("offcut")))
    yield worst("bar_sums_off_mm", off, room, nesting["stock_id"])
    yield worst("bar_used_mm", used, stock + room, nesting["stock_id"])
    least = least_bars([length + kerf for length in cut.values()], stock)
    # What the longest first, each where it fits, is sure to keep (Dósa 2007).
    yield Finding("bars_beyond_the_lower_bound", float(len(nesting) - least), float((11 * least + 6) // 9 - least))
    waste = 1.0 - sum(cut.values()) / (stock * max(len(nesting), 1))
    yield Finding("waste_pct", 100 * waste, 100.0)


def check_splices(folder: Folder) -> Iterator[Finding]:
    """Splices are long enough, held, little bent and not beside each other."""
    splices, diameter = folder.table("splices"), folder.diameter
    ids, kinds = splices["splice_id"], splices["kind"]
    thick = np.array([diameter[rod] for rod in splices["rod_id"]], np.float64)
    is_overlap = np.array([kind == OVERLAP for kind in kinds], bool)
    crossings = splices.floats("n_crossings")
    loose = np.where(is_overlap, crossings < 2, crossings > 0)
    yield count("splice_not_held_as_it_should", [ids[k] for k in np.flatnonzero(loose)])
    short = is_overlap & (splices.floats("length") < OVERLAP_DIAMETERS * (thick - _ROUNDING))
    yield count("splice_overlap_too_short", [ids[k] for k in np.flatnonzero(short)])
    yield worst("splice_utilisation", splices.floats("utilisation"), MOST_UTILISED, ids)
    nearest = splices.floats("nearest_splice")
    beside = nearest < splices.floats("wanted_apart")
    yield count("splice_beside_another", [ids[k] for k in np.flatnonzero(beside)])


def check_bom(folder: Folder) -> Iterator[Finding]:
    """The bill's sums are those of the tables."""
    bom, joints = folder.table("bom"), folder.table("joints")
    cut = folder.table("pieces").floats("cut_length").sum()
    yield Finding("bom_bars_off", abs(bom.floats("stock_count").sum() - len(folder.table("nesting"))), 0.0)
    yield Finding("bom_ties_off", abs(bom.floats("ties").sum() - joints.floats("ties").sum()), 0.0)
    yield Finding("bom_labels_off", abs(bom.floats("labels").sum() - 2 * len(folder.table("pieces"))), 0.0)
    room = _ROUNDING * max(len(folder.table("pieces")), 1)
    yield Finding("bom_cut_length_off_mm", abs(float(bom.floats("cut_length").sum() - cut)), room)
    density, diameter = bom.floats("density")[0], bom.floats("diameter")[0]
    if density > 0:
        mass = cut * np.pi / 4 * diameter**2 * density * 1e-9
        room = 1e-4 + mass * _ROUNDING / diameter
        yield Finding("bom_mass_off_kg", float(abs(bom.floats("mass")[0] - mass)), float(room))
    longest = joints.floats("tie_length").max(initial=0.0)
    yield Finding("tie_longer_than_bought_mm", float(longest), float(bom.floats("tie_size")[0]) if len(joints) else 0.0)


def _differ(named: list[str], pieces: ReadTable) -> bool:
    return sorted(named) != sorted(pieces["piece_id"])


def _arc_length(station: Floats, point: Floats) -> float:
    """Arc length of the cubic spline through the points of an axis."""
    if len(station) < 2 or not (np.diff(station) > 0).all():
        return float(np.linalg.norm(np.diff(point, axis=0), axis=1).sum())
    slope = CubicSpline(station, point).derivative()
    width = np.diff(station)
    parts = [w * np.linalg.norm(slope(station[:-1] + width * (1 + x) / 2), axis=1) for x, w in zip(*_GAUSS)]
    return float((sum(parts) * width / 2).sum())


def _widest_gap(low: Floats, high: Floats, length: float, closed: bool) -> float:
    """The longest part of a rod that no piece covers."""
    if len(low) == 0:
        return length
    if closed:
        low, high = (np.concatenate([ends - length, ends, ends + length]) for ends in (low, high))
    order = np.argsort(low)
    reached = np.maximum.accumulate(np.concatenate([[0.0], high[order]]))
    begins = np.append(low[order], length)
    gap: float = float((np.minimum(begins, length) - np.maximum(reached, 0.0)).max())
    return max(gap, 0.0)
