"""Where along an edge a level lies.

The distance is known at both ends of an edge, and how steeply it rises there.  Where both ends belong to
one front a cubic through these four numbers is exact but for the fourth order of the edge.
Where two fronts meet on the edge the distance has a kink, which no smooth curve follows:
there it is the lesser of the two straight continuations.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.offsetting.contours import Crossings
from weavecore.offsetting.ladder import Ladder
from weavecore.offsetting.persistence import Regions
from weavecore.offsetting.sheet import Sheet
from weavecore.tolerances import LEVEL_FROM_VERTEX

KINK = 0.25
"""Slopes at both ends that differ by more than this belong to two fronts."""
_LEAST_FLAT = 0.25
"""A gradient that stands steeper on the surface than this, squared, has lost its direction."""
_LEAST_SLOPE, _NEAR, _MOST_STEPS = 0.01, 1e-9, 60


def place_crossings(sheet: Sheet, regions: Regions, crossings: Crossings, *, ladder: Ladder) -> Floats:
    """(N,) where each crossing lies on its halfedge: 0 at its deep end, 1 at its shallow end.

    Positions on one edge keep the order of their levels, apart from each other and from the ends.
    """
    deep, shallow = crossings.deep, crossings.shallow
    low, high = regions.distance[shallow], regions.distance[deep]
    rise = np.maximum(high - low, np.finfo(float).tiny)
    height = np.clip((ladder.distance(crossings.level.astype(np.float64)) - low) / rise, 0.0, 1.0)
    along = sheet.points[deep] - sheet.points[shallow]
    normal = sheet.edge_normals(crossings.halfedge)
    start, is_start = slope_along(sheet.gradient[shallow], along, normal)
    end, is_end = slope_along(sheet.gradient[deep], along, normal)
    is_kept = regions.distance == sheet.distance
    stays = is_kept[deep] & is_kept[shallow]
    is_start, is_end = is_start & stays, is_end & stays
    start, end = start / rise, end / rise
    start, end = np.where(is_start, start, 2.0 - end), np.where(is_end, end, 2.0 - start)
    unknown = ~(is_start | is_end)
    start[unknown] = end[unknown] = 1.0
    length = np.sqrt(np.einsum("ij,ij->i", along, along))
    is_kink = (start - end) * rise > KINK * length
    part = np.where(is_kink & is_start & is_end, invert_kink(height, start, end), invert_cubic(height, start, end))
    return 1.0 - _kept_apart(part, regions.band, crossings)


def slope_along(gradient: Floats, along: Floats, normal: Floats) -> tuple[Floats, Bools]:
    """How much the distance would rise over each whole edge, and whether that is known.

    Parameters
    ----------
    gradient : (N, 3) float64
        In the plane of some face at an end of the edge.
    along : (N, 3) float64
        The edge from end to end.
    normal : (N, 3) float64
        Of the surface at the edge: into its plane the gradient is turned.
    """
    flat = 1.0 - np.einsum("ij,ij->i", gradient, normal) ** 2
    rise = np.einsum("ij,ij->i", gradient, along) / np.sqrt(np.maximum(flat, _LEAST_FLAT))
    return rise, (gradient != 0).any(1) & (flat > _LEAST_FLAT)


def invert_cubic(height: Floats, start: Floats, end: Floats) -> Floats:
    """Where the monotone cubic from (0, 0) to (1, 1) with the given end slopes reaches a height.

    Newton's method, kept inside a bracket; only what has not arrived goes on.
    """
    start, end = np.clip(start, 0.0, 3.0), np.clip(end, 0.0, 3.0)
    reached = height.copy()
    going = np.arange(len(height))
    part, least, most = height.copy(), np.zeros_like(height), np.ones_like(height)
    for _ in range(_MOST_STEPS):
        a, b, c = (start + end - 2.0)[going], (3.0 - 2.0 * start - end)[going], start[going]
        off = ((a * part + b) * part + c) * part - height[going]
        on = np.abs(off) > _NEAR
        reached[going] = part
        if not on.any():
            break
        slope = (3.0 * a * part + 2.0 * b) * part + c
        least, most = np.where(off < 0, part, least), np.where(off < 0, most, part)
        step = part - np.divide(off, slope, out=np.full_like(part, 2.0), where=slope > _LEAST_SLOPE)
        part = np.where((step >= least) & (step <= most), step, 0.5 * (least + most))
        going, part, least, most = going[on], part[on], least[on], most[on]
    return reached


def invert_kink(height: Floats, start: Floats, end: Floats) -> Floats:
    """Where the lesser of the two straight continuations reaches a height."""
    from_start = height / np.maximum(start, 1.0)
    from_end = 1.0 - np.divide(1.0 - height, end, out=np.ones_like(height), where=end > 0)
    return np.maximum(from_start, from_end)


def _kept_apart(part: Floats, band: Ints, crossings: Crossings) -> Floats:
    """Positions held off the ends of the edge and, in their order, off each other."""
    below = crossings.level - band[crossings.shallow]
    above = band[crossings.deep] + 1 - crossings.level
    least = np.minimum(LEVEL_FROM_VERTEX, 0.5 / (below + above))
    kept: Floats = np.clip(part, least * below, 1.0 - least * above)
    return kept
