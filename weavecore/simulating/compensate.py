"""Compensation for spring-back: marks, and where they do not suffice supports, for a weave to rest as it was drawn.

1. The weave comes to rest.  Where it keeps within the limit, nothing changes.
2. Where it rests near its drawing, its marks are fitted (`weavecore.simulating.marks`).
3. Where that does not suffice, few nodes to hold are chosen in a linear model (`weavecore.simulating.hold`), and an
   equilibrium verifies them.
4. In the same model marks are fitted to the held nodes, and as many of these are let go as the limit allows; again an
   equilibrium verifies what is left.

Held nodes that are let go are tried in batches, those that move the weave least first.  All searches count their
factorisations; when a number of them is spent, the search ends with what it has, so that results do not depend on the
clock.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Callable, Optional, cast

import numpy as np

from weavecore.errors import NotConverged, Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.model import Compensation, Equilibrium, Note, Weave
from weavecore.model.compensation import DRAWN, HELD, MARKS, OUT_OF_REACH, SUPPORTS, UNSTABLE
from weavecore.simulating.anchored import NearDrawing
from weavecore.simulating.boundary import Loads, Supports, supported_nodes, three_point_gauge
from weavecore.simulating.hold import MARGIN, STIFF, WEAK, hold_until_within, nodes_to_hold
from weavecore.simulating.linearised import LinearisedWeave
from weavecore.simulating.marks import FIRST_DAMPING, FIT_WORK, MarkFit, moving
from weavecore.simulating.newton import factorised, find_equilibrium
from weavecore.simulating.simulate import laid_over, simulate_weave
from weavecore.units import millimetres_in, with_unit

Progress = Callable[[float, str], None]

LIMIT = 2.0
"""Departure in millimetres that is allowed by default: about what marks and ties of a workshop hold."""

_NEAR = 0.02
"""Of the weave's size: where it rests further from its drawing, marks are not fitted to it without held nodes."""

_ROUNDS = 2
"""Splines through the moved nodes differ a little from the target of the fit: a second round, in which nodes move less,
takes up what is left where that exceeds the limit."""

_PARTS = (1.0, 0.75, 0.5, 0.25)
"""Of the nodes that the linear model with marks lets go, those that are tried in turn: it errs by more than the one
without."""

_MOST_WORK = 3.5e6
"""Unknowns times factorisations, after which no weave comes to rest and no more nodes are let go: about a minute."""

_LEAST_STEPS = 12
"""Factorisations of a search when the work is spent: one that begins near its equilibrium takes up to 9."""

_FIRST_BATCH = 0.25
"""Part of the held nodes that are let go at once at first."""

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
    near = NearDrawing(weave, weave.axes.points * metres, metres)
    work = _Work(_MOST_WORK / (3 * len(near.rods.points)))
    before = _reached(weave, work, supports=supports, loads=carried, unit=unit, progress=progress)
    if before.is_stable and before.departure_max <= limit:
        return Compensation(weave, before, before, limit, np.zeros(0, np.int64), DRAWN)
    search = _Search(near, move_nodes, before, work, limit, is_held, supports, loads, unit, progress)
    made = search.with_marks(carried)
    if not made.is_within and may_hold:
        made = search.with_held_nodes()
    noted = _with_note(made.weave, compensation_note(made))
    return replace(made, weave=noted, after=replace(made.after, weave=noted))


@dataclass
class _Work:
    """Factorisations that are left."""

    left: float


