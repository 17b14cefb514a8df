"""Stage 3: from the latitudes to the lattice (Yan et al. 2016, §5)."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.delaunay import improve_triangles
from weavecore.linking.assembling import assemble
from weavecore.linking.cells import as_quads, edges_of, faces_of_zip
from weavecore.linking.division import count_nodes, points_at
from weavecore.linking.feet import find_feet
from weavecore.linking.patterns import Pattern, pattern_named
from weavecore.linking.pockets import Filling, fill_bands
from weavecore.linking.rings import RingLinker
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice

_BAD_ZIP = 0.6

Progress = Optional[Callable[[float, str], None]]


def link_latitudes(
    latitudes: Latitudes,
    *,
    edge_length: Optional[float] = None,
    pattern: str = "triangular",
    progress: Progress = None,
) -> Lattice:
    """Divide the latitudes and bind each to its neighbours (Yan et al. 2016, §5).

    Parameters
    ----------
    latitudes : Latitudes
    edge_length : float, optional
        Length that the edges along the latitudes come near to, in the model's unit.  By default
        the one that makes equilateral triangles with the spacing.
    pattern : str
        ``"triangular"`` or ``"quad"``.
    progress : callable, optional
        Called with a fraction and a label.

    Returns
    -------
    Lattice
        A manifold with the Euler characteristic and the borders of the surface.

    Raises
    ------
    Unsupported
        When the edge length is not a positive number, or there is no such pattern.
    """
    tell = progress or (lambda _fraction, _label: None)
    design = pattern_named(pattern)
    length = 2.0 / np.sqrt(3.0) * latitudes.spacing if edge_length is None else float(edge_length)
    if not (np.isfinite(length) and length > 0):
        raise Unsupported(f"An edge length of {length:g} is no length", remedy="Give a positive length.")
    tell(0.0, "dividing the latitudes")
    counts = count_nodes(latitudes, length, design)
    linker = RingLinker(latitudes, counts, find_feet(latitudes, counts), design)
    linker.run()
    latitude, station = rows_of(offsets_of(counts)), np.concatenate(linker.nodes)
    places = points_at(latitudes.polylines, latitude, station)
    tell(0.5, "filling the pockets")
    zipped = _zip_faces(linker, counts, design)
    rings = _ring_edges(counts)
    filling = _fill(latitudes, linker, places, np.concatenate([rings, edges_of(zipped)]), length)
    tell(0.8, "turning edges")
    nodes = np.concatenate([places, filling.hubs])
    faces = _turn_edges(nodes, zipped, filling.triangles, rings, design)
    return assemble(latitudes, nodes, latitude, station, faces, design, length)


def _zip_faces(linker: RingLinker, counts: Ints, pattern: Pattern) -> Ints:
    """Faces (k, 4) of all plain bands."""
    first = offsets_of(counts)
    faces = [
        faces_of_zip(
            zipped,
            np.arange(first[zipped.parent], first[zipped.parent + 1]),
            np.arange(first[zipped.child], first[zipped.child + 1]),
            has_diagonals=pattern.has_diagonals,
        )
        for zipped in linker.zips.values()
    ]
    return np.concatenate([*faces, np.zeros((0, 4), np.int64)])


def _ring_edges(counts: Ints) -> Ints:
    """(N, 2) the edges along the polylines, the lesser node first."""
    after = next_in_loop(offsets_of(counts))
    edges: Ints = np.sort(np.c_[np.arange(len(after)), after], axis=1)
    return edges


def _fill(latitudes: Latitudes, linker: RingLinker, places: Floats, taken: Ints, edge_length: float) -> Filling:
    """Fill the bands that were not zipped."""
    wanted = np.setdiff1d(np.arange(len(latitudes.bands)), np.array(list(linker.zips), np.int64))
    if len(wanted) == 0:
        return Filling(np.zeros((0, 3), np.int64), np.zeros((0, 3)))
    return fill_bands(latitudes, linker.nodes, places, wanted, taken, edge_length)


def _turn_edges(nodes: Floats, zipped: Ints, filled: Ints, rings: Ints, pattern: Pattern) -> Ints:
    """All faces, after edges between the rings were turned where that makes better angles.

    In a plain band that is only done where the zip made a bad one, as at a sharp corner, where
    a ring had better be linked to itself (Yan et al. 2016, Fig. 10).
    """
    n = np.int64(len(nodes))

    def keys(edges: Ints) -> Ints:
        unique: Ints = np.unique(edges[:, 0] * n + edges[:, 1])
        return unique

    if pattern.has_diagonals:
        fixed = keys(np.concatenate([rings, edges_of(as_quads(filled))]))
        zipped = as_quads(improve_triangles(nodes, zipped[:, :3], fixed, least_gain=_BAD_ZIP))
    fixed = keys(np.concatenate([rings, edges_of(zipped)]))
    return np.concatenate([zipped, as_quads(improve_triangles(nodes, filled, fixed))])
