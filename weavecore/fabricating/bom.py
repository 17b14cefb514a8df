"""The bill of materials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weavecore.fabricating.nesting import Bar
from weavecore.fabricating.pieces import Piece, Splice
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.table import Table, mm, number
from weavecore.fabricating.ties import Ties, size_of_tie
from weavecore.fabricating.workshop import SLEEVE, Workshop

LABELS_PER_PIECE = 2


def kilograms_per_mm(diameter: float, density: float) -> float:
    """Mass of a round rod by its length; not a number where the density is not known."""
    return np.pi / 4 * diameter**2 * density * 1e-9 if density > 0 else float("nan")


def bom_table(
    plan: RodPlan,
    workshop: Workshop,
    pieces: Sequence[Piece],
    splices: Sequence[Splice],
    bars: Sequence[Bar],
    ties: Ties,
) -> Table:
    """What to buy: one row, as all rods are of one material and diameter."""
    material = plan.weave.material
    per_mm = kilograms_per_mm(plan.diameter, material.density)
    cut = sum(piece.cut_length for piece in pieces)
    longest = float(ties.length.max(initial=0.0))
    columns = (
        "material,diameter,stock_count,ties,mass,stock_length,cut_length,stock_mass,tie_size,sleeves,sleeve_length,"
        "labels,density,kerf"
    )
    is_sleeve = workshop.splice == SLEEVE
    row = (
        material.name,
        mm(plan.diameter),
        len(bars),
        int(ties.count.sum()),
        number(cut * per_mm, 4),
        mm(workshop.stock),
        mm(cut),
        number(len(bars) * workshop.stock * per_mm, 4),
        mm(size_of_tie(longest)) if longest else "",
        len(splices) if is_sleeve else 0,
        mm(workshop.sleeve_length(plan.diameter)) if is_sleeve else "",
        LABELS_PER_PIECE * len(pieces),
        number(material.density, 1),
        mm(workshop.kerf),
    )
    return Table("bom", columns.split(","), [row])
