"""Where a curve on a mesh runs beside its border, and its ends put there."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.border_stretch import BorderPlaces, nearest_on_border
from weavecore.geometry.curve_on_mesh import CurveOnMesh
from weavecore.geometry.curve_points import segments_of

_NEAR, _NEAR_OF_SIZE = 0.1, 0.01
"""A point is beside a border that is nearer than the first part of the edges there, and the second of the size."""

_MOST_RUN = 30.0
"""So many times this distance a curve may run beside a border, where it does not run along it altogether."""

_ON_BORDER = 1e-3  # of the edges there: as good as on it


@dataclass(frozen=True, eq=False)
class CurveBesideBorder:
    """A curve with its nearest places on the border.

    Parameters
    ----------
    curve : CurveOnMesh
    border : BorderPlaces
        Of its points and, between each and the next, of the middles.
    near : (k,) float64
        How near to the border each of these counts as beside it.
    """

    curve: CurveOnMesh
    border: BorderPlaces
    near: Floats

    @property
    def is_beside(self) -> Bools:
        """(k,) whether each point and middle is beside the border."""
        flags: Bools = self.border.distance <= self.near
        return flags

    @property
    def runs_along(self) -> bool:
        """Whether all of the curve runs along one border."""
        return bool(self.is_beside.all() and (self.border.loop == self.border.loop[0]).all())

    def refuse_in_part(self) -> None:
        """Refuse a curve that stays beside a border for long, or touches one between its ends.

        Raises
        ------
        BadCurve
        """
        is_beside = self.is_beside
        run, longest, where = 0.0, 0.0, 0
        start, end = segments_of(self.curve.places, self.curve.is_closed)
        half = np.repeat(np.linalg.norm(end - start, axis=1) / 2, 2)
        n = len(half)
        for row in range(2 * n if self.curve.is_closed else n):
            k = row % n
            both = is_beside[k] and is_beside[(k + 1) % len(is_beside)]
            run = run + half[k] / self.near[k] if both else 0.0
            if run > longest:
                longest, where = run, k
        if longest > _MOST_RUN:
            raise BadCurve(
                f"The curve runs along a border in part, near {_told(self.curve.places[where // 2])}",
                remedy="Let it run along the border altogether, or only end there; split it in two if it does both.",
            )
        first, last = self._inner()
        inner = 2 * np.arange(first, last + 1)
        touches = self.border.distance[inner] <= _ON_BORDER * self.border.edge_length[inner]
        if touches.any():
            raise BadCurve(
                f"The curve touches a border between its ends near "
                f"{_told(self.curve.places[first + int(np.argmax(touches))])}",
                remedy="Keep it clear of the border, or let it end there.",
            )

    def with_ends_on_border(self) -> tuple[CurveOnMesh, Bools]:
        """The curve with its ends put on the border where they are beside it, and which of its points these are."""
        n = len(self.curve.places)
        on_border = np.zeros(n, bool)
        if self.curve.is_closed:
            return self.curve, on_border
        on_border[[0, -1]] = self.is_beside[[0, -1]]
        places = np.where(on_border[:, None], self.border.place[::2], self.curve.places)
        first, last = self._inner()
        rows = np.unique(np.concatenate([[0], np.arange(first, last + 1), [n - 1]]))
        face = np.where(on_border, self.border.halfedge[::2] // 3, self.curve.face)
        return replace(self.curve, places=places, face=face).take(rows), on_border[rows]

    def _inner(self) -> tuple[int, int]:
        """The first and the last point that are no ends, nor as near to one that is put on the border."""
        n = len(self.curve.places)
        if self.curve.is_closed:
            return 0, n - 1
        first, last = 1, n - 2
        foot, near, places = self.border.place[::2], self.near[::2], self.curve.places
        if self.is_beside[0]:
            clear = np.linalg.norm(places - foot[0], axis=1) > near[0]
            first = max(first, int(np.argmax(clear)) if clear.any() else n)
        if self.is_beside[-1]:
            clear = np.linalg.norm(places - foot[-1], axis=1) > near[-1]
            last = min(last, n - 1 - int(np.argmax(clear[::-1])) if clear.any() else -1)
        return first, last


def curve_beside_border(
    vertices: Floats, faces: Ints, twins: Ints, curve: CurveOnMesh, tolerance: float
) -> CurveBesideBorder | None:
    """A curve with its nearest places on the border; None on a closed mesh."""
    start, end = segments_of(curve.places, curve.is_closed)
    middles = (start + end) / 2
    points = np.empty((len(curve.places) + len(middles), 3))
    points[0::2], points[1::2] = curve.places, middles
    border = nearest_on_border(vertices, faces, twins, points)
    if border is None:
        return None
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    height = np.repeat(curve.height, 2)[: len(points)]
    near = np.minimum(_NEAR * np.minimum(border.edge_length, 2 * height), _NEAR_OF_SIZE * size)
    return CurveBesideBorder(curve, border, np.maximum(near, max(tolerance, np.finfo(float).tiny)))


def _told(place: Floats) -> str:
    x, y, z = place.tolist()
    return f"({x:.6g}, {y:.6g}, {z:.6g})"
