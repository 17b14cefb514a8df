"""Tracing level sets: where they cross the edges, and the loops that the crossings make.

A *crossing* is where one level meets one edge.  It is named by the *descending* halfedge of
that edge, the one that runs from the deeper to the shallower end: a polyline with the deeper
side on its left enters a face across a descending halfedge and leaves it across the opposite of
another one.  So each crossing has exactly one successor, or none where a polyline ends on
the border, and all levels are traced at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from weavecore.geometry.arrays import Bools, Ints, offsets_of
from weavecore.geometry.halfedges import next_halfedge, previous_halfedge
from weavecore.offsetting.sheet import Sheet

NO_CROSSING = -1


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
        The next crossing along the polyline, -1 where it ends.
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
    """The polylines that the crossings make, by level, then by the crossing with which each begins.

    A closed one begins with its least crossing.

    Parameters
    ----------
    order : (N,) int64
        Crossings, polyline after polyline.
    offsets : (P+1,) int64
    closed : (P,) bool
    """

    order: Ints
    offsets: Ints
    closed: Bools


def count_crossings(sheet: Sheet, band: Ints) -> int:
    """Number of crossings, without allocating them."""
    return int(np.abs(band[sheet.tail[sheet.edges]] - band[sheet.head[sheet.edges]]).sum())


def find_crossings(sheet: Sheet, band: Ints) -> Crossings:
    """All crossings of an edge with a level.

    Parameters
    ----------
    sheet : Sheet
    band : (n,) int64
        Number of levels at or below each node.
    """
    tail, head = sheet.tail, sheet.head
    count = np.maximum(band[tail] - band[head], 0)
    first = np.cumsum(count) - count
    falling = np.flatnonzero(count)
    halfedge = np.repeat(falling, count[falling])
    shallow = head[halfedge]
    level = band[shallow] + 1 + (np.arange(len(halfedge)) - first[halfedge])
    inner = np.flatnonzero(halfedge < len(sheet.twins))
    before, behind = next_halfedge(halfedge[inner]), previous_halfedge(halfedge[inner])
    apex_is_deeper = band[tail[behind]] >= level[inner]
    across = sheet.opposite[np.where(apex_is_deeper, before, behind)]
    after = np.full(len(halfedge), NO_CROSSING)
    after[inner] = first[across] + level[inner] - band[head[across]] - 1
    return Crossings(halfedge, level, after, tail[halfedge], shallow)


def chain_loops(crossings: Crossings) -> Loops:
    """Order the crossings along the polylines that they make.

    Closed ones are opened before their first crossing, and all are strung one behind the other, so
    that one walk, in compiled code, orders them all.
    """
    n = len(crossings)
    if n == 0:
        return Loops(np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, bool))
    index = np.arange(n)
    is_end = crossings.after == NO_CROSSING
    onward = np.where(is_end, index, crossings.after)
    count, label = connected_components(_pointers(onward), directed=False)
    first = np.empty(count, np.int64)
    first[label[::-1]] = index[::-1]
    before = np.full(n, NO_CROSSING)
    before[onward[~is_end]] = index[~is_end]
    starts, ends = np.flatnonzero(before == NO_CROSSING), np.flatnonzero(is_end)
    first[label[starts]] = starts
    last = before[first]
    last[label[ends]] = ends
    closed = np.ones(count, bool)
    closed[label[ends]] = False
    rank = np.lexsort((first, crossings.level[first]))
    onward[last[rank]] = np.roll(first[rank], -1)
    order = breadth_first_order(_pointers(onward), first[rank[0]], return_predecessors=False)
    return Loops(order.astype(np.int64), offsets_of(np.bincount(label, minlength=count)[rank]), closed[rank])


def _pointers(after: Ints) -> csr_matrix:
    n = len(after)
    return csr_matrix((np.ones(n, np.int8), after, np.arange(n + 1)), shape=(n, n))
