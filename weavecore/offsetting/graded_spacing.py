r"""Spacings graded by a field: points with factors make the rings that pass near them denser or wider.

The field is interpolated between the points by inverse distance weighting (Shepard 1968) of the logarithms of their
factors, with the factor 1 as one more sample at the distance `reach`, so that the field fades to 1 away from them::

    log f(x) = Σ w_i log f_i / (1 + Σ w_i),    w_i = (reach / |x - p_i|)^4

Rings are parallel, so a ring has one spacing to the next, whatever the field does along it.  The spacing grows with the
mean m(d) of the field along the level set of each distance d: in the *graded distance* the schedule is the one asked
for, and it is mapped back to distances::

    b(D) = ∫ dd / m(d) from 0 to D        generation g lies where b = d_g of the schedule that was asked for

The level set of d is a segment in each face that it crosses; m(d) is the mean over these by their lengths.  All rings
at one distance share m(d), those of several borders too.

Work: linear in the segments, `_LEVELS_PER_SPACING` level sets in each spacing, times the points.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Optional

import numpy as np
from numpy.typing import ArrayLike

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, frozen, ranges, rows_of
from weavecore.model import Note, SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField, measure_distance
from weavecore.offsetting.isolines.extract import refuse_too_many_points
from weavecore.offsetting.preparation import refine_for_spacing, refuse_closed
from weavecore.offsetting.spacing import LevelSchedule, Spacing
from weavecore.polling import each, poll

DEFAULT_REACH = 0.25
"""Part of the surface's extent at which a single point has half of its effect."""

_LEVELS_PER_SPACING = 8
"""Level sets in one spacing, or in the width along which the field changes little: the mesh has two edges there."""

_WIDTH = 0.1
"""Part of the reach along which a field changes little: by 2% at a single point of the factor 0.5."""

_SHARPNESS = 4
"""Power of the inverse distance: at twice the reach a sixteenth of the weight is left."""

_NEAREST = 1e-6
"""Part of the reach below which a place counts as the point itself."""

_VARIES = 1.1
"""Ratio of the largest and the smallest factor along one ring from which on that is noted."""

FactorAtPoint = tuple[ArrayLike, float]
"""A point (3,) and the factor of the spacing there."""


@dataclass(frozen=True, eq=False)
class SpacingField:
    """Factor of the spacing at every place.

    Parameters
    ----------
    points : (n, 3) float64
    factors : (n,) float64
    reach : float
        Distance, straight through space, at which a single point has half of its effect.
    """

    points: Floats
    factors: Floats
    reach: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(self.points, np.float64, (-1, 3)))
        object.__setattr__(self, "factors", frozen(self.factors, np.float64, (len(self.points),)))

    def at(self, places: Floats) -> Floats:
        """The factor at each place.

        Parameters
        ----------
        places : (m, 3) float64

        Returns
        -------
        (m,) float64
        """
        total, weighted = np.ones(len(places)), np.zeros(len(places))
        for point, factor in each(zip(self.points, self.factors.tolist())):
            square = ((places - point) ** 2).sum(axis=1) / self.reach**2
            weight = np.maximum(square, _NEAREST**2) ** (-_SHARPNESS / 2)
            total += weight
            weighted += weight * math.log(factor)
        return np.exp(weighted / total)


def spacing_field(
    surface: SurfaceMesh, factors: Iterable[FactorAtPoint], reach: Optional[float] = None
) -> Optional[SpacingField]:
    """The field of some points with factors.

    Parameters
    ----------
    surface : SurfaceMesh
    factors : iterable of ((3,) array_like, float)
        Factors below 1 make rings denser, above 1 wider.
    reach : float, optional
        By default `DEFAULT_REACH` of the diagonal of the surface's bounding box.

    Returns
    -------
    SpacingField
        None where there are no points.

    Raises
    ------
    Unsupported
        Where a point is not three finite numbers, or a factor or the reach not a positive number.
    """
    points, values = [], []
    for place, value in factors:
        try:
            point, factor = np.asarray(place, np.float64), float(value)
        except (TypeError, ValueError):
            raise _wrong(f"{place!r} with {value!r}") from None
        if point.shape != (3,) or not np.isfinite(point).all():
            raise _wrong(f"the point {place!r}")
        if not (math.isfinite(factor) and factor > 0):
            raise _wrong(f"the factor {value!r}")
        points.append(point)
        values.append(factor)
    if reach is not None and not (math.isfinite(reach) and reach > 0):
        raise Unsupported(f"The reach must be positive (got {reach:g})", remedy="Give a positive length.")
    if not points:
        return None
    far = DEFAULT_REACH * _extent(surface) if reach is None else float(reach)
    return SpacingField(np.array(points), np.array(values), far)


def _extent(surface: SurfaceMesh) -> float:
    """The diagonal of the bounding box."""
    return float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))


