"""Where distances start: at chosen borders, not at all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Optional

import numpy as np

from weavecore.errors import BadIndex, Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.model import SurfaceMesh
from weavecore.model.origins import Origins

_MOST_LENGTHS_TOLD = 12


def start_at(surface: SurfaceMesh, *, borders: Optional[Sequence[int]] = None) -> SurfaceMesh:
    """Choose where distances start, other than at all borders and cuts.

    Parameters
    ----------
    surface : SurfaceMesh
    borders : sequence of int, optional
        Places in `SurfaceMesh.borders`.  The other borders become selvedges, which cut the polylines.

    Returns
    -------
    SurfaceMesh
        With ``starts`` and without ``cuts``; the surface itself where nothing is chosen.  The origins are in the
        order of ``borders``; one that is named twice counts once.

    Raises
    ------
    BadIndex
        Where there is no such border.
    Unsupported
        Where nothing is left to start from.
    """
    if borders is None:
        return surface
    chosen = list(dict.fromkeys(int(number) for number in borders))
    _check_borders(surface, chosen)
    if not chosen:
        raise Unsupported("No border is chosen to start from", remedy="Choose one at least, or leave them all.")
    paths = tuple(surface.borders[number] for number in chosen)
    return replace(surface, cuts=(), starts=Origins(paths, np.ones(len(paths), bool)))


def _check_borders(surface: SurfaceMesh, chosen: Sequence[int]) -> None:
    """Raise `BadIndex` where a border is named that is not there."""
    n = len(surface.borders)
    unknown = [number for number in chosen if not 0 <= number < n]
    if not unknown:
        return
    if n == 0:
        raise BadIndex(
            "The surface is closed: it has no border to start from",
            remedy="Start from a curve on it, or leave the borders away to have it cut in two.",
            ids=unknown,
            kind="border",
        )
    lengths = [f"{number}: {_length(surface.vertices[loop]):.5g}" for number, loop in enumerate(surface.borders)]
    shown = ", ".join(lengths[:_MOST_LENGTHS_TOLD]) + (", …" if n > _MOST_LENGTHS_TOLD else "")
    there = "1 border, number 0" if n == 1 else f"{n} borders, numbers 0 to {n - 1}"
    raise BadIndex(
        f"The surface has {there}",
        remedy=f"Choose among them, by their lengths: {shown}.",
        ids=unknown,
        kind="there is no border",
    )


def _length(loop: Floats) -> float:
    return float(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).sum())
