"""Pieces and borders of a mesh that may not be meant: scraps, slits and small holes.

A *piece* is a connected component.  A *scrap* has less than a hundredth of the area of the largest piece.  A *slit* is
a border that encloses no area, lacks a single face, or is shorter than a thousandth of the longest, or of the side of a
square of the piece's area.  A *speck* is a border shorter than a hundredth of the spacing.  Linear in the faces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from weavecore.errors import NoSurface
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.model import Note, SurfaceMesh
from weavecore.model.notes import at
from weavecore.reading.raw import RawMesh, counted

_SCRAP = 0.01
"""Of the area of the largest piece: a smaller one is noted."""

_SHORT = 1e-3
"""Of the longest border, or of the root of the piece's area: a shorter one is noted."""

_MANY_FACES = 100
"""A mesh of more faces has holes of more than three corners; one of three is a face that is missing."""

_OPENING = 0.5
"""Of the root of the piece's area: its longest border is an outer one if it is longer, even of three corners."""

_SPECK = 0.01
"""Part of the spacing: shorter borders are closed.  Of three edges around one, one would be below a 300th."""

_FLAT = 1e-4
"""Least area that a border encloses, in its squared length: a circle has 0.08, a slit of 5,000 times its width 1e-4."""


@dataclass(frozen=True)
class SurfacePiece:
    """A connected component.

    Parameters
    ----------
    n_faces : int
    area : float
        In the unit squared.
    size : float
        Diagonal of its box.
    middle : (float, float, float)
        Middle of its box.
    """

    n_faces: int
    area: float
    size: float
    middle: tuple[float, float, float]


def pieces_of(surface: SurfaceMesh) -> tuple[SurfacePiece, ...]:
    """The pieces of a mesh, in the order of their first faces.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    tuple of SurfacePiece
    """
    label = surface.component_of_face
    count, area = np.bincount(label), _areas(surface)
    low, high = (np.full((len(count), 3), sign * np.inf) for sign in (1, -1))
    corners = surface.vertices[surface.faces]
    np.minimum.at(low, label, corners.min(1))
    np.maximum.at(high, label, corners.max(1))
    size, middle = np.linalg.norm(high - low, axis=1), (low + high) / 2
    rows = zip(count.tolist(), area.tolist(), size.tolist(), middle.tolist())
    return tuple(SurfacePiece(n, a, s, (m[0], m[1], m[2])) for n, a, s, m in rows)


def _areas(surface: SurfaceMesh) -> Floats:
    return np.asarray(np.bincount(surface.component_of_face, surface.face_areas), np.float64)


def keep_largest(surface: SurfaceMesh) -> SurfaceMesh:
    """The piece with the largest area.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    SurfaceMesh
        With the note LEFT_OUT where there were others.
    """
    pieces = pieces_of(surface)
    if len(pieces) == 1:
        return surface
    largest = int(np.argmax([piece.area for piece in pieces]))
    keep = surface.component_of_face == largest
    n = int((~keep).sum())
    text = f"Left out {counted(len(pieces) - 1, 'piece')} with {counted(n, 'face')}: only the largest was asked for."
    where = [piece.middle for k, piece in enumerate(pieces) if k != largest]
    note = Note("LEFT_OUT", text, {"pieces": len(pieces) - 1, "faces": n}, where)
    return with_faces(surface, surface.faces[keep], note)


def with_faces(surface: SurfaceMesh, faces: Ints, note: Note) -> SurfaceMesh:
    """A surface with other faces on its vertices, of which the unused are dropped, and one note more.

    Parameters
    ----------
    surface : SurfaceMesh
    faces : (G, 3) int64
    note : Note

    Returns
    -------
    SurfaceMesh
    """
    used, named = np.unique(faces, return_inverse=True)
    vertices, notes = surface.vertices[used], (*surface.notes, note)
    return replace(surface, vertices=vertices, faces=named.reshape(-1, 3), notes=notes)


def note_pieces(surface: SurfaceMesh) -> SurfaceMesh:
    """Note scraps and slits.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    SurfaceMesh
        With the notes SCRAPS and SLIT where they apply.
    """
    notes = [*_scraps(surface), *_slits(surface)]
    return surface.with_notes((*surface.notes, *notes)) if notes else surface


