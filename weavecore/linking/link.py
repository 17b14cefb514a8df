"""Stage 3: from the latitudes to the lattice (Yan et al. 2016, §5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.bisecting import naked_edges
from weavecore.geometry.delaunay import improve_triangles
from weavecore.linking.assembling import assemble
from weavecore.linking.cells import BandFaces, as_quads, faces_of_zip
from weavecore.linking.division import count_nodes, points_at
from weavecore.linking.evening import even_out
from weavecore.linking.fairing import fair
from weavecore.linking.patterns import Pattern, pattern_named
from weavecore.linking.pockets import fill_bands
from weavecore.linking.quads import pair_triangles
from weavecore.linking.rings import RingLinker
from weavecore.linking.selvedges import (
    Hem,
    divide_selvedges,
    find_selvedges,
    find_tongues,
    give_way,
    number_hem,
    plain_strips,
)
from weavecore.linking.splicing import faces_with_long_links, splice
from weavecore.linking.uprighting import node_normals, turn_upright
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice

_STRETCH = 0.97

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
        the one that makes equilateral triangles, or squares, with the spacing.
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
    length = design.edge_per_spacing * latitudes.spacing if edge_length is None else float(edge_length)
    if not (np.isfinite(length) and length > 0):
        raise Unsupported(f"An edge length of {length:g} is no length", remedy="Give a positive length.")
    tell(0.0, "dividing the latitudes")
    divided = _divide(latitudes, length, design)
    linker, hem, places = divided.linker, divided.hem, divided.places
    tell(0.4, "filling the pockets")
    counts = np.array([len(stations) for stations in linker.nodes], np.int64)
    ring_edges = np.concatenate([_ring_edges(counts, latitudes.polylines.closed), hem.edges()])
    zipped = _zip_faces(linker, counts, design)
    longest = _longest_link(latitudes.spacing, length)
    bad = faces_with_long_links(zipped, places, ring_edges, longest)
    is_wanted = np.ones(len(latitudes.bands), bool)
    is_wanted[np.setdiff1d(zipped.band, zipped.band[bad])] = False
    taken = np.concatenate([ring_edges, zipped.where(~is_wanted[zipped.band]).edges()])
    nodes, filled = _fill(latitudes, linker.nodes, hem, places, np.flatnonzero(is_wanted), taken, length)
    faces = splice(zipped, bad, filled, ring_edges)
    if design.has_diagonals:
        faces = _evened(nodes, divided.latitude, faces, ring_edges, longest)
    normals = node_normals(latitudes, divided.latitude, divided.station, faces, len(nodes))
    faces = turn_upright(latitudes.surface, nodes, normals, faces, ring_edges)
    if not design.has_diagonals:
        faces = pair_triangles(faces, nodes, ring_edges, leave_few=design.in_pairs)
    tell(0.8, "fairing the lattice")
    lattice = assemble(latitudes, nodes, divided.latitude, divided.station, faces, hem, longest, design, length)
    return fair(lattice, linker.spikes)


@dataclass(frozen=True, eq=False)
class _Divided:
    """Polylines divided and zipped, selvedges divided, and their nodes (N,): latitude or -1, station, place (N, 3)."""

    linker: RingLinker
    hem: Hem
    latitude: Ints
    station: Floats
    places: Floats


def _divide(latitudes: Latitudes, length: float, design: Pattern) -> _Divided:
    selvedges = find_selvedges(latitudes)
    turns = divide_selvedges(selvedges, length)
    counts = count_nodes(latitudes, length, design, find_tongues(latitudes, selvedges))
    linker = RingLinker(latitudes, counts, design, plain_strips(latitudes, selvedges, turns))
    linker.run()
    counts = np.array([len(stations) for stations in linker.nodes], np.int64)
    latitude, station = rows_of(offsets_of(counts)), np.concatenate(linker.nodes)
    places = points_at(latitudes.polylines, latitude, station)
    tree = cKDTree(places)
    turns = [give_way(selvedge, stations, tree) for selvedge, stations in zip(selvedges, turns)]
    linker.keep_zips(plain_strips(latitudes, selvedges, turns))
    hem = number_hem(selvedges, turns, counts)
    n_more = len(hem.places)
    return _Divided(
        linker,
        hem,
        np.concatenate([latitude, np.full(n_more, -1)]),
        np.concatenate([station, np.zeros(n_more)]),
        np.concatenate([places, hem.places]),
    )


def _longest_link(spacing: float, edge_length: float) -> float:
    """The longest link between two rings: that of a triangle whose tip lies well beyond its base."""
    return _STRETCH * float(np.hypot(spacing, 1.25 * edge_length))


def _evened(nodes: Floats, latitude: Ints, faces: BandFaces, ring_edges: Ints, longest: float) -> BandFaces:
    """The same faces with edges turned where that gives the nodes more even numbers of edges."""
    of_node = np.concatenate([latitude, np.full(len(nodes) - len(latitude), -1)])
    is_border = np.zeros(len(nodes), bool)
    is_border[naked_edges(faces.corners[:, :3])] = True
    triangles = even_out(nodes, of_node, is_border, faces.corners[:, :3], ring_edges, longest)
    return BandFaces(as_quads(triangles), faces.band)


def _zip_faces(linker: RingLinker, counts: Ints, pattern: Pattern) -> BandFaces:
    """The faces of all plain bands."""
    first = offsets_of(counts)
    parts = []
    for band, zipped in linker.zips.items():
        parent = np.arange(first[zipped.parent], first[zipped.parent + 1])
        child = np.arange(first[zipped.child], first[zipped.child + 1])
        corners = faces_of_zip(zipped, parent, child, has_diagonals=pattern.has_diagonals)
        parts.append(BandFaces(corners, np.full(len(corners), band)))
    return BandFaces.of(parts)


def _ring_edges(counts: Ints, closed: Bools) -> Ints:
    """(N, 2) the edges along the polylines, the lesser node first."""
    offsets = offsets_of(counts)
    after = next_in_loop(offsets)
    edges: Ints = np.sort(np.c_[np.arange(len(after)), after], axis=1)
    return np.delete(edges, offsets[1:][~closed] - 1, axis=0)


def _fill(
    latitudes: Latitudes, stations: list[Floats], hem: Hem, places: Floats, bands: Ints, taken: Ints, edge_length: float
) -> tuple[Floats, BandFaces]:
    """All nodes, hubs among them, and the faces that fill these bands."""
    if len(bands) == 0:
        return places, BandFaces.of([])
    filling = fill_bands(latitudes, stations, hem, places, bands, taken, edge_length)
    nodes = np.concatenate([places, filling.hubs])
    keys = np.unique(taken[:, 0] * np.int64(len(nodes)) + taken[:, 1])
    return nodes, BandFaces(as_quads(improve_triangles(nodes, filling.triangles, keys)), filling.band)
