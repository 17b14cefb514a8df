"""The cycles of a permutation, in order."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Ints, offsets_of


def order_cycles(after: Ints) -> tuple[Ints, Ints]:
    """Each cycle of ``after`` from its least element on; cycles by that element.

    The cycles are opened and strung one behind the other, so that one walk, in compiled code,
    orders them all.

    Parameters
    ----------
    after : (n,) int64
        A permutation of 0 … n - 1.

    Returns
    -------
    order : (n,) int64
        Elements, cycle after cycle.
    offsets : (C+1,) int64
    """
    n = len(after)
    if n == 0:
        return np.zeros(0, np.int64), np.zeros(1, np.int64)
    count, label = connected_components(_pointers(after), directed=False)
    index = np.arange(n)
    first = np.empty(count, np.int64)
    first[label[::-1]] = index[::-1]
    rank = np.argsort(first, kind="stable")
    starts = first[rank]
    before = np.empty(n, np.int64)
    before[after] = index
    follower = after.copy()
    follower[before[starts]] = np.roll(starts, -1)
    order = breadth_first_order(_pointers(follower), starts[0], return_predecessors=False)
    return order.astype(np.int64), offsets_of(np.bincount(label, minlength=count)[rank])


def _pointers(after: Ints) -> csr_matrix:
    n = len(after)
    return csr_matrix((np.ones(n, np.int8), after, np.arange(n + 1)), shape=(n, n))
