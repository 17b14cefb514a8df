"""Read-only arrays, products, ragged arrays, permutations and components: the array helpers of the package.

A *ragged* array is many short rows end to end in one array ``values``, with ``offsets`` (P+1,): row ``p`` is
``values[offsets[p]:offsets[p + 1]]``, as in shapely 2::

    values   a b c d e f g        offsets  0 3 3 7
             row 0 |  row 2       (row 1 is empty)

Everything here takes linear time, or the time of one sort.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.polling import each, poll

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def frozen(values: ArrayLike, dtype: Any, shape: tuple[int, ...]) -> NDArray[Any]:
    """Copy an array and make the copy read-only.

    Parameters
    ----------
    values : array_like
    dtype : data-type
        Of the copy.
    shape : tuple of int
        Expected shape; -1 where any length is allowed.

    Returns
    -------
    ndarray
        Read-only and contiguous in C order.

    Raises
    ------
    ValueError
        If the values have another shape.
    """
    array = np.array(values, dtype=dtype, order="C", copy=True)
    if array.size == 0:
        array = array.reshape([max(n, 0) for n in shape])
    if array.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, array.shape)):
        raise ValueError(f"an array of shape {shape} was expected, not {array.shape}")
    array.flags.writeable = False
    return array


# Long arrays

BLOCK = 16_384
"""Rows that are computed at once where a mesh has millions: what a block leaves between stays in the processor's cache,
and takes no memory worth mentioning."""


def blocks(n: int) -> Iterator[slice]:
    """Cover ``n`` rows by slices of up to `BLOCK`, with a poll before each.

    Parameters
    ----------
    n : int

    Yields
    ------
    slice
    """
    for start in each(range(0, n, BLOCK)):
        yield slice(start, min(start + BLOCK, n))


# Rows of vectors


def dots(a: Floats, b: Floats) -> Floats:
    """Inner products of rows; several times as fast as ``(a * b).sum(1)`` where rows are short.

    Parameters
    ----------
    a, b : (n, k) float64

    Returns
    -------
    (n,) float64
    """
    products: Floats = np.einsum("nk,nk->n", a, b)
    return products


def inner(a: Floats, b: Floats) -> float:
    """Inner product of two vectors; unlike BLAS, with the same last bit on every processor.

    Parameters
    ----------
    a, b : (n,) float64
    """
    return float((a * b).sum())


def small_products(a: Floats, b: Floats) -> Floats:
    """Products of stacks of small matrices; unlike BLAS, with the same last bit on every processor.

    Parameters
    ----------
    a : (..., n, k) float64
    b : (..., k, m) float64

    Returns
    -------
    (..., n, m) float64
    """
    total = a[..., :, 0, None] * b[..., None, 0, :]
    for k in range(1, a.shape[-1]):
        total += a[..., :, k, None] * b[..., None, k, :]
    return total


def unit_vectors(vectors: Floats) -> Floats:
    """Vectors divided by their lengths; those without a length stay 0.

    Parameters
    ----------
    vectors : (..., k) float64

    Returns
    -------
    (..., k) float64
    """
    unit: Floats = vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), np.finfo(float).tiny)
    return unit


def cross(a: Floats, b: Floats) -> Floats:
    """Cross products of rows; twice as fast as NumPy's, which takes any shape.

    Parameters
    ----------
    a, b : (n, 3) float64

    Returns
    -------
    (n, 3) float64
    """
    product = np.empty((len(a), 3))
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product[:, k] = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    return product


def face_vectors(vertices: Floats, faces: Ints) -> Floats:
    """Normals of triangles, as long as twice their areas.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Corners counter-clockwise seen from where the normals point.

    Returns
    -------
    (F, 3) float64
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return cross(b - a, c - a)


def edge_lengths(vertices: Floats, faces: Ints) -> Floats:
    """Lengths of the edges of triangles, in halfedge order.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64

    Returns
    -------
    (3F,) float64
    """
    lengths = np.empty((len(faces), 3))
    for k in blocks(len(faces)):
        corners = vertices[faces[k]]
        lengths[k] = np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2)
    return lengths.ravel()


