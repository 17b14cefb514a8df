"""`Replay`: where a weave rests at steps of its building sequence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen
from weavecore.model.weave import Weave


@dataclass(frozen=True, eq=False)
class Replay:
    """The unfinished weave after some steps of the sequence.  Lengths are in the model's unit, stresses in MPa.

    Parameters
    ----------
    weave : Weave
    step : (K,) int64
        Rising: after which step of the sequence, from 0; the last is the finished weave.
    n_rods : (K,) int64
        Rods that are tied so far that they carry; others are taken as held by hand.
    displacement : (K,) float64
        Largest distance of a tied node from where it was drawn.
    node : (K,) int64
        That node; -1 where nothing is tied yet.
    stress : (K,) float64
        Largest stress.
    rod : (K,) int64
        The rod in which it is; -1 where there is none.
    is_converged : (K,) bool
        Whether an equilibrium was found; else the figures are of the state that was reached.
    supports, loads : str
    strand : (S,) int64
        The rod of each step of the sequence.
    spread : tuple of int
        Generations whose rods are set far from each other in turn.
    """

    weave: Weave
    step: Ints
    n_rods: Ints
    displacement: Floats
    node: Ints
    stress: Floats
    rod: Ints
    is_converged: Bools
    supports: str
    loads: str
    strand: Ints
    spread: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.step)
        for name in ("step", "n_rods", "node", "rod"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int64, (n,)))
        for name in ("displacement", "stress"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.float64, (n,)))
        object.__setattr__(self, "strand", frozen(self.strand, np.int64, (len(self.weave),)))
        object.__setattr__(self, "is_converged", frozen(self.is_converged, np.bool_, (n,)))

    def __len__(self) -> int:
        return len(self.step)

    @property
    def worst(self) -> int:
        """The row with the largest displacement."""
        return int(np.argmax(self.displacement))

    @property
    def most_stressed(self) -> int:
        """The row with the largest stress."""
        return int(np.argmax(self.stress))

    @property
    def utilisation(self) -> Floats:
        """(K,) stress over the admissible one."""
        material = self.weave.material
        return self.stress * material.factor / material.strength