@dataclass(frozen=True, eq=False)
class _Search:
    """The search for marks and held nodes of one weave; ``limit`` is in the model's unit."""

    near: NearDrawing
    move_nodes: MoveNodes
    before: Equilibrium
    work: _Work
    limit: float
    is_held: Bools
    supports: Supports
    loads: Loads
    unit: Optional[str]
    progress: Optional[Progress]

    @property
    def weave(self) -> Weave:
        """As drawn."""
        return self.near.weave

    @property
    def metres(self) -> float:
        """In one unit of the model."""
        return self.near.metres

    def with_marks(self, loads: Loads) -> Compensation:
        """Marks alone, fitted from where the weave rests, where that is near its drawing."""
        before, none = self.before, np.zeros(0, np.int64)
        is_near = before.departure_max <= _NEAR * self.weave.lattice.latitudes.surface.size
        cut, after = self.weave, before
        if before.is_stable and is_near:
            start = before.points * self.metres
            found = self._cut(self.is_held, loads, start=start)
            cut, after = found or (cut, after)
        made = Compensation(cut, before, after, self.limit, none, MARKS)
        if not made.is_within:
            made = replace(made, verdict=UNSTABLE if self._leaves_drawing(loads) else OUT_OF_REACH)
        return made

    def with_held_nodes(self) -> Compensation:
        """Nodes held besides the supports, with the drawn marks or, where fewer suffice then, with others."""
        drawn = self._with_drawn_marks()
        if not drawn.is_within:
            return drawn
        model = _MarkedModel(self.near, self.is_held, self.loads, drawn.held)
        let_go = model.let_go(MARGIN * self.limit * self.metres, self.work)
        for part in _PARTS:
            fewer = let_go[: int(part * len(let_go))]
            if not fewer or self.work.left <= 0:
                break
            held, moves = model.without(fewer)
            is_fixed = self.is_held.copy()
            is_fixed[held] = True
            found = self._cut(is_fixed, self.loads, start=model.points, moves=moves)
            if found and found[1].departure_max <= self.limit and found[1].is_stable:
                return Compensation(found[0], self.before, found[1], self.limit, held, HELD)
        return drawn

    def _with_drawn_marks(self) -> Compensation:
        """The weave as drawn with nodes held besides the supports."""
        weave, nodes = self.weave, self.weave.lattice.nodes
        fixed = [nodes[[n]] for n in np.flatnonzero(self.is_held)]

        def at_rest(held: Sequence[Floats], start: Floats) -> Equilibrium:
            found = self._simulated(weave, [*fixed, *held], start)
            if found.departure_max > self.limit and self.work.left <= 0:
                raise NotConverged("The work is spent", remedy="Hold nodes, or allow more.", reached=found)
            return found

        try:
            after = hold_until_within(
                at_rest,
                self.limit,
                weave=weave,
                released=None,
                choose=lambda: nodes_to_hold(
                    weave, self.limit, is_held=self.is_held, loads=self.loads, metres=self.metres
                ),
            )
        except NotConverged as error:
            after = cast(Equilibrium, error.reached)
        held = np.flatnonzero(after.is_supported & ~self.is_held)
        made = Compensation(weave, self.before, after, self.limit, held, SUPPORTS)
        return made if made.is_within and after.is_stable else replace(made, verdict=OUT_OF_REACH)

    def _cut(
        self, is_fixed: Bools, loads: Loads, *, start: Floats, moves: Optional[Floats] = None
    ) -> Optional[tuple[Weave, Equilibrium]]:
        """The weave with fitted marks and where it rests, None where no marks were found."""
        near, added = self.near, np.flatnonzero(is_fixed & ~self.is_held)
        supports: Supports = list(self.weave.lattice.nodes[is_fixed]) if len(added) else self.supports
        made: Optional[tuple[Weave, Equilibrium]] = None
        for _ in range(_ROUNDS):
            fit = MarkFit(near, MARGIN * self.limit * self.metres, self.progress)
            state = fit.find(is_fixed, loads, start=start, moves=moves)
            self.work.left -= fit.n_factorised
            if not state.solution.is_converged:
                break
            cut = self.move_nodes(near.weave, near.weave.lattice.nodes + state.moves / self.metres)
            after = self._simulated(cut, supports, state.points / self.metres)
            after = replace(after, points=_beside(after, self.before), drawn=self.before.drawn)
            if made is None or after.departure_max < made[1].departure_max:
                made = cut, after
            is_last = state.worst > self.limit * self.metres or self.work.left <= 0
            if after.departure_max <= self.limit or is_last:
                break
            near = NearDrawing(cut, self.near.drawn, self.metres)
            start, moves = after.points * self.metres, None
        return made

    def _simulated(self, weave: Weave, supports: Supports, start: Floats) -> Equilibrium:
        is_supported = bool(supported_nodes(weave, supports).any())
        return _reached(
            weave,
            self.work,
            supports=supports,
            loads=self.loads if is_supported else Loads(),
            unit=self.unit,
            start=start if is_supported else None,
            progress=self.progress,
        )

    def _leaves_drawing(self, loads: Loads) -> bool:
        """Whether the weave is unstable at its drawing, so that no marks near to the drawn ones keep it there."""
        near = self.near
        structure = near.supported(self.is_held, loads)
        stiff = structure.on_springs(near.springs(structure, STIFF))
        found = find_equilibrium(stiff, near.at_anchors(stiff, near.rods.points))
        if not self.is_held.any():
            structure = replace(structure, is_fixed=three_point_gauge(near.rods.points))
        return factorised(structure, structure.hessian(found.points))[1] > 0


