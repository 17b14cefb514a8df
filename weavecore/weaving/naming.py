r"""Names of the rods, a letter and a number, as they are written on tape.

The letter is the family: L for latitudes, A and B for longitudes that lean forward and back, P for pockets::

       next latitude   o-------o        A leans forward: the way in which the latitude runs,
                      / A   B \           the unexplored side on its left
       latitude  --->o---------o        B leans back

The lean of a strand is the sign of the sum of its slants over all its steps.  Linear in the visits, but for sorting.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.polygon_mesh import edges_between, find_fans
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, POCKET, Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.strands import steps_along

LETTERS = {(LATITUDINAL, 0): "L", (LONGITUDINAL, 1): "A", (LONGITUDINAL, -1): "B", (POCKET, 0): "P"}
"""First letter of a name by family and lean."""

_LEAST_SLANT = 0.02
"""Mean cosine to the latitudes below which a rod leans neither way: straight across, only noise would decide."""


def name_strands(strands: Strands, lattice: Lattice, lean: Ints) -> tuple[str, ...]:
    """Name each strand by a letter and a number.

    The numbers follow the place of a rod: its least generation, then the border or latitude that it
    starts at and how far along that, so that they stay when the spacing changes a little.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice
    lean : (S,) int64
        From `find_lean`.

    Returns
    -------
    tuple of str
        In the order of the strands; all different.
    """
    side = np.where(strands.family == LONGITUDINAL, np.where(lean < 0, -1, 1), 0)
    order = np.lexsort([*_places(strands, lattice)[::-1], side, strands.family])
    names = [""] * len(strands)
    for (family, leaning), letter in LETTERS.items():
        mine = order[(strands.family[order] == family) & (side[order] == leaning)]
        digits = max(2, len(str(len(mine))))
        for number, s in enumerate(mine.tolist(), start=1):
            names[s] = f"{letter}{number:0{digits}d}"
    return tuple(names)


def _places(strands: Strands, lattice: Lattice) -> tuple[Floats, Floats, Floats]:
    """Generation, latitude and part of its length (S,) at which each strand starts: the least that it visits."""
    latitudes = lattice.latitudes
    none = len(latitudes)
    latitude = np.where(lattice.node_latitude < 0, none, lattice.node_latitude)[strands.nodes]
    generation = np.append(latitudes.generation, latitudes.n_generations)[latitude]
    length = np.append(latitudes.polylines.lengths, 1.0)[latitude]
    part = lattice.node_station[strands.nodes] / length
    owner = rows_of(strands.offsets)
    order = np.lexsort([part, latitude, generation, owner])
    first = order[strands.offsets[:-1]]
    return generation[first].astype(float), latitude[first].astype(float), part[first]


@dataclass(frozen=True, eq=False)
class Slants:
    """What the edges of a lattice add to the lean of a rod that follows them, either way.

    Parameters
    ----------
    slant : (E,) float64
        Cosine to the latitudes where an edge leaves one for the next, positive if it leans forward.
    inside : (E,) bool
        Whether an edge lies inside the surface, or the surface has no free border.
    """

    slant: Floats
    inside: Bools


def find_slants(lattice: Lattice) -> Slants:
    """Find how the edges slant.

    Parameters
    ----------
    lattice : Lattice
    """
    a, b = lattice.edges.T
    ahead, depth = _latitude_tangents(lattice), lattice.node_depths
    step, mean = lattice.nodes[b] - lattice.nodes[a], ahead[a] + ahead[b]
    rises = np.sign(depth[b] - depth[a])
    size = np.linalg.norm(step, axis=1) * np.maximum(np.linalg.norm(mean, axis=1), np.finfo(float).tiny)
    slant = rises * (step * mean).sum(1) / np.maximum(size, np.finfo(float).tiny)
    inside = np.ones(lattice.n_edges, bool)
    if lattice.latitudes.surface.is_free_border.any():
        inside = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes).n_faces > 1
    return Slants(slant, inside)


def find_lean(strands: Strands, lattice: Lattice, slants: Optional[Slants] = None) -> Ints:
    """Whether each strand leans forward (1) or back (-1) as it leaves a latitude for the next, or neither (0).

    Forward is the way in which the latitude runs, the unexplored side on its left.  Both
    ways of going along a strand agree on that, and so do two fronts that meet.  A rod along a free border leans
    neither way: it holds the ends of those that lean forward and of those that lean back.  Nor does a rod that follows
    a ring for most of its way.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice
    slants : Slants, optional
        From `find_slants`, where they are known.

    Returns
    -------
    (S,) int64
    """
    slants = slants or find_slants(lattice)
    before, after = steps_along(strands)
    edge = edges_between(lattice.edges, strands.nodes[before], strands.nodes[after])
    owner, n = strands.owner[before], len(strands)
    total, steps = np.bincount(owner, slants.slant[edge], n), np.bincount(owner, minlength=n)
    lean: Ints = np.sign(np.where(np.abs(total) > _LEAST_SLANT * steps, total, 0.0)).astype(np.int64)
    lean[2 * np.bincount(owner, lattice.edge_family[edge] == LATITUDINAL, n) > steps] = 0
    lean[np.bincount(owner, slants.inside[edge], n) == 0] = 0
    return lean


def _latitude_tangents(lattice: Lattice) -> Floats:
    """(N, 3) direction of the latitude at each node that lies on one, else 0."""
    on = np.flatnonzero(lattice.node_latitude >= 0)
    order = on[np.lexsort([lattice.node_station[on], lattice.node_latitude[on]])]
    latitude = lattice.node_latitude[order]
    first = np.searchsorted(latitude, latitude, side="left")
    count = np.searchsorted(latitude, latitude, side="right") - first
    rank = np.arange(len(order)) - first
    closed = lattice.latitudes.polylines.closed[latitude]
    # An open latitude does not go on from its last node to its first.
    ahead = np.where(closed, (rank + 1) % count, np.minimum(rank + 1, count - 1))
    behind = np.where(closed, (rank - 1) % count, np.maximum(rank - 1, 0))
    tangents = np.zeros((lattice.n_nodes, 3))
    tangents[order] = lattice.nodes[order[first + ahead]] - lattice.nodes[order[first + behind]]
    size = np.linalg.norm(tangents, axis=1, keepdims=True)
    unit: Floats = np.divide(tangents, size, out=tangents, where=size > 0)
    return unit
