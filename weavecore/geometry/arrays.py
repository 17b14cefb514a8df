"""Freezing arrays, and the arithmetic of ragged ones.

A *ragged* array is many short arrays end to end in ``values``, with ``offsets``
(P+1,) telling where each begins, in the manner of shapely 2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
