"""`Joints`: where rods cross, and in which order they lie there; `Clashes`: where rods intersect elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, frozen, ranks_in_rows, rows_of


@dataclass(frozen=True, eq=False)
class Joints:
    """The nodes that two or more rods pass, each with its rods from the innermost to the outermost.

    A *visit* is an entry of ``strands.nodes``: one strand at one node.  Outermost is furthest along the normal of the
    surface.

    Parameters
    ----------
    node : (J,) int64
        Rising.
    offsets : (J+1,) int64
    visit : (V,) int64
        Visits at joint ``j``, each rod under the next: ``visit[offsets[j]:offsets[j + 1]]``.
    strand : (V,) int64
        The strand of each of these visits.
    """

    node: Ints
    offsets: Ints
    visit: Ints
    strand: Ints

    def __post_init__(self) -> None:
        n = len(self.node)
        for name, shape in (("node", (n,)), ("offsets", (n + 1,)), ("visit", (-1,)), ("strand", (len(self.visit),))):
            object.__setattr__(self, name, frozen(getattr(self, name), np.int64, shape))

    def __len__(self) -> int:
        return len(self.node)

    @cached_property
    def joint(self) -> Ints:
        """(V,) the joint of each visit."""
        return rows_of(self.offsets)

    @cached_property
    def rank(self) -> Ints:
        """(V,) how many rods lie under each visit."""
        ranks: Ints = np.arange(len(self.visit)) - self.offsets[self.joint]
        return ranks

    @cached_property
    def contacts(self) -> Ints:
        """(C, 2) positions in ``visit`` of the rods that touch: the lower one and the one on it."""
        lower = np.flatnonzero(np.diff(self.joint) == 0)
        return np.stack([lower, lower + 1], axis=1)

    @cached_property
    def crossings(self) -> Ints:
        """(C, 3) node, strand that lies over and strand that lies under, for every pair of rods at a joint."""
        counts = np.diff(self.offsets)
        above = np.repeat(np.arange(len(self.visit)), self.rank)
        nth = ranks_in_rows(self.rank)
        below = self.offsets[:-1][self.joint[above]] + nth
        rows: Ints = np.stack([self.node[self.joint[above]], self.strand[above], self.strand[below]], axis=1)
        return rows if counts.size else np.zeros((0, 3), np.int64)


@dataclass(frozen=True, eq=False)
class Clashes:
    """Pairs of rods whose axes come nearer to each other than half the sum of their diameters, the nearest first.

    Parameters
    ----------
    strands : (K, 2) int64
        A rod that intersects itself is named twice.
    distance : (K,) float64
        The least one of each pair.
    point : (K, 3) float64
        Where it is, halfway between the axes.
    """

    strands: Ints
    distance: Floats
    point: Floats

    def __post_init__(self) -> None:
        n = len(self.distance)
        object.__setattr__(self, "strands", frozen(self.strands, np.int64, (n, 2)))
        object.__setattr__(self, "distance", frozen(self.distance, np.float64, (n,)))
        object.__setattr__(self, "point", frozen(self.point, np.float64, (n, 3)))

    def __len__(self) -> int:
        return len(self.distance)
