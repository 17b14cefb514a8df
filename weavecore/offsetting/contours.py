"""Tracing level sets: where they cross the edges, and the loops that the crossings make.

A *crossing* is where one level meets one edge.  It is named by the *descending* halfedge of
that edge, the one that runs from the deeper to the shallower end: a polyline with the deeper
side on its left enters a face across a descending halfedge and leaves it across the twin of
another one.  So each crossing has exactly one successor, and all levels are traced at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Ints, offsets_of
from weavecore.geometry.halfedges import next_halfedge, previous_halfedge
from weavecore.offsetting.sheet import Sheet


@dataclass(frozen=True, eq=False)
class Crossings:
    """All crossings of levels and edges, by halfedge and from the shallow end to the deep one.

    Parameters
    ----------
    halfedge : (N,) int64
        The descending halfedge; the polyline goes on through its face.
    level : (N,) int64
        Which level crosses there, from 1.
    after : (N,) int64
        The next crossing along the polyline.
    deep, shallow : (N,) int64
        Tail and head vertex of the halfedge.
    """

    halfedge: Ints
    level: Ints
    after: Ints
    deep: Ints
    shallow: Ints

    def __len__(self) -> int:
        return len(self.halfedge)


@dataclass(frozen=True, eq=False)
class Loops:
    """Closed loops of crossings, by level, then by their least crossing, with which each begins.

    Parameters
    ----------
    order : (N,) int64
        Crossings, loop after loop.
    offsets : (P+1,) int64
    """

    order: Ints
    offsets: Ints


def count_crossings(sheet: Sheet, band: Ints) -> int:
    """Number of crossings, without allocating them."""
    return int(np.abs(band[sheet.tail[sheet.edges]] - band[sheet.head[sheet.edges]]).sum())


def find_crossings(sheet: Sheet, band: Ints) -> Crossings:
    """All crossings of an edge with a level.

    Parameters
    ----------
    sheet : Sheet
    band : (n,) int64
        Number of levels at or below each node; the same at both ends of an edge of the border.
    """
    tail, head = sheet.tail, sheet.head
    count = np.maximum(band[tail] - band[head], 0)
    first = np.cumsum(count) - count
    falling = np.flatnonzero(count)
    halfedge = np.repeat(falling, count[falling])
    shallow = head[halfedge]
    level = band[shallow] + 1 + (np.arange(len(halfedge)) - first[halfedge])
    before, behind = next_halfedge(halfedge), previous_halfedge(halfedge)
    apex_is_deeper = band[tail[behind]] >= level
    across = sheet.twins[np.where(apex_is_deeper, before, behind)]
    after = first[across] + level - band[head[across]] - 1
    return Crossings(halfedge, level, after, tail[halfedge], shallow)


def chain_loops(crossings: Crossings) -> Loops:
    """Order the crossings along the closed loops that they make.

    The loops are opened before their first crossing and strung one behind the other, so
    that one walk, in compiled code, orders them all.
    """
    n = len(crossings)
    if n == 0:
        return Loops(np.zeros(0, np.int64), np.zeros(1, np.int64))
    count, label = connected_components(_pointers(crossings.after), directed=False)
    index = np.arange(n)
    first = np.empty(count, np.int64)
    first[label[::-1]] = index[::-1]
    rank = np.lexsort((first, crossings.level[first]))
    before = np.empty(n, np.int64)
    before[crossings.after] = index
    follower = crossings.after.copy()
    starts = first[rank]
    follower[before[starts]] = np.roll(starts, -1)
    order = breadth_first_order(_pointers(follower), starts[0], return_predecessors=False)
    return Loops(order.astype(np.int64), offsets_of(np.bincount(label, minlength=count)[rank]))


def _pointers(after: Ints) -> csr_matrix:
    n = len(after)
    return csr_matrix((np.ones(n, np.int8), after, np.arange(n + 1)), shape=(n, n))
