"""`SurfaceCurves`: polylines embedded in the mesh, each segment in one face.

The paper's polylines have straight segments in space (Yan et al. 2016, §4.2).  Here each is cut where it crosses an
edge, so that intersections can be found face by face::

       vertex            edge            edge       vertex
         o----- segment --+--- segment ---+---------- o        is_vertex: 1 0 0 1
           in face f        in face g       in face h
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of


@dataclass(frozen=True, eq=False)
class SurfaceCurves:
    """Closed and open curves on a `Domain`, curve after curve; each has the unswept surface on its left.

    The last segment of an open curve is its end point: its length is 0, and it follows itself.

    Parameters
    ----------
    offsets : (C+1,) int64
        Where the segments of each curve begin.
    closed : (C,) bool
    face : (m,) int64
        The face of each segment.
    start, end : (m, 3) float64
        Barycentric coordinates of both ends of each segment in its face.
    is_vertex : (m,) bool
        Whether a segment begins at a vertex of the polyline, made by an offset or by a reconnection; elsewhere the
        curve only goes from one face to the next.
    is_corner : (m,) bool
        Whether that vertex was made by a reconnection.
    points : (m, 3) float64
        Where each segment begins, in the domain's unit.
    """

    offsets: Ints
    closed: Bools
    face: Ints
    start: Floats
    end: Floats
    is_vertex: Bools
    is_corner: Bools
    points: Floats

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def owner(self) -> Ints:
        """(m,) the curve of each segment."""
        return rows_of(self.offsets)

    @cached_property
    def after(self) -> Ints:
        """(m,) the next segment of the same curve."""
        return next_along(self.offsets, self.closed)

    @cached_property
    def segment_lengths(self) -> Floats:
        """(m,) length of each segment."""
        lengths: Floats = np.linalg.norm(self.points[self.after] - self.points, axis=1)
        return lengths

    @property
    def curve_lengths(self) -> Floats:
        """(C,) length of each curve."""
        return np.bincount(self.owner, self.segment_lengths, minlength=len(self)).astype(np.float64)

    @property
    def ends(self) -> tuple[Ints, Ints]:
        """First and last segments (c,) of the open curves."""
        return self.offsets[:-1][~self.closed], self.offsets[1:][~self.closed] - 1

    def locate(self, station: Floats, owner: Ints) -> tuple[Ints, Floats]:
        """Segments at arc lengths.

        Parameters
        ----------
        station : (n,) float64
            Arc length summed over all curves in order.
        owner : (n,) int64
            The curve of each: it decides where two curves share a station.

        Returns
        -------
        segment : (n,) int64
        part : (n,) float64
            Where on the segment, in 0 to 1.
        """
        total = np.concatenate([[0.0], np.cumsum(self.segment_lengths)])
        segment = np.searchsorted(total, station, side="right") - 1
        segment = np.clip(segment, self.offsets[owner], self.offsets[owner + 1] - 1)
        length = self.segment_lengths[segment]
        part = np.divide(station - total[segment], length, out=np.zeros(len(segment)), where=length > 0)
        return segment, np.clip(part, 0.0, 1.0)

    def interpolate(self, segment: Ints, part: Floats) -> tuple[Ints, Floats]:
        """Face (n,) and barycentric coordinates (n, 3) of places on segments, given by their parts in 0 to 1."""
        weights = self.start[segment] * (1 - part)[:, None] + self.end[segment] * part[:, None]
        return self.face[segment], weights

    def take(self, chosen: Bools) -> SurfaceCurves:
        """The curves where ``chosen`` (C,) is true."""
        kept = chosen[self.owner]
        return SurfaceCurves(
            offsets_of(np.diff(self.offsets)[chosen]),
            self.closed[chosen],
            self.face[kept],
            self.start[kept],
            self.end[kept],
            self.is_vertex[kept],
            self.is_corner[kept],
            self.points[kept],
        )


def next_along(offsets: Ints, closed: Bools) -> Ints:
    """The next value along closed and open rows of a ragged array.

    Parameters
    ----------
    offsets : (C+1,) int64
    closed : (C,) bool

    Returns
    -------
    (n,) int64
        Index of the next value; the last of a closed row is followed by its first, that of an open one by itself.
    """
    after = next_in_loop(offsets)
    last = offsets[1:][~closed & (np.diff(offsets) > 0)] - 1
    after[last] = last
    return after
