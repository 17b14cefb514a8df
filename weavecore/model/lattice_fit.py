"""How well a lattice follows its surface: the gap under its edges, its inverted faces, and edges without length.

    gap of an edge          o────────o         at a quarter, half and three quarters of the way from node to node
                           ╱ ╲__↕__╱ ╲

A face is *inverted* where its normal points against that of the surface nearest to its middle.  Both happen where a
fold is narrower than the edges are long.  An edge without length joins borders that almost touch.  Time is
O(n log n) for n faces of both meshes.
"""

from __future__ import annotations

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, cross, dots, next_in_loop, rows_of
from weavecore.model.lattice import Lattice
from weavecore.model.notes import Note, at

_PARTS = np.array([0.25, 0.5, 0.75])
"""Where gaps are measured; over a crease the gap is widest where the edge crosses it."""

_INVERTED: WeakKeyDictionary[Lattice, Ints] = WeakKeyDictionary()
"""The inverted faces of lattices that were asked for them: linking asks several times."""

_FAR = 0.6
"""Of the spacing or the edge length: edges further from the surface are noted.  One over a crease of 90° leaves it by
up to half its own length."""

_SHORT = 2e-3
"""Of the spacing or the edge length: shorter edges are noted: whoever ties the rods sees one node."""


def edge_gaps(lattice: Lattice) -> Floats:
    """(E,) greatest distance of each edge from the surface, in the model's unit.

    Parameters
    ----------
    lattice : Lattice
    """
    return _gaps_under(lattice, lattice.edges)


def _gaps_under(lattice: Lattice, edges: Ints) -> Floats:
    a, b = lattice.nodes[edges[:, 0]], lattice.nodes[edges[:, 1]]
    points = (a + _PARTS[:, None, None] * (b - a)).reshape(-1, 3)
    surface = lattice.latitudes.surface
    _, place = surface.face_finder.find(points)
    gaps: Floats = np.linalg.norm(place - points, axis=1).reshape(len(_PARTS), -1).max(0)
    return gaps


def face_middles(lattice: Lattice) -> tuple[Floats, Floats]:
    """Mean of the corners (F, 3) and area vector (F, 3) of each face, planar or not.

    Parameters
    ----------
    lattice : Lattice
    """
    first, face = lattice.face_offsets[:-1], rows_of(lattice.face_offsets)
    corners = lattice.nodes[lattice.face_nodes]
    heads = corners[next_in_loop(lattice.face_offsets)]
    if len(first) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    middle = np.add.reduceat(corners, first) / np.diff(lattice.face_offsets)[:, None]
    area = cross(corners - middle[face], heads - middle[face]) / 2
    return middle, np.add.reduceat(area, first)


def inverted_faces(lattice: Lattice) -> Ints:
    """Faces whose normals point against that of the surface nearest to their middles, in rising order.

    Parameters
    ----------
    lattice : Lattice
    """
    known = _INVERTED.get(lattice)
    if known is None:
        surface = lattice.latitudes.surface
        middle, area = face_middles(lattice)
        # Nodes lie on the surface, so it comes as near to the middle of a face as its nearest node.
        arms = lattice.nodes[lattice.face_nodes] - middle[rows_of(lattice.face_offsets)]
        near = np.sqrt(np.minimum.reduceat(dots(arms, arms), lattice.face_offsets[:-1])) if len(middle) else area[:, 0]
        known = _INVERTED[lattice] = np.flatnonzero(surface.nearest_normals.are_against(middle, area, near))
    return known


def note_far_edges(lattice: Lattice) -> Lattice:
    """Note the edges of a lattice that leave its surface by more than `_FAR`.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    Lattice
        With a note COARSE on its surface where there are such edges; else the same.
    """
    latitudes = lattice.latitudes
    reach = max(latitudes.spacing, lattice.edge_length)
    # Nodes lie on the surface, so an edge leaves it by half its length at most.
    far = np.flatnonzero(lattice.edge_lengths > 2 * _FAR * reach)
    gaps = _gaps_under(lattice, lattice.edges[far])
    far, gaps = far[gaps > _FAR * reach], gaps[gaps > _FAR * reach]
    if len(far) == 0:
        return lattice
    places = lattice.nodes[lattice.edges[far]].mean(1)
    edges = "1 edge of the lattice lies" if len(far) == 1 else f"{len(far):,} edges of the lattice lie"
    furthest = float(gaps.max())
    text = f"{edges} up to {furthest:.3g} from the surface, the first near {at(places[0])}: a tube or a fold is hardly "
    text += f"wider there than the spacing of {latitudes.spacing:.3g}. Use a smaller one."
    numbers = {"far_edges": len(far), "edges": lattice.n_edges, "distance": furthest, "spacing": latitudes.spacing}
    return _with_note(lattice, Note("COARSE", text, numbers, places))


def note_short_edges(lattice: Lattice) -> Lattice:
    """Note the edges of a lattice that are shorter than `_SHORT`.

    Nodes on borders stay on them, so where two borders almost touch the edge across is as short as the way.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    Lattice
        With a note COARSE on its surface where there are such edges; else the same.
    """
    latitudes, length = lattice.latitudes, lattice.edge_lengths
    short = np.flatnonzero(length < _SHORT * max(latitudes.spacing, lattice.edge_length))
    if len(short) == 0:
        return lattice
    places = lattice.nodes[lattice.edges[short]].mean(1)
    edges = "1 edge of the lattice is" if len(short) == 1 else f"{len(short):,} edges of the lattice are"
    least = float(length[short].min())
    text = f"{edges} without length, {least:.3g} at the least, the first near {at(places[0])}: borders almost touch "
    text += f"there, or distances start at a hole far smaller than the spacing of {latitudes.spacing:.3g}. "
    text += "Join borders or move them apart, and close such holes."
    numbers = {"short_edges": len(short), "edges": lattice.n_edges, "length": least, "spacing": latitudes.spacing}
    return _with_note(lattice, Note("COARSE", text, numbers, places))


def _with_note(lattice: Lattice, note: Note) -> Lattice:
    latitudes = lattice.latitudes
    surface = latitudes.surface.with_notes((*latitudes.surface.notes, note))
    return replace(lattice, latitudes=replace(latitudes, surface=surface))


def note_inverted_faces(lattice: Lattice) -> Lattice:
    """Note the inverted faces of a lattice.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    Lattice
        With a note COARSE on its surface where faces are inverted; else the same.
    """
    inverted = inverted_faces(lattice)
    if len(inverted) == 0:
        return lattice
    latitudes = lattice.latitudes
    places = face_middles(lattice)[0][inverted]
    faces = "1 face of the lattice lies" if len(inverted) == 1 else f"{len(inverted):,} faces of the lattice lie"
    text = f"{faces} inverted, the first near {at(places[0])}: a fold or a tube is narrower there than the spacing of "
    text += f"{latitudes.spacing:.3g}. Use a smaller one."
    numbers = {"inverted_faces": len(inverted), "faces": lattice.n_faces, "spacing": latitudes.spacing}
    return _with_note(lattice, Note("COARSE", text, numbers, places))
