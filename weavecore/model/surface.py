"""`SurfaceMesh`: the triangle mesh that is woven; `Origins`: the paths on it from which distances start.

Halfedge h = 3 · face + k runs from corner k of its face to corner k + 1; ``twins[h]`` is its twin in the other
direction.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Optional

import numpy as np

from weavecore.errors import BadIndex, Degenerate, NonFinite
from weavecore.geometry.arrays import Bools, Floats, Ints, blocks, edge_lengths, face_vectors, frozen
from weavecore.geometry.closest import FaceFinder
from weavecore.geometry.halfedges import (
    NO_TWIN,
    border_loops,
    check_manifold_vertices,
    components,
    find_twins,
    halfedge_ends,
)
from weavecore.geometry.nearest_normals import NearestNormals
from weavecore.geometry.refine import Refinement
from weavecore.model.notes import Note


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceMesh:
    """An oriented manifold triangle mesh, checked once, when it is made.

    Parameters
    ----------
    vertices : (V, 3) float64
        Positions in the model's unit; each is used by a face.
    faces : (F, 3) int64
        Corners counter-clockwise seen from outside.
    unit : str, optional
        Rhino's name of the unit: ``"Millimeters"``, ``"Meters"``… or ``"None"``.
    tolerance : float, optional
        The model's absolute tolerance in its unit; 0 where it is not known.
    cuts : sequence of int arrays, optional
        Closed vertex loops along edges, by which a closed surface is cut in two
        (Yan et al. 2016, §4.1).  The mesh stays closed; distances start at the cuts
        as they do at the borders, on both sides.
    name : str, optional
        Name of the object or file.
    notes : sequence of Note, optional
        What was changed, left out, guessed or doubted since it was read.
    starts : Origins, optional
        Where distances start, if not at all borders and cuts.  The other borders cut the polylines, which then
        are open.

    Attributes
    ----------
    twins : (3F,) int64
        Twin of halfedge ``3 * face + k``, -1 on the border.

    Raises
    ------
    NonFinite, BadIndex, Degenerate, NonManifold
    """

    vertices: Floats
    faces: Ints
    unit: str = "None"
    tolerance: float = 0.0
    cuts: tuple[Ints, ...] = ()
    name: str = ""
    notes: tuple[Note, ...] = ()
    starts: Optional[Origins] = None

    def __repr__(self) -> str:
        return f"<SurfaceMesh: {self.n_faces} faces, {len(self.borders)} borders, in {self.unit}>"

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, np.float64, (-1, 3)))
        object.__setattr__(self, "faces", frozen(self.faces, np.int64, (-1, 3)))
        object.__setattr__(self, "cuts", tuple(frozen(loop, np.int64, (-1,)) for loop in self.cuts))
        object.__setattr__(self, "notes", tuple(self.notes))
        self._check_arrays()
        self._check_starts()
        twins = find_twins(self.faces, len(self.vertices))
        check_manifold_vertices(self.faces, twins, len(self.vertices))
        twins.flags.writeable = False
        object.__setattr__(self, "_twins", twins)

    def _check_arrays(self) -> None:
        if len(self.faces) == 0:
            raise Degenerate("The mesh has no faces", remedy="Use a surface that has an area.")
        bad = np.flatnonzero(~np.isfinite(self.vertices).all(1))
        if len(bad):
            raise NonFinite(
                "Some coordinates are not finite",
                remedy="Repair or delete these vertices.",
                ids=bad.tolist(),
                kind="vertex",
            )
        bad = np.flatnonzero(((self.faces < 0) | (self.faces >= len(self.vertices))).any(1))
        if len(bad):
            raise BadIndex(
                f"Some faces name vertices beyond the {len(self.vertices)} of the mesh",
                remedy="Repair the mesh: its face list does not fit its vertices.",
                ids=bad.tolist(),
                kind="face",
            )

    def _check_starts(self) -> None:
        if self.starts is None:
            return
        n = np.int64(len(self.vertices))
        (tail, head), (a, b) = halfedge_ends(self.faces), self.starts.edges()
        sides = np.concatenate([tail * n + head, head * n + tail])
        inside = (a >= 0) & (a < n) & (b >= 0) & (b < n)
        bad = ~inside | ~np.isin(a * n + b, sides)
        if bad.any():
            raise BadIndex(
                "Some paths from which distances start do not run along edges",
                remedy="Use vertices each of which has an edge to the next.",
                ids=np.unique(a[bad]).tolist(),
                kind="vertex",
            )

    def refined(self, refinement: Refinement) -> SurfaceMesh:
        """The surface on a finer mesh of it.

        Parameters
        ----------
        refinement : Refinement
            Of this mesh, with its cuts and origins protected.  What was checked of this mesh holds for it too.

        Returns
        -------
        SurfaceMesh
        """
        arrays = {"vertices": refinement.vertices, "faces": refinement.faces, "_twins": refinement.twins}
        for array in arrays.values():
            array.flags.writeable = False
        return _unchecked({**{field.name: getattr(self, field.name) for field in fields(self)}, **arrays})

    def with_notes(self, notes: Iterable[Note]) -> SurfaceMesh:
        """The same mesh with other notes; both share their arrays, and what was derived from them.

        Parameters
        ----------
        notes : iterable of Note

        Returns
        -------
        SurfaceMesh
        """
        return _unchecked({**self.__dict__, "notes": tuple(notes)})

    @property
    def twins(self) -> Ints:
        """(3F,) twin of each halfedge, -1 on the border."""
        twins: Ints = self.__dict__["_twins"]
        return twins

    @property
    def n_vertices(self) -> int:
        """Count of vertices."""
        return len(self.vertices)

    @property
    def n_faces(self) -> int:
        """Count of faces."""
        return len(self.faces)

    @property
    def n_edges(self) -> int:
        """Count of undirected edges."""
        return (3 * self.n_faces + int((self.twins == NO_TWIN).sum())) // 2

    @property
    def euler_characteristic(self) -> int:
        """V - E + F."""
        return self.n_vertices - self.n_edges + self.n_faces

    @cached_property
    def borders(self) -> tuple[Ints, ...]:
        """Vertex loops of the border, surface on the left; by least vertex."""
        return tuple(border_loops(self.faces, self.twins))

    @property
    def is_closed(self) -> bool:
        """Whether the mesh has no border."""
        return len(self.borders) == 0

    @cached_property
    def origins(self) -> Origins:
        """Where distances start: as chosen, or the borders, then the cuts."""
        if self.starts is not None:
            return self.starts
        loops = (*self.borders, *self.cuts)
        return Origins(loops, np.ones(len(loops), bool))

    @cached_property
    def is_origin(self) -> Bools:
        """(3F,) whether a halfedge lies on an origin, in either direction."""
        if self.starts is None and not self.cuts:
            flag: Bools = self.twins == NO_TWIN
        else:
            (tail, head), (a, b) = halfedge_ends(self.faces), self.origins.edges()
            n = self.n_vertices
            flag = np.isin(tail * n + head, np.concatenate([a * n + b, b * n + a]))
        flag.flags.writeable = False
        return flag

    @cached_property
    def is_cut(self) -> Bools:
        """(3F,) whether a halfedge lies on an origin inside the surface: a cut, or a chosen curve."""
        flag: Bools = self.is_origin & (self.twins != NO_TWIN)
        flag.flags.writeable = False
        return flag

    @cached_property
    def is_free_border(self) -> Bools:
        """(3F,) whether a halfedge lies on a border from which no distance starts."""
        flag: Bools = (self.twins == NO_TWIN) & ~self.is_origin
        flag.flags.writeable = False
        return flag

    @cached_property
    def component_of_face(self) -> Ints:
        """(F,) connected component of each face; cuts do not separate them."""
        return components(self.twins)[1]

    @cached_property
    def edge_lengths(self) -> Floats:
        """(3F,) length of every halfedge."""
        return edge_lengths(self.vertices, self.faces)

    @cached_property
    def face_areas(self) -> Floats:
        """(F,) areas of the faces, in square units."""
        areas = np.empty(self.n_faces)
        for k in blocks(self.n_faces):
            areas[k] = np.linalg.norm(face_vectors(self.vertices, self.faces[k]), axis=1) / 2
        return areas

    @cached_property
    def area(self) -> float:
        """Sum of the areas of the faces, in square units."""
        return float(self.face_areas.sum())

    @cached_property
    def face_normals(self) -> Floats:
        """(F, 3) unit normals; zero where a face has no area."""
        unit = np.zeros((self.n_faces, 3))
        for k in blocks(self.n_faces):
            normal = face_vectors(self.vertices, self.faces[k])
            size = np.linalg.norm(normal, axis=1, keepdims=True)
            np.divide(normal, size, out=unit[k], where=size > 0)
        return unit

    @cached_property
    def face_finder(self) -> FaceFinder:
        """Finds the closest faces of points."""
        return FaceFinder(self.vertices, self.faces)

    @cached_property
    def nearest_normals(self) -> NearestNormals:
        """Compares vectors with the normals of the faces closest to points."""
        return NearestNormals(self.vertices, self.faces, self.face_normals, self.face_finder)

    @cached_property
    def size(self) -> float:
        """Length of the diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))


