"""What the report checks of rods, pieces, bars, splices and the bill of materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from scipy.interpolate import CubicSpline

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, count_of, greatest_of
from weavecore.fabricating.nesting import least_bars
from weavecore.fabricating.workshop import KG_PER_MM3, LABELS_PER_PIECE, OVERLAP, OVERLAP_DIAMETERS, SPLICE_UTILISATION
from weavecore.geometry.arrays import Floats
from weavecore.polling import each

_LENGTH_LIMIT = 0.1
"""How far the length of a rod may be from that of its axis, in millimetres: less than a saw's accuracy."""

_RADIUS_LIMIT = 0.05
"""How far the stated least radius of a rod may be above the one measured on its axis, as a part of that: the circle
through three points that are a few millimetres apart is that close to the curve."""

_STRAIGHT = 1e-9
"""Curvature per millimetre below which an axis is straight."""

_ROUNDING = 0.002
"""Numbers are written to a micrometre: the difference of two may be off by so many millimetres."""

_MASS_ROUNDING = 1e-4
"""Masses are written to so many kilograms."""

_CROSSINGS_OF_OVERLAP = 2
"""Joints that tie the two pieces of an overlap together."""

_GAUSS = np.polynomial.legendre.leggauss(3)
"""Nodes and weights on [-1, 1], exact for polynomials of degree 5."""


