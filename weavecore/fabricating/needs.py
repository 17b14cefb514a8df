"""What a weave needs of stock and ties, without the tables and templates of the workshop folder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np

from weavecore.fabricating.nesting import nest_pieces
from weavecore.fabricating.plan import plan_rods
from weavecore.fabricating.splices import cut_rods
from weavecore.fabricating.workshop import KG_PER_MM3, Workshop
from weavecore.model import Weave

_MM_PER_M = 1000.0


@dataclass(frozen=True)
class MaterialNeeds:
    """The sums of a bill of materials.

    Parameters
    ----------
    metres : float
        Length of all pieces, splices included.
    kilograms : float or None
        Their mass; None where the density of the material is not known.
    n_bars : int
        Bars of stock that they are cut from.
    waste : float
        Share of the bars that is left over, from 0 to 1.
    """

    metres: float
    kilograms: Optional[float]
    n_bars: int
    waste: float


def estimate_needs(weave: Weave, *, scale: float, workshop: Workshop) -> MaterialNeeds:
    """Cut the rods of a weave and nest their pieces in bars.

    Parameters
    ----------
    weave : Weave
    scale : float
        Millimetres in one unit of the model.
    workshop : Workshop

    Returns
    -------
    MaterialNeeds

    Raises
    ------
    Unsupported
        Where the stock is too short for a rod.
    """
    plan = plan_rods(weave, scale)
    pieces, _ = cut_rods(plan, workshop)
    bars = nest_pieces(pieces, stock=workshop.stock, kerf=workshop.kerf, diameters=plan.diameters)
    lengths = np.array([piece.cut_length for piece in pieces])
    cut = float(lengths.sum())
    density = weave.material.density
    area = np.pi / 4 * plan.diameters[[piece.rod for piece in pieces]] ** 2
    mass = density * KG_PER_MM3 * (area * lengths).sum()
    waste = 1.0 - cut / (workshop.stock * max(len(bars), 1))
    return MaterialNeeds(cut / _MM_PER_M, float(mass) if density > 0 else None, len(bars), float(waste))
