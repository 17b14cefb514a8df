"""The colours of the families, one home: files and pictures show the same ones.

Blue to green for the latitudes, by generation, so that neighbouring rings can be told
apart and the distance from the border be read; amber for the longitudes, its complement, and
crimson for pockets.  Blue and amber stay apart for eyes that do not see red and green.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

_LATITUDES = np.array(
    [(38, 34, 98), (40, 72, 146), (26, 113, 173), (16, 150, 176), (52, 183, 158), (126, 209, 136), (196, 226, 132)],
    float,
)
LONGITUDES = (201, 122, 43)
POCKETS = (196, 38, 74)
WOVEN = {"L": (40, 72, 146), "A": (201, 122, 43), "B": (226, 176, 88), "P": POCKETS}
"""The rods of a weave by the letter of their names."""

NODES = (60, 60, 66)
SURFACE = (226, 220, 208)
FREE_BORDERS = (128, 122, 116)
"""Borders from which no distance starts."""


def latitude_colours(generation: ArrayLike, n_generations: int) -> NDArray[Any]:
    """Colours (n, 3) in 0…255 of generations 0 to ``n_generations - 1``: dark at the borders, light in the depth."""
    position = np.asarray(generation, float) / max(n_generations - 1, 1) * (len(_LATITUDES) - 1)
    low = np.clip(position.astype(int), 0, len(_LATITUDES) - 2)
    part = (position - low)[..., None]
    colours: NDArray[Any] = np.rint(_LATITUDES[low] * (1 - part) + _LATITUDES[low + 1] * part).astype(int)
    return colours


_UTILISATIONS = np.array([(58, 110, 165), (120, 170, 120), (232, 190, 70), (222, 120, 50), (186, 30, 50)], float)


def utilisation_colours(utilisation: ArrayLike) -> NDArray[Any]:
    """Colours (n, 3) in 0…255: blue for a straight rod over yellow at half to red at 1, and red beyond."""
    position = np.clip(np.asarray(utilisation, float), 0.0, 1.0) * (len(_UTILISATIONS) - 1)
    low = np.clip(position.astype(int), 0, len(_UTILISATIONS) - 2)
    part = (position - low)[..., None]
    colours: NDArray[Any] = np.rint(_UTILISATIONS[low] * (1 - part) + _UTILISATIONS[low + 1] * part).astype(int)
    return colours
