"""`Polylines`: many polylines on a mesh, as a ragged array."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen, next_in_loop, rows_of


@dataclass(frozen=True, eq=False)
class Polylines:
    """Polylines on a surface, as points and offsets (like the ragged arrays of shapely 2).

    Parameters
    ----------
    points : (N, 3) float64
        Points of all polylines, one polyline after the other.  The first point of a closed
        one is not repeated.
    offsets : (P+1,) int64
        Polyline ``p`` is ``points[offsets[p]:offsets[p + 1]]``.
    closed : (P,) bool
    face : (N,) int64
        A face of the mesh that each point lies in.
    barycentric : (N, 3) float64
        Weights of the corners of that face.
    """

    points: Floats
    offsets: Ints
    closed: Bools
    face: Ints
    barycentric: Floats

    def __post_init__(self) -> None:
        for name, dtype, shape in (
            ("points", np.float64, (-1, 3)),
            ("offsets", np.int64, (-1,)),
            ("closed", np.bool_, (len(self.offsets) - 1,)),
            ("face", np.int64, (len(self.points),)),
            ("barycentric", np.float64, (len(self.points), 3)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))
        if self.offsets[0] != 0 or self.offsets[-1] != len(self.points) or (np.diff(self.offsets) < 0).any():
            raise ValueError("offsets must rise from 0 to the number of points")

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def polyline(self, p: int) -> Floats:
        """The points (n, 3) of polyline ``p``."""
        points: Floats = self.points[self.offsets[p] : self.offsets[p + 1]]
        return points

    @property
    def counts(self) -> Ints:
        """(P,) number of points of each polyline."""
        return np.diff(self.offsets)

    @cached_property
    def owner(self) -> Ints:
        """(N,) polyline of each point."""
        return rows_of(self.offsets)

    @cached_property
    def segment_lengths(self) -> Floats:
        """(N,) length from each point to the next; 0 after the last of an open polyline."""
        after = next_in_loop(self.offsets)
        lengths: Floats = np.linalg.norm(self.points[after] - self.points, axis=1)
        is_open = ~self.closed & (self.counts > 0)
        lengths[self.offsets[1:][is_open] - 1] = 0.0
        return lengths

    @cached_property
    def lengths(self) -> Floats:
        """(P,) arc length of each polyline, closing segment included."""
        lengths: Floats = np.bincount(self.owner, self.segment_lengths, minlength=len(self)).astype(np.float64)
        return lengths

    @cached_property
    def stations(self) -> Floats:
        """(N,) arc length from the start of its polyline to each point."""
        total = np.concatenate([[0.0], np.cumsum(self.segment_lengths)])[:-1]
        stations: Floats = total - total[self.offsets[:-1]][self.owner] if len(total) else total
        return stations

    @cached_property
    def stations_end_to_end(self) -> tuple[Floats, Floats]:
        """Stations (N,) of all polylines as of one behind the other, after the start (P+1,) of each and the end."""
        start = np.concatenate([[0.0], np.cumsum(self.lengths)])
        return start, start[self.owner] + self.stations