class _MarkedModel:
    """A weave with held nodes and other marks, linear about its equilibrium on stiff springs."""

    def __init__(self, near: NearDrawing, is_held: Bools, loads: Loads, held: Ints) -> None:
        structure = near.supported(is_held, loads)
        structure = structure.on_springs(near.springs(structure, STIFF))
        found = find_equilibrium(structure, near.at_anchors(structure, near.rods.points))
        self.points, self._held, self._is_held = found.points, held.tolist(), is_held
        self._linear = LinearisedWeave(near, structure, found.points)
        still = np.zeros((near.weave.lattice.n_nodes, 3))
        self._by_moves = MarkFit(near, 0.0).forces_by_moves(structure, still, found.points)

    def let_go(self, limit: float, work: _Work) -> list[int]:
        """Held nodes that may go, in turn, so that none departs by more than the limit in metres with other marks.

        It takes half of the work that is left at most.
        """
        least_left = work.left / 2
        linear = self._linear
        linear.held = list(self._held)
        linear.on_springs(WEAK)
        gone: list[int] = []
        batch = max(int(_FIRST_BATCH * len(linear.held)), 1)
        while batch and work.left > least_left:
            least = self._dispensable(batch)
            kept = np.isin(linear.held, least, invert=True)
            before, is_enough = list(linear.held), False
            if kept.any() and linear.without(kept)[1] == 0:
                linear.keep(kept)
                work.left -= FIT_WORK
                is_enough = bool(self._fitted()[1].max() <= limit)
            if is_enough:
                gone += least
            else:
                linear.held = before
                linear.on_springs(WEAK)
                batch //= 2
        return gone

    def without(self, gone: list[int]) -> tuple[Ints, Floats]:
        """The other held nodes, and moves (N, 3) of the target with which the weave departs least."""
        linear = self._linear
        linear.held = [node for node in self._held if node not in gone]
        linear.on_springs(WEAK)
        return np.array(linear.held, np.int64), self._fitted()[0]

    def _fitted(self) -> tuple[Floats, Floats]:
        """Moves of the target with which the weave departs least, and departures (N,)."""
        is_held = self._is_held.copy()
        is_held[self._linear.held] = True
        return self._linear.fitted(self._by_moves @ moving(is_held), FIRST_DAMPING)

    def _dispensable(self, count: int) -> list[int]:
        """So many held nodes without which the others depart least, those first."""
        linear, worst = self._linear, []
        for k in range(len(linear.held)):
            departure, n_negative = linear.without(np.arange(len(linear.held)) != k)
            worst.append(np.inf if n_negative else float(departure.max()))
        order = np.argsort(worst, kind="stable")[:count]
        return [linear.held[k] for k in order.tolist()]


def _reached(weave: Weave, work: _Work, **options: Any) -> Equilibrium:
    """Where a weave rests, or where the search for it or the work ended."""
    try:
        found = simulate_weave(weave, most_steps=max(int(work.left), _LEAST_STEPS), **options)
    except NotConverged as error:
        found = cast(Equilibrium, error.reached)
    work.left -= found.n_steps
    return found


def _beside(after: Equilibrium, before: Equilibrium) -> Floats:
    """Points of a weave at rest, laid over the first drawing where nothing holds them."""
    if after.is_supported.any():
        return after.points
    return laid_over(after.points, before.drawn, weights=np.ones(len(after.points)))


def _with_note(weave: Weave, note: Note) -> Weave:
    """The same weave, with a note beside those of its surface."""
    latitudes = weave.lattice.latitudes
    surface = latitudes.surface.with_notes((*latitudes.surface.notes, note))
    return replace(weave, lattice=replace(weave.lattice, latitudes=replace(latitudes, surface=surface)))


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
    # Where the search ends before it has converged, nodes may lie near the drawing and yet not be at rest.
    code = "SPRINGS_BACK" if found.verdict in (UNSTABLE, OUT_OF_REACH) else "COMPENSATED"
    return Note(code, text + reasons[found.verdict] + ".", numbers, found.weave.lattice.nodes[found.held])
