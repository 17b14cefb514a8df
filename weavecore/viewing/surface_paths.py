"""The paths along edges of a surface that are drawn: origins of distances, and free borders, where none starts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends
from weavecore.model import Origins, SurfaceMesh


@dataclass(frozen=True, eq=False)
class SurfacePaths:
    """Paths along edges of a surface.

    Parameters
    ----------
    surface : SurfaceMesh
    paths : tuple of (n,) int64
        Vertices; the first of a closed one is not repeated.
    closed, is_free_border : (L,) bool
    names : tuple of str
    """

    surface: SurfaceMesh
    paths: tuple[Ints, ...]
    closed: Bools
    is_free_border: Bools
    names: tuple[str, ...]

    @cached_property
    def points(self) -> Floats:
        """(N, 3) points of all, one path after the other."""
        points: Floats = self.surface.vertices[np.concatenate([np.zeros(0, np.int64), *self.paths])]
        return points

    @cached_property
    def offsets(self) -> Ints:
        """(L+1,) where the points of each begin."""
        return offsets_of([len(path) for path in self.paths])

    def segments(self) -> tuple[Ints, Ints, Bools]:
        """First and second vertex of every segment, and whether it is on a free border."""
        nothing = np.zeros(0, np.int64)
        ends = [(path, np.roll(path, -1)) if c else (path[:-1], path[1:]) for path, c in zip(self.paths, self.closed)]
        marks = np.repeat(self.is_free_border, np.array([len(a) for a, _ in ends], np.int64))
        return np.concatenate([nothing, *(a for a, _ in ends)]), np.concatenate([nothing, *(b for _, b in ends)]), marks


def paths_of_surface(surface: SurfaceMesh) -> SurfacePaths:
    """Find the paths of a surface.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    SurfacePaths
        The borders, then the cuts; where origins were chosen these, then the free borders, border by border.
    """
    if surface.starts is None:
        paths: list[Ints] = [*surface.borders, *surface.cuts]
        names = [f"border {k}" for k in range(len(surface.borders))] + [f"cut {k}" for k in range(len(surface.cuts))]
        flags = np.ones(len(paths), bool), np.zeros(len(paths), bool)
        return SurfacePaths(surface, tuple(paths), *flags, tuple(names))
    origins, stretches = surface.starts, _free_stretches(surface)
    n, m = len(origins), len(stretches)
    return SurfacePaths(
        surface,
        (*origins.paths, *(path for path, _ in stretches)),
        np.concatenate([origins.closed, np.array([closed for _, closed in stretches], bool)]),
        np.arange(n + m) >= n,
        (*(f"origin {k}" for k in range(n)), *(f"free border {k}" for k in range(m))),
    )


def _free_stretches(surface: SurfaceMesh) -> list[tuple[Ints, bool]]:
    """The stretches of border between origins, and whether each is a whole border."""
    tail, head = halfedge_ends(surface.faces)
    n = surface.n_vertices
    keys = (tail * n + head)[surface.is_free_border]
    found: list[tuple[Ints, bool]] = []
    for loop in surface.borders:
        flag = np.isin(loop * n + np.roll(loop, -1), keys)
        if flag.all():
            found.append((loop, True))
            continue
        begins = np.flatnonzero(flag & ~np.roll(flag, 1))
        ends = np.flatnonzero(~flag & np.roll(flag, 1))
        for k in begins.tolist():
            length = int(((ends - k) % len(loop)).min())
            found.append((np.roll(loop, -k)[: length + 1], False))
    return found


def describe_chosen_borders(surface: SurfaceMesh) -> tuple[str, int]:
    """Describe in words how many borders were chosen as origins.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    words : str
        To follow the count of borders; empty where distances start at all of them.
    n_inside : int
        Count of chosen curves inside the surface.
    """
    if surface.starts is None:
        return "", 0
    inside, closed = origins_inside(surface, surface.starts), surface.starts.closed
    whole, parts = int((~inside & closed).sum()), int((~inside & ~closed).sum())
    words = [f"{whole} chosen"] if whole else []
    words += [f"{parts} chosen in part"] if parts else []
    return f" ({', '.join(words) or 'none chosen'})" if surface.borders else "", int(inside.sum())


def origins_inside(surface: SurfaceMesh, origins: Origins) -> Bools:
    """Whether each origin runs inside the surface, and not along a border.

    Parameters
    ----------
    surface : SurfaceMesh
    origins : Origins

    Returns
    -------
    (O,) bool
    """
    tail, head = halfedge_ends(surface.faces)
    n, on_border = surface.n_vertices, surface.twins == NO_TWIN
    first = np.array([path[0] * n + path[1] for path in origins.paths], np.int64)
    inside: Bools = ~np.isin(first, (tail * n + head)[on_border])
    return inside