def _scraps(surface: SurfaceMesh) -> list[Note]:
    if int(surface.component_of_face.max()) == 0:
        return []
    pieces = pieces_of(surface)
    most = max(piece.area for piece in pieces)
    scraps = [piece for piece in pieces if piece.area < _SCRAP * most]
    if not scraps:
        return []
    least = min(scraps, key=lambda piece: piece.area)
    text = (
        f"{counted(len(scraps), 'piece')} of {len(pieces)} with less than a hundredth of the largest one's area, the "
    )
    text += f"smallest {least.size:.3g} large at {at(least.middle)}: --largest leaves them out."
    numbers = {"count": len(scraps), "pieces": len(pieces), "least_area": least.area, "largest_area": most}
    return [Note("SCRAPS", text, numbers, [piece.middle for piece in scraps])]


def _slits(surface: SurfaceMesh) -> list[Note]:
    lengths = border_lengths(surface)
    slit = np.flatnonzero(_is_slit(surface, lengths))
    if len(slit) == 0:
        return []
    where = np.array([surface.vertices[surface.borders[k]].mean(0) for k in slit.tolist()])
    longest = float(lengths[slit].max())
    text = f"{counted(len(slit), 'border')} without area, of a single face, or far shorter than the longest, "
    text += f"up to {longest:.3g} long, "
    text += f"first at {at(where[0])}: --fill-holes {longest * 1.01:.3g} closes them."
    return [Note("SLIT", text, {"count": len(slit), "longest": longest}, where)]


def _is_slit(surface: SurfaceMesh, lengths: Floats) -> Bools:
    """Whether each border (B,) is a slit."""
    if len(lengths) == 0:
        return np.zeros(0, bool)
    areas = np.array([spanned_area(surface.vertices[loop]) for loop in surface.borders])
    is_face = np.array([len(loop) == 3 and surface.n_faces > _MANY_FACES for loop in surface.borders])
    side = np.sqrt(_areas(surface))[_piece_of_border(surface)]
    if len(lengths) > 1:
        is_face |= lengths < _SHORT * lengths.max()
    is_face &= ~_is_longest(surface, lengths) | (lengths < _OPENING * side)
    slit: Bools = is_face | (areas < _FLAT * lengths**2) | (lengths < _SHORT * side)
    return slit


def _piece_of_border(surface: SurfaceMesh) -> Ints:
    """The piece (B,) of each border."""
    face_of_vertex = np.zeros(surface.n_vertices, np.int64)
    face_of_vertex[surface.faces.ravel()] = np.repeat(np.arange(surface.n_faces), 3)
    piece: Ints = surface.component_of_face[face_of_vertex[[loop[0] for loop in surface.borders]]]
    return piece


def _is_longest(surface: SurfaceMesh, lengths: Floats) -> Bools:
    """Whether each border (B,) is the longest of its piece."""
    piece = _piece_of_border(surface)
    order = np.lexsort([-lengths, piece])
    is_longest = np.zeros(len(order), bool)
    is_longest[order[np.flatnonzero(np.r_[True, np.diff(piece[order]) != 0])]] = True
    return is_longest


def border_lengths(surface: SurfaceMesh) -> Floats:
    """Length (B,) of each border.

    Parameters
    ----------
    surface : SurfaceMesh
    """
    loops = [surface.vertices[loop] for loop in surface.borders]
    return np.array([np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).sum() for loop in loops])


def spanned_area(loop: Floats) -> float:
    """Length of the vector area of a closed polyline: the area of a plane loop.

    Parameters
    ----------
    loop : (n, 3) float64
    """
    centred = loop - loop.mean(0)
    return float(np.linalg.norm(np.cross(centred, np.roll(centred, -1, axis=0)).sum(0)) / 2)


