"""The building sequence replayed: where the unfinished weave rests after some of its steps.

After step ``k`` the rods set so far are joined by the ties made so far.  What hangs on nothing yet is held by hand and
left out: rods that no ties connect to a support, or without supports to the largest part, open rods that are tied at
one joint, and rings that are tied at fewer than three.  An open rod is taken between its outermost ties::

    ----+-------+-------+-- - - - -      + tied     what runs on beyond them carries nothing
       first           last

Points that take no part are fixed, so that the arrays of the finished weave serve all steps.  Each equilibrium starts
at the drawing, where no segment or tie is strained: states of the steps before are further away, because a rod that is
added does not fit them.  One search of `weavecore.simulating.newton` for each step that is replayed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Callable, Optional

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, rows_of
from weavecore.model import BuildSequence, Replay, Weave
from weavecore.simulating.boundary import NONE, Loads, Supports, load_forces, supported_nodes, three_point_gauge
from weavecore.simulating.discretise import RodPoints, place_points
from weavecore.simulating.elements import Bends, Stretches, TieElements, half_angle_tangents, tie_values
from weavecore.simulating.newton import find_equilibrium
from weavecore.simulating.simulate import SEGMENTS, laid_over, structure_of
from weavecore.simulating.structure import Structure

Progress = Callable[[float, str], None]

FindSequence = Callable[[tuple[int, ...]], BuildSequence]
"""Finds a building sequence in which the rods of some generations are *spread*: set far from each other in turn."""

MOST_STEPS = 12
"""Steps that are replayed by default: enough to find the worst third of the sequence."""

_MOST_SEARCH = 150
"""Factorisations of one step; unfinished weaves may be mechanisms, which no number of them brings to rest."""

_MOST_SPREAD = 3
"""Generations that are spread at most; each costs a replay."""

_FEWEST_OF_RING = 3
"""Ties that keep a ring from turning about them."""


@dataclass(frozen=True, eq=False)
class _Row:
    """Figures of one step: rods, displacement in metres and its node, stress in Pa and its rod."""

    n_rods: int
    displacement: float
    node: int
    stress: float
    rod: int
    is_converged: bool


def replay_sequence(
    weave: Weave,
    sequence: BuildSequence,
    *,
    supports: Supports,
    loads: Loads,
    metres: float,
    most_steps: int = MOST_STEPS,
    progress: Optional[Progress] = None,
) -> Replay:
    """Find where a weave rests after steps of its building sequence.

    Parameters
    ----------
    weave : Weave
    sequence : BuildSequence
    supports : str or sequence of (n, 3) array_like
    loads : Loads
        Without supports none.
    metres : float
        In one unit of the model.
    most_steps : int
        Steps that are replayed, 1 at least; the last is always among them.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Replay

    Raises
    ------
    Unsupported
        Where no step would be replayed.
    """
    if most_steps < 1:
        raise Unsupported(f"A replay of {most_steps} steps shows nothing", remedy="Replay 1 or more.")
    held = supported_nodes(weave, supports)
    unfinished = _UnfinishedWeave(weave, held, loads if held.any() else Loads(), metres)
    steps = chosen_steps(sequence, most_steps)
    rows = []
    for k, step in enumerate(steps.tolist()):
        if progress:
            progress(k / len(steps), f"after step {step + 1} of {len(sequence)}")
        rows.append(unfinished.rest_after(sequence, step))
    return Replay(
        weave=weave,
        step=steps,
        n_rods=np.array([row.n_rods for row in rows]),
        displacement=np.array([row.displacement for row in rows]) / metres,
        node=np.array([row.node for row in rows]),
        stress=np.array([row.stress for row in rows]) / 1e6,
        rod=np.array([row.rod for row in rows]),
        is_converged=np.array([row.is_converged for row in rows]),
        supports=supports if isinstance(supports, str) else f"{int(held.sum())} nodes",
        loads=str(loads) if held.any() else NONE,
        strand=sequence.strand,
    )


def improve_sequence(find: FindSequence, replay: Callable[[BuildSequence], Replay]) -> Replay:
    """Replay the sequence, and set the rods of its worst generations far from each other where that helps.

    A ring to which rods are woven from one side on hangs free at the other.  So the generation of the worst step is
    spread; that is kept where the largest displacement falls, and the next worst generation is tried.

    Parameters
    ----------
    find : callable
        See `FindSequence`.
    replay : callable
        Replays a sequence, as `replay_sequence` does.

    Returns
    -------
    Replay
        That with the least displacement, with the generations that are spread in it.
    """
    spread: tuple[int, ...] = ()
    sequence = find(spread)
    best = replay(sequence)
    for _ in range(_MOST_SPREAD):
        worst = int(sequence.generation[best.step[best.worst]])
        if worst in spread:
            break
        tried = replay(find((*spread, worst)))
        if tried.displacement.max() >= best.displacement.max():
            break
        spread = (*spread, worst)
        best = replace(tried, spread=spread)
    return best


def chosen_steps(sequence: BuildSequence, most: int) -> Ints:
    """(K,) steps to replay: half of them ends of generations, as far as there are, the others evenly between."""
    n = len(sequence)
    ends = np.append(np.flatnonzero(np.diff(sequence.generation)), n - 1)
    n_ends = min(len(ends), max(most // 2, 1))
    at_ends = ends[np.linspace(len(ends) - 1, 0, n_ends).round().astype(np.int64)]
    between = np.linspace(0, n - 1, most - n_ends + 2).round().astype(np.int64)[1:-1]
    return np.unique(np.concatenate([at_ends, between]))


class _UnfinishedWeave:
    """A weave whose rods are set one after the other."""

    def __init__(self, weave: Weave, held: Bools, loads: Loads, metres: float) -> None:
        self.weave, self.held = weave, held
        self.rods = place_points(weave.axes, segments=SEGMENTS, metres=metres)
        self.diameter = weave.diameters[self.rods.rod] * metres
        self.whole = structure_of(weave, self.rods, held, Loads(), diameter=self.diameter, metres=metres)
        self.loads = load_forces(weave, self.rods, loads, diameter=self.diameter, metres=metres)

    def rest_after(self, sequence: BuildSequence, step: int) -> _Row:
        """Where the weave rests after a step."""
        is_tied = self._tied(sequence, step)
        anchored = self._anchored(is_tied, sequence, step)
        segments = _spans(self.rods, anchored)
        if not segments.any():
            return _Row(0, 0.0, -1, 0.0, -1, True)
        structure = self._part(is_tied, segments)
        found = find_equilibrium(structure, self.rods.points, most_steps=_MOST_SEARCH)
        return self._figures(structure, found.points, anchored, found.is_converged)

    def _tied(self, sequence: BuildSequence, step: int) -> Bools:
        """(C,) contacts that are tied after a step."""
        joints = self.weave.joints
        done = np.zeros(len(joints), bool)
        done[sequence.tied[: sequence.tied_offsets[step + 1]]] = True
        tied: Bools = done[joints.joint[joints.contacts[:, 0]]]
        return tied

    def _anchored(self, is_tied: Bools, sequence: BuildSequence, step: int) -> Bools:
        """(M,) visits at which a rod that carries is tied or held."""
        weave, joints = self.weave, self.weave.joints
        owner, n = rows_of(weave.strands.offsets), len(weave)
        is_set = np.zeros(n, bool)
        is_set[sequence.strand[: step + 1]] = True
        contacts = joints.contacts[is_tied]
        at_support = self.held[weave.strands.nodes] & is_set[owner]
        anchored = at_support.copy()
        anchored[joints.visit[contacts].ravel()] = True
        links = joints.strand[contacts]
        for _ in range(n):
            ground = np.unique(owner[at_support & anchored])
            rows, columns = np.append(links[:, 0], ground), np.append(links[:, 1], np.full(len(ground), n))
            graph = csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(n + 1, n + 1))
            _, part = connected_components(graph, directed=False)
            home = part[n] if len(ground) else int(np.argmax(np.bincount(part[:n][is_set])))
            count = np.bincount(owner[anchored], minlength=n)
            carries = (part[:n] == home) & (count >= np.where(weave.strands.closed, _FEWEST_OF_RING, 2))
            left = anchored & carries[owner]
            links = links[carries[links].all(axis=1)]
            kept = at_support & left
            kept[self._visits_of(is_tied, carries)] = True
            if (kept == anchored).all():
                break
            anchored = kept
        return anchored

    def _visits_of(self, is_tied: Bools, carries: Bools) -> Ints:
        """Visits at contacts that are tied and of which both rods carry."""
        joints = self.weave.joints
        both = is_tied & carries[joints.strand[joints.contacts]].all(axis=1)
        visits: Ints = joints.visit[joints.contacts[both]].ravel()
        return visits

    def _part(self, is_tied: Bools, segments: Bools) -> Structure:
        """The structure of the segments that carry, with all other points fixed."""
        whole, rods = self.whole, self.rods
        n, index = len(rods.points), np.arange(len(rods.points))
        after, before = index.copy(), index.copy()
        start, stop = rods.segments[segments].T
        after[start], before[stop] = stop, start
        carries = np.zeros(n, bool)
        carries[rods.segments[segments]] = True
        inner = whole.bends.points[:, 1]
        bends = (after[inner] != inner) & (before[inner] != inner)
        stretches = whole.stretches
        a, b = whole.ties.points[:, :2].T
        ties = np.flatnonzero(is_tied & carries[a] & carries[b])
        a, b = a[ties], b[ties]
        points = np.stack([a, b, before[a], after[a], before[b], after[b]], axis=1)
        fixed = whole.is_fixed | ~carries[:, None]
        if not self.held.any():
            fixed = np.ones((n, 3), bool)
            fixed[carries] = three_point_gauge(rods.points[carries])
        return Structure(
            n,
            Bends(whole.bends.points[bends], whole.bends.stiffness[bends]),
            Stretches(stretches.points[segments], stretches.rest[segments], stretches.stiffness[segments]),
            TieElements(points, tie_values(rods.points, points)[0], whole.ties.stiffness[ties]),
            self.loads * carries[:, None],
            fixed,
        )

    def _figures(self, structure: Structure, x: Floats, anchored: Bools, is_converged: bool) -> _Row:
        rods, weave = self.rods, self.weave
        carries = np.zeros(len(x), bool)
        carries[structure.stretches.points] = True
        if not self.held.any():
            x = x.copy()
            x[carries] = laid_over(x[carries], rods.points[carries], weights=rods.widths[carries])
        visits = np.flatnonzero(anchored)
        moves = np.linalg.norm((x - rods.points)[rods.of_visit[visits]], axis=1)
        bends, stretches = structure.bends, structure.stretches
        area, section = np.pi * self.diameter**2 / 4, np.pi * self.diameter**3 / 32
        stress = np.zeros(len(x))
        at = bends.points[:, 1]
        # EI / w times the turn is the moment.
        stress[at] = bends.stiffness * half_angle_tangents(x, bends) / section[at]
        axial = np.abs(structure.forces(x).axial) / area[stretches.points[:, 0]]
        largest = np.zeros(len(x))
        np.maximum.at(largest, stretches.points, axial[:, None])
        stress += largest
        most, worst = int(np.argmax(moves)), int(np.argmax(stress))
        n_rods = len(np.unique(rods.rod[carries]))
        node = int(weave.strands.nodes[visits[most]])
        return _Row(n_rods, float(moves[most]), node, float(stress[worst]), int(rods.rod[worst]), is_converged)


def _spans(rods: RodPoints, anchored: Bools) -> Bools:
    """(M,) segments between the outermost anchored visits of each open rod, and all of a ring that has any."""
    points = rods.of_visit[anchored]
    rod, n = rods.rod[points], len(rods.offsets) - 1
    first, last = np.full(n, len(rods.points)), np.full(n, -1)
    np.minimum.at(first, rod, points)
    np.maximum.at(last, rod, points)
    start = rods.segments[:, 0]
    of_rod = rods.rod[start]
    carries: Bools = np.where(rods.closed[of_rod], last[of_rod] >= 0, (start >= first[of_rod]) & (start < last[of_rod]))
    return carries