def _wrong(what: str) -> Unsupported:
    return Unsupported(
        f"A spacing factor needs a point of three numbers and a positive factor (got {what})",
        remedy="Give ((x, y, z), 0.5) to halve the spacing there.",
    )


def grade_spacing(surface: SurfaceMesh, spacing: Spacing, field: SpacingField) -> tuple[SurfaceMesh, Floats]:
    """Grade a spacing by a field.

    Parameters
    ----------
    surface : SurfaceMesh
        Every component has an origin.
    spacing : float or sequence of float
        What it would be without the field.
    field : SpacingField

    Returns
    -------
    surface : SurfaceMesh
        With the note GRADED where the field varies along a ring.
    spacings : (n,) float64
        From each generation to the next.

    Raises
    ------
    Unsupported, TooMuchWork
    """
    asked = LevelSchedule.of(spacing)
    refuse_closed(surface)
    # The field hardly changes within a part of its reach: so fine need neither the mesh nor the level sets be.
    width = max(asked.least_spacing, _WIDTH * min(field.reach, DEFAULT_REACH * _extent(surface)))
    fine = refine_for_spacing(surface, width)
    step = width / _LEVELS_PER_SPACING
    means, ratio, widest = _means_along_levels(fine, measure_distance(fine), field, step)
    graded = np.concatenate([[0.0], np.cumsum(step / means)])
    n = float(asked.level_index(graded[-1:])[0])
    refuse_too_many_points(n, asked.least_spacing * float(means.min()))
    targets = asked.distance_of(np.arange(math.floor(n) + 2.0))
    # The last one lies beyond the deepest point, where the mean goes on as it was there.
    beyond = np.maximum(targets - graded[-1], 0.0) * means[-1]
    levels = np.interp(targets, graded, step * np.arange(len(graded))) + beyond
    spacings = np.diff(levels)
    if ratio < _VARIES:
        return surface, spacings
    return _note_variation(surface, ratio, means[widest]), spacings


def _note_variation(surface: SurfaceMesh, ratio: float, mean: float) -> SurfaceMesh:
    text = f"Along a ring the spacing factor varies up to {ratio:.3g} times; rings stay parallel, so each keeps one "
    text += f"spacing, by the mean along it ({mean:.3g} there)."
    others = (one for one in surface.notes if one.code != "GRADED")
    return surface.with_notes((*others, Note("GRADED", text, {"ratio": ratio, "mean": mean})))


def _means_along_levels(
    surface: SurfaceMesh, distance: DistanceField, field: SpacingField, step: float
) -> tuple[Floats, float, int]:
    """Mean of the field along the level sets in the middles of all steps, by length.

    Returns
    -------
    means : (n,) float64
    ratio : float
        The largest along one level set over the smallest, at most.
    widest : int
        The level set where that is.
    """
    level, middles, lengths = _segments(surface, distance.distance, step)
    values = field.at(middles)
    n = int(level.max(initial=0)) + 1
    total = np.bincount(level, lengths, n)
    means = np.bincount(level, lengths * values, n) / np.maximum(total, np.finfo(float).tiny)
    poll()
    order = np.argsort(level, kind="stable")
    starts = np.searchsorted(level[order], np.arange(n))
    filled = np.flatnonzero(total > 0)
    high = np.maximum.reduceat(values[order], starts[filled])
    low = np.minimum.reduceat(values[order], starts[filled])
    # Where no face has a part of a level set, the mean is that of the one before.
    known = filled[np.maximum(np.searchsorted(filled, np.arange(n), side="right") - 1, 0)]
    widest = int(np.argmax(high / low))
    return means[known], float((high / low)[widest]), int(filled[widest])


def _segments(surface: SurfaceMesh, distance: Floats, step: float) -> tuple[Ints, Floats, Floats]:
    """Level, middle and length of each segment of a level set in a face; level k lies at (k + 1/2) steps."""
    order = np.argsort(distance[surface.faces], axis=1, kind="stable")
    corners = np.take_along_axis(surface.faces, order, axis=1)
    heights = distance[corners] / step - 0.5
    first = np.maximum(np.ceil(heights[:, 0]), 0.0).astype(np.int64)
    counts = np.maximum(np.ceil(heights[:, 2]).astype(np.int64) - first, 0)
    face = rows_of(np.concatenate([[0], np.cumsum(counts)]))
    level = ranges(first, counts)
    poll()
    a, b, c = (surface.vertices[corners[face, k]] for k in range(3))
    low, middle, high = heights[face].T
    one = a + ((level - low) / (high - low))[:, None] * (c - a)
    is_lower = level < middle
    start, end = np.where(is_lower[:, None], a, b), np.where(is_lower[:, None], b, c)
    base, top = np.where(is_lower, low, middle), np.where(is_lower, middle, high)
    other = start + ((level - base) / (top - base))[:, None] * (end - start)
    return level, (one + other) / 2, np.linalg.norm(other - one, axis=1)