def fill_holes(surface: SurfaceMesh, longest: float) -> SurfaceMesh:
    """Close borders up to a length: three corners by a triangle, others by triangles about their mean.

    The longest border of each piece stays unless it is a slit, so that no open piece is closed.

    Parameters
    ----------
    surface : SurfaceMesh
    longest : float

    Returns
    -------
    SurfaceMesh
        With the note FILLED where there were such borders.
    """
    lengths = border_lengths(surface)
    if len(lengths) == 0:
        return surface
    is_outer = _is_longest(surface, lengths) & ~_is_slit(surface, lengths)
    chosen = np.flatnonzero((lengths <= longest) & ~is_outer)
    return _closed(surface, lengths, chosen.tolist(), f"of up to {longest:.6g}")


def fill_specks(surface: SurfaceMesh, spacing: float) -> SurfaceMesh:
    """Close borders far shorter than the spacing, unless distances start there: no edge of a lattice fits around them.

    The longest border of each piece stays.

    Parameters
    ----------
    surface : SurfaceMesh
    spacing : float

    Returns
    -------
    SurfaceMesh
        With the note FILLED where there were such borders.
    """
    lengths = border_lengths(surface)
    if len(lengths) == 0 or float(lengths.min()) >= _SPECK * spacing:
        return surface
    started = set() if surface.starts is None else set(surface.starts.vertices().tolist())
    is_speck = (lengths < _SPECK * spacing) & ~_is_longest(surface, lengths)
    chosen = [
        k
        for k in np.flatnonzero(is_speck).tolist()
        if started.isdisjoint(surface.borders[k].tolist())
        and spanned_area(surface.vertices[surface.borders[k]]) > _FLAT * lengths[k] ** 2
    ]
    return _closed(surface, lengths, chosen, f"shorter than a hundredth of the spacing of {spacing:.3g}")


def _closed(surface: SurfaceMesh, lengths: Floats, chosen: list[int], which: str) -> SurfaceMesh:
    """Close borders, and note that; the same surface where there are none."""
    if len(chosen) == 0:
        return surface
    faces, n = [surface.faces], surface.n_vertices
    means: list[Floats] = []
    for k in chosen:
        loop = surface.borders[k]
        if len(loop) == 3:
            faces.append(loop[::-1][None])
        else:
            faces.append(np.column_stack([np.roll(loop, -1), loop, np.full(len(loop), n + len(means))]))
            means.append(surface.vertices[loop].mean(0))
    where = np.array([surface.vertices[surface.borders[k]].mean(0) for k in chosen])
    text = f"Closed {counted(len(chosen), 'border')} {which}, the longest {lengths[chosen].max():.6g}."
    note = Note("FILLED", text, {"count": len(chosen), "longest": float(lengths[chosen].max())}, where)
    vertices = np.concatenate([surface.vertices, np.reshape(means, (-1, 3))])
    return replace(surface, vertices=vertices, faces=np.concatenate(faces), notes=(*surface.notes, note))


def select_parts(raw: RawMesh, names: Sequence[str], file_name: str) -> RawMesh:
    """The objects or groups of an .obj with one of several names.

    Parameters
    ----------
    raw : RawMesh
    names : sequence of str
    file_name : str
        For the error.

    Returns
    -------
    RawMesh
        With the vertices of these alone.

    Raises
    ------
    NoSurface
        Where none has one of the names.
    """
    known = list(dict.fromkeys(name for part in raw.part_names for name in part))
    missing = [name for name in names if name not in known]
    if missing or raw.part_of_face is None:
        raise NoSurface(
            f"{file_name} has no object or group named {', '.join(map(repr, missing or names))}",
            remedy="Name one of these." if known else "Omit the name: the file has one mesh.",
            ids=known,
            kind="there is",
        )
    chosen = [k for k, part in enumerate(raw.part_names) if set(part) & set(names)]
    keep = np.isin(raw.part_of_face, chosen)
    faces = raw.faces[keep]
    used, named = np.unique(faces, return_inverse=True)
    ids = np.flatnonzero(keep) if raw.face_ids is None else raw.face_ids[keep]
    return replace(
        raw,
        vertices=raw.vertices[used],
        faces=named.reshape(faces.shape),
        face_ids=ids,
        name=", ".join(dict.fromkeys(names)),
        part_names=(),
        part_of_face=None,
    )
