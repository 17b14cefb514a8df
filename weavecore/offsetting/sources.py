"""Origins: the borders and curves from which distances start.

By default these are all borders and cuts.  Chosen borders make the others *free borders*, at which polylines end;
chosen curves are embedded in the mesh one after the other (`geometry.curve_embedding`).  Work: that of the embedding.
"""

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

_MAX_LENGTHS_LISTED = 12  # of borders, in an error


def start_at(
    surface: SurfaceMesh,
    *,
    borders: Optional[Iterable[int]] = None,
    curves: Optional[Iterable[ArrayLike]] = None,
) -> SurfaceMesh:
    """Choose where distances start, instead of at all borders and cuts.

    Parameters
    ----------
    surface : SurfaceMesh
    borders : iterable of int, optional
        Numbers in `SurfaceMesh.borders`.  The other borders become free borders, at which polylines end.
    curves : iterable of (n, 3) array_like, optional
        Points along curves on the surface, in its unit; a closed one comes back to its first point.  Each becomes a
        path of edges: faces that it crosses are split.  One that runs along a border becomes that stretch of it.

    Returns
    -------
    SurfaceMesh
        With ``starts`` and without ``cuts``; the surface itself if nothing is chosen.  The origins are the borders in
        their order, each once, then the curves.  Old vertices keep their numbers.

    Raises
    ------
    BadIndex
        If there is no such border, or a number is not an integer.
    BadCurve
        If a curve lies off the surface, is too short, crosses or touches itself, another origin or, between its
        ends, a border, or runs along a border in part.
    NonFinite, TooMuchWork
    Unsupported
        If nothing is left to start from.
    """
    if borders is None and curves is None:
        return surface
    chosen = _whole_numbers(() if borders is None else borders)
    curves_chosen = list(() if curves is None else curves)
    _check_borders(surface, chosen)
    if not chosen and not curves_chosen:
        raise Unsupported("No border or curve chosen to start from", remedy="Choose at least one, or omit the choice.")
    vertices, faces, embedded = _embed_all(surface, curves_chosen)
    started = replace(surface, vertices=vertices, faces=faces, cuts=(), starts=None)
    loops = [started.borders[number] for number in chosen]
    _check_apart(chosen, loops, embedded)
    closed = [True] * len(loops) + [one.is_closed for one in embedded]
    return replace(started, starts=Origins((*loops, *(one.path for one in embedded)), np.array(closed, bool)))


def _whole_numbers(borders: Iterable[int]) -> list[int]:
    """The numbers of borders, each once; flags (one bool for each border) are refused."""
    numbers = list(borders) if np.iterable(borders) else [None]
    if not all(isinstance(number, (int, np.integer)) and not isinstance(number, bool) for number in numbers):
        raise BadIndex(
            "Borders must be a list of integers",
            remedy="Give their numbers in the surface's borders, also a single one in a list: [0].",
        )
    return list(dict.fromkeys(map(int, numbers)))


def _embed_all(surface: SurfaceMesh, curves: Sequence[ArrayLike]) -> tuple[Floats, Ints, list[Embedding]]:
    """The mesh with all curves in it, one after the other."""
    vertices, faces = surface.vertices, surface.faces
    embedded: list[Embedding] = []
    for number, curve in enumerate(curves):
        done = Origins(tuple(one.path for one in embedded), np.array([one.is_closed for one in embedded], bool))
        fixed = np.stack(done.edges(), axis=1)
        try:
            points = _as_points(curve)
            embedded.append(embed_curve(vertices, faces, points, tolerance=surface.tolerance, fixed=fixed))
        except WeaveError as error:
            raise type(error)(error.what, remedy=error.remedy, ids=[number], kind="curve") from error
        vertices, faces = embedded[-1].vertices, embedded[-1].faces
    return vertices, faces, embedded


def _as_points(curve: ArrayLike) -> Floats:
    try:
        return np.asarray(curve, np.float64)
    except (TypeError, ValueError):
        raise BadCurve("A curve must be rows of numbers", remedy="Give its points as rows of x, y and z.") from None


def _check_apart(chosen: Sequence[int], loops: Sequence[Ints], embedded: Sequence[Embedding]) -> None:
    """Raise `BadCurve` where a curve shares a vertex with a chosen border."""
    for number, loop in zip(chosen, loops):
        for i, one in enumerate(embedded):
            if np.isin(one.path, loop).any():
                raise BadCurve(
                    f"A curve touches border {number}, from which distances also start",
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
            remedy="Start from a curve on it, or omit the borders to have it cut in two.",
            ids=unknown,
            kind="border",
        )
    lengths = [f"{number}: {_length(surface.vertices[loop]):.5g}" for number, loop in enumerate(surface.borders)]
    shown = ", ".join(lengths[:_MAX_LENGTHS_LISTED]) + (", …" if n > _MAX_LENGTHS_LISTED else "")
    there = "1 border, number 0" if n == 1 else f"{n} borders, numbers 0 to {n - 1}"
    raise BadIndex(
        f"The surface has {there}",
        remedy=f"Choose among them, by their lengths: {shown}.",
        ids=unknown,
        kind="there is no border",
    )


def _length(loop: Floats) -> float:
    return float(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).sum())
