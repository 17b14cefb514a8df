"""The colours of the families, the same in files and pictures.

Blue to green for the latitudes, by generation, so that neighbouring rings can be
distinguished and the distance from the border be read; amber for the longitudes, its complement, and
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
"""Scale of the latitudes, from the first generation to the last: red, green and blue in 0…255, as all colours here."""

_UTILISATIONS = np.array([(58, 110, 165), (120, 170, 120), (232, 190, 70), (222, 120, 50), (186, 30, 50)], float)
"""Scale of the utilisation, from 0 to 1."""

LONGITUDES = (201, 122, 43)
POCKETS = (196, 38, 74)
"""Edges of these families."""

WOVEN = {"L": (40, 72, 146), "A": (201, 122, 43), "B": (226, 176, 88), "P": POCKETS}
"""The rods of a weave by the letter of their names."""

NODES = (60, 60, 66)
SURFACE = (226, 220, 208)
"""Points of nodes, and the mesh beneath all."""

FREE_BORDERS = (128, 122, 116)
"""Borders from which no distance starts."""


def latitude_colours(generation: ArrayLike, n_generations: int) -> NDArray[Any]:
    """Colours of generations: dark at the borders, light farthest from them.

    Parameters
    ----------
    generation : (n,) int64 or float64
        From 0 to ``n_generations - 1``.
    n_generations : int

    Returns
    -------
    (n, 3) int64
        In 0…255.
    """
    position = np.asarray(generation, float) / max(n_generations - 1, 1) * (len(_LATITUDES) - 1)
    low = np.clip(position.astype(int), 0, len(_LATITUDES) - 2)
    part = (position - low)[..., None]
    colours: NDArray[Any] = np.rint(_LATITUDES[low] * (1 - part) + _LATITUDES[low + 1] * part).astype(int)
    return colours


def utilisation_colours(utilisation: ArrayLike) -> NDArray[Any]:
    """Colours of the utilisation: blue for a straight rod over yellow at half to red at 1, and red beyond.

    Parameters
    ----------
    utilisation : (n,) float64

    Returns
    -------
    (n, 3) int64
        In 0…255.
    """
    position = np.clip(np.asarray(utilisation, float), 0.0, 1.0) * (len(_UTILISATIONS) - 1)
    low = np.clip(position.astype(int), 0, len(_UTILISATIONS) - 2)
    part = (position - low)[..., None]
    colours: NDArray[Any] = np.rint(_UTILISATIONS[low] * (1 - part) + _UTILISATIONS[low + 1] * part).astype(int)
    return colours
