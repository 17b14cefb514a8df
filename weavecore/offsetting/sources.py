"""Where distances start: at chosen borders, or at curves on the surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Optional

import numpy as np
from numpy.typing import ArrayLike

from weavecore.errors import BadCurve, BadIndex, Unsupported, WeaveError
from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.curve_embedding.embed import Embedding, embed_curve
from weavecore.model import SurfaceMesh
from weavecore.model.surface import Origins

_MOST_LENGTHS_TOLD = 12


def start_at(
    surface: SurfaceMesh,
    *,
    borders: Optional[Iterable[int]] = None,
    curves: Optional[Iterable[ArrayLike]] = None,
) -> SurfaceMesh:
    """Choose where distances start, other than at all borders and cuts.

    Parameters
    ----------
    surface : SurfaceMesh
    borders : iterable of int, optional
        Places in `SurfaceMesh.borders`.  The other borders become selvedges, which cut the polylines.
    curves : iterable of (n, 3) array_like, optional
        Points along curves on the surface, in its unit; a closed one comes back to its first point.  Each becomes a
        path along edges: faces that it crosses are split.  One that runs along a border becomes that stretch of it.

    Returns
    -------
    SurfaceMesh
        With ``starts`` and without ``cuts``; the surface itself where nothing is chosen.  The origins are the
        borders in their order, each once, then the curves.  Old vertices keep their numbers.

    Raises
    ------
    BadIndex
        Where there is no such border, or it is no whole number.
    BadCurve
        Where a curve lies off the surface, is too short, crosses or touches itself, another origin or, between its
        ends, a border, or runs along a border in part.
    NonFinite, TooMuchWork
    Unsupported
        Where nothing is left to start from.
    """
    if borders is None and curves is None:
        return surface
    chosen = _whole_numbers(() if borders is None else borders)
    given = list(() if curves is None else curves)
    _check_borders(surface, chosen)
    if not chosen and not given:
        raise Unsupported(
            "Nothing is chosen to start from", remedy="Choose a border or a curve at least, or leave the choice away."
        )
    vertices, faces, drawn = _embed_all(surface, given)
    started = replace(surface, vertices=vertices, faces=faces, cuts=(), starts=None)
    loops = [started.borders[number] for number in chosen]
    _check_apart(chosen, loops, drawn)
    closed = [True] * len(loops) + [one.is_closed for one in drawn]
    return replace(started, starts=Origins((*loops, *(one.path for one in drawn)), np.array(closed, bool)))


def _whole_numbers(borders: Iterable[int]) -> list[int]:
    """The numbers of borders, each once; of flags for each border none would be meant as a number."""
    numbers = list(borders) if np.iterable(borders) else [None]
    if not all(isinstance(number, (int, np.integer)) and not isinstance(number, bool) for number in numbers):
        raise BadIndex(
            "The borders are no list of whole numbers",
            remedy="Give their places in the surface's borders, in a list for a single one too: [0].",
        )
    return list(dict.fromkeys(map(int, numbers)))


def _embed_all(surface: SurfaceMesh, curves: Sequence[ArrayLike]) -> tuple[Floats, Ints, list[Embedding]]:
    """The mesh with all curves in it, one after the other."""
    vertices, faces = surface.vertices, surface.faces
    drawn: list[Embedding] = []
    for number, curve in enumerate(curves):
        done = Origins(tuple(one.path for one in drawn), np.array([one.is_closed for one in drawn], bool))
        fixed = np.stack(done.edges(), axis=1)
        try:
            points = _as_points(curve)
            drawn.append(embed_curve(vertices, faces, points, tolerance=surface.tolerance, fixed=fixed))
        except WeaveError as error:
            raise type(error)(error.what, remedy=error.remedy, ids=[number], kind="curve") from error
        vertices, faces = drawn[-1].vertices, drawn[-1].faces
    return vertices, faces, drawn


def _as_points(curve: ArrayLike) -> Floats:
    try:
        return np.asarray(curve, np.float64)
    except (TypeError, ValueError):
        raise BadCurve("A curve that is no rows of numbers", remedy="Give its points as rows of x, y and z.") from None


def _check_apart(chosen: Sequence[int], loops: Sequence[Ints], drawn: Sequence[Embedding]) -> None:
    """Raise `BadCurve` where a curve shares a vertex with a chosen border."""
    for number, loop in zip(chosen, loops):
        for i, one in enumerate(drawn):
            if np.isin(one.path, loop).any():
                raise BadCurve(
                    f"A curve touches border {number}, at which distances start too",
                    remedy="Keep it clear of that border, or choose only one of both.",
                    ids=[i],
                    kind="curve",
                )


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
