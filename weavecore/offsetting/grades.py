"""An order among the rays of a wall that does not hang on how the mesh is numbered."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

_AS_FAR = 1 - 1e-6
"""Points that are further from the middle than this part of the furthest count as the furthest."""


def places_along(points: Floats, before: Ints, count: Ints) -> Ints:
    """Number the rays of each loop of wall halfedges, from the point that is furthest from the loop's middle.

    Parameters
    ----------
    points : (W, 3) float64
        Where each wall halfedge begins.
    before : (W,) int64
        The wall halfedge before each around its loop.
    count : (W,) int64
        How many rays each has.

    Returns
    -------
    (W,) int64
        The number of each one's first ray.
    """
    loop, doublings = np.arange(len(before)), range(len(before).bit_length())
    jump = before
    for _ in doublings:
        loop, jump = np.minimum(loop, loop[jump]), jump[jump]
    start = _furthest_of_each(points, loop)
    jump, place = before.copy(), count[before]
    jump[start], place[start] = start, 0
    for _ in doublings:
        place, jump = place + place[jump], jump[jump]
    return place


def _furthest_of_each(points: Floats, loop: Ints) -> Ints:
    _, number = np.unique(loop, return_inverse=True)
    number = number.ravel()
    total = np.bincount(number)
    middle = np.stack([np.bincount(number, weights=x) for x in points.T], axis=1) / total[:, None]
    far = np.linalg.norm(points - middle[number], axis=1)
    furthest = np.zeros(len(total))
    np.maximum.at(furthest, number, far)
    candidates = np.flatnonzero(far >= _AS_FAR * furthest[number])
    _, first = np.unique(number[candidates], return_index=True)
    starts: Ints = candidates[first]
    return starts


def grade_of(place: Ints) -> Ints:
    """How often a place can be halved: every other one has grade 0, every fourth more than 1, and so on."""
    grades: Ints = np.log2(np.where(place > 0, place & -place, np.int64(1) << 40)).astype(np.int64)
    return grades
