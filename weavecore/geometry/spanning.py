"""Unknowns tied in pairs: values along a spanning forest."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order

from weavecore.geometry.arrays import Ints, connected


def spread_sums(a: Ints, b: Ints, rise: Ints, n: int) -> Ints:
    """Whole numbers x (n,) with ``x[b] - x[a] == rise`` for every tie of a spanning forest; 0 at its roots.

    Parameters
    ----------
    a, b, rise : (k,) int64
        The ties, none from an unknown to itself.
    n : int
    """
    if len(a) == 0:
        return np.zeros(n, np.int64)
    roots = np.unique(connected(a, b, n)[1], return_index=True)[1]
    # One more unknown joins all parts, so that one walk reaches them all.
    tails, heads = np.r_[a, np.full(len(roots), n)], np.r_[b, roots]
    graph = coo_matrix((np.ones(len(tails), np.int8), (tails, heads)), shape=(n + 1, n + 1)).tocsr()
    _, parent = breadth_first_order(graph, n, directed=False)
    parent = parent.astype(np.int64)
    parent[n] = n
    forth, first = np.unique(tails * (n + 1) + heads, return_index=True)
    rises = np.r_[rise, np.zeros(len(roots), np.int64)][first]
    child = np.arange(n + 1)
    x = np.zeros(n + 1, np.int64)
    for key, sign in ((parent * (n + 1) + child, 1), (child * (n + 1) + parent, -1)):
        at = np.minimum(np.searchsorted(forth, key), len(forth) - 1)
        found = forth[at] == key
        x[found] = sign * rises[at[found]]
    # The value of an unknown is the sum along its way to the root, found by doubling the steps.
    while (parent != n).any():
        x = x + x[parent]
        parent = parent[parent]
    return x[:n]


def spread_signs(a: Ints, b: Ints, product: Ints, n: int) -> Ints:
    """Signs x (n,) with ``x[a] * x[b] == product`` for every tie of a spanning forest."""
    signs: Ints = 1 - 2 * (spread_sums(a, b, (1 - product) // 2, n) % 2)
    return signs
