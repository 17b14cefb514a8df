"""Plain weave: at every joint a rod lies on the other side than at the joint before.

A joint of two rods has one unknown: which of them is over.  Two joints that follow each other
along a rod tie their unknowns to each other.  Where no loop of such ties contradicts itself all are met;
elsewhere the fewest that can be found are broken (`frustration`), and what is left is improved joint by joint.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.edges import edges_between
from weavecore.geometry.spanning import spread_signs
from weavecore.model.lattice import Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.frustration import UNTIED, ties_to_break
from weavecore.weaving.joints import Meetings, steps_along

_MOST_ROUNDS = 50


def alternate(lattice: Lattice, strands: Strands, meetings: Meetings) -> list[Floats]:
    """Two ways how each visit may want to lie among its joint's: above the others with greater numbers (M,).

    One breaks what contradicts a spanning forest of the ties, the other the fewest ties between joints of
    two rods; where joints of more are many, either may be the better one.

    At joints of two rods it is 1 and -1.  At joints of more it is the mean of what the
    neighbours along the rod leave; a ring of a border lies between the ends of the rods that it holds.
    """
    sign = visit_signs(strands, meetings)
    before, after = steps_along(strands)
    tied = (sign[before] != 0) & (sign[after] != 0)
    a, b = meetings.joint_of_visit[before[tied]], meetings.joint_of_visit[after[tied]]
    # Of the unknowns x: sides are sign · x, and they must differ.
    product = -sign[before[tied]] * sign[after[tied]]
    tie = _ties_of_edges(lattice, strands.nodes[before[tied]], strands.nodes[after[tied]])
    bent = product.copy()
    bent[ties_to_break(lattice, tie, product)] *= -1
    n = len(meetings.node)
    ways = [solve_signs(a, b, product, spread_signs(a, b, wanted, n)) for wanted in (product, bent)]
    return [with_wishes((sign * x[meetings.joint_of_visit]).astype(np.float64), strands) for x in ways]


def _ties_of_edges(lattice: Lattice, one: Ints, other: Ints) -> Ints:
    """Tie (E,) of each edge of the lattice, -1 of those that tie nothing."""
    tie = np.full(lattice.n_edges, UNTIED, np.int64)
    tie[edges_between(lattice.edges, one, other)] = np.arange(len(one))
    return tie


def visit_signs(strands: Strands, meetings: Meetings) -> Ints:
    """(M,) 1 for the first visit of each joint of two rods, -1 for the second, 0 elsewhere."""
    first = meetings.offsets[:-1][meetings.counts == 2]
    sign = np.zeros(len(strands.nodes), np.int64)
    sign[meetings.visit[first]], sign[meetings.visit[first + 1]] = 1, -1
    return sign


def with_wishes(side: Floats, strands: Strands) -> Floats:
    """Sides (M,), and where there is none what the joints before and after along the rod leave."""
    before, after = steps_along(strands)
    wish = np.zeros(len(side))
    np.subtract.at(wish, before, side[after])
    np.subtract.at(wish, after, side[before])
    return np.where(side != 0, side, wish)


def solve_signs(a: Ints, b: Ints, product: Ints, start: Ints) -> Ints:
    """Signs x (n,) with ``x[a] * x[b] == product`` for as many ties as turning single ones of ``start`` can reach."""
    loop = a == b
    a, b, product = a[~loop], b[~loop], product[~loop]
    x, n = start.copy(), len(start)
    for _ in range(_MOST_ROUNDS):
        is_met = x[a] * x[b] == product
        gain = np.bincount(a, 1 - 2 * is_met, n) + np.bincount(b, 1 - 2 * is_met, n)
        # Neighbours must not be turned in the same round.
        best = np.full(n, -1.0)
        np.maximum.at(best, a, gain[b])
        np.maximum.at(best, b, gain[a])
        turned = (gain > 0) & (gain > best)
        if not turned.any():
            break
        x[turned] *= -1
    return x
