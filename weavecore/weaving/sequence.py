"""The order of construction: borders first, ring after ring, and the other rods woven in between.

A basket maker sets the rings and binds them with rods that bend in and out (Yan et al. 2016, §3).  Set all
at first, the rings would hang free until the last of them stands; so a rod is woven in as soon as two rings that
follow each other along it do, and the rings beyond are tied to the rods that wait for them.  A *ring* is a closed
rod of the latitudinal family, or any rod of it where free borders cut the latitudes open.  Elsewhere open rods of that
family count among the others.

All is sorting of visits: O(M log M).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.model.lattice import LATITUDINAL, node_generations
from weavecore.model.sequence import BuildSequence
from weavecore.model.strands import first_generations
from weavecore.model.weave import Weave

_NONE = -1

_LESS_THAN_HALF = 0.49
"""Bound of what a mean depth adds to the generation of a cut ring: below a half, so that it is rounded off."""


@dataclass(frozen=True, eq=False)
class _Rings:
    """Which strands (S,) are rings, how deep each lies, the ring at each node (N,) or -1, and where along it."""

    is_ring: Bools
    depth: Floats
    at_node: Ints
    place: Ints

    @cached_property
    def generation(self) -> Ints:
        """(S,) of the nearest latitude."""
        generation: Ints = np.rint(self.depth).astype(np.int64)
        return generation

    @cached_property
    def rank(self) -> Ints:
        """(S,) when each ring is set: rings before the other strands, from the borders inwards."""
        order = np.lexsort([np.arange(len(self.depth)), self.depth, ~self.is_ring])
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        return rank


def find_sequence(weave: Weave, *, spread: Sequence[int] = ()) -> BuildSequence:
    """Order the rods so that each can be set when its turn comes.

    All rings of a generation come before the rods that bind them to the generation before, and
    those before the next generation.  Rods of one generation go around its rings.  A joint is tied in the
    step that sets the last of its rods.

    Parameters
    ----------
    weave : Weave
    spread : sequence of int
        Generations whose rods are set far from each other in turn, as bit reversal orders them, instead of one beside
        the other: the rings are then held all around early.

    Returns
    -------
    BuildSequence
    """
    strands = weave.strands
    rings = _find_rings(weave)
    links = _find_links(weave, rings)
    bound = _first_bound(links, rings, len(strands))
    generation, place = rings.generation.copy(), np.zeros(len(strands), np.int64)
    # A rod without a ring has its turn when the rings about its least depth stand.
    lone = ~rings.is_ring & (bound[:, 0] == _NONE)
    generation[lone] = np.floor(_least_depth(weave)[lone])
    bind = np.flatnonzero(~rings.is_ring & ~lone)
    generation[bind] = rings.generation[bound[bind, :2]].max(axis=1)
    place[bind] = bound[bind, 2]
    base = np.where(rings.is_ring | lone, rings.rank, rings.rank[bound[:, 0]])
    is_spread = np.isin(generation, np.asarray(spread, np.int64)) & ~rings.is_ring
    place = np.where(is_spread, _spread_places(base, place, rings.rank), place)
    order = np.lexsort([rings.rank, place, base, lone, ~rings.is_ring, generation])
    step = np.empty(len(order), np.int64)
    step[order] = np.arange(len(order))
    return BuildSequence(
        order, rings.is_ring[order], generation[order], *_ties(weave, step), *_needs(links, bound, rings, step)
    )


def _spread_places(base: Ints, place: Ints, rank: Ints) -> Ints:
    """(S,) the places of rods around each base, in bit reversal: halves first, then quarters, and so on."""
    order = np.lexsort([rank, place, base])
    first = np.searchsorted(base[order], base[order])
    index = np.arange(len(order)) - first
    reversed_bits = np.zeros(len(order), np.int64)
    for _ in range(max(len(order) - 1, 1).bit_length()):
        reversed_bits = 2 * reversed_bits + index % 2
        index = index // 2
    spread = np.empty(len(order), np.int64)
    spread[order] = reversed_bits
    return spread


def _least_depth(weave: Weave) -> Floats:
    strands = weave.strands
    depth: Floats = np.minimum.reduceat(node_generations(weave.lattice)[strands.nodes], strands.offsets[:-1])
    return depth


def _find_rings(weave: Weave) -> _Rings:
    strands = weave.strands
    owner = rows_of(strands.offsets)
    is_cut_open = not weave.lattice.latitudes.polylines.closed.all()
    is_ring = (strands.family == LATITUDINAL) & (strands.closed | is_cut_open)
    counts = np.diff(strands.offsets)
    mean = np.bincount(owner, node_generations(weave.lattice)[strands.nodes], minlength=len(strands)) / counts
    if is_cut_open:
        # A cut ring may follow a free border to any depth: its turn comes with the first latitude that it touches.
        mean = first_generations(strands, weave.lattice) + _LESS_THAN_HALF * mean / (1.0 + mean.max())
    visit = np.flatnonzero(is_ring[owner])[::-1]  # Where two rings cross, the first has the node.
    at_node = np.full(weave.lattice.n_nodes, _NONE, np.int64)
    place = np.zeros(weave.lattice.n_nodes, np.int64)
    at_node[strands.nodes[visit]] = owner[visit]
    place[strands.nodes[visit]] = visit - strands.offsets[owner[visit]]
    return _Rings(is_ring, mean, at_node, place)


def _find_links(weave: Weave, rings: _Rings) -> Ints:
    """Rows (n, 4): rod, ring that it passes, ring that it passes next, and how far along the first that is.

    The ring that is set first stands first.  A rod that passes one ring alone has a row with that ring twice.
    """
    strands = weave.strands
    owner = rows_of(strands.offsets)
    ring, place = rings.at_node[strands.nodes], rings.place[strands.nodes]
    a = np.flatnonzero(~rings.is_ring[owner] & (ring != _NONE))
    b = np.append(a[1:], a[-1:])
    b = np.where(owner[b] == owner[a], b, a)
    swap = rings.rank[ring[b]] < rings.rank[ring[a]]
    a, b = np.where(swap, b, a), np.where(swap, a, b)
    links: Ints = np.stack([owner[a], ring[a], ring[b], place[a]], axis=1)
    return links


def _first_bound(links: Ints, rings: _Rings, n_strands: int) -> Ints:
    """(S, 3) of each rod the two rings that it binds first, and where along the first; -1 where there is none."""
    rod, low, high, place = links.T
    order = np.lexsort([place, rings.rank[low], rings.rank[high], low == high, rod])
    rods, first = np.unique(rod[order], return_index=True)
    bound = np.full((n_strands, 3), _NONE, np.int64)
    bound[rods] = links[order[first], 1:]
    return bound


def _ties(weave: Weave, step: Ints) -> tuple[Ints, Ints]:
    """Ragged: the joints of which each step sets the last rod."""
    joints = weave.joints
    if len(joints) == 0:
        return np.zeros(len(step) + 1, np.int64), np.zeros(0, np.int64)
    last = np.maximum.reduceat(step[joints.strand], joints.offsets[:-1])
    return offsets_of(np.bincount(last, minlength=len(step))), np.argsort(last, kind="stable")


def _needs(links: Ints, bound: Ints, rings: _Rings, step: Ints) -> tuple[Ints, Ints]:
    """Ragged: the earlier steps that each step needs."""
    _, low, high, _ = links.T
    deeper = rings.generation[low] < rings.generation[high]
    rods = np.flatnonzero(bound[:, 0] != _NONE)
    needs = np.concatenate(
        [
            np.stack([step[high[deeper]], step[low[deeper]]], axis=1),
            np.stack([step[rods], step[bound[rods, 0]]], axis=1),
            np.stack([step[rods], step[bound[rods, 1]]], axis=1),
        ]
    )
    needs = np.unique(needs, axis=0)
    return offsets_of(np.bincount(needs[:, 0], minlength=len(step))), needs[:, 1]
