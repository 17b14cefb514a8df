"""Twill: over m rods, under n, and one step aside from each rod to the next.

Each joint has a phase, which rises by one from joint to joint along every rod, one way or the
other; a ring is over while the phase modulo m + n is below m.  The two rods on opposite sides of a cell of
four rise the same way, so that the diagonals of the twill run on.
"""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.geometry.spanning import spread_signs, spread_sums
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.strands import Strands
from weavecore.weaving.plain import solve_signs, visit_signs, with_wishes
from weavecore.weaving.strands import Meetings, steps_along

_MOST_ROUNDS = 200


def twill(lattice: Lattice, strands: Strands, meetings: Meetings, over: int, under: int) -> tuple[Floats, Bools]:
    """Wishes (M,) as in a plain weave, and which steps along the strands break the twill.

    The steps are those of `steps_along`.
    """
    cycle = over + under
    rises = _rising_ways(lattice, strands)
    before, after = steps_along(strands)
    sign = visit_signs(strands, meetings)
    tied = (sign[before] != 0) & (sign[after] != 0)
    a, b = meetings.joint_of_visit[before[tied]], meetings.joint_of_visit[after[tied]]
    rise = rises[rows_of(strands.offsets)[before[tied]]]
    apart = a != b
    ties = a[apart], b[apart], rise[apart]
    phase = settle_phases(*ties, spread_sums(*ties, len(meetings.node)), cycle)
    is_broken = np.zeros(len(before), bool)
    is_broken[tied] = (phase[b] - phase[a] - rise) % cycle != 0
    is_ring = strands.family[rows_of(strands.offsets)] == LATITUDINAL
    # Of two rods of one kind the first one stands for the ring.
    joint = meetings.joint_of_visit
    rings = np.bincount(joint[joint >= 0], is_ring[joint >= 0], minlength=len(meetings.node))
    leads = np.where(rings[joint] == 1, is_ring, sign > 0)
    is_over = (phase[joint] % cycle < over) == leads
    side = np.where(sign != 0, np.where(is_over, 1.0, -1.0), 0.0)
    return with_wishes(side, strands), is_broken


def settle_phases(a: Ints, b: Ints, rise: Ints, phase: Ints, cycle: int) -> Ints:
    """Phases (J,) changed at single joints as long as more of the ties ``phase[b] - phase[a] == rise`` hold then."""
    phase, n = phase % cycle, len(phase)
    for _ in range(_MOST_ROUNDS):
        holds = np.zeros((n, cycle), np.int64)
        np.add.at(holds, (b, (phase[a] + rise) % cycle), 1)
        np.add.at(holds, (a, (phase[b] - rise) % cycle), 1)
        best = holds.argmax(1)
        gain = holds.max(1) - holds[np.arange(n), phase]
        # Neighbours must not change in the same round; of two that gain as much the first one does.
        rank = gain * n - np.arange(n)
        most = np.full(n, np.iinfo(np.int64).min)
        np.maximum.at(most, a, rank[b])
        np.maximum.at(most, b, rank[a])
        changed = (gain > 0) & (rank > most)
        if not changed.any():
            break
        phase[changed] = best[changed]
    return phase


def _rising_ways(lattice: Lattice, strands: Strands) -> Ints:
    """Sign (S,) of each strand: whether phases rise or fall along it."""
    before, after = steps_along(strands)
    a, b = strands.nodes[before], strands.nodes[after]
    edge = edges_between(lattice.edges, a, b)
    strand, way = np.zeros(lattice.n_edges, np.int64), np.ones(lattice.n_edges, np.int64)
    strand[edge], way[edge] = rows_of(strands.offsets)[before], np.where(a < b, 1, -1)
    start = lattice.face_offsets[:-1][np.diff(lattice.face_offsets) == 4]
    corners = lattice.face_nodes[start[:, None] + np.arange(4)]
    tail, head = corners, np.roll(corners, -1, axis=1)
    side = edges_between(lattice.edges, tail, head)
    along = way[side] * np.where(tail < head, 1, -1)
    one, other = strand[side[:, :2]].ravel(), strand[side[:, 2:]].ravel()
    opposite = -(along[:, :2] * along[:, 2:]).ravel()
    return solve_signs(one, other, opposite, spread_signs(one, other, opposite, len(strands)))
