"""Compensation for spring-back: marks, and where they do not suffice supports, for a weave to rest as it was drawn.

Rods are nearly inextensible, so distances between marks set the metric of the woven surface, and bending chooses among
the shapes of that metric.  A shape can be balanced by axial and tie forces where the bending energy is level along all
*flexes*, the motions that stretch no rod.  The drawn shape is not; a shape near to it may be.  So a *target* is woven
instead of the drawing: its nodes are moved by ``z``, which gives the rest lengths, and ``z`` is chosen so that the
weave rests near the drawing.  With ``x(z)`` the equilibrium, ``K`` its Hessian, and ``B`` the forces by ``z``::

    min |e + A dz|^2 + d^2 |dz|^2       e = x - drawn,  A = -K^-1 B       (Levenberg-Marquardt)

Each product with A or its transpose costs two solves with the factors of K, which the equilibrium leaves; LSMR (Fong
and Saunders 2011) needs a few dozen.  A weave that is let go at once moves far, where linear steps fail.  So springs
to the drawn places hold it at first, and are made weaker from step to step; the marks follow.

The balance that is found may be unstable: as the springs fade, the weave leaves it.  Then nodes are held where they
were drawn, first those that depart most, and the marks are fitted again.  Where that fails, the marks stay as drawn,
and nodes are held until it suffices (`weavecore.simulating.hold`).  Each equilibrium takes one search of
`weavecore.simulating.newton`; there are some 15 in each round.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Callable, Optional, cast

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags, identity, kron
from scipy.sparse.linalg import LinearOperator, lsmr

from weavecore.errors import NotConverged, Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.model import Compensation, Equilibrium, Note, Weave
from weavecore.model.compensation import DRAWN, HELD, MARKS, OUT_OF_REACH, SUPPORTS, UNSTABLE
from weavecore.simulating.boundary import Loads, Supports, load_forces, supported_nodes
from weavecore.simulating.discretise import RodPoints, place_points
from weavecore.simulating.elements import normalised
from weavecore.simulating.hold import hold_until_within
from weavecore.simulating.newton import Solution, find_equilibrium, stiffness_scale
from weavecore.simulating.simulate import SEGMENTS, laid_over, simulate_weave, structure_of
from weavecore.simulating.structure import Forces, Structure
from weavecore.units import millimetres_in, with_unit

Progress = Callable[[float, str], None]

_SPRINGS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-7)
"""Stiffness of the springs in ``EI / l^3`` of a median segment: the first hold a weave near
its drawing, the last only keep a released weave from drifting."""

_STEPS_EACH = 2
"""Steps of the marks with each stiffness; each costs a search."""

_FIRST_DAMPING, _LEAST_DAMPING = 0.3, 0.1
"""On the target's moves, against departures: chosen on the hemisphere and the hourglass; smaller ones give rods sharper
bends."""

_LEFT = 5.0
"""The balance was left where the departure grows by this factor from one stiffness to the next."""

_MOST_SEARCH = 20
"""Factorisations of one search: one that takes longer has left the neighbourhood of the drawing."""

_SOLVES = 40
"""Iterations of LSMR at most."""

_ENOUGH = 0.5
"""Of the limit: nearer than that the marks are not fitted further."""

_MARGIN = 0.75
"""Of the limit: what is sought, because the axes that are laid through the nodes differ a little from the rods here."""

_APART = 0.25
"""Nodes that are held in one round are this part of the bounding box's diagonal apart, as in `hold`."""

_FIRST_HELD, _MOST_ROUNDS = 3, 4
"""Nodes that are held in the first round, for three stop rigid motion; each later round at most doubles them."""


LIMIT = 2.0
"""Departure in millimetres that is allowed by default: about what marks and ties of a workshop hold."""


_ROUNDS = 2
"""The axes that are laid through the moved nodes differ a little from the rods at rest: a second round takes up what is
left where that exceeds the limit."""

MoveNodes = Callable[[Weave, Floats], Weave]
"""Lays the same rods through nodes (N, 3) that are moved a little."""


