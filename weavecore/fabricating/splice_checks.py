"""What the report checks of splices, measured on the axes and marks.

A splice may be bent beyond `SPLICE_UTILISATION` only where the rod has no other place for it.  The places are those
between neighbouring joints.  Whether little bent ones alone would do is found by taking, from each splice, the last
place that a bar reaches: if any choice makes up the rod, this one does.  O(c) for the c places of a rod, O(c²) of a
ring that is longer than a bar.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder, count_of, greatest_of, note_of
from weavecore.fabricating.splices import nearest_of_others, places_between_joints
from weavecore.fabricating.workshop import OVERLAP, OVERLAP_DIAMETERS, SPLICE_UTILISATION
from weavecore.fabricating.written_axes import BENDING_TOLERANCE
from weavecore.geometry.arrays import Floats, Ints

_ROUNDING = 0.002
"""Numbers are written to a micrometre: the difference of two may be off by so many millimetres."""

_CROSSINGS_OF_OVERLAP = 2
"""Joints that tie the two pieces of an overlap together."""

_NEAREST_LIMIT = 0.1
"""How far the stated distance to the nearest splice may be off, in millimetres."""

_LEAST_STATED = 1e-3
"""Utilisations below are not compared: a thousandth of the allowable stress is nothing, and is rounded."""

_CLEARLY_STRAIGHTER = 0.1
"""Part of the limit by which another place must be below it: curvature changes fast beside a joint, where zones end, so
that the one measured there differs from the one that the splices were placed by."""

_BENT_THROUGHOUT = (
    "The rod is bent beyond the limit wherever it could be spliced. The splice is where it is bent least: tie it "
    "closely, or use a sleeve or thinner rods."
)


def check_splices(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Check that splices are held, long enough, little bent and apart.

    Parameters
    ----------
    folder : WrittenFolder
    """
    splices, diameter = folder.table("splices"), folder.diameter
    ids, kinds = splices["splice_id"], splices["kind"]
    thickness = np.array([diameter[rod] for rod in splices["rod_id"]], np.float64)
    is_overlap = np.array([kind == OVERLAP for kind in kinds], bool)
    crossings = splices.floats("n_crossings")
    is_loose = np.where(is_overlap, crossings < _CROSSINGS_OF_OVERLAP, crossings > 0)
    yield count_of("splice_not_held", [ids[k] for k in np.flatnonzero(is_loose)])
    is_short = is_overlap & (splices.floats("length") < OVERLAP_DIAMETERS * (thickness - _ROUNDING))
    yield count_of("splice_overlap_too_short", [ids[k] for k in np.flatnonzero(is_short)])
    yield from _check_bending(folder)
    is_near = splices.floats("nearest_splice") < splices.floats("wanted_apart")
    yield count_of("splice_near_another", [ids[k] for k in np.flatnonzero(is_near)])
    yield greatest_of("splice_nearest_off_mm", _nearest_off(folder), _NEAREST_LIMIT, ids)


def _nearest_off(folder: WrittenFolder) -> Floats:
    """(n,) how far the stated distance of each splice to the nearest one of another rod is off."""
    splices, axes = folder.table("splices"), folder.axes
    owners = np.array([axes.rod_of[rod] for rod in splices["rod_id"]], np.int64)
    if len(owners) == 0:
        return np.zeros(0)
    points, _ = axes.at(owners, (splices.floats("from") + splices.floats("to")) / 2)
    stated = np.nan_to_num(splices.floats("nearest_splice"), nan=np.inf)
    measured = nearest_of_others(points, owners)
    is_alone = np.isinf(measured) & np.isinf(stated)
    off: Floats = np.abs(np.where(is_alone, 0.0, measured) - np.where(is_alone, 0.0, stated))
    return off


