"""Step one (Yan et al. 2016, §5): every plain band, between one parent and one child, is zipped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.linking.feet import Feet
from weavecore.linking.phases import foot_indices
from weavecore.linking.zipping import match_rings, swap_diagonals, zip_rings
from weavecore.model.latitudes import Latitudes


@dataclass(frozen=True, eq=False)
class Zip:
    """The walk around one band, unrolled: nodes before each step, and whose step it is.

    Parameters
    ----------
    parent, child : (n + m,) int64
        Nodes of the lattice.
    is_parent : (n + m,) bool
        Whether the step advances along the parent.
    """

    parent: Ints
    child: Ints
    is_parent: Bools

    def triangles(self) -> Ints:
        """One triangle a step, counter-clockwise seen from outside."""
        next_parent, next_child = np.roll(self.parent, -1), np.roll(self.child, -1)
        third = np.where(self.is_parent, next_parent, next_child)
        # The band lies on the left of its parent and on the right of its child.
        triangles: Ints = np.c_[self.parent, third, self.child]
        return triangles

    def links(self) -> Ints:
        """(n + m, 2) the edges between the rings, the lesser node first."""
        links: Ints = np.sort(np.c_[self.parent, self.child], axis=1)
        return links


def zip_band(latitudes: Latitudes, band: int, feet: Feet, nodes: list[Floats], places: Floats) -> Optional[Zip]:
    """Zip a plain band; None where the child does not run around its parent once, or the rings are too small for it."""
    bands = latitudes.bands
    side = int(bands.offsets[band])
    parent, child = int(bands.polyline[side]), int(bands.polyline[side + 1])
    first = offsets_of([len(stations) for stations in nodes])
    n, m = len(nodes[parent]), len(nodes[child])
    own = first[child] + np.arange(m)
    other = first[parent] + np.arange(n)
    if not bands.is_left[side]:
        other = np.roll(other[::-1], 1)  # index -i of the parent comes i-th
    over = match_rings(_node_feet(latitudes, child, feet, nodes, n), n)
    if over is None:
        return None
    i, j, is_parent = swap_diagonals(places[other], places[own], *zip_rings(over, m))
    links = np.unique((i % n) * np.int64(m) + j % m)
    if len(links) < n + m:
        return None
    return Zip(other[i % n], own[j % m], is_parent)


def _node_feet(latitudes: Latitudes, child: int, feet: Feet, nodes: list[Floats], n_parent: int) -> Floats:
    """Index on the parent of the foot of each node of the child, between those of the samples beside it."""
    index = foot_indices(latitudes, child, feet, nodes)
    at = nodes[child] / float(latitudes.polylines.lengths[child]) * len(index)
    low = np.floor(at).astype(np.int64) % len(index)
    step = index[(low + 1) % len(index)] - index[low]
    step -= n_parent * np.rint(step / n_parent)
    feet_of_nodes: Floats = index[low] + (at - np.floor(at)) * step
    return feet_of_nodes
