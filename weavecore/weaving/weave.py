"""Stage 4: from the lattice to the rods (Yan et al. 2016, §3 and §6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.model.bending import Bending, Material
from weavecore.model.lattice import Lattice
from weavecore.model.rod_axes import RodAxes
from weavecore.model.strands import Strands
from weavecore.model.weave import Weave
from weavecore.weaving.axes import lay_axes
from weavecore.weaving.bending import material_named, measure_bending
from weavecore.weaving.clearance import find_clashes
from weavecore.weaving.layers import STACKED, Order, Style, order_rods, style_named, usual_style
from weavecore.weaving.naming import find_lean, name_strands
from weavecore.weaving.stock import choose_diameter, stock_diameters
from weavecore.weaving.strands import find_strands

_SPACING_IN_RODS = 48.0
"""Spacing, or mean edge where that is shorter, over the diameter that the search for a diameter starts from."""

_MOST_TRIALS = 4
"""The thickest diameter that passes follows from the axes at another diameter to a few percent: two trials are usual."""

Progress = Optional[Callable[[float, str], None]]


def weave_lattice(
    lattice: Lattice,
    *,
    rod_diameter: Optional[float] = None,
    material: Union[str, Material] = "gfrp",
    over_under: Optional[str] = None,
    progress: Progress = None,
) -> Weave:
    """Lay rods over and under each other along the edges of a lattice.

    Parameters
    ----------
    lattice : Lattice
    rod_diameter : float, optional
        In the model's unit; by default the thickest stock diameter with which nearly all rods can be bent to
        their places (`weavecore.weaving.stock`).
    material : str or Material
        A name in the table of materials, or one of your own.
    over_under : str, optional
        ``"stacked"``: in layers that rods do not leave; ``"plain"``: over, under, over…;
        ``"twill 2/2"`` or others: over two, under two.  By default what the lattice's pattern is woven in.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Weave

    Raises
    ------
    Unsupported
    """
    tell = progress or (lambda _fraction, _label: None)
    diameter = 1.0 if rod_diameter is None else float(rod_diameter)
    if not (np.isfinite(diameter) and diameter > 0):
        raise Unsupported(f"A rod of diameter {diameter:g} is no rod", remedy="Give a positive diameter.")
    style = style_named(over_under or usual_style(lattice.pattern))
    stuff = material if isinstance(material, Material) else material_named(material)
    tell(0.0, "finding the strands")
    strands = find_strands(lattice)
    lean = find_lean(strands, lattice)
    tell(0.2, "over and under")
    order = order_rods(lattice, strands, lean, style)
    tell(0.4, "bending the rods")
    woven = _Woven(lattice, strands, order, stuff, style)
    bent = woven.bend_in_stock() if rod_diameter is None else woven.bend(diameter)
    tell(0.8, "measuring")
    return Weave(
        lattice=lattice,
        strands=strands,
        ids=name_strands(strands, lattice, lean),
        joints=order.joints,
        axes=bent.axes,
        normals=bent.normals,
        bending=bent.bending,
        rod_diameter=bent.diameter,
        material=stuff,
        over_under=style.name,
        conflicts=order.conflicts,
        clashes=find_clashes(bent.axes, bent.diameter),
    )


@dataclass(frozen=True, eq=False)
class _Bent:
    """Rods of one diameter in their places."""

    diameter: float
    axes: RodAxes
    normals: Floats
    bending: Bending


@dataclass(frozen=True, eq=False)
class _Woven:
    """Rods in their order, before they have a diameter."""

    lattice: Lattice
    strands: Strands
    order: Order
    material: Material
    style: Style

    def bend(self, diameter: float) -> _Bent:
        """The axes of rods of this diameter, and how sharply they are bent."""
        axes, normals = lay_axes(
            self.lattice, self.strands, self.order.joints, diameter, centred_on_rings=self.style.name == STACKED
        )
        bending = measure_bending(axes, normals[self.strands.nodes], rod_diameter=diameter, material=self.material)
        return _Bent(diameter, axes, normals, bending)

    def bend_in_stock(self) -> _Bent:
        """The same in the diameter of the stock that is right for most rods."""
        stock = stock_diameters(self.material.name, self.lattice.latitudes.surface.unit)
        bent = self.bend(_first_diameter(self.lattice))
        for _ in range(_MOST_TRIALS):
            diameter = choose_diameter(bent.bending.largest_diameter, stock)
            if diameter == bent.diameter:
                break
            bent = self.bend(diameter)
        return bent


def _first_diameter(lattice: Lattice) -> float:
    edge = float(lattice.edge_lengths.mean()) if lattice.n_edges else np.inf
    return min(lattice.latitudes.spacing, edge) / _SPACING_IN_RODS
