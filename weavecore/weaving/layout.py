"""Layouts: rods before they have a diameter.

Which edges a rod follows, which rod lies over which, and which way the rods at a node share for a normal do not depend
on their diameters or material.  So a weave in another diameter begins with the layout of the one before, and is the
same as if that were found anew.  Linear in the edges but for sorting.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Optional

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints
from weavecore.model.lattice import Lattice
from weavecore.model.rod_pairing import DartPairs, find_dart_pairs
from weavecore.model.strands import Strands
from weavecore.weaving.axes import normals_of_rods, surface_normals
from weavecore.weaving.layers import Order, Style, order_rods, style_named, usual_style
from weavecore.weaving.naming import Slants, find_lean, find_slants, name_strands
from weavecore.weaving.strands import find_strands


@dataclass(frozen=True, eq=False)
class Layout:
    """Rods along the edges of a lattice, over and under each other, of any diameter.

    Parameters
    ----------
    lattice : Lattice
    style : Style
    strands : Strands
        Before any are broken.
    lean : (S,) int64
        As of `find_lean`.
    order : Order
        Of the rods at the joints.
    outward : (N, 3) float64
        Unit normals of the lattice.
    normals : (N, 3) float64
        Unit normals common to the rods that pass each node, for rods without thickness.
    pairs : DartPairs
        The pairs of edges that rods may follow.
    slants : Slants
        How the edges slant.
    """

    lattice: Lattice
    style: Style
    strands: Strands
    lean: Ints
    order: Order
    outward: Floats
    normals: Floats
    pairs: DartPairs
    slants: Slants

    def __repr__(self) -> str:
        return f"<Layout: {len(self.strands)} rods, {len(self.order.joints)} joints, {self.style.name}>"

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Names of the rods."""
        return name_strands(self.strands, self.lattice, self.lean)


def lay_out_rods(lattice: Lattice, over_under: Optional[str] = None) -> Layout:
    """Find the rods of a lattice, and which lies over which.

    Parameters
    ----------
    lattice : Lattice
    over_under : str, optional
        As of `weave_lattice`.

    Returns
    -------
    Layout

    Raises
    ------
    Unsupported
        Where the style is not known.
    """
    style = style_named(over_under or usual_style(lattice.pattern))
    pairs, slants = find_dart_pairs(lattice), find_slants(lattice)
    strands = find_strands(lattice, pairs=pairs)
    lean = find_lean(strands, lattice, slants)
    order = order_rods(lattice, strands, lean, style)
    outward = surface_normals(lattice)
    return Layout(
        lattice=lattice,
        style=style,
        strands=strands,
        lean=lean,
        order=order,
        outward=outward,
        normals=normals_of_rods(lattice, strands, outward),
        pairs=pairs,
        slants=slants,
    )


def check_layout(layout: Layout, lattice: Lattice, over_under: Optional[str]) -> None:
    """Refuse a layout of another lattice or in another style.

    Parameters
    ----------
    layout : Layout
    lattice : Lattice
    over_under : str or None
        The style that is asked for; any if None.

    Raises
    ------
    Unsupported
    """
    if layout.lattice is not lattice:
        raise Unsupported("The layout is that of another lattice", remedy="Lay out the rods of this lattice.")
    if over_under is not None and style_named(over_under) != layout.style:
        raise Unsupported(
            f"The layout is {layout.style.name}, not {over_under}",
            remedy="Lay out the rods in the style that is asked for.",
        )
