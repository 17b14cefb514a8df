"""`Product`: what a writer gets, whichever stage it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from weavecore.geometry.arrays import Floats, next_in_loop, rows_of
from weavecore.model import Equilibrium, Latitudes, Lattice, Strands, SurfaceMesh, Weave

StageValue = Union[SurfaceMesh, Latitudes, Lattice, Weave, Equilibrium]
"""The results of the stages."""


@dataclass(frozen=True, eq=False)
class Product:
    """A stage's result with all that it was made from.

    Parameters
    ----------
    surface : SurfaceMesh
    latitudes : Latitudes, optional
    lattice : Lattice, optional
    strands : Strands, optional
        The rods of the lattice.
    weave : Weave, optional
    equilibrium : Equilibrium, optional
    parameters : mapping
        The options it was made with: numbers, texts and lists of them.
    """

    surface: SurfaceMesh
    latitudes: Optional[Latitudes] = None
    lattice: Optional[Lattice] = None
    strands: Optional[Strands] = None
    weave: Optional[Weave] = None
    equilibrium: Optional[Equilibrium] = None
    parameters: Mapping[str, object] = field(default_factory=dict)

    @property
    def value(self) -> StageValue:
        """The stage's result itself."""
        later_first = (self.equilibrium, self.weave, self.lattice, self.latitudes)
        return next((one for one in later_first if one is not None), self.surface)


def product_of(
    value: StageValue, *, strands: Optional[Strands] = None, parameters: Optional[Mapping[str, object]] = None
) -> Product:
    """Gather a stage's result and what it was made from.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    strands : Strands, optional
        The rods of a lattice; a weave has its own.
    parameters : mapping, optional
        Options to be named in the file; those that the values themselves have are added.

    Returns
    -------
    Product
    """
    known: dict[str, object] = dict(parameters or {})
    if isinstance(value, SurfaceMesh):
        return Product(value, parameters=known)
    if isinstance(value, Equilibrium):
        known.update(supports=value.supports, loads=value.loads)
        return replace(product_of(value.weave, parameters=known), equilibrium=value)
    if isinstance(value, Weave):
        known.update(rod_diameter=value.rod_diameter, material=value.material.name, over_under=value.over_under)
        if len(set(value.family_diameters.values())) > 1:
            known["rod_diameters"] = value.family_diameters
        return replace(product_of(value.lattice, strands=value.strands, parameters=known), weave=value)
    latitudes = value if isinstance(value, Latitudes) else value.latitudes
    known["spacing"] = latitudes.spacing
    if len(latitudes.steps) > 1:
        known["spacings"] = latitudes.steps.tolist()
    if isinstance(value, Latitudes):
        return Product(latitudes.surface, latitudes, parameters=known)
    known["edge_length"], known["pattern"] = value.edge_length, value.pattern
    return Product(latitudes.surface, latitudes, value, strands, parameters=known)


def strand_lengths(strands: Strands, lattice: Lattice) -> Floats:
    """Lengths of strands from node to node, the closing edge of closed ones included.

    Parameters
    ----------
    strands : Strands
    lattice : Lattice

    Returns
    -------
    (S,) float64
        In the model's unit.
    """
    after = next_in_loop(strands.offsets)
    steps = np.linalg.norm(lattice.nodes[strands.nodes[after]] - lattice.nodes[strands.nodes], axis=1)
    is_last_of_open = ~strands.closed & (np.diff(strands.offsets) > 0)
    steps[strands.offsets[1:][is_last_of_open] - 1] = 0.0
    lengths: NDArray[Any] = np.bincount(rows_of(strands.offsets), steps, minlength=len(strands))
    return lengths
