"""Finding the edge between two nodes."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Ints


def edges_between(edges: Ints, one: Ints, other: Ints) -> Ints:
    """Number of the edge between each two nodes, whichever comes first, in the shape in which these are given.

    Parameters
    ----------
    edges : (E, 2) int64
        Each once, the lesser node first.
    one, other : int64
        Nodes that are joined by one of them.
    """
    n = np.int64(edges.max(initial=0) + 1)
    keys = edges[:, 0] * n + edges[:, 1]
    order = np.argsort(keys)
    wanted = np.minimum(one, other) * n + np.maximum(one, other)
    found: Ints = order[np.searchsorted(keys, wanted, sorter=order)]
    return found
