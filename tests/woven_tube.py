"""A tube woven by hand: a surface, its latitudes and a lattice that are right, to be broken by tests.

Height 5, spacing 1, two borders: polylines at heights 0, 5, 1, 4, 2, 3 and a pocket in the middle.
"""

from __future__ import annotations

import numpy as np

from weavecore.model import (
    LATITUDINAL,
    LONGITUDINAL,
    POCKET,
    Bands,
    Latitudes,
    Lattice,
    Polylines,
    Strands,
    SurfaceMesh,
)

COLUMNS = 12
ROWS = np.array([0.0, 2.5, 5.0])
HEIGHTS = (0.0, 5.0, 1.0, 4.0, 2.0, 3.0)


def tube_surface() -> SurfaceMesh:
    """Rows of vertices around the z axis; seen from outside each row runs to the right."""
    turn = 2 * np.pi * np.arange(COLUMNS) / COLUMNS
    circle = np.c_[np.cos(turn), np.sin(turn)]
    vertices = np.concatenate([np.c_[circle, np.full(COLUMNS, z)] for z in ROWS])
    faces = []
    for r in range(len(ROWS) - 1):
        for j in range(COLUMNS):
            a, b = r * COLUMNS + j, r * COLUMNS + (j + 1) % COLUMNS
            faces += [[a, b, b + COLUMNS], [a, b + COLUMNS, a + COLUMNS]]
    return SurfaceMesh(vertices, np.array(faces), unit="Meters")


def _ring(z: float) -> tuple[list[int], list[list[float]]]:
    """Faces and barycentric coordinates of the points around the tube at a height, to the right."""
    if z == ROWS[0]:
        return [2 * j for j in range(COLUMNS)], [[1, 0, 0]] * COLUMNS
    if z == ROWS[-1]:
        last = 2 * COLUMNS * (len(ROWS) - 2)
        return [last + 2 * j + 1 for j in range(COLUMNS)], [[0, 0, 1]] * COLUMNS
    r = int(np.searchsorted(ROWS, z)) - 1
    t = (z - ROWS[r]) / (ROWS[r + 1] - ROWS[r])
    face = [2 * (r * COLUMNS + j) + 1 for j in range(COLUMNS) for _ in "ab"]
    return face, [[1 - t, 0, t], [1 - t, t, 0]] * COLUMNS


def tube_latitudes() -> Latitudes:
    surface = tube_surface()
    face, barycentric, offsets = [], [], [0]
    for z in HEIGHTS:
        f, b = _ring(z)
        order = np.arange(len(f)) if z < 2.5 else -np.arange(len(f)) % len(f)  # unexplored side on the left
        face.append(np.array(f)[order])
        barycentric.append(np.array(b, float)[order])
        offsets.append(offsets[-1] + len(f))
    face, barycentric = np.concatenate(face), np.concatenate(barycentric)
    points = np.einsum("nk,nkd->nd", barycentric, surface.vertices[surface.faces[face]])
    polylines = Polylines(points, offsets, np.ones(len(HEIGHTS), bool), face, barycentric)
    bands = Bands(
        offsets=[0, 2, 4, 6, 8, 10],
        polyline=[0, 2, 1, 3, 2, 4, 3, 5, 4, 5],
        is_parent=[True, False, True, False, True, False, True, False, True, True],
        is_left=[True, False, True, False, True, False, True, False, True, True],
        euler=[0] * 5,
        depth=[1.0, 1.0, 2.0, 2.0, 2.5],
    )
    height = surface.vertices[:, 2]
    return Latitudes(
        surface,
        polylines,
        generation=[0, 0, 1, 1, 2, 2],
        distance=[0.0, 0.0, 1.0, 1.0, 2.0, 2.0],
        parents=[[0, 2], [1, 3], [2, 4], [3, 5]],
        bands=bands,
        spacing=1.0,
        vertex_distance=np.minimum(height, 5 - height),
    )


def tube_lattice() -> Lattice:
    """One node at every column of every ring, joined straight up and by one diagonal."""
    latitudes = tube_latitudes()
    polylines = latitudes.polylines
    nodes, station, rings = [], [], {}
    for p, z in enumerate(HEIGHTS):
        every = int(polylines.counts[p]) // COLUMNS
        at = np.arange(polylines.offsets[p], polylines.offsets[p + 1], every)
        first = sum(map(len, nodes))
        ring = np.arange(first, first + COLUMNS)
        rings[z] = ring if z < 2.5 else np.roll(ring[::-1], 1)
        nodes.append(polylines.points[at])
        station.append(polylines.stations[at])
    faces, edges, family = [], [], []
    for z, ring in rings.items():
        edges += zip(ring, np.roll(ring, -1))
        family += [LATITUDINAL] * COLUMNS
        if z == 5:
            continue
        above = rings[z + 1]
        for a, b, c, d in zip(ring, np.roll(ring, -1), np.roll(above, -1), above):
            faces += [[a, b, c], [a, c, d]]
            edges += [(a, c), (a, d)]
        family += [POCKET if z == 2 else LONGITUDINAL] * (2 * COLUMNS)
    edges = np.sort(np.array(edges), axis=1)
    order = np.lexsort(edges.T[::-1])
    return Lattice(
        latitudes,
        np.concatenate(nodes),
        face_offsets=3 * np.arange(len(faces) + 1),
        face_nodes=np.concatenate(faces),
        edges=edges[order],
        edge_family=np.array(family)[order],
        node_latitude=np.repeat(np.arange(len(HEIGHTS)), COLUMNS),
        node_station=np.concatenate(station),
        pattern="triangular",
        edge_length=1.0,
    )


def tube_strands() -> Strands:
    """The rings, and each other edge a strand of its own."""
    lattice = tube_lattice()
    rings = np.arange(lattice.n_nodes).reshape(-1, COLUMNS)
    across = np.flatnonzero(lattice.edge_family != LATITUDINAL)
    counts = np.r_[np.full(len(rings), COLUMNS), np.full(len(across), 2)]
    return Strands(
        offsets=np.r_[0, np.cumsum(counts)],
        nodes=np.r_[rings.ravel(), lattice.edges[across].ravel()],
        family=np.r_[np.full(len(rings), LATITUDINAL), lattice.edge_family[across]],
        closed=counts == COLUMNS,
    )