def check_rods(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check rods, pieces, bars, splices and the bill of materials.

    Parameters
    ----------
    folder : WrittenFolder
    """
    yield from _check_lengths(folder)
    yield from _check_pieces(folder)
    yield from _check_nesting(folder)
    yield from _check_splices(folder)
    yield from _check_bom(folder)


def _check_lengths(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Lengths against the axes, and bending."""
    rods, axes = folder.table("rods"), folder.axes
    yield count_of("rods_without_axis", [rod for rod in rods["rod_id"] if rod not in axes.rod_of])
    lengths = np.array(
        [_arc_length(axes.stations[axes.rod(k)], axes.points[axes.rod(k)]) for k in each(range(len(axes.ids)))]
    )
    stated = dict(zip(rods["rod_id"], rods.floats("length").tolist()))
    off = np.abs(lengths - np.array([stated.get(rod, np.nan) for rod in axes.ids]))
    yield greatest_of("rod_length_off_its_axis_mm", off, _LENGTH_LIMIT, axes.ids)
    yield from _check_bending(folder)


def _check_bending(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Bending, measured again on the points of the axes."""
    rods, axes = folder.table("rods"), folder.axes
    closed = dict(zip(rods["rod_id"], rods["closed"]))
    radius = {rod: _least_radius(axes.points[axes.rod(k)], closed.get(rod) == "yes") for k, rod in enumerate(axes.ids)}
    measured = np.array([radius.get(rod, np.nan) for rod in rods["rod_id"]])
    yield greatest_of("rod_bending_utilisation", rods.floats("allowed_radius") / measured, 1.0, rods["rod_id"])
    # A straight rod has no radius stated.
    stated = np.nan_to_num(rods.floats("min_radius"), nan=np.inf)
    bent = np.isfinite(measured)
    over = np.where(bent, stated, 1.0) / np.where(bent, measured, 1.0) - 1.0
    yield greatest_of("rod_min_radius_overstated", over, _RADIUS_LIMIT, rods["rod_id"])


def _least_radius(points: Floats, closed: bool) -> float:
    """The least radius of the circles through three points in a row of an axis (n, 3), infinite of a straight one."""
    if closed and len(points) > 2:
        points = np.concatenate([points[-2:-1], points])
    if len(points) < 3:
        return np.inf
    a, b, c = points[:-2], points[1:-1], points[2:]
    sides = np.linalg.norm(b - a, axis=1) * np.linalg.norm(c - b, axis=1) * np.linalg.norm(c - a, axis=1)
    twice_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    curvature = float(np.divide(2.0 * twice_area, sides, out=np.zeros(len(a)), where=sides > 0).max())
    return 1.0 / curvature if curvature > _STRAIGHT else np.inf


def _arc_length(stations: Floats, points: Floats) -> float:
    """Arc length of the cubic spline through the points (n, 3) of an axis, by Gauss-Legendre quadrature."""
    if len(stations) < 2 or not (np.diff(stations) > 0).all():
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    slope = CubicSpline(stations, points).derivative()
    width = np.diff(stations)
    parts = [w * np.linalg.norm(slope(stations[:-1] + width * (1 + x) / 2), axis=1) for x, w in zip(*_GAUSS)]
    return float((sum(parts) * width / 2).sum())


def _check_pieces(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Pieces cover their rods and fit the stock."""
    pieces, rods = folder.table("pieces"), folder.table("rods")
    low, high, cut = (pieces.floats(name) for name in ("from", "to", "cut_length"))
    yield greatest_of("piece_cut_length_off_mm", np.abs(high - low - cut), _ROUNDING, pieces["piece_id"])
    stock = folder.table("bom").floats("stock_length").min(initial=np.inf)
    yield greatest_of("piece_longest_mm", cut, float(stock), pieces["piece_id"])
    of_rod: dict[str, list[int]] = {}
    for k, rod in enumerate(pieces["rod_id"]):
        of_rod.setdefault(rod, []).append(k)
    gaps = [
        _longest_gap(low[of_rod.get(rod, [])], high[of_rod.get(rod, [])], length, closed == "yes")
        for rod, length, closed in zip(rods["rod_id"], rods.floats("length").tolist(), rods["closed"])
    ]
    yield greatest_of("rod_not_covered_by_pieces_mm", np.array(gaps), _ROUNDING, rods["rod_id"])


def _longest_gap(low: Floats, high: Floats, length: float, closed: bool) -> float:
    """The longest part of a rod that no piece, from ``low`` to ``high`` (n,), covers."""
    if len(low) == 0:
        return length
    if closed:
        low, high = (np.concatenate([ends - length, ends, ends + length]) for ends in (low, high))
    order = np.argsort(low)
    reached = np.maximum.accumulate(np.concatenate([[0.0], high[order]]))
    begins = np.append(low[order], length)
    gap: float = float((np.minimum(begins, length) - np.maximum(reached, 0.0)).max())
    return max(gap, 0.0)


def _check_nesting(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Each piece is cut once, from bars that are long enough and few."""
    pieces, nesting, bom = folder.table("pieces"), folder.table("nesting"), folder.table("bom")
    rows = nesting.lists("pieces")
    named = Counter(piece for row in rows for piece in row)
    yield count_of("piece_not_cut_once", [piece for piece in {*named, *pieces["piece_id"]} if named[piece] != 1])
    bar_of = {piece: bar for bar, row in zip(nesting["stock_id"], rows) for piece in row}
    stated = dict(zip(pieces["piece_id"], pieces["stock_id"]))
    yield count_of("piece_on_another_bar", [piece for piece in stated if bar_of.get(piece) != stated[piece]])
    cut = dict(zip(pieces["piece_id"], pieces.floats("cut_length").tolist()))
    kerf, stock = float(bom.floats("kerf")[0]), float(bom.floats("stock_length")[0])
    used = np.array([sum(cut.get(piece, np.nan) + kerf for piece in row) for row in rows])
    room = _ROUNDING * (1 + max((len(row) for row in rows), default=0))
    off = np.maximum(np.abs(used - nesting.floats("used")), np.abs(stock - used - nesting.floats("offcut")))
    yield greatest_of("bar_sums_off_mm", off, room, nesting["stock_id"])
    yield greatest_of("bar_used_mm", used, stock + room, nesting["stock_id"])
    least = least_bars([length + kerf for length in cut.values()], stock)
    # First fit decreasing never needs more than (11 · least + 6) / 9 bars (Dósa 2007).
    yield CheckResult("bars_beyond_the_lower_bound", float(len(nesting) - least), float((11 * least + 6) // 9 - least))
    waste = 1.0 - sum(cut.values()) / (stock * max(len(nesting), 1))
    yield CheckResult("waste_pct", 100 * waste, 100.0)


def _check_splices(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Splices are long enough, held by crossings, little bent and apart."""
    splices, diameter = folder.table("splices"), folder.diameter
    ids, kinds = splices["splice_id"], splices["kind"]
    thickness = np.array([diameter[rod] for rod in splices["rod_id"]], np.float64)
    is_overlap = np.array([kind == OVERLAP for kind in kinds], bool)
    crossings = splices.floats("n_crossings")
    is_loose = np.where(is_overlap, crossings < _CROSSINGS_OF_OVERLAP, crossings > 0)
    yield count_of("splice_not_held", [ids[k] for k in np.flatnonzero(is_loose)])
    is_short = is_overlap & (splices.floats("length") < OVERLAP_DIAMETERS * (thickness - _ROUNDING))
    yield count_of("splice_overlap_too_short", [ids[k] for k in np.flatnonzero(is_short)])
    yield greatest_of("splice_utilisation", splices.floats("utilisation"), SPLICE_UTILISATION, ids)
    is_near = splices.floats("nearest_splice") < splices.floats("wanted_apart")
    yield count_of("splice_near_another", [ids[k] for k in np.flatnonzero(is_near)])


def _check_bom(folder: WrittenFolder) -> Iterator[CheckResult]:
    """The sums of the bill of materials are those of the tables."""
    bom, joints = folder.table("bom"), folder.table("joints")
    n_pieces = len(folder.table("pieces"))
    cut = folder.table("pieces").floats("cut_length").sum()
    yield CheckResult("bom_bars_off", abs(bom.floats("stock_count").sum() - len(folder.table("nesting"))), 0.0)
    yield CheckResult("bom_ties_off", abs(bom.floats("ties").sum() - joints.floats("ties").sum()), 0.0)
    yield CheckResult("bom_labels_off", abs(bom.floats("labels").sum() - LABELS_PER_PIECE * n_pieces), 0.0)
    room = _ROUNDING * max(n_pieces, 1)
    yield CheckResult("bom_cut_length_off_mm", abs(float(bom.floats("cut_length").sum() - cut)), room)
    density, diameter = bom.floats("density")[0], bom.floats("diameter")[0]
    if density > 0:
        mass = cut * np.pi / 4 * diameter**2 * density * KG_PER_MM3
        room = _MASS_ROUNDING + mass * _ROUNDING / diameter
        yield CheckResult("bom_mass_off_kg", float(abs(bom.floats("mass")[0] - mass)), float(room))
    longest = joints.floats("tie_length").max(initial=0.0)
    size = float(bom.floats("tie_size")[0]) if len(joints) else 0.0
    yield CheckResult("tie_longer_than_bought_mm", float(longest), size)
