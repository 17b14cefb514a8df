"""`Strands`: which edges of a lattice are one continuous rod."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Ints, frozen, next_in_loop, previous_in_loop, rows_of
from weavecore.model.lattice import Lattice, node_generations


@dataclass(frozen=True, eq=False)
class Strands:
    """A partition of the edges of a lattice into continuous rods, as ragged node lists.

    Parameters
    ----------
    offsets : (S+1,) int64
        Strand ``s`` runs through ``nodes[offsets[s]:offsets[s + 1]]``.
    nodes : (M,) int64
        The first node of a closed strand is not repeated at its end.
    family : (S,) int64
        `LATITUDINAL`, `LONGITUDINAL` or `POCKET`.  Latitudinal strands have latitudinal edges only; a longitudinal
        strand may continue along edges of a pocket, or of a latitude that is broken there.
    closed : (S,) bool
    """

    offsets: Ints
    nodes: Ints
    family: Ints
    closed: Bools

    def __post_init__(self) -> None:
        n_strands = len(self.offsets) - 1
        for name, dtype, shape in (
            ("offsets", np.int64, (n_strands + 1,)),
            ("nodes", np.int64, (-1,)),
            ("family", np.int64, (n_strands,)),
            ("closed", np.bool_, (n_strands,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))
        if self.offsets[0] != 0 or self.offsets[-1] != len(self.nodes):
            raise ValueError("offsets must run from 0 to the number of nodes")

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @cached_property
    def owner(self) -> Ints:
        """(M,) strand of each entry of ``nodes``."""
        return frozen(rows_of(self.offsets), np.int64, (-1,))

    @cached_property
    def following(self) -> Ints:
        """(M,) entry of ``nodes`` that comes next along its strand, -1 at the end of an open one."""
        after = next_in_loop(self.offsets)
        after[self.offsets[1:][~self.closed] - 1] = -1
        return frozen(after, np.int64, (-1,))

    @cached_property
    def preceding(self) -> Ints:
        """(M,) entry of ``nodes`` that comes before along its strand, -1 at the start of an open one."""
        before = previous_in_loop(self.offsets)
        before[self.offsets[:-1][~self.closed]] = -1
        return frozen(before, np.int64, (-1,))

    def strand(self, s: int) -> Ints:
        """The nodes (n,) of strand ``s`` in order."""
        nodes: Ints = self.nodes[self.offsets[s] : self.offsets[s + 1]]
        return nodes


def first_generations(strands: Strands, lattice: Lattice) -> Ints:
    """The least generation that each strand touches.

    Nodes off the latitudes do not count unless all are; then it is 0, or on a surface with free borders, along which
    rods lie at any depth, that of the latitudes before them, by their mean depth as in the order of construction.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice

    Returns
    -------
    (S,) int64
    """
    latitudes = lattice.latitudes
    none = latitudes.n_generations
    of_node = np.where(lattice.node_latitude < 0, none, latitudes.generation[lattice.node_latitude])
    least: Ints = np.minimum.reduceat(of_node[strands.nodes], strands.offsets[:-1])
    before = np.zeros(len(strands), np.int64)
    if latitudes.surface.is_free_border.any():
        depth = np.add.reduceat(node_generations(lattice)[strands.nodes], strands.offsets[:-1])
        before = np.floor(depth / np.diff(strands.offsets))
    begins: Ints = np.where(least == none, before, least).astype(np.int64)
    return begins