def used_rows(rows: Floats, index: Ints) -> Floats:
    """The rows of an array that an index array of any shape names, each once."""
    used = np.zeros(len(rows), bool)
    used[index] = True
    return rows[used]


# Ragged arrays


def offsets_of(counts: ArrayLike) -> Ints:
    """Offsets of ragged rows from their lengths.

    Parameters
    ----------
    counts : (P,) array_like of int

    Returns
    -------
    (P+1,) int64
    """
    poll()
    return np.concatenate([[0], np.cumsum(np.asarray(counts, np.int64))]).astype(np.int64)


def rows_of(offsets: Ints) -> Ints:
    """Row of each value of a ragged array.

    Parameters
    ----------
    offsets : (P+1,) int64

    Returns
    -------
    (N,) int64
    """
    poll()
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def ranks_in_rows(counts: Ints) -> Ints:
    """Position of each value within its row: 0, 1, … for every row.

    Parameters
    ----------
    counts : (P,) int64
        Lengths of the rows.

    Returns
    -------
    (N,) int64
    """
    counts = np.asarray(counts, np.int64)
    ends = np.cumsum(counts)
    ranks: Ints = np.arange(ends[-1] if len(ends) else 0) - np.repeat(ends - counts, counts)
    return ranks


def ranges(starts: Ints, counts: Ints) -> Ints:
    """Many runs of consecutive indices, end to end: the gather index for chosen rows of a ragged array.

    Parameters
    ----------
    starts : (P,) int64
        First index of each run.
    counts : (P,) int64
        Length of each run.

    Returns
    -------
    (N,) int64
        ``starts[0], starts[0] + 1, …, starts[1], …``; row ``p`` of the result has ``counts[p]`` values.
    """
    run: Ints = np.repeat(starts, counts) + ranks_in_rows(counts)
    return run


def sorted_unique(values: Ints) -> Ints:
    """Different values in rising order; faster than hashing where they are few.

    Parameters
    ----------
    values : (N,) int64

    Returns
    -------
    (K,) int64
    """
    ordered = np.sort(values)
    keep = np.ones(len(ordered), bool)
    keep[1:] = ordered[1:] != ordered[:-1]
    unique: Ints = ordered[keep]
    return unique


def range_maxima(values: Floats, first: Ints, last: Ints) -> Floats:
    """Greatest of ``values[first:last]``, for many ranges of one array.

    A table holds the greatest of every 1, 2, 4… values in a row (a sparse table), and two of its entries cover a range.
    O(N log N) for the table, O(1) for each range.

    Parameters
    ----------
    values : (N,) float64
    first, last : (K,) int64

    Returns
    -------
    (K,) float64
        0 of an empty range.
    """
    greatest = np.zeros(len(first))
    count = np.maximum(last - first, 0)
    level = np.frexp(np.maximum(count, 1).astype(np.float64))[1] - 1
    row = np.asarray(values, np.float64)
    for k in range(int(level.max(initial=-1)) + 1):
        at = np.flatnonzero((level == k) & (count > 0))
        greatest[at] = np.maximum(row[first[at]], row[last[at] - 2**k])
        row = np.maximum(row[: len(row) - 2**k], row[2**k :]) if len(row) > 2**k else row
    return greatest


# Closed loops and permutations


def next_in_loop(offsets: Ints) -> Ints:
    """Index of the following value around each row of a ragged array, the first after the last.

    Parameters
    ----------
    offsets : (P+1,) int64

    Returns
    -------
    (N,) int64
        A permutation.
    """
    poll()
    after = np.arange(1, offsets[-1] + 1)
    filled = np.diff(offsets) > 0
    after[offsets[1:][filled] - 1] = offsets[:-1][filled]
    return after


def previous_in_loop(offsets: Ints) -> Ints:
    """Index of the preceding value around each row of a ragged array, the last before the first.

    Parameters
    ----------
    offsets : (P+1,) int64

    Returns
    -------
    (N,) int64
        The inverse of `next_in_loop`.
    """
    return inverted(next_in_loop(offsets))