def _check_bending(folder: WrittenFolder) -> Iterator[CheckResult]:
    """Bending at splices, measured on the axes."""
    splices, axes = folder.table("splices"), folder.axes
    ids = splices["splice_id"]
    rods = np.array([axes.rod_of[rod] for rod in splices["rod_id"]], np.int64)
    low, high, stated = (splices.floats(name) for name in ("from", "to", "utilisation"))
    allowed = dict(zip(folder.table("rods")["rod_id"], folder.table("rods").floats("allowed_radius").tolist()))
    scale = np.array([allowed[rod] for rod in splices["rod_id"]])
    measured = np.array(
        [axes.greatest_curvatures(k, a, b)[0] for k, a, b in zip(rods.tolist(), low[:, None], high[:, None])]
    )
    measured = measured * scale if len(rods) else np.zeros(0)
    over = np.where(measured > _LEAST_STATED, measured / np.maximum(stated, _LEAST_STATED) - 1.0, 0.0)
    yield greatest_of("splice_utilisation_understated", over, BENDING_TOLERANCE, ids)
    bent = np.maximum(stated, measured) > SPLICE_UTILISATION
    can_be_straighter = {rod: _can_be_straighter(folder, rod) for rod in set(rods[bent].tolist())}
    bent_splices = [(ids[k], can_be_straighter[int(rods[k])]) for k in np.flatnonzero(bent).tolist()]
    yield count_of("splice_bent_avoidably", [name for name, other in bent_splices if other])
    yield note_of("splices_bent_throughout", [name for name, other in bent_splices if not other], _BENT_THROUGHOUT)


def _can_be_straighter(folder: WrittenFolder, rod: int) -> bool:
    """Whether a rod could be spliced at little bent places alone."""
    axes, bom, name = folder.axes, folder.table("bom"), folder.axes.ids[rod]
    rods, splices = folder.table("rods"), folder.table("splices")
    row = rods["rod_id"].index(name)
    kind = splices["kind"][splices["rod_id"].index(name)]
    length, closed = float(axes.ends[rod]), bool(axes.closed[rod])
    joints = np.array(folder.joint_stations.get(name, []))
    if len(joints) < 2:
        return False
    diameter = float(rods.floats("diameter")[row])
    centres, half = places_between_joints(joints, length, closed=closed, kind=kind, diameter=diameter)
    bending = axes.greatest_curvatures(rod, centres - half, centres + half) * rods.floats("allowed_radius")[row]
    good = bending * (1.0 + _CLEARLY_STRAIGHTER) <= SPLICE_UTILISATION
    longest = float(bom.floats("stock_length")[0] - bom.floats("kerf")[0])
    reach = half[good] if kind == OVERLAP else np.zeros(int(good.sum()))
    return _makes_up(centres[good], half[good], reach, length, longest, closed)


def _makes_up(centres: Floats, half: Floats, reach: Floats, length: float, longest: float, closed: bool) -> bool:
    """Whether splices at some of the centres (n,) divide a rod into pieces that bars are long enough for."""
    if not closed:
        return _covers(centres, half, reach, 0.0, -np.inf, length, longest)
    for k in range(len(centres)):
        if length + 2 * reach[k] <= longest:
            return True
        ahead: Ints = np.arange(k + 1, k + len(centres)) % len(centres)
        lap = np.where(ahead <= k, length, 0.0)
        start, end = centres[k] - reach[k], centres[k] + length + reach[k]
        if _covers(centres[ahead] + lap, half[ahead], reach[ahead], start, centres[k] + half[k], end, longest):
            return True
    return False


def _covers(
    centres: Floats, half: Floats, reach: Floats, start: float, clear: float, end: float, longest: float
) -> bool:
    """Whether pieces from ``start``, each ending at the last splice in its reach, arrive at ``end``."""
    while end - start > longest:
        within = np.flatnonzero((centres - half >= clear) & (centres + reach - start <= longest))
        if len(within) == 0:
            return False
        k = int(within[np.argmax(centres[within] - reach[within])])
        if centres[k] - reach[k] <= start:
            return False
        start, clear = centres[k] - reach[k], centres[k] + half[k]
    return True
