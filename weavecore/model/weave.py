"""`Weave`: rods with names, an order at every joint, and axes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen
from weavecore.geometry.elementary import arctangents
from weavecore.geometry.polygon_mesh import nodes_on_border
from weavecore.model.bending import Bending, Material
from weavecore.model.joints import Clashes, Joints
from weavecore.model.lattice import FAMILIES, LATITUDINAL, Lattice
from weavecore.model.rod_axes import RodAxes
from weavecore.model.strands import Strands


@dataclass(frozen=True, eq=False, repr=False)
class Weave:
    """Continuous rods, over and under one another (Yan et al. 2016, §3 and §6).

    Parameters
    ----------
    lattice : Lattice
        The lattice that it was made from.
    strands : Strands
        The rods as rows of nodes.
    ids : tuple of str
        Name of each rod: a letter for its family and a number, ``L03`` latitudinal,
        ``A12`` and ``B12`` longitudinal, leaning forwards and backwards, ``P05`` of a pocket.
    joints : Joints
        Which rods cross at which nodes, from the innermost to the outermost.
    axes : RodAxes
        The centre lines of the rods.
    normals : (N, 3) float64
        The direction out of the surface in which the rods at each node are stacked: the axis of a
        rod is at ``nodes + layer_offset * normals``.
    bending : Bending
    diameters : (S,) float64
        Of the rods, in the model's unit.
    material : Material
    over_under : str
        ``"stacked"``, ``"plain"`` or a twill such as ``"twill 2/2"``.
    conflicts : (C, 3) int64
        Departures from the over-under order: a strand, a node, and the node before it along the strand
        from which the order does not continue.
    clashes : Clashes
        Rods that intersect away from their joints; mostly where they run
        side by side, or where joints are closer than a few diameters.
    """

    lattice: Lattice
    strands: Strands
    ids: tuple[str, ...]
    joints: Joints
    axes: RodAxes
    normals: Floats
    bending: Bending
    diameters: Floats
    material: Material
    over_under: str
    conflicts: Ints
    clashes: Clashes

    def __repr__(self) -> str:
        return f"<Weave: {len(self)} rods, {len(self.joints)} joints, {self.over_under}, {self.material.name}>"

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", tuple(self.ids))
        object.__setattr__(self, "normals", frozen(self.normals, np.float64, (self.lattice.n_nodes, 3)))
        object.__setattr__(self, "conflicts", frozen(self.conflicts, np.int64, (-1, 3)))
        object.__setattr__(self, "diameters", frozen(self.diameters, np.float64, (len(self.strands),)))
        if len(self.ids) != len(self.strands) or len(set(self.ids)) != len(self.ids):
            raise ValueError("each strand needs an id of its own")

    def __len__(self) -> int:
        return len(self.strands)

    @property
    def rod_diameter(self) -> float:
        """Diameter of the thickest rods."""
        return float(self.diameters.max(initial=0.0))

    @cached_property
    def family_diameters(self) -> dict[str, float]:
        """Diameter of the rods by their family, of those families that have rods."""
        families, first = np.unique(self.strands.family, return_index=True)
        return {FAMILIES[f]: float(self.diameters[s]) for f, s in zip(families.tolist(), first.tolist())}

    @cached_property
    def crossings(self) -> Ints:
        """(C, 3) node, strand over, strand under, for every pair of rods at a joint."""
        return self.joints.crossings

    @cached_property
    def is_border_node(self) -> Bools:
        """(N,) whether a node lies on a border of the surface."""
        return nodes_on_border(self.lattice.face_offsets, self.lattice.face_nodes, self.lattice.n_nodes)

    @cached_property
    def end_nodes(self) -> Ints:
        """(2 · open strands,) the first and the last node of every open strand."""
        is_open = ~self.strands.closed
        first, last = self.strands.offsets[:-1][is_open], self.strands.offsets[1:][is_open] - 1
        ends: Ints = self.strands.nodes[np.stack([first, last], axis=1).ravel()]
        return ends

    @property
    def n_ends_inside(self) -> int:
        """Count of rod ends that do not lie on a border of the surface."""
        return int((~self.is_border_node[self.end_nodes]).sum())

    @cached_property
    def turns(self) -> Floats:
        """(T,) angle in radians by which a rod that is no ring turns at each node that it passes, as the edges turn."""
        strands = self.strands
        passes = np.repeat(strands.family != LATITUDINAL, np.diff(strands.offsets))
        passes[strands.offsets[:-1]] = passes[strands.offsets[1:] - 1] = False
        at = np.flatnonzero(passes)
        before, here, after = (self.lattice.nodes[strands.nodes[at + k]] for k in (-1, 0, 1))
        one, other = here - before, after - here
        across = np.linalg.norm(np.cross(one, other), axis=1)
        return arctangents(across, (one * other).sum(1))

    @property
    def median_length(self) -> float:
        """Median arc length of the rods."""
        return float(np.median(self.axes.lengths)) if len(self) else 0.0