def inverted(permutation: Ints) -> Ints:
    """Inverse of a permutation.

    Parameters
    ----------
    permutation : (n,) int64
        Each of 0 … n - 1 once.

    Returns
    -------
    (n,) int64
    """
    inverse = np.empty(len(permutation), np.int64)
    inverse[permutation] = np.arange(len(permutation))
    return inverse


def order_cycles(after: Ints) -> tuple[Ints, Ints]:
    """Cycles of a permutation, each from its least element on, in the order of these elements.

    The cycles are opened and chained one behind the other, so that one breadth-first walk, in compiled code,
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
    index = np.arange(n)
    count, label = connected(index, after, n)
    first = np.empty(count, np.int64)
    first[label[::-1]] = index[::-1]
    rank = np.argsort(first, kind="stable")
    starts = first[rank]
    follower = after.copy()
    follower[inverted(after)[starts]] = np.roll(starts, -1)
    order = follow(follower, int(starts[0]))
    return order, offsets_of(np.bincount(label, minlength=count)[rank])


def follow(after: Ints, start: int) -> Ints:
    """Elements in the order in which pointers visit them, in compiled code.

    Parameters
    ----------
    after : (n,) int64
        The element that each one points to.
    start : int

    Returns
    -------
    (k,) int64
        ``start`` and all that follow it, each once.
    """
    n = len(after)
    pointers = csr_matrix((np.ones(n, np.int8), after, np.arange(n + 1)), shape=(n, n))
    order = breadth_first_order(pointers, start, return_predecessors=False)
    return np.asarray(order, np.int64)


def order_by(keys: Ints, n: int) -> Ints:
    """Stable order of keys below ``n``, by counting: linear, in compiled code.

    Parameters
    ----------
    keys : (k,) int64
        From 0 to n - 1.
    n : int

    Returns
    -------
    (k,) int64
    """
    k = len(keys)
    table = csr_matrix((np.ones(k, np.int8), keys, np.arange(k + 1)), shape=(k, n))
    return np.asarray(table.tocsc().indices, np.int64)


def order_rows_by(keys: Ints, n: int) -> tuple[Ints, Ints]:
    """Values grouped by keys below ``n``: a ragged array whose row ``k`` has the places of the key ``k``, in order.

    Parameters
    ----------
    keys : (N,) int64
        From 0 to n - 1.
    n : int

    Returns
    -------
    order : (N,) int64
    offsets : (n+1,) int64
    """
    return order_by(keys, n), offsets_of(np.bincount(keys, minlength=n))


# Graphs


def connected(a: Ints, b: Ints, n: int) -> tuple[int, Ints]:
    """Connected components of an undirected graph.

    Parameters
    ----------
    a, b : (m,) int64
        Ends of its edges.
    n : int
        Number of its nodes.

    Returns
    -------
    count : int
    label : (n,) int64
        Component of each node; components are numbered by their least node.
    """
    poll()
    links = coo_matrix((np.ones(len(a), bool), (a, b)), shape=(n, n))
    count, label = connected_components(links, directed=False)
    return int(count), label.astype(np.int64)


# Equal rows

_ODD = np.uint64(0x9E3779B97F4A7C15)  # the golden ratio in 64 bits (Knuth, TAOCP 3, §6.4): spreads near keys
_SHIFT = np.uint64(32)


def first_equal_row(rows: NDArray[np.uint64]) -> Ints:
    """Least index of an equal row, for each row of a table.

    Sorting one hash a row is four times as fast as sorting rows.  Where two different rows have the same
    hash, the rows are sorted after all.

    Parameters
    ----------
    rows : (N, K) uint64

    Returns
    -------
    (N,) int64
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
    """Least index of a point with the same coordinates, for each point; 0 and -0 are the same.

    Parameters
    ----------
    points : (N, 3) float64

    Returns
    -------
    (N,) int64
    """
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
