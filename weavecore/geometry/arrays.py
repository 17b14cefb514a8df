"""Freezing arrays, and the arithmetic of ragged ones.

A *ragged* array is many short arrays end to end in ``values``, with ``offsets``
(P+1,) telling where each begins, in the manner of shapely 2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, dtype: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Return a read-only, contiguous copy of ``values`` with the given dtype and shape (-1 = any)."""
    array = np.array(values, dtype=dtype, order="C", copy=True)
    if array.size == 0:
        array = array.reshape([max(n, 0) for n in shape])
    if array.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, array.shape)):
        raise ValueError(f"an array of shape {shape} was expected, not {array.shape}")
    array.flags.writeable = False
    return array


def offsets_of(counts: ArrayLike) -> Ints:
    """Offsets (P+1,) of ragged rows with the given lengths (P,)."""
    return np.concatenate([[0], np.cumsum(np.asarray(counts, np.int64))]).astype(np.int64)


def rows_of(offsets: Ints) -> Ints:
    """For each value of a ragged array the row that it belongs to."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def sorted_unique(values: Ints) -> Ints:
    """The different values, rising; faster than hashing them where they are few."""
    ordered = np.sort(values)
    keep = np.ones(len(ordered), bool)
    keep[1:] = ordered[1:] != ordered[:-1]
    unique: Ints = ordered[keep]
    return unique


def next_in_loop(offsets: Ints) -> Ints:
    """For each value of a ragged array of closed loops the index of the next one around its loop."""
    after = np.arange(1, offsets[-1] + 1)
    filled = np.diff(offsets) > 0
    after[offsets[1:][filled] - 1] = offsets[:-1][filled]
    return after


# ----------------------------------------------------------------------
# The cycles of a permutation, in order.


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


# ----------------------------------------------------------------------
# Rows of an array that are equal, found by sorting one hash of each instead of the rows.

_ODD = np.uint64(0x9E3779B97F4A7C15)
_SHIFT = np.uint64(32)


def first_equal_row(rows: NDArray[np.uint64]) -> Ints:
    """For each row (N, K) the least index of a row equal to it (N,).

    Sorting one number a row is four times as fast as sorting rows.  Where two different
    rows have the same hash, the rows are sorted after all.
    """
    if len(rows) == 0:
        return np.empty(0, np.int64)
    key = _hash(rows)
    order = np.argsort(key, kind="stable")
    same = _same_as_before(rows, order)
    if (~same & (key[order][1:] == key[order][:-1])).any():
        order = np.lexsort(rows.T)
        same = _same_as_before(rows, order)
    begins = np.concatenate([[True], ~same])
    first = np.empty(len(rows), np.int64)
    first[order] = order[begins][np.cumsum(begins) - 1]
    return first


def first_equal_point(points: Floats) -> Ints:
    """For each point (N, 3) the least index of one with the same coordinates; 0 and -0 are the same."""
    return first_equal_row(np.ascontiguousarray(points + 0.0).view(np.uint64))


def _same_as_before(rows: NDArray[np.uint64], order: Ints) -> NDArray[np.bool_]:
    ordered = rows[order]
    same: NDArray[np.bool_] = (ordered[1:] == ordered[:-1]).all(1)
    return same


def _hash(rows: NDArray[np.uint64]) -> NDArray[np.uint64]:
    key = rows[:, 0] * _ODD
    for column in rows.T[1:]:
        key ^= key >> _SHIFT
        key += column
        key *= _ODD
    key ^= key >> _SHIFT
    return key