def _unchecked(values: dict[str, Any]) -> SurfaceMesh:
    """A surface of values that are known to be sound."""
    surface = object.__new__(SurfaceMesh)
    surface.__dict__.update(values)
    return surface


@dataclass(frozen=True, eq=False)
class Origins:
    """Paths along the edges of a mesh: generation 0 of the latitudes.

    Parameters
    ----------
    paths : sequence of (n,) int64
        Vertices of each path; the first of a closed one is not repeated.  No vertex lies on two.  A path along
        a border runs with the surface on its left; one inside the surface starts distances on both sides.
    closed : (P,) bool
    """

    paths: tuple[Ints, ...]
    closed: Bools

    def __post_init__(self) -> None:
        object.__setattr__(self, "paths", tuple(frozen(path, np.int64, (-1,)) for path in self.paths))
        object.__setattr__(self, "closed", frozen(self.closed, np.bool_, (len(self.paths),)))

    def __len__(self) -> int:
        return len(self.paths)

    def edges(self) -> tuple[Ints, Ints]:
        """First and second vertex of every edge of the paths, in their order."""
        ends = [(path, np.roll(path, -1)) if c else (path[:-1], path[1:]) for path, c in zip(self.paths, self.closed)]
        nothing = np.zeros(0, np.int64)
        return np.concatenate([nothing, *(a for a, _ in ends)]), np.concatenate([nothing, *(b for _, b in ends)])

    def vertices(self) -> Ints:
        """Vertices of all paths, in their order."""
        return np.concatenate([np.zeros(0, np.int64), *self.paths])
