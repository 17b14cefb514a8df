"""More nodes on selvedges where faces of the lattice look against the surface.

A border from which no distance starts may be far smaller than an edge, or nearly touch another.  Its nodes are
then too few for its shape: a chord leaves the surface, and faces beyond it are turned over.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.linking.selvedges import Hem, Selvedge, number_hem, points_on


def loosen(hem: Hem, fallen: Ints, n_nodes: Ints) -> Hem:
    """The selvedges with one more node on each edge that a fallen face lies on.

    The new one is the vertex of the selvedge farthest from the edge; an edge that the selvedge follows gets none.

    Parameters
    ----------
    hem : Hem
    fallen : (k, 3) int64
        Nodes of the faces that look against the surface.
    n_nodes : (P,) int64
        Number of nodes of each polyline.
    """
    sides = np.concatenate([fallen[:, [0, 1]], fallen[:, [1, 2]], fallen[:, [2, 0]]])
    fallen_sides = {(min(side), max(side)) for side in sides.tolist()}
    stations = [
        np.sort(np.concatenate([own, _farthest_off(selvedge, own, nodes, fallen_sides)]))
        for selvedge, own, nodes in zip(hem.selvedges, hem.stations, hem.nodes)
    ]
    return number_hem(hem.selvedges, stations, n_nodes)


def _farthest_off(selvedge: Selvedge, stations: Floats, nodes: Ints, sides: set[tuple[int, int]]) -> Floats:
    """The station of one vertex for each of these edges."""
    ends = np.append(stations, stations[0] + selvedge.length) if selvedge.closed else stations
    after = np.append(nodes, nodes[0]) if selvedge.closed else nodes
    found = []
    for k in range(len(ends) - 1):
        if (min(after[k], after[k + 1]), max(after[k], after[k + 1])) in sides:
            known = np.concatenate([selvedge.stations, selvedge.stations + selvedge.length])
            inner = known[(known > ends[k]) & (known < ends[k + 1])]
            off = _heights(points_on(selvedge, np.append(inner, ends[k : k + 2]) % selvedge.length))
            if len(inner) and off.max() > 0:
                found.append(float(inner[off.argmax()]) % selvedge.length)
    return np.array(found)


def _heights(points: Floats) -> Floats:
    """How far points are from the line through the last two of them, which are left out."""
    start, end = points[-2:]
    along = (end - start) / max(float(np.linalg.norm(end - start)), np.finfo(float).tiny)
    arm = points[:-2] - start
    return np.asarray(np.linalg.norm(arm - (arm @ along)[:, None] * along, axis=1))
