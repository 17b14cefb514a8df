"""`Polygons`: the faces that mesh files hold, of a surface or a lattice, or of the rods of a weave as pipes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import Unsupported
from weavecore.exporting.product import Product
from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.pipes import pipe_mesh
from weavecore.geometry.splines import CurveSamples
from weavecore.model import Weave

_DIAMETERS_PER_SECTION = 1.0
"""Distance of the cross-sections of a pipe along its axis, in diameters: segments about as long as they are wide."""


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces of any number of corners.

    Parameters
    ----------
    points : (N, 3) float64
    offsets : (F+1,) int64
        Face ``f`` has the corners ``corners[offsets[f]:offsets[f + 1]]``.
    corners : (C,) int64
        Indices of points, counter-clockwise seen from outside.
    """

    points: Floats
    offsets: Ints
    corners: Ints

    @property
    def n_faces(self) -> int:
        """Count of faces."""
        return len(self.offsets) - 1

    def rows(self, separator: str, *, first: int = 0) -> list[str]:
        """The corners of each face as text, counted from ``first``."""
        texts = list(map(str, (self.corners + first).tolist()))
        ends = self.offsets.tolist()
        return [separator.join(texts[start:end]) for start, end in zip(ends, ends[1:])]


def polygons_to_write(product: Product, ending: str) -> Polygons:
    """The faces of a mesh file: the rods of a weave as pipes, else those of `faces_of`.

    Parameters
    ----------
    product : Product
    ending : str
        Of the file, named in the error.

    Raises
    ------
    Unsupported
        For latitudes, which are curves, and for an equilibrium: the pipes would show the rods as drawn.
    """
    if product.equilibrium is not None:
        raise Unsupported(f"A {ending} file cannot contain rods at rest", remedy="Write them as .3dm or .json.")
    return faces_of(product, ending) if product.weave is None else pipes_of(product.weave)


def faces_of(product: Product, ending: str) -> Polygons:
    """The faces of the lattice where there is one, else those of the surface.

    Parameters
    ----------
    product : Product
    ending : str
        Of the file, named in the error.

    Raises
    ------
    Unsupported
        For latitudes, which are curves.
    """
    if product.lattice is not None:
        return Polygons(product.lattice.nodes, product.lattice.face_offsets, product.lattice.face_nodes)
    if product.latitudes is not None:
        raise Unsupported(
            f"A {ending} file holds faces, but latitudes are curves",
            remedy="Write them as .3dm or .json, or link them into a lattice first.",
        )
    faces = product.surface.faces
    return Polygons(product.surface.vertices, np.arange(0, 3 * len(faces) + 1, 3), faces.ravel())


def pipes_of(weave: Weave) -> Polygons:
    """The rods of a weave as closed pipes of 12 sides.

    Parameters
    ----------
    weave : Weave
    """
    samples = weave.axes.samples(_DIAMETERS_PER_SECTION * float(weave.diameters.min(initial=np.inf)))
    normals = _normals_along(weave, samples)
    return Polygons(*pipe_mesh(samples, weave.strands.closed, normals, weave.diameters / 2.0))


def _normals_along(weave: Weave, samples: CurveSamples) -> Floats:
    """(n, 3) normals of the nodes, interpolated linearly to the samples of the axes."""
    given = np.flatnonzero(samples.is_given)
    last = samples.offsets[1:] - 1
    closed = weave.strands.closed
    # The last sample of a closed rod is its first visit again.
    ends = last[closed]
    firsts = weave.strands.offsets[:-1][closed]
    place = np.concatenate([given, ends])
    normal = np.concatenate([weave.normals[weave.strands.nodes], weave.normals[weave.strands.nodes[firsts]]])
    order = np.argsort(place, kind="stable")
    at = np.arange(samples.offsets[-1])
    columns = [np.interp(at, place[order], normal[order, k]) for k in range(3)]
    normals: Floats = np.stack(columns, axis=1)
    return normals
