"""`Product`: what a writer gets, whichever stage it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, next_in_loop, rows_of
from weavecore.geometry.pipes import pipe_mesh
from weavecore.geometry.splines import CurveSamples
from weavecore.model import Equilibrium, Latitudes, Lattice, Strands, SurfaceMesh, Weave

StageValue = Union[SurfaceMesh, Latitudes, Lattice, Weave, Equilibrium]


@dataclass(frozen=True, eq=False)
class Product:
    """A stage's result with all that it was made from.

    Parameters
    ----------
    surface : SurfaceMesh
    latitudes : Latitudes, optional
    lattice : Lattice, optional
    strands : Strands, optional
        The rods of the lattice.
    weave : Weave, optional
    equilibrium : Equilibrium, optional
    parameters : mapping
        The options that led to it: plain numbers, texts and lists of them.
    """

    surface: SurfaceMesh
    latitudes: Optional[Latitudes] = None
    lattice: Optional[Lattice] = None
    strands: Optional[Strands] = None
    weave: Optional[Weave] = None
    equilibrium: Optional[Equilibrium] = None
    parameters: Mapping[str, object] = field(default_factory=dict)


def product_of(
    value: StageValue, *, strands: Strands | None = None, parameters: Mapping[str, object] | None = None
) -> Product:
    """Gather a stage's result and what it was made from.

    The options that the values themselves know are added to ``parameters``.
    """
    known: dict[str, object] = dict(parameters or {})
    if isinstance(value, SurfaceMesh):
        return Product(value, parameters=known)
    if isinstance(value, Equilibrium):
        known.update(supports=value.supports, loads=value.loads)
        return replace(product_of(value.weave, parameters=known), equilibrium=value)
    if isinstance(value, Weave):
        known.update(rod_diameter=value.rod_diameter, material=value.material.name, over_under=value.over_under)
        return replace(product_of(value.lattice, strands=value.strands, parameters=known), weave=value)
    latitudes = value if isinstance(value, Latitudes) else value.latitudes
    known["spacing"] = latitudes.spacing
    if len(latitudes.steps) > 1:
        known["spacings"] = latitudes.steps.tolist()
    if isinstance(value, Latitudes):
        return Product(latitudes.surface, latitudes, parameters=known)
    known["edge_length"], known["pattern"] = value.edge_length, value.pattern
    return Product(latitudes.surface, latitudes, value, strands, parameters=known)


def strand_lengths(strands: Strands, lattice: Lattice) -> Floats:
    """(S,) length of each strand from node to node, the closing edge of closed ones included."""
    after = next_in_loop(strands.offsets)
    steps = np.linalg.norm(lattice.nodes[strands.nodes[after]] - lattice.nodes[strands.nodes], axis=1)
    is_last_of_open = ~strands.closed & (np.diff(strands.offsets) > 0)
    steps[strands.offsets[1:][is_last_of_open] - 1] = 0.0
    lengths: NDArray[Any] = np.bincount(rows_of(strands.offsets), steps, minlength=len(strands))
    return lengths


# ----------------------------------------------------------------------
# Faces as mesh files hold them: the polygons of a surface or of a lattice.


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


# ----------------------------------------------------------------------
# The rods of a weave as solid pipes, for the mesh files.

_STEPS_PER_DIAMETER = 1.0


def faces_to_write(product: Product, ending: str) -> Polygons:
    """The rods of a weave as pipes; otherwise the faces of `polygons_of`."""
    return polygons_of(product, ending) if product.weave is None else rod_polygons(product.weave)


def rod_polygons(weave: Weave) -> Polygons:
    """All rods as solid pipes."""
    samples = weave.axes.samples(_STEPS_PER_DIAMETER * weave.rod_diameter)
    normals = _normals_along(weave, samples)
    return Polygons(*pipe_mesh(samples, weave.strands.closed, normals, weave.rod_diameter / 2.0))


def _normals_along(weave: Weave, samples: CurveSamples) -> Floats:
    """Normals of the nodes (N, 3), carried along the rods by linear interpolation."""
    given = np.flatnonzero(samples.is_given)
    last = samples.offsets[1:] - 1
    closed = weave.strands.closed
    # The sample at the end of a closed rod is its first visit once more.
    ends = last[closed]
    firsts = weave.strands.offsets[:-1][closed]
    place = np.concatenate([given, ends])
    normal = np.concatenate([weave.normals[weave.strands.nodes], weave.normals[weave.strands.nodes[firsts]]])
    order = np.argsort(place, kind="stable")
    at = np.arange(samples.offsets[-1])
    columns = [np.interp(at, place[order], normal[order, k]) for k in range(3)]
    normals: Floats = np.stack(columns, axis=1)
    return normals
