"""Seats: the nodes around some bands, each as it is seen from one side."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, offsets_of, rows_of
from weavecore.linking.selvedges import Hem
from weavecore.model.latitudes import Latitudes

NONE = -1


class Seats:
    """Numbers of the seats along sides of bands and along selvedges.

    A selvedge shares its ends with the sides of the polylines that end there.  A curve inside the surface has two
    sides, which meet at an end that no border cuts off.

    Attributes
    ----------
    node : (s,) int64
        The node of each seat.
    """

    def __init__(self, latitudes: Latitudes, nodes: list[Floats], hem: Hem, sides: Ints) -> None:
        bands = latitudes.bands
        polyline, is_left = bands.polyline[sides], bands.is_left[sides]
        counts = np.array([len(stations) for stations in nodes], np.int64)
        first = offsets_of(counts)
        own = [first[p] + np.arange(counts[p]) for p in polyline.tolist()]
        self._offsets = offsets_of([len(row) for row in own])
        self._hem = hem
        self._band = rows_of(bands.offsets)[sides]
        self._rank = {(p, left): rank for rank, (p, left) in enumerate(zip(polyline.tolist(), is_left.tolist()))}
        self._first_of_hem = int(first[-1])
        hem_nodes = first[-1] + np.arange(len(hem.places))
        self.node: Ints = np.concatenate([np.zeros(0, np.int64), *own, hem_nodes])
        self._alias = np.arange(len(self.node))
        on_border = {end for selvedge in hem.selvedges for end in (selvedge.first, selvedge.last)}
        for p in np.flatnonzero(~latitudes.polylines.closed).tolist():
            for end in (0, 1):
                left, right = self._end(p, end, left=True), self._end(p, end, left=False)
                if (p, end) not in on_border and NONE not in (left, right):
                    self._alias[right] = left

    def of_side(self, rank: int) -> Ints:
        """The seats along a side, in the order of its polyline's nodes."""
        return self._alias[self._offsets[rank] : self._offsets[rank + 1]]

    def of_selvedge(self, s: int) -> Ints:
        """The seats along a selvedge, its ends among them."""
        selvedge, nodes = self._hem.selvedges[s], self._hem.nodes[s]
        seats: Ints = self._offsets[-1] + nodes - self._first_of_hem
        if selvedge.first is not None and selvedge.last is not None:
            # Beyond the end of a polyline lies its left side, before its beginning as well.
            seats[0] = self._end(*selvedge.first, left=selvedge.first[1] == 1)
            seats[-1] = self._end(*selvedge.last, left=selvedge.last[1] == 0)
        return seats

    def band_of_selvedge(self, s: int) -> int:
        """The band on an open selvedge; -1 where that is not among those asked for, and of closed ones."""
        first = self._hem.selvedges[s].first
        rank = NONE if first is None else self._rank.get((first[0], first[1] == 1), NONE)
        return NONE if rank == NONE else int(self._band[rank])

    def _end(self, p: int, end: int, *, left: bool) -> int:
        rank = self._rank.get((p, left), NONE)
        return NONE if rank == NONE else int(self._offsets[rank + end]) - end
