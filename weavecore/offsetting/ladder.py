"""`Ladder`: how far from the borders each generation lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, frozen
from weavecore.tolerances import LEVEL_REACHED

Spacing = Union[float, Sequence[float], Floats]
"""One distance from each generation to the next, or one after the other, of which the last goes on."""


@dataclass(frozen=True, eq=False)
class Ladder:
    """Distances of the generations.

    A *height* counts generations: 2.5 lies halfway between the second and the third.

    Parameters
    ----------
    rungs : (n + 1,) float64
        Distances of generations 0 to n, from 0.
    step : float
        From each generation after those to the next.
    """

    rungs: Floats
    step: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "rungs", frozen(self.rungs, np.float64, (-1,)))

    @staticmethod
    def of(spacing: Spacing) -> Ladder:
        """The ladder of one spacing or of several.

        Raises
        ------
        Unsupported
            When one is not a positive number, or there is none.
        """
        steps = np.atleast_1d(np.asarray(spacing, np.float64))
        if steps.ndim != 1 or len(steps) == 0:
            raise Unsupported("No spacing is given", remedy="Give one positive length, or several.")
        wrong = steps[~(np.isfinite(steps) & (steps > 0))]
        if len(wrong):
            raise Unsupported(
                f"A spacing of {wrong[0]:g} is no distance", remedy="Give a positive length in the surface's unit."
            )
        return Ladder(np.concatenate([[0.0], np.cumsum(steps[:-1])]), float(steps[-1]))

    @property
    def steps(self) -> Floats:
        """(n + 1,) what it was made of."""
        return np.append(np.diff(self.rungs), self.step)

    @property
    def least(self) -> float:
        """The narrowest step."""
        return float(self.steps.min())

    def widest(self, n_generations: int) -> float:
        """The widest step up to the one beyond the last of so many generations."""
        return float(self.steps[:n_generations].max())

    def step_after(self, generation: int) -> float:
        """From a generation to the next."""
        return float(self.steps[min(generation, len(self.rungs) - 1)])

    def height(self, distance: Floats) -> Floats:
        """How many generations each distance lies from the borders."""
        top = len(self.rungs) - 1
        beyond: Floats = (distance - self.rungs[-1]) / self.step
        if top == 0:
            return beyond
        within = np.interp(distance, self.rungs, np.arange(top + 1.0))
        return np.where(distance < self.rungs[-1], within, top + beyond)

    def distance(self, height: Floats) -> Floats:
        """The distance at each height; the other way of `height`."""
        top = len(self.rungs) - 1
        beyond: Floats = self.rungs[-1] + (height - top) * self.step
        if top == 0:
            return beyond
        within = np.interp(height, np.arange(top + 1.0), self.rungs)
        return np.where(height < top, within, beyond)

    def count_below(self, distance: Floats) -> Ints:
        """Number of generations at or below each distance."""
        return np.floor(self.height(distance) + LEVEL_REACHED).astype(np.int64)
