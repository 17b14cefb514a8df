"""Values along a spanning forest: unknowns that are known up to a constant from pairwise differences.

Each component gets one root of value 0; the values of the others are sums along their paths to the root, found by
pointer doubling in O(n log n).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order

from weavecore.geometry.arrays import Ints, connected


def spread_sums(a: Ints, b: Ints, rise: Ints, n: int) -> Ints:
    """Solve ``x[b] - x[a] == rise`` on a spanning forest.

    Parameters
    ----------
    a, b : (k,) int64
        Pairs of unknowns, none with itself.
    rise : (k,) int64
        Their differences; those of pairs outside the forest are ignored.
    n : int
        How many unknowns there are.

    Returns
    -------
    (n,) int64
        0 at the least unknown of each component.
    """
    if len(a) == 0:
        return np.zeros(n, np.int64)
    roots = np.unique(connected(a, b, n)[1], return_index=True)[1]
    # One more unknown joins all components, so that one walk reaches them all.
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
    # The value of an unknown is the sum along its path to the root: pointer doubling.
    while (parent != n).any():
        x = x + x[parent]
        parent = parent[parent]
    return x[:n]


def spread_signs(a: Ints, b: Ints, product: Ints, n: int) -> Ints:
    """Solve ``x[a] * x[b] == product`` for signs on a spanning forest.

    Parameters
    ----------
    a, b : (k,) int64
    product : (k,) int64
        1 or -1.
    n : int

    Returns
    -------
    (n,) int64
        1 or -1.
    """
    signs: Ints = 1 - 2 * (spread_sums(a, b, (1 - product) // 2, n) % 2)
    return signs
