"""`Compensation`: a weave that is cut so that it rests where another one was drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen
from weavecore.model.equilibrium import Equilibrium
from weavecore.model.weave import Weave

DRAWN, MARKS, HELD = "as drawn", "marks", "marks and held nodes"
"""Verdicts within the limit: nothing has to change; other marks suffice; they do with further nodes held."""

SUPPORTS = "held nodes"
"""Within it too: no other marks were found to help, but with the drawn ones further nodes held suffice."""

UNSTABLE, OUT_OF_REACH = "unstable", "out of reach"
"""Verdicts beyond it: marks give a balance, but an unstable one; no balance was found."""


@dataclass(frozen=True, eq=False)
class Compensation:
    """A weave with compensated marks.  Lengths are in the model's unit.

    Parameters
    ----------
    weave : Weave
        As it is to be cut and marked: its lengths and marks are those to cut.  It is drawn as the target, from which it
        springs to near the first drawing.
    before : Equilibrium
        Of the weave as it was drawn.
    after : Equilibrium
        Of the compensated weave; its departure is that from the first drawing.
    limit : float
        Departure that was allowed.
    held : (h,) int64
        Nodes that must be held besides the supports.
    verdict : str
        ``"as drawn"``, ``"marks"``, ``"marks and held nodes"``, ``"held nodes"``, ``"unstable"`` or ``"out of reach"``.
    """

    weave: Weave
    before: Equilibrium
    after: Equilibrium
    limit: float
    held: Ints
    verdict: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "held", frozen(self.held, np.int64, (-1,)))

    @property
    def is_within(self) -> bool:
        """Whether no node departs by more than the limit."""
        return self.after.departure_max <= self.limit

    @property
    def mark_changes(self) -> Floats:
        """(M,) how far each mark moves along its rod."""
        changes: Floats = self.weave.axes.stations - self.before.weave.axes.stations
        return changes

    @property
    def length_changes(self) -> Floats:
        """(S,) by how much each rod gets longer."""
        changes: Floats = self.weave.axes.lengths - self.before.weave.axes.lengths
        return changes
