"""`Latitudes`: the latitudinal family, and the bands between its polylines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, frozen
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh

_ONE_STEP = 1e-9
"""Steps that differ by less than this part of the spacing, by rounding, are equal."""


@dataclass(frozen=True, eq=False)
class Bands:
    """The regions between the polylines: the parts of the surface cut along all of them.

    A *side* is one polyline seen from one band that it bounds.  The sides of band ``b`` are
    ``offsets[b]:offsets[b + 1]`` of the arrays below, parents before children.  A band
    without children is a *pocket*.

    Parameters
    ----------
    offsets : (B+1,) int64
    polyline : (S,) int64
        The polyline of each side.
    is_parent : (S,) bool
        Whether the band lies beyond that polyline, at greater distances.
    is_left : (S,) bool
        Whether the band lies on the left of the polyline, seen from outside.  True of
        parents and False of children, but for the second side of a cut.
    euler : (B,) int64
        Euler characteristic: 1 for a disk, 0 for an annulus, -1 for a split or merge.
    depth : (B,) float64
        Greatest distance from the origins in the band.
    """

    offsets: Ints
    polyline: Ints
    is_parent: Bools
    is_left: Bools
    euler: Ints
    depth: Floats

    def __post_init__(self) -> None:
        n_bands, n_sides = len(self.offsets) - 1, len(self.polyline)
        for name, dtype, shape in (
            ("offsets", np.int64, (n_bands + 1,)),
            ("polyline", np.int64, (n_sides,)),
            ("is_parent", np.bool_, (n_sides,)),
            ("is_left", np.bool_, (n_sides,)),
            ("euler", np.int64, (n_bands,)),
            ("depth", np.float64, (n_bands,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))

    def __len__(self) -> int:
        return len(self.offsets) - 1


@dataclass(frozen=True, eq=False, repr=False)
class Latitudes:
    """Polylines parallel to the borders, and the graph of parents and children (Yan et al. 2016, §4).

    The relation is a graph, not a tree: fronts that merge give a child of two parents
    (§4.4), a front that splits gives two children (§4.3), a handle makes a cycle.

    Parameters
    ----------
    surface : SurfaceMesh
        The mesh on which they lie.
    polylines : Polylines
        Generation 0 first: the origins of the surface, point for point; then by generation.  Each
        runs with its unexplored side on its left.
    generation : (P,) int64
    distance : (P,) float64
        Distance from the origins along the surface.
    parents : (E, 2) int64
        Pairs (parent, child), sorted; a child is one generation above its parent.
    bands : Bands
    spacing : float
        Distance from one generation to the next; where these differ, the widest.
    vertex_distance : (V,) float64
        Distance from the origins at every vertex of the surface.
    """

    surface: SurfaceMesh
    polylines: Polylines
    generation: Ints
    distance: Floats
    parents: Ints
    bands: Bands
    spacing: float
    vertex_distance: Floats

    def __repr__(self) -> str:
        return f"<Latitudes: {len(self)} curves in {self.n_generations} generations, spacing {self.spacing:g}>"

    def __post_init__(self) -> None:
        n = len(self.polylines)
        for name, dtype, shape in (
            ("generation", np.int64, (n,)),
            ("distance", np.float64, (n,)),
            ("parents", np.int64, (-1, 2)),
            ("vertex_distance", np.float64, (self.surface.n_vertices,)),
        ):
            object.__setattr__(self, name, frozen(getattr(self, name), dtype, shape))

    def __len__(self) -> int:
        return len(self.polylines)

    @cached_property
    def steps(self) -> Floats:
        """Distance from each generation to the next; a single number where they are equal."""
        of_generation = np.zeros(self.n_generations)
        of_generation[self.generation] = self.distance
        steps: Floats = np.diff(of_generation)
        is_one = len(steps) == 0 or float(np.ptp(steps)) <= _ONE_STEP * self.spacing
        return np.array([self.spacing]) if is_one else steps

    @property
    def n_generations(self) -> int:
        """Count of generations, the origins included."""
        return int(self.generation.max(initial=-1)) + 1
