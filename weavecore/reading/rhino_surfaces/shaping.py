"""Patches brought into shape: edges flipped, inner vertices shifted, edges that are too long halved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.nurbs import NurbsSurface, surface_jet, surface_points
from weavecore.geometry.relaxing import flip_edges, take_back_folds, wanted_shift
from weavecore.reading.rhino_surfaces.grids import lookup
from weavecore.reading.rhino_surfaces.patches import Patches, by_owner, split_edges

_ROUNDS = 6
_ROUNDS_AFTER_SPLIT = 2
_MOST_SPLITS = 8
_STEP = 0.8
_TOO_LONG = 1.45
_RISE = 0.75
"""What the surface may rise over an edge, in chord errors: over a triangle's middle it is a third more."""


def relaxed(patches: Patches, chord: float, tell: Callable[[float, str], None]) -> Patches:
    """Flip edges and shift inner vertices until the triangles are well shaped and keep the chord error."""
    patches = _in_rounds(patches, _ROUNDS)
    for k in range(_MOST_SPLITS):
        tell(0.75 + 0.2 * k / _MOST_SPLITS, "Shaping triangles")
        long = _long_edges(patches, chord)
        if len(long) == 0:
            break
        patches = _in_rounds(split_edges(patches, long), _ROUNDS_AFTER_SPLIT)
    return patches


def _in_rounds(patches: Patches, n: int) -> Patches:
    patches = _flipped(patches)
    for _ in range(n):
        patches = _flipped(_shifted(patches))
    return patches


def _long_edges(p: Patches, chord: float) -> Ints:
    """Inner edges (K, 2) much longer than wanted, or that the surface leaves by more than ``chord``."""
    sides = np.sort(np.concatenate([p.faces[:, [0, 1]], p.faces[:, [1, 2]], p.faces[:, [2, 0]]]), axis=1)
    edges, times = np.unique(sides, axis=0, return_counts=True)
    edges = edges[(times == 2) & (p.names[edges[:, 0]] != p.names[edges[:, 1]])]
    n = np.int64(len(p.uv))
    held = np.sort(p.creases, axis=1)
    edges = edges[~np.isin(edges[:, 0] * n + edges[:, 1], held[:, 0] * n + held[:, 1])]
    a, b = edges.T
    length = np.linalg.norm(p.points[a] - p.points[b], axis=1)
    wanted = _wanted_sizes(p)
    long = length > _TOO_LONG * (wanted[a] + wanted[b]) / 2
    # At a singular side the parameters of the two ends are far apart and their mean says nothing.
    inner = np.flatnonzero(p.inner[a] | p.inner[b])
    for face, which in by_owner(p.owner[a[inner]], inner):
        uv = (p.uv[a[which]] + p.uv[b[which]]) / 2
        jet = surface_jet(p.surfaces[face].surface, uv)
        normal = np.cross(jet.du, jet.dv)
        middle = (p.points[a[which]] + p.points[b[which]]) / 2
        rise = np.abs(np.einsum("ij,ij->i", jet.point - middle, normal))
        long[which] |= rise > _RISE * chord * np.linalg.norm(normal, axis=1)
    too_long: Ints = edges[long]
    return too_long


def _wanted_sizes(p: Patches) -> Floats:
    wanted = np.zeros(len(p.uv))
    for face, index in by_owner(p.owner, np.arange(len(p.uv))):
        wanted[index] = lookup(p.grids[face], p.sizes[face], p.uv[index])
    return wanted


def _flipped(p: Patches) -> Patches:
    return replace(p, faces=flip_edges(p.faces, p.plane, p.points, p.names, p.creases))


def _shifted(p: Patches) -> Patches:
    shift = _STEP * wanted_shift(p.faces, p.points, _wanted_sizes(p))
    uv, plane = p.uv.copy(), p.plane.copy()
    free = by_owner(p.owner[p.inner], np.flatnonzero(p.inner))
    for face, index in free:
        uv[index] += _in_parameters(p.surfaces[face].surface, p.uv[index], shift[index])
        plane[index] = p.grids[face].to_chart(uv[index])
    plane = take_back_folds(p.faces, p.plane, plane)
    points = p.points.copy()
    for face, index in free:
        uv[index] = np.where((plane[index] == p.plane[index]).all(1)[:, None], p.uv[index], uv[index])
        points[index] = surface_points(p.surfaces[face].surface, uv[index])
    return replace(p, uv=uv, plane=plane, points=points)


def _in_parameters(surface: NurbsSurface, uv: Floats, shift: Floats) -> Floats:
    """The step (K, 2) in (u, v) that moves a point by the tangential part of a shift in space."""
    jet = surface_jet(surface, uv)
    e, f, g = (np.einsum("ij,ij->i", a, b) for a, b in ((jet.du, jet.du), (jet.du, jet.dv), (jet.dv, jet.dv)))
    a, b = np.einsum("ij,ij->i", jet.du, shift), np.einsum("ij,ij->i", jet.dv, shift)
    det = e * g - f * f
    regular = det > 1e-8 * e * g
    det = np.where(regular, det, 1.0)
    step = np.column_stack([(g * a - f * b) / det, (e * b - f * a) / det])
    return np.where(regular[:, None], step, 0.0)