def compensate_weave(
    weave: Weave,
    move_nodes: MoveNodes,
    *,
    supports: Supports,
    loads: Loads,
    within: Optional[float] = None,
    may_hold: bool = True,
    unit: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Compensation:
    """Change marks so that a weave rests where it was drawn, and hold nodes where that does not suffice.

    Parameters
    ----------
    weave : Weave
    move_nodes : callable
    supports : str or sequence of (n, 3) array_like
    loads : Loads
        They act where nodes are held.
    within : float, optional
        Departure that is allowed, in the model's unit; by default `LIMIT`.
    may_hold : bool
        Whether nodes may be held besides the supports.
    unit : str, optional
        Unit of the weave where it states none.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Raises
    ------
    Unsupported
        Where the limit is not positive, or supports hold nothing.
    """
    metres = millimetres_in(weave.lattice.latitudes.surface.unit, unit) / 1000.0
    limit = LIMIT / 1000.0 / metres if within is None else float(within)
    if not 0 < limit < np.inf:
        raise Unsupported(f"The limit of departure must be positive (got {limit:g})", remedy="Give a length.")
    is_held = supported_nodes(weave, supports)
    carried = loads if is_held.any() else Loads()
    before = _reached(weave, supports=supports, loads=carried, unit=unit, progress=progress)
    if before.is_stable and before.departure_max <= limit:
        return Compensation(weave, before, before, limit, np.zeros(0, np.int64), DRAWN)
    cut, is_fixed = weave, is_held
    for _ in range(_ROUNDS):
        fit = _Fit(cut, weave.axes.points * metres, _MARGIN * limit * metres, metres, progress)
        found = fit.find(is_fixed, carried, loads, may_hold=may_hold)
        cut, is_fixed = move_nodes(cut, found.nodes), found.is_held
        added = np.flatnonzero(is_fixed & ~is_held)
        held: Supports = list(weave.lattice.nodes[is_fixed]) if len(added) else supports
        carried = loads if is_fixed.any() else Loads()
        after = _reached(cut, supports=held, loads=carried, unit=unit, progress=progress)
        after = replace(after, points=_beside(after, before), drawn=before.drawn)
        if after.departure_max <= limit or found.departure.max() > limit:
            break
    made = Compensation(cut, before, after, limit, added, _verdict(found, len(added), after, limit))
    if made.verdict == OUT_OF_REACH and may_hold:
        made = _with_drawn_marks(made, is_held, loads, unit=unit, progress=progress) or made
        cut, after = made.weave, made.after
    noted = _with_note(cut, compensation_note(made))
    return replace(made, weave=noted, after=replace(after, weave=noted))


def _with_drawn_marks(made: Compensation, is_held: Bools, loads: Loads, **options: Any) -> Optional[Compensation]:
    """The weave as drawn with nodes held besides the supports (N,), where few are found that suffice."""
    weave = made.before.weave
    nodes = weave.lattice.nodes
    supports = [nodes[[n]] for n in np.flatnonzero(is_held)]

    def at_rest(held: Sequence[Floats]) -> Equilibrium:
        return simulate_weave(weave, supports=[*supports, *held], loads=loads, **options)

    try:
        after = hold_until_within(at_rest, made.limit, released=made.before)
    except NotConverged:
        return None
    return Compensation(weave, made.before, after, made.limit, np.flatnonzero(after.is_supported & ~is_held), SUPPORTS)


def _reached(weave: Weave, **options: Any) -> Equilibrium:
    """Where a weave rests, or where the search for it ended."""
    try:
        return simulate_weave(weave, **options)
    except NotConverged as error:
        return cast(Equilibrium, error.reached)


def _beside(after: Equilibrium, before: Equilibrium) -> Floats:
    """Points of a weave at rest, laid over the first drawing where nothing holds them."""
    if after.is_supported.any():
        return after.points
    return laid_over(after.points, before.drawn, weights=np.ones(len(after.points)))


def _with_note(weave: Weave, note: Note) -> Weave:
    """The same weave, with a note beside those of its surface."""
    latitudes = weave.lattice.latitudes
    surface = replace(latitudes.surface, notes=(*latitudes.surface.notes, note))
    return replace(weave, lattice=replace(weave.lattice, latitudes=replace(latitudes, surface=surface)))


@dataclass(frozen=True, eq=False)
class _Anchored(Structure):
    """A structure with springs of a stiffness (n,) in N/m from its points to anchors (n, 3)."""

    springs: Floats = field(default_factory=lambda: np.zeros(0))
    anchors: Floats = field(default_factory=lambda: np.zeros((0, 3)))

    def energy(self, x: Floats) -> float:
        return super().energy(x) + float((self.springs[:, None] * (x - self.anchors) ** 2).sum()) / 2

    def gradient(self, x: Floats) -> Floats:
        gradient: Floats = super().gradient(x) + self.springs[:, None] * (x - self.anchors)
        return gradient

    def hessian(self, x: Floats, forces: Optional[Forces] = None, *, convex: bool = False) -> csc_matrix:
        springs = np.repeat(self.springs, 3)[self.free]
        return (super().hessian(x, forces, convex=convex) + diags(springs)).tocsc()


@dataclass(frozen=True, eq=False)
class Balance:
    """A shape near the drawn one in which a weave rests when it is cut and marked for it.

    Parameters
    ----------
    nodes : (N, 3) float64
        In the model's unit.
    is_held : (N,) bool
        Nodes that must be held.
    departure : (N,) float64
        From the drawing, in the model's unit.
    is_unstable : bool
        Whether the marks alone gave a balance within the limit that the weave leaves.
    """

    nodes: Floats
    is_held: Bools
    departure: Floats
    is_unstable: bool


def _verdict(balance: Balance, n_held: int, after: Equilibrium, limit: float) -> str:
    """What compensation reached, as `Compensation` names it; ``n_held`` counts the nodes held besides supports."""
    if after.departure_max <= limit:
        return HELD if n_held else MARKS
    return UNSTABLE if balance.is_unstable and not n_held else OUT_OF_REACH


def compensation_note(found: Compensation) -> Note:
    """What was reached, in a sentence with numbers and the places of the nodes to hold."""
    before, after = found.before, found.after
    unit = found.weave.lattice.latitudes.surface.unit
    least, most, limit = (
        with_unit(x, unit, digits=3) for x in (before.departure_max, after.departure_max, found.limit)
    )
    mark = float(np.abs(found.mark_changes).max(initial=0.0))
    text = f"Marks move by at most {with_unit(mark, unit, digits=3)}; nodes depart by at most {most} (before: {least})"
    reasons = {
        MARKS: "",
        HELD: f", with {len(found.held)} more nodes held where they are",
        SUPPORTS: f", with {len(found.held)} more nodes held where they are: no other marks were found to help",
        UNSTABLE: f"; the balance near the drawing is unstable, so marks alone do not keep within {limit}: hold nodes",
        OUT_OF_REACH: f"; within {limit} no balance was found with {len(found.held)} more nodes held: hold others",
    }
    numbers = {"limit": found.limit, "mark_change_max": mark, "held": len(found.held)}
    for name, one in (("before", before), ("after", after)):
        figures = {"mean": one.departure_mean, "p95": one.departure_p95, "max": one.departure_max}
        numbers.update({f"departure_{key}_{name}": figure for key, figure in figures.items()})
    code = "COMPENSATED" if found.is_within else "SPRINGS_BACK"
    return Note(code, text + reasons[found.verdict] + ".", numbers, found.weave.lattice.nodes[found.held])


@dataclass(frozen=True, eq=False)
class _State:
    """Moves of the target (N, 3), where it rests, and the last state before it left the drawing."""

    moves: Floats
    points: Floats
    solution: Solution
    structure: _Anchored
    departure: Floats
    before: Optional[_State] = None

    @property
    def worst(self) -> float:
        return float(self.departure.max())

    @property
    def mean_square(self) -> float:
        return float((self.departure**2).mean())

    @property
    def near(self) -> _State:
        return self.before or self


class _Fit:
    """The marks of one weave."""

    def __init__(self, weave: Weave, drawn: Floats, limit: float, metres: float, progress: Optional[Progress]) -> None:
        self.weave, self.limit, self.metres, self.progress = weave, limit, metres, progress
        self.rods = place_points(weave.axes, segments=SEGMENTS, metres=metres)
        nodes, n = weave.strands.nodes, len(self.rods.points)
        counts = np.maximum(np.bincount(nodes, minlength=weave.lattice.n_nodes), 1)
        share: Floats = 1.0 / counts.astype(np.float64)
        self.average = csr_matrix((share[nodes], (nodes, self.rods.of_visit)), shape=(len(counts), n))
        self.anchors = self.rods.points.copy()
        self.anchors[self.rods.of_visit] = drawn
        self.n_searches = 0

    @cached_property
    def spread(self) -> csr_matrix:
        """(n, N) moves of points from those of nodes: a point between two joints takes its part of both."""
        return _spread(self.weave, self.rods)

    def find(self, is_held: Bools, loads: Loads, held_loads: Loads, *, may_hold: bool) -> Balance:
        """Marks with which the weave rests near the drawing, and nodes to hold besides the supports."""
        state, held = self.fade(self.supported(is_held, loads)), is_held
        is_unstable = state.before is not None and state.near.worst <= self.limit
        if may_hold and state.worst > self.limit:
            state, held = self.hold(state, is_held, held_loads)
        moves = np.asarray(self.average @ (state.near.points - self.rods.points)) / self.metres
        nodes: Floats = self.weave.lattice.nodes + moves
        return Balance(nodes, held, state.departure / self.metres, is_unstable)

    def supported(self, is_held: Bools, loads: Loads) -> _Anchored:
        """The structure with nodes held where they were drawn, and no springs yet."""
        weave, diameter = self.weave, self.weave.diameters[self.rods.rod] * self.metres
        none = np.zeros(weave.lattice.n_nodes, bool)
        free = structure_of(weave, self.rods, none, Loads(), diameter=diameter, metres=self.metres)
        forces = load_forces(weave, self.rods, loads, diameter=diameter, metres=self.metres)
        fixed = np.zeros((len(self.rods.points), 3), bool)
        fixed[self.rods.of_visit[is_held[weave.strands.nodes]]] = True
        springs = np.zeros(len(self.rods.points))
        elements = (free.n_points, free.bends, free.stretches, free.ties)
        return _Anchored(*elements, forces, fixed, springs=springs, anchors=self.anchors)

    def fade(self, structure: _Anchored) -> _State:
        """Fit the marks while springs to the drawn places are made weaker, until the weave leaves them."""
        n_nodes = self.weave.lattice.n_nodes
        start = self._at_anchors(structure, self.rods.points)
        state, damping = self.rest(structure, np.zeros((n_nodes, 3)), start, _SPRINGS[0]), _FIRST_DAMPING
        state, damping = self.improve(state, _SPRINGS[0], damping)
        for springs in _SPRINGS[1:]:
            before = state
            state = self.rest(structure, state.moves, state.points, springs)
            if state.worst > _LEFT * max(before.worst, self.limit) or not state.solution.is_converged:
                freed = self.rest(structure, before.moves, state.points, _SPRINGS[-1])
                return replace(freed, before=before)
            state, damping = self.improve(state, springs, damping)
        return state

    def hold(self, state: _State, is_held: Bools, loads: Loads) -> tuple[_State, Bools]:
        """Hold nodes that depart most, and fit the marks again, until none departs by more than the limit."""
        held = is_held.copy()
        for k in range(_MOST_ROUNDS):
            held[self._worst(state.departure, held, _FIRST_HELD * 2 ** max(k - 1, 0))] = True
            state = self.fade(self.supported(held, loads))
            if state.worst <= self.limit and state.solution.is_converged:
                break
        return state, held

    def improve(self, state: _State, springs: float, damping: float) -> tuple[_State, float]:
        """A few Levenberg-Marquardt steps of the target, and the damping for the next ones."""
        for _ in range(_STEPS_EACH):
            if state.worst <= _ENOUGH * self.limit:
                break
            moves = state.moves + self._step(state, damping)
            forces = state.structure.forces(state.points)
            tried = self.rest(state.structure, moves, state.points, springs, forces=forces)
            if tried.solution.is_converged and tried.mean_square < state.mean_square:
                state, damping = tried, max(damping / 2, _LEAST_DAMPING)
            else:
                damping *= 4
        return state, damping

    def rest(
        self, structure: _Anchored, moves: Floats, start: Floats, springs: float, forces: Optional[Forces] = None
    ) -> _State:
        """Where the weave rests that is cut for the drawing with its nodes moved, on springs."""
        self.n_searches += 1
        a, b = self.rods.segments.T
        target = self.rods.points + self.spread @ moves
        stiff = np.zeros(structure.n_points)
        stiff[self.rods.of_visit] = springs * stiffness_scale(structure)
        lengths, _ = normalised(target[b] - target[a])
        cut = structure.cut_to(lengths * self.rods.scale[a])
        assert isinstance(cut, _Anchored)
        cut = replace_springs(cut, stiff)
        found = find_equilibrium(cut, start, forces=forces, most_steps=_MOST_SEARCH)
        departure = np.linalg.norm(np.asarray(self.average @ (found.points - self.anchors)), axis=1)
        if self.progress:
            self.progress(1.0 - 0.9**self.n_searches, f"marks, within {departure.max() / self.metres:.3g}")
        return _State(moves, found.points, found, cut, departure)

    def _step(self, state: _State, damping: float) -> Floats:
        """(N, 3) move of the target that brings the weave nearer to the drawing."""
        structure, factors = state.structure, state.solution.factors
        by_moves = self._forces_by_moves(state)[structure.free]
        average: csr_matrix = kron(self.average, identity(3), format="csr")[:, structure.free]
        back = average.T.tocsr()

        def product(move: Floats) -> Floats:
            moved: Floats = -(average @ factors.solve(by_moves @ move))
            return moved

        def transposed(error: Floats) -> Floats:
            moved: Floats = -(by_moves.T @ factors.solve(back @ error))
            return moved

        error = np.asarray(self.average @ (state.points - self.anchors)).ravel()
        shape = (len(error), 3 * self.weave.lattice.n_nodes)
        operator = LinearOperator(shape, matvec=product, rmatvec=transposed, dtype=np.float64)
        found = lsmr(operator, -error, damp=damping, atol=1e-6, btol=1e-6, maxiter=_SOLVES)[0]
        step: Floats = found.reshape(-1, 3)
        return step

    def _forces_by_moves(self, state: _State) -> csr_matrix:
        """(3n, 3N) derivative of the gradient by the moves of the target's nodes, through the rest lengths."""
        a, b = self.rods.segments.T
        target = self.rods.points + self.spread @ state.moves
        _, along = normalised(target[b] - target[a])
        length, unit = normalised(state.points[b] - state.points[a])
        stretches = state.structure.stretches
        # The force EA (l / r - 1) falls by EA l / r^2 with the rest length r, and EA is stiffness times r.
        slope = -stretches.stiffness * length / stretches.rest
        n = state.structure.n_points
        by_rest = _differences(self.rods.segments, slope[:, None] * unit, n).T
        of_points = _differences(self.rods.segments, along * self.rods.scale[a][:, None], n)
        of_moves = of_points @ kron(self.spread, identity(3), format="csr")
        product: csr_matrix = (by_rest @ of_moves).tocsr()
        return product

    def _worst(self, departure: Floats, is_held: Bools, most: int) -> Ints:
        """Nodes to hold next, those that depart most first."""
        nodes = self.weave.lattice.nodes
        apart = _APART * float(np.linalg.norm(np.ptp(nodes, axis=0)))
        left = np.where(is_held, 0.0, departure)
        chosen: list[int] = []
        while len(chosen) < most and left.max() > (self.limit if is_held.any() else 0.0):
            chosen.append(int(np.argmax(left)))
            left[np.linalg.norm(nodes - nodes[chosen[-1]], axis=1) < apart] = 0.0
        return np.array(chosen, np.int64)

    def _at_anchors(self, structure: Structure, points: Floats) -> Floats:
        """Points with the held ones where they were drawn."""
        return np.where(structure.is_fixed, self.anchors, points)


def replace_springs(structure: _Anchored, springs: Floats) -> _Anchored:
    """The same with other springs; the pattern of the Hessian is shared."""
    changed = replace(structure, springs=springs)
    for name in ("free", "_order", "_pairs", "_pattern"):
        changed.__dict__[name] = getattr(structure, name)
    return changed


def _differences(segments: Ints, weights: Floats, n: int) -> csr_matrix:
    """(M, 3n) weights (M, 3) times the difference of the two points of each segment."""
    a, b = segments.T
    rows = np.repeat(np.arange(len(segments)), 6)
    columns = np.concatenate([3 * b[:, None] + np.arange(3), 3 * a[:, None] + np.arange(3)], axis=1)
    values = np.concatenate([weights, -weights], axis=1)
    return csr_matrix((values.ravel(), (rows, columns.ravel())), shape=(len(segments), 3 * n))


def _spread(weave: Weave, rods: RodPoints) -> csr_matrix:
    nodes, n = weave.strands.nodes, len(rods.points)
    is_visit = np.zeros(n, bool)
    is_visit[rods.of_visit] = True
    index = np.arange(n)
    visit = np.cumsum(is_visit) - 1
    part = index - rods.of_visit[visit]
    between = np.flatnonzero(~is_visit)
    # The visit after a point between two: one on along the rod, or the first of a closed one.
    last = rods.offsets[1:][rods.rod[between]] - 1
    after = np.where(visit[last] == visit[between], visit[rods.offsets[:-1][rods.rod[between]]], visit[between] + 1)
    share = part[between] / SEGMENTS
    rows = np.concatenate([index[is_visit], between, between])
    columns = nodes[np.concatenate([visit[is_visit], visit[between], after])]
    values = np.concatenate([np.ones(int(is_visit.sum())), 1.0 - share, share])
    return csr_matrix((values, (rows, columns)), shape=(n, weave.lattice.n_nodes))
