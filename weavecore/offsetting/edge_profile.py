"""Where along an edge a level lies."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.offsetting.contours import Crossings
from weavecore.offsetting.sheet import Sheet
from weavecore.tolerances import LEVEL_FROM_VERTEX


def place_crossings(sheet: Sheet, crossings: Crossings, band: Ints, *, spacing: float) -> Floats:
    """(N,) where each crossing lies on its halfedge: 0 at its deep end, 1 at its shallow end."""
    low, high = sheet.distance[crossings.shallow], sheet.distance[crossings.deep]
    # A node that was levelled lies in another band than its distance says.
    low = np.minimum(low, spacing * (band[crossings.shallow] + 1))
    high = np.maximum(high, spacing * band[crossings.deep])
    rise = high - low
    part = np.divide(spacing * crossings.level - low, rise, out=np.full(len(rise), 0.5), where=rise > 0)
    return 1.0 - _kept_apart(part, crossings, band)


def _kept_apart(part: Floats, crossings: Crossings, band: Ints) -> Floats:
    """Positions held off the ends of the edge and, in their order, off each other."""
    below = crossings.level - band[crossings.shallow]
    above = band[crossings.deep] + 1 - crossings.level
    least = np.minimum(LEVEL_FROM_VERTEX, 0.5 / (below + above))
    kept: Floats = np.clip(part, least * below, 1.0 - least * above)
    return kept
