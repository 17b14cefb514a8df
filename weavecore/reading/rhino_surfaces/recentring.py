"""Shapes far from the origin, brought near to it while they are meshed.

Coordinates of ten million leave nine digits for the shape, and evaluating a NURBS surface there loses some of them.
The way to the origin is a whole multiple of a power of two above the size, so that subtracting it is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.reading.rhino_surfaces.shape import BrepShape

_FAR = 8.0
"""A surface that is further from the origin than so many times its size is brought near."""


def recentred(shapes: Sequence[BrepShape]) -> tuple[list[BrepShape], Floats]:
    """The shapes moved towards the origin, and the vector (3,) that brings them back; zero where they are near."""
    places = np.concatenate([_places(face.surface.points) for shape in shapes for face in shape.faces])
    low, high = places.min(0), places.max(0)
    size = float((high - low).max())
    if not size > 0 or np.abs(low + high).max() / 2 <= _FAR * size:
        return list(shapes), np.zeros(3)
    step = 2.0 ** np.ceil(np.log2(size))
    origin: Floats = np.round((low + high) / 2 / step) * step
    return [_moved(shape, origin) for shape in shapes], origin


def extent_of(shapes: Sequence[BrepShape]) -> float:
    """Diagonal of the box about the control points."""
    places = np.concatenate([_places(face.surface.points) for shape in shapes for face in shape.faces])
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def _places(points: Floats) -> Floats:
    flat = points.reshape(-1, 4)
    places: Floats = flat[:, :3] / flat[:, 3:]
    return places


def _moved(shape: BrepShape, origin: Floats) -> BrepShape:
    return replace(
        shape,
        vertices=shape.vertices - origin,
        edges=tuple(replace(edge, points=_less(edge.points, origin)) for edge in shape.edges),
        faces=tuple(
            replace(face, surface=replace(face.surface, points=_less(face.surface.points, origin)))
            for face in shape.faces
        ),
    )


def _less(points: Floats, origin: Floats) -> Floats:
    """Homogeneous points (..., 4) moved by -origin."""
    moved = points.copy()
    moved[..., :3] -= points[..., 3:] * origin
    return moved
