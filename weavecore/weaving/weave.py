"""Stage 4: from the lattice to the rods (Yan et al. 2016, §3 and §6)."""

from __future__ import annotations

from typing import Callable, Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.model.bending import Material
from weavecore.model.lattice import Lattice
from weavecore.model.weave import Weave
from weavecore.weaving.axes import lay_axes
from weavecore.weaving.bending import material_named, measure_bending
from weavecore.weaving.clearance import find_clashes
from weavecore.weaving.layers import STACKED, order_rods, style_named, usual_style
from weavecore.weaving.naming import find_lean, name_strands
from weavecore.weaving.strands import find_strands

_SPACING_IN_RODS = 24.0
"""Spacing over diameter where none is asked for: rods of 5 mm at 120 mm.  Where edges are shorter they count
instead: going over and under from joint to joint bends a rod the more, the nearer the joints are."""

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
        In the model's unit; by default a 24th of the spacing, or of the mean edge where that is shorter.
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
    diameter = _usual_diameter(lattice) if rod_diameter is None else float(rod_diameter)
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
    axes, normals = lay_axes(lattice, strands, order.joints, diameter, centred_on_rings=style.name == STACKED)
    tell(0.8, "measuring")
    bending = measure_bending(axes, rod_diameter=diameter, material=stuff, unit=lattice.latitudes.surface.unit)
    return Weave(
        lattice=lattice,
        strands=strands,
        ids=name_strands(strands, lattice, lean),
        joints=order.joints,
        axes=axes,
        normals=normals,
        bending=bending,
        rod_diameter=diameter,
        material=stuff,
        over_under=style.name,
        conflicts=order.conflicts,
        clashes=find_clashes(axes, diameter),
    )


def _usual_diameter(lattice: Lattice) -> float:
    edge = float(lattice.edge_lengths.mean()) if lattice.n_edges else np.inf
    return min(lattice.latitudes.spacing, edge) / _SPACING_IN_RODS
