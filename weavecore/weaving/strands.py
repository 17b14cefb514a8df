"""Strands: which edges of a lattice one rod follows through the nodes.

A *dart* is an edge with a direction: dart ``2 * e`` runs along edge ``e`` as it is listed, dart ``2 * e + 1`` back.
At each node the edges are paired so that rods bend little and few are short (`rod_pairing`); a dart is followed by the
one that leaves the node along the partner of its edge.  Chains of followers are the connected components of that
relation, ordered by one breadth-first walk: O(E).

Strands that pass one node are gathered by it (`SharedNodes`): these nodes become the joints of the weave.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Bools, Ints, offsets_of, ranks_in_rows, rows_of
from weavecore.geometry.matching import ALONE
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL, POCKET, Lattice
from weavecore.model.rod_pairing import DartPairs, pair_darts
from weavecore.model.strands import Strands

_NONE = ALONE


def find_strands(lattice: Lattice, cuts: Optional[Ints] = None, pairs: Optional[DartPairs] = None) -> Strands:
    """Chain the edges into rods that bend little at the nodes.

    Parameters
    ----------
    lattice : Lattice
    cuts : (k, 2) int64, optional
        Pairs of darts of one node that no rod may follow.
    pairs : DartPairs, optional
        From `find_dart_pairs`, where they are known.

    Returns
    -------
    Strands
        Every edge in exactly one.  Family by family, those with edges of several families as longitudinal ones; those
        along the latitudes in the order of these, the others by their least edge.  A closed strand begins with its
        least edge, an open one with the end that gives the lesser first dart.
    """
    follower = _followers(lattice, cuts, pairs)
    n = len(follower)
    if n == 0:
        return Strands(np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, bool))
    dart = np.arange(n)
    follows = follower != _NONE
    before = np.full(n, _NONE, np.int64)
    before[follower[follows]] = dart[follows]
    links = csr_matrix((np.ones(int(follows.sum()), np.int8), (dart[follows], follower[follows])), shape=(n, n))
    count, label = connected_components(links, directed=False)
    chain = label.astype(np.int64)
    least = np.empty(count, np.int64)
    least[chain[::-1]] = dart[::-1]
    # Each strand is found in both directions; the one that holds the lesser dart is kept.
    kept = least[chain] < least[chain[dart ^ 1]]
    is_open = np.zeros(count, bool)
    start = least.copy()
    heads = np.flatnonzero(kept & (before == _NONE))
    is_open[chain[heads]] = True
    start[chain[heads]] = heads
    chains = np.unique(chain[kept])
    family = _families(lattice.edge_family[dart // 2], chain, count)[chains]
    order = np.lexsort((least[chains], family))
    chains, family = chains[order], family[order]
    return _in_order(lattice, follower, before, chain, chains, family, start, is_open)


def darts_at(lattice: Lattice, strands: Strands, visits: Bools) -> Ints:
    """The pair of darts (k, 2) on which a rod arrives at each marked visit inside it, turned round, and goes on.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    visits : (M,) bool
    """
    at = np.flatnonzero(visits)
    here = strands.nodes[at]
    pairs = []
    for beside in (strands.nodes[strands.preceding[at]], strands.nodes[strands.following[at]]):
        edge = edges_between(lattice.edges, here, beside)
        pairs.append(2 * edge + (lattice.edges[edge, 1] == here))
    return np.stack(pairs, axis=1)


def families_along(strands: Strands, lattice: Lattice) -> Ints:
    """Family (S,) of each strand by its edges: theirs, or longitudinal if they have several.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice
    """
    before, after = steps_along(strands)
    edge = edges_between(lattice.edges, strands.nodes[before], strands.nodes[after])
    return _families(lattice.edge_family[edge], rows_of(strands.offsets)[before], len(strands))


def _families(family: Ints, chain: Ints, count: int) -> Ints:
    """Family (count,) of each chain of darts: that of all of its edges, or longitudinal if there is more than one."""
    families = np.full(count, POCKET)
    families[chain] = family
    has_several = np.zeros(count, bool)
    has_several[chain[family != families[chain]]] = True
    families[has_several] = LONGITUDINAL
    return families


def _in_order(
    lattice: Lattice,
    follower: Ints,
    before: Ints,
    chain: Ints,
    chains: Ints,
    family: Ints,
    start: Ints,
    is_open: Bools,
) -> Strands:
    """The strands of chains of darts, in the order of ``chains``.

    The chains are linked one behind the other, so that one walk in compiled code orders all darts.
    """
    n = len(follower)
    after = follower.copy()
    first = start[chains]
    last = np.full(len(is_open), _NONE, np.int64)
    ends = np.flatnonzero(follower == _NONE)
    last[chain[ends]] = ends
    closed = ~is_open[chains]
    last[chains[closed]] = before[first[closed]]
    after[last[chains]] = np.append(first[1:], _NONE)
    dart = np.flatnonzero(after != _NONE)
    graph = csr_matrix((np.ones(len(dart), np.int8), (dart, after[dart])), shape=(n, n))
    order = breadth_first_order(graph, int(first[0]), return_predecessors=False).astype(np.int64)
    tails = lattice.edges.ravel()[order]
    heads = lattice.edges.ravel()[order ^ 1]
    size = np.bincount(chain[order], minlength=len(is_open))[chains]
    # An open strand has one node more than it has edges.
    offsets = offsets_of(size + is_open[chains])
    nodes = np.empty(offsets[-1], np.int64)
    inside = np.ones(len(nodes), bool)
    inside[offsets[1:][~closed] - 1] = False
    nodes[inside] = tails
    nodes[~inside] = heads[np.cumsum(size)[~closed] - 1]
    return Strands(offsets, nodes, family, closed)


def _followers(lattice: Lattice, cuts: Optional[Ints], pairs: Optional[DartPairs]) -> Ints:
    """The dart that follows each dart, -1 where the rod ends."""
    # A dart arrives where its reverse leaves.
    follower: Ints = pair_darts(lattice, cuts, pairs)[np.arange(2 * lattice.n_edges) ^ 1]
    return follower


def part_at_latitudes(strands: Strands, lattice: Lattice) -> Strands:
    """Part strands where they leave a latitude or come to one, so that each runs along latitudes or across them.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice

    Returns
    -------
    Strands
        The parts of a strand follow each other in its place; those along latitudes are `LATITUDINAL`, the others keep
        its family.
    """
    before, after = steps_along(strands)
    is_ring = np.zeros(len(strands.nodes), bool)
    edge = edges_between(lattice.edges, strands.nodes[before], strands.nodes[after])
    is_ring[before] = lattice.edge_family[edge] == LATITUDINAL
    rows: list[Ints] = []
    families: list[int] = []
    closed: list[bool] = []
    for s in range(len(strands)):
        nodes, is_closed = strands.strand(s), bool(strands.closed[s])
        rings = is_ring[strands.offsets[s] : strands.offsets[s + 1]][: len(nodes) - (not is_closed)]
        if is_closed and not (rings == rings[0]).all():
            first = int(np.flatnonzero(rings != np.roll(rings, 1))[0])
            rings, nodes = np.roll(rings, -first), np.append(np.roll(nodes, -first), nodes[first])
            is_closed = False
        cuts = [0, *(np.flatnonzero(np.diff(rings)) + 1).tolist(), len(rings)]
        for begin, end in zip(cuts[:-1], cuts[1:]):
            rows.append(nodes[begin:end] if is_closed else nodes[begin : end + 1])
            families.append(LATITUDINAL if rings[begin] else int(strands.family[s]))
            closed.append(is_closed)
    offsets = offsets_of([len(row) for row in rows])
    return Strands(offsets, np.concatenate(rows), np.array(families), np.array(closed)) if rows else strands


@dataclass(frozen=True, eq=False)
class SharedNodes:
    """The nodes that two or more rods pass, their visits in the order of the strands.

    Parameters
    ----------
    node : (J,) int64
    offsets : (J+1,) int64
    visit : (…,) int64
        Entries of ``strands.nodes``.
    joint_of_visit : (M,) int64
        For every visit its joint, or -1.
    """

    node: Ints
    offsets: Ints
    visit: Ints
    joint_of_visit: Ints

    @property
    def counts(self) -> Ints:
        """(J,) rods at each joint."""
        return np.diff(self.offsets)


def find_shared_nodes(strands: Strands) -> SharedNodes:
    """Find the nodes that two or more rods pass.

    Parameters
    ----------
    strands : Strands

    Returns
    -------
    SharedNodes
        Nodes rise; the visits of each are in the order of the strands.
    """
    order = np.argsort(strands.nodes, kind="stable")
    node, first, count = np.unique(strands.nodes[order], return_index=True, return_counts=True)
    shared = count > 1
    offsets = offsets_of(count[shared])
    visit = order[np.repeat(first[shared], count[shared]) + ranks_in_rows(count[shared])]
    joint = np.full(len(strands.nodes), -1, np.int64)
    joint[visit] = rows_of(offsets)
    return SharedNodes(node[shared], offsets, visit, joint)


def steps_along(strands: Strands) -> tuple[Ints, Ints]:
    """Pairs of visits that follow each other along a strand, the closing step of rings included.

    Parameters
    ----------
    strands : Strands

    Returns
    -------
    before, after : (k,) int64
        Entries of ``strands.nodes``.
    """
    start = np.flatnonzero(strands.following >= 0)
    return start, strands.following[start]
