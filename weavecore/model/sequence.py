"""`BuildSequence`: the order in which rods are set, and when each joint is tied."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, frozen


@dataclass(frozen=True, eq=False)
class BuildSequence:
    """One step a rod: step ``k`` sets rod ``strand[k]`` and ties the joints whose rods are then all set.

    Parameters
    ----------
    strand : (S,) int64
        Each rod once.
    is_ring : (S,) bool
        Whether the rod of each step is a ring of the latitudinal family, or a rod of that family
        between free borders.
    generation : (S,) int64
        Never falling: all rings of a generation, then the rods that are woven in before the next.  Generation 0
        are the borders, and the rods that bind only them.
    tied_offsets : (S+1,) int64
    tied : (J,) int64
        Joints that step ``k`` ties, rising: ``tied[tied_offsets[k]:tied_offsets[k + 1]]``; each joint once.
    after_offsets : (S+1,) int64
    after : (…,) int64
        Earlier steps that step ``k`` needs: for a ring those of the rings before it, for another rod
        those of the rings that it binds first.
    """

    strand: Ints
    is_ring: Bools
    generation: Ints
    tied_offsets: Ints
    tied: Ints
    after_offsets: Ints
    after: Ints

    def __post_init__(self) -> None:
        n = len(self.strand)
        for name, dtype, shape in (
            ("strand", np.int64, (n,)),
            ("is_ring", np.bool_, (n,)),
            ("generation", np.int64, (n,)),
            ("tied_offsets", np.int64, (n + 1,)),
            ("tied", np.int64, (-1,)),
            ("after_offsets", np.int64, (n + 1,)),
            ("after", np.int64, (-1,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))

    def __len__(self) -> int:
        return len(self.strand)

    def tied_at(self, step: int) -> Ints:
        """Joints that a step ties."""
        joints: Ints = self.tied[self.tied_offsets[step] : self.tied_offsets[step + 1]]
        return joints

    def needed_by(self, step: int) -> Ints:
        """Earlier steps that a step needs."""
        steps: Ints = self.after[self.after_offsets[step] : self.after_offsets[step + 1]]
        return steps
