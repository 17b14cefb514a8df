"""Faces as mesh files hold them: the polygons of a surface or of a lattice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import Unsupported
from weavecore.exporting.product import Product
from weavecore.geometry.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class Polygons:
    """Ragged faces on points.

    Parameters
    ----------
    points : (N, 3) float64
    offsets : (F+1,) int64
    corners : (…,) int64
    """

    points: Floats
    offsets: Ints
    corners: Ints

    @property
    def n_faces(self) -> int:
        return len(self.offsets) - 1

    def rows(self, separator: str, *, first: int = 0) -> list[str]:
        """The corners of each face as text, counted from ``first``."""
        texts = list(map(str, (self.corners + first).tolist()))
        ends = self.offsets.tolist()
        return [separator.join(texts[start:end]) for start, end in zip(ends, ends[1:])]


def polygons_of(product: Product, ending: str) -> Polygons:
    """The faces to write: the lattice's where there is one, otherwise the surface's.

    Raises
    ------
    Unsupported
        For latitudes alone, which are curves.
    """
    if product.lattice is not None:
        return Polygons(product.lattice.nodes, product.lattice.face_offsets, product.lattice.face_nodes)
    if product.latitudes is not None:
        raise Unsupported(
            f"A {ending} file holds faces, and latitudes are curves",
            remedy="Write them as .3dm or .json, or link them to a lattice first.",
        )
    faces = product.surface.faces
    return Polygons(product.surface.vertices, np.arange(0, 3 * len(faces) + 1, 3), faces.ravel())


def coordinate_lines(points: Floats, prefix: str = "") -> list[str]:
    """One line a point; each number reads back to the same bits."""
    return [f"{prefix}{x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
