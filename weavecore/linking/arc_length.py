"""Points and node indices at arc lengths along polylines.

A *station* is an arc length from the first point of a polyline.  The *node index* of a station on a divided
polyline counts its nodes: 2.5 lies halfway between nodes 2 and 3.  All look-ups are binary searches.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.model.polylines import Polylines
from weavecore.polling import poll


def points_at(polylines: Polylines, polyline: Ints, station: Floats) -> Floats:
    """Points at stations along polylines.

    Parameters
    ----------
    polylines : Polylines
    polyline : (n,) int64
        The polyline of each station.
    station : (n,) float64
        From 0 to the length of that polyline.

    Returns
    -------
    (n, 3) float64
    """
    return interpolated_at(polylines, polylines.points, polyline, station)


def interpolated_at(polylines: Polylines, values: Floats, polyline: Ints, station: Floats) -> Floats:
    """Values at stations along polylines, linear between those at their points.

    Parameters
    ----------
    polylines : Polylines
    values : (N, k) float64
        At the points of the polylines.
    polyline : (n,) int64
        The polyline of each station.
    station : (n,) float64
        From 0 to the length of that polyline.

    Returns
    -------
    (n, k) float64
    """
    return Located(polylines, polyline, station).values(values)


class Located:
    """Stations along polylines with the segments that they lie on.

    Parameters
    ----------
    polylines : Polylines
    polyline : (n,) int64
        The polyline of each station.
    station : (n,) float64
        From 0 to the length of that polyline.
    """

    def __init__(self, polylines: Polylines, polyline: Ints, station: Floats) -> None:
        poll()
        self._start = start = segments_at(polylines, polyline, station)
        length = polylines.segment_lengths[start]
        along = station - polylines.stations[start]
        self._part = np.divide(along, length, out=np.zeros_like(along), where=length > 0)[:, None]
        ends = polylines.offsets[polyline + 1] - 1
        self._after = np.where(start == ends, polylines.offsets[polyline], start + 1)

    def values(self, at_points: Floats) -> Floats:
        """Values (n, k), linear between those (N, k) at the points of the polylines."""
        part = self._part
        first = at_points.take(self._start, axis=0)
        values: Floats = first + (at_points.take(self._after, axis=0) - first) * part
        return values


def segments_at(polylines: Polylines, polyline: Ints, station: Floats) -> Ints:
    """First point of the segment in which each station lies.

    Parameters
    ----------
    polylines : Polylines
    polyline : (n,) int64
    station : (n,) float64

    Returns
    -------
    (n,) int64
        Indices of ``polylines.points``.
    """
    # Stations of all polylines end to end make one rising row to search in.
    base, row = polylines.stations_end_to_end
    found = np.searchsorted(row, base[polyline] + station, side="right") - 1
    start: Ints = np.clip(found, polylines.offsets[polyline], polylines.offsets[polyline + 1] - 1)
    return start


def index_at(node_stations: Floats, length: float, station: Floats, *, closed: bool = True) -> Floats:
    """Node index of stations on one divided polyline.

    Parameters
    ----------
    node_stations : (n,) float64
        Rising stations of the nodes.
    length : float
        Of the polyline.
    station : (k,) float64
        On a closed polyline they may run on beyond its end; each turn adds n.
    closed : bool

    Returns
    -------
    (k,) float64
    """
    n = len(node_stations)
    if not closed:
        return np.interp(station, node_stations, np.arange(n, dtype=np.float64))
    turn = np.floor(station / length)
    known = np.concatenate([[node_stations[-1] - length], node_stations, [node_stations[0] + length]])
    index: Floats = np.interp(station - turn * length, known, np.arange(-1.0, n + 1)) + turn * n
    return index
