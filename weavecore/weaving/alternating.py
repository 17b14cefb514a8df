"""Plain weave: at every joint a rod lies on the other side than at the joint before.

A joint of two rods has one unknown: which of them is over.  Two joints that follow each other
along a rod tie their unknowns to each other.  Where no loop of such ties contradicts itself all are met;
elsewhere a spanning forest is, and what is left is improved joint by joint.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Floats, Ints
from weavecore.model.strands import Strands
from weavecore.weaving.joints import Meetings, steps_along

_MOST_ROUNDS = 50


def alternate(strands: Strands, meetings: Meetings) -> Floats:
    """Where each visit wants to lie among its joint's: above the others with greater numbers (M,).

    At joints of two rods it is 1 and -1.  At joints of more it is the mean of what the
    neighbours along the rod leave; a ring of a border lies between the ends of the rods that it holds.
    """
    two = np.flatnonzero(meetings.counts == 2)
    first = meetings.offsets[:-1][two]
    sign = np.zeros(len(strands.nodes), np.int64)
    sign[meetings.visit[first]], sign[meetings.visit[first + 1]] = 1, -1
    before, after = steps_along(strands)
    tied = (sign[before] != 0) & (sign[after] != 0)
    a, b = meetings.joint_of_visit[before[tied]], meetings.joint_of_visit[after[tied]]
    # Of the unknowns x: sides are sign · x, and they must differ.
    unknown = _solve(a, b, -sign[before[tied]] * sign[after[tied]], len(meetings.node))
    side = (sign * unknown[meetings.joint_of_visit]).astype(np.float64)
    wish = np.zeros(len(side))
    np.subtract.at(wish, before, side[after])
    np.subtract.at(wish, after, side[before])
    return np.where(sign != 0, side, wish)


def _solve(a: Ints, b: Ints, product: Ints, n: int) -> Ints:
    """Signs x (n,) with ``x[a] * x[b] == product`` for as many ties as can be."""
    loop = a == b
    a, b, product = a[~loop], b[~loop], product[~loop]
    x = _spread(a, b, product, n)
    for _ in range(_MOST_ROUNDS):
        is_met = x[a] * x[b] == product
        gain = np.bincount(a, 1 - 2 * is_met, n) + np.bincount(b, 1 - 2 * is_met, n)
        # Neighbours must not be turned in the same round.
        best = np.full(n, -1.0)
        np.maximum.at(best, a, gain[b])
        np.maximum.at(best, b, gain[a])
        turned = (gain > 0) & (gain > best)
        if not turned.any():
            break
        x[turned] *= -1
    return x


def _spread(a: Ints, b: Ints, product: Ints, n: int) -> Ints:
    """Signs that meet every tie of a spanning forest."""
    if len(a) == 0:
        return np.ones(n, np.int64)
    graph = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(n, n)).tocsr()
    _, label = connected_components(graph, directed=False)
    roots = np.unique(label, return_index=True)[1]
    # One more vertex joins all parts, so that one walk reaches them all.
    hub = np.full(len(roots), n)
    graph = coo_matrix(
        (np.ones(len(a) + len(roots), np.int8), (np.r_[a, hub], np.r_[b, roots])), shape=(n + 1, n + 1)
    ).tocsr()
    _, parent = breadth_first_order(graph, n, directed=False)
    parent = parent.astype(np.int64)
    parent[n] = n
    low, high = np.minimum(a, b), np.maximum(a, b)
    key, first = np.unique(low * (n + 1) + high, return_index=True)
    child = np.arange(n)
    wanted = np.minimum(child, parent[:n]) * (n + 1) + np.maximum(child, parent[:n])
    at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
    x = np.ones(n + 1, np.int64)
    x[:n] = np.where(key[at] == wanted, product[first[at]], 1)
    # The sign of a vertex is the product along its way to the root, found by doubling the steps.
    while (parent != n).any():
        x = x * x[parent]
        parent = parent[parent]
        x[n] = 1
    return x[:n]
