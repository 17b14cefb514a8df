"""What the report checks of rods, pieces, bars and the bill of materials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, count_of, greatest_of
from weavecore.fabricating.nesting import least_bars
from weavecore.fabricating.workshop import KG_PER_MM3, LABELS_PER_PIECE
from weavecore.fabricating.written_axes import BENDING_TOLERANCE
from weavecore.geometry.arrays import Floats

_LENGTH_LIMIT = 0.1
"""How far the length of a rod may be from that of its axis, in millimetres: less than a saw's accuracy."""

_ROUNDING = 0.002
"""Numbers are written to a micrometre: the difference of two may be off by so many millimetres."""

_MASS_ROUNDING = 1e-4
"""Masses are written to so many kilograms."""


def check_rods(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check rods, pieces, bars and the bill of materials.

    Parameters
    ----------
    folder : WrittenFolder
    """
    yield from _check_lengths(folder)
    yield from _check_pieces(folder)
    yield from _check_nesting(folder)
    yield from _check_bom(folder)


def _check_lengths(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Lengths against the axes, and bending."""
    rods, axes = folder.table("rods"), folder.axes
    yield count_of("rods_without_axis", [rod for rod in rods["rod_id"] if rod not in axes.rod_of])
    stated = dict(zip(rods["rod_id"], rods.floats("length").tolist()))
    off = np.abs(axes.lengths - np.array([stated.get(rod, np.nan) for rod in axes.ids]))
    yield greatest_of("rod_length_off_its_axis_mm", off, _LENGTH_LIMIT, axes.ids)
    yield from _check_bending(folder)


def _check_bending(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Bending, measured again on the points of the axes."""
    rods, axes = folder.table("rods"), folder.axes
    radius = dict(zip(axes.ids, axes.least_radii.tolist()))
    measured = np.array([radius.get(rod, np.nan) for rod in rods["rod_id"]])
    yield greatest_of("rod_bending_utilisation", rods.floats("allowed_radius") / measured, 1.0, rods["rod_id"])
    # A straight rod has no radius stated.
    stated = np.nan_to_num(rods.floats("min_radius"), nan=np.inf)
    bent = np.isfinite(measured)
    over = np.where(bent, stated, 1.0) / np.where(bent, measured, 1.0) - 1.0
    yield greatest_of("rod_min_radius_overstated", over, BENDING_TOLERANCE, rods["rod_id"])


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
    thickness = {piece: folder.diameter[rod] for piece, rod in zip(pieces["piece_id"], pieces["rod_id"])}
    mixed = [
        bar for bar, row in zip(nesting["stock_id"], rows) if len({thickness[p] for p in row if p in thickness}) > 1
    ]
    yield count_of("bar_of_two_diameters", mixed)
    least, most = 0, 0
    for size in sorted(set(thickness.values())):
        need = least_bars([length + kerf for piece, length in cut.items() if thickness[piece] == size], stock)
        # First fit decreasing never needs more than (11 · least + 6) / 9 bars (Dósa 2007).
        least, most = least + need, most + (11 * need + 6) // 9
    yield CheckResult("bars_beyond_the_lower_bound", float(len(nesting) - least), float(most - least))
    waste = 1.0 - sum(cut.values()) / (stock * max(len(nesting), 1))
    yield CheckResult("waste_pct", 100 * waste, 100.0)


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
    density, diameter = bom.floats("density")[0], bom.floats("diameter")
    if density > 0:
        mass = bom.floats("cut_length") * np.pi / 4 * diameter**2 * density * KG_PER_MM3
        off, room = np.abs(bom.floats("mass") - mass), _MASS_ROUNDING + mass * _ROUNDING / diameter
        yield CheckResult("bom_mass_off_kg", float(off.sum()), float(room.sum()))
    longest = joints.floats("tie_length").max(initial=0.0)
    size = float(bom.floats("tie_size")[0]) if len(joints) else 0.0
    yield CheckResult("tie_longer_than_bought_mm", float(longest), size)
