r"""Pairs of edges at a node that one rod follows.

A *dart* is an edge with a direction: dart ``2 * e`` leaves the first node of edge ``e``, dart ``2 * e + 1`` its second.
At each node the darts are paired so that rods bend least: two rods that cross at a node of four edges each go straight
across; elsewhere the least bend goes first.  No rod turns by more than `MOST_TURN`: a ring that would is broken.  The
ends of a broken ring run on along links only where a rod would be short otherwise (`rod_ends`), and for such a rod a
long ring may be opened::

        ring \   / ring
              \ /
               X            two short rods from the border below go straight on along the two ends of the ring
              / \
       short /   \ short

Complexity O(E log E).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, unit_vectors
from weavecore.geometry.elementary import angles_between
from weavecore.geometry.matching import match_greedily, pairs_of_equals
from weavecore.geometry.polygon_mesh import NONE, darts_across, find_fans
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.rod_ends import LAST_RESORT, RING, USUAL, lengthen_short_rods

MOST_TURN = np.radians(44.0)
"""A rod that would turn more than this at one node ends there, rings too: two rods cross and run past.  The offsets
over and under add up to a degree, and 45° is the most that the axis should turn."""


@dataclass(frozen=True, eq=False)
class DartPairs:
    """The pairs of darts of one node that rods may follow, before any are broken.

    Parameters
    ----------
    one, other : (k,) int64
    bend : (k,) float64
        Angle by which a rod turns there.
    cost : (k,) float64
        The least is paired first.
    is_alike : (k,) bool
        Whether both run along rings, or neither.
    kind : (k,) int64
        `USUAL`, `LAST_RESORT` or `RING` of `rod_ends`.
    is_choice : (k,) bool
        Whether a short rod may be lengthened by the pair.
    cheapest : (2E,) int64
        For each dart the one that it is paired with if the cheapest pairs are taken first, or -1.
    """

    one: Ints
    other: Ints
    bend: Floats
    cost: Floats
    is_alike: Bools
    kind: Ints
    is_choice: Bools
    cheapest: Ints


def find_dart_pairs(lattice: Lattice) -> DartPairs:
    """Find the pairs of darts that rods may follow.

    Parameters
    ----------
    lattice : Lattice
    """
    tail = lattice.edges.ravel()
    family = np.repeat(lattice.edge_family, 2)
    is_ring = family == LATITUDINAL
    one, other = pairs_of_equals(tail)
    bend = turns_between(lattice, one, other)
    straight, on_border = _darts_straight_on(lattice)
    is_straight = straight[one] == other
    # A rod that comes to a border ends there: it cannot cross what lies beyond.
    allowed = (bend <= MOST_TURN) & (is_straight | ~on_border[tail[one]])
    one, other, bend, is_straight = one[allowed], other[allowed], bend[allowed], is_straight[allowed]
    # Straight pairs come first, then pairs of one family, then the least bend.
    cost = bend - 2.0 * np.pi * is_straight + np.pi * (family[one] != family[other])
    # Pairs at crossings stay, and along borders; edges that may go on to several others are exchanged.
    is_free = np.where(is_ring, ~on_border[tail], straight == NONE)
    kind = np.array([USUAL, LAST_RESORT, RING])[is_ring[one].astype(np.int64) + is_ring[other]]
    # A longitude may go on through a pocket, where nothing of its own kind goes on.
    alike, is_choice = is_ring[one] == is_ring[other], is_free[one] & is_free[other]
    cheapest = match_greedily(one[alike], other[alike], cost[alike], len(tail))
    return DartPairs(one, other, bend, cost, alike, kind, is_choice, cheapest)


def turns_between(lattice: Lattice, one: Ints, other: Ints) -> Floats:
    """Angles (k,) in radians by which a rod turns from one dart to another of the same node.

    Parameters
    ----------
    lattice : Lattice
    one, other : (k,) int64
    """
    tail, head = lattice.edges.ravel(), lattice.edges[:, ::-1].ravel()
    away = unit_vectors(lattice.nodes[head] - lattice.nodes[tail])
    turns: Floats = np.pi - angles_between(away[one], away[other])
    return turns


def pair_darts(lattice: Lattice, cuts: Optional[Ints] = None, pairs: Optional[DartPairs] = None) -> Ints:
    """Find the dart on which a rod that arrives along another goes on.

    Parameters
    ----------
    lattice : Lattice
    cuts : (k, 2) int64, optional
        Pairs of darts of one node that no rod may follow.
    pairs : DartPairs, optional
        From `find_dart_pairs`, where they are known.

    Returns
    -------
    (2E,) int64
        For each dart the other dart at the same node that belongs to the same rod, -1 where the rod ends.
    """
    if pairs is None:
        pairs = find_dart_pairs(lattice)
    one, other, tail = pairs.one, pairs.other, lattice.edges.ravel()
    partner, choice = pairs.cheapest, pairs.is_choice
    if cuts is not None:
        is_cut_node = np.zeros(lattice.n_nodes, bool)
        is_cut_node[tail[cuts[:, 0]]] = True
        there, n = np.flatnonzero(is_cut_node[tail[one]]), len(tail)
        keys = np.minimum(one, other)[there] * n + np.maximum(one, other)[there]
        allowed = ~np.isin(keys, cuts.min(axis=1) * n + cuts.max(axis=1))
        alike = there[allowed & pairs.is_alike[there]]
        # Which darts of a node are paired does not depend on other nodes.
        anew = match_greedily(one[alike], other[alike], pairs.cost[alike], n)
        partner, choice = np.where(is_cut_node[tail], anew, partner), choice.copy()
        choice[there[~allowed]] = False
    return lengthen_short_rods(partner, tail, one[choice], other[choice], pairs.bend[choice], pairs.kind[choice])


def _darts_straight_on(lattice: Lattice) -> tuple[Ints, Bools]:
    """For each dart (2E,) the one that goes straight on at the same node, or -1 where the bend decides.

    At a node where two rods cross it is the dart across, at a node on a border the other dart along the border.
    Without it two rods of one family, as in kagome, could swap at a sharp crossing for a smaller bend.
    Also whether each node (N,) is on a border.
    """
    fans = find_fans(lattice.face_offsets, lattice.face_nodes, lattice.edges, lattice.n_nodes)
    across = darts_across(fans, lattice.edges)
    node, is_ring = lattice.edges.ravel(), np.repeat(lattice.edge_family == LATITUDINAL, 2)
    known = np.flatnonzero(across != NONE)
    is_mixed = np.zeros(lattice.n_nodes, bool)
    is_mixed[node[known[is_ring[known] != is_ring[across[known]]]]] = True
    across[is_mixed[node]] = NONE
    border = np.flatnonzero(fans.on_border)
    first, last = (side[border] for side in (fans.first_side, fans.last_side))
    first, last = 2 * first + (lattice.edges[first, 1] == border), 2 * last + (lattice.edges[last, 1] == border)
    across[first], across[last] = last, first
    return across, fans.on_border
