"""Vertices on a Brep's edges where creases inside a face meet them, so that a crease runs up to its ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.reading.rhino_surfaces.borders import travelled_shares
from weavecore.reading.rhino_surfaces.creases import folds
from weavecore.reading.rhino_surfaces.grids import FaceGrid
from weavecore.reading.rhino_surfaces.shape import NO_EDGE, BrepShape, FaceShape, TrimCurve

_AT_END = 1e-6
_TOO_NEAR = 0.4


def divide_at_creases(shape: BrepShape, grids: Sequence[FaceGrid], lengths: Sequence[Floats]) -> list[Floats]:
    """The edges' arc lengths (see `divide_path`) with the places added at which creases end.

    A vertex that would lie too near to such a place makes room for it; the edge's ends stay.
    """
    divided = list(lengths)
    for face, grid in zip(shape.faces, grids):
        for way in (0, 1):
            for at in folds(face.surface, grid, way):
                for trim in (t for loop in face.loops for t in loop if t.edge != NO_EDGE):
                    shares = _crossings(face, trim, way, at)
                    if len(shares):
                        divided[trim.edge] = _with_stops(divided[trim.edge], shares)
    return divided


def _crossings(face: FaceShape, trim: TrimCurve, way: int, at: float) -> Floats:
    """Shares of the edge's length at which a trim crosses a line of constant parameter."""
    off = trim.uv[:, way] - at
    k = np.flatnonzero(np.sign(off[1:]) * np.sign(off[:-1]) < 0)
    travelled = travelled_shares(face, trim)
    t = off[k] / (off[k] - off[k + 1])
    shares = np.concatenate([travelled[k] * (1 - t) + travelled[k + 1] * t, travelled[np.flatnonzero(off == 0)]])
    return 1.0 - shares if trim.against_edge else shares


def _with_stops(along: Floats, shares: Floats) -> Floats:
    total = float(along[-1])
    shares = shares[(shares > _AT_END) & (shares < 1 - _AT_END)]
    if total == 0 or len(shares) == 0:
        return along
    stops = np.unique(shares * total)
    stops = stops[np.concatenate([[True], np.diff(stops) > _AT_END * total])]
    apart = np.abs(along[:, None] - stops).min(1)
    room = _TOO_NEAR * np.minimum(np.diff(along, prepend=-np.inf), np.diff(along, append=np.inf))
    kept = apart > room
    kept[[0, -1]] = True
    return np.unique(np.concatenate([along[kept], stops]))
