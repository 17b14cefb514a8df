"""`Origins`: the paths along edges of a surface from which distances start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, frozen


@dataclass(frozen=True, eq=False)
class Origins:
    """Paths along the edges of a mesh: generation 0 of the latitudes.

    Parameters
    ----------
    paths : sequence of (n,) int64
        Vertices of each path; the first of a closed one is not repeated.  No vertex lies on two.  A path along
        a border runs with the surface on its left; one inside the surface starts distances on both sides.
    closed : (P,) bool
    """

    paths: tuple[Ints, ...]
    closed: Bools

    def __post_init__(self) -> None:
        object.__setattr__(self, "paths", tuple(frozen(path, np.int64, (-1,)) for path in self.paths))
        object.__setattr__(self, "closed", frozen(self.closed, np.bool_, (len(self.paths),)))

    def __len__(self) -> int:
        return len(self.paths)

    def edges(self) -> tuple[Ints, Ints]:
        """First and second vertex of every edge of the paths, in their order."""
        ends = [(path, np.roll(path, -1)) if c else (path[:-1], path[1:]) for path, c in zip(self.paths, self.closed)]
        nothing = np.zeros(0, np.int64)
        return np.concatenate([nothing, *(a for a, _ in ends)]), np.concatenate([nothing, *(b for _, b in ends)])

    def vertices(self) -> Ints:
        """Vertices of all paths, in their order."""
        return np.concatenate([np.zeros(0, np.int64), *self.paths])
