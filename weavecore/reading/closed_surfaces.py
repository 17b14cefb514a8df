"""Where a closed surface is cut in two, if nobody says (Yan et al. 2016, §4.1).

Planes across the principal axes of the surface, and across the lines between them, are tried at several
heights.  Taken is the one with the shortest cut for the area of its smaller side: short and balanced at once,
as Cheeger's constant is.  A cut by a plane is smooth, may have several loops (a torus gives two), and turns
with the surface.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN, border_loops, find_twins, halfedge_ends
from weavecore.model import SurfaceMesh
from weavecore.reading.polygon_triangulation import split_quads
from weavecore.reading.raw import Plane, counted
from weavecore.tolerances import CUT_FROM_VERTEX, LEAST_CUT_OFF

_SHARES = 0.5 + 0.04 * np.array([0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5])
"""Parts of the area below the planes that are tried, the balanced ones first."""

_ROWS = 256
_MOST_NESTED = 4
_TOUCH = 1e-9

_ALIKE = 0.01
"""Cuts whose worth differs by less are alike, and the first is taken; so are axes with such moments."""


def cut_closed_parts(surface: SurfaceMesh, *, plane: Optional[Plane] = None) -> SurfaceMesh:
    """The surface with each closed part cut in two; itself where there is none.

    Parameters
    ----------
    surface : SurfaceMesh
    plane : (point, normal), optional
        Cuts the closed parts that lie on both sides of it.

    Raises
    ------
    Degenerate
        Where a plane is given that has no normal, or meets none of the closed parts.
    """
    heights = None if plane is None else _heights(surface.vertices, plane)
    parts = _closed_parts(surface)
    if not parts:
        unused = () if plane is None else ("The cutting plane was not used: no part of the surface is closed.",)
        return replace(surface, mendings=surface.mendings + unused) if unused else surface
    level, n_met = np.ones(surface.n_vertices), 0
    for faces in parts:
        used, local = np.unique(faces, return_inverse=True)
        if heights is not None and _is_met(heights[used], surface.size):
            level[used] = heights[used]
            n_met += 1
        else:
            level[used] = balanced_level(surface.vertices[used], local.reshape(-1, 3))
    if heights is not None and n_met == 0:
        raise Degenerate("The plane meets no closed part of the surface", remedy="Move it, or leave it away.")
    cut = cut_along(surface.vertices, surface.faces, surface.twins, level)
    said = f"Cut {counted(len(parts), 'closed part')} in two along {counted(len(cut.loops), 'loop')}."
    return replace(surface, vertices=cut.vertices, faces=cut.faces, cuts=cut.loops, mendings=(*surface.mendings, said))


def balanced_level(points: Floats, faces: Ints) -> Floats:
    """A function (V,) of the vertices of a closed connected mesh whose zero line is a short and balanced cut."""
    points = (points - points.mean(0)) / np.ptp(points, axis=0).max()
    corners = points[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    axes = candidate_axes(corners.mean(1), area)
    shifts, worth = zip(*(_try_planes(points, faces, area, points @ axis) for axis in axes))
    is_good = np.concatenate(worth) >= (1 - _ALIKE) * np.max(worth)
    axis, share = divmod(int(np.argmax(is_good)), len(_SHARES))
    return _without_specks(faces, area, points @ axes[axis] - shifts[axis][share])


def candidate_axes(points: Floats, weight: Floats) -> Floats:
    """Directions (9, 3) across which planes are tried: the principal axes, longest first, then their sums."""
    offset = points - np.average(points, axis=0, weights=weight)
    moment, axes = np.linalg.eigh((offset * weight[:, None]).T @ offset)
    axes = _settled(moment[::-1], axes[:, ::-1].T)
    sums = [axes[i] + sign * axes[j] for i, j in ((0, 1), (0, 2), (1, 2)) for sign in (1, -1)]
    return np.concatenate([axes, np.array(sums) / np.sqrt(2)])


def _settled(moment: Floats, axes: Floats) -> Floats:
    """Principal axes (3, 3) made definite: what the moments leave open is chosen as near to z, x or y as can be."""
    group = np.concatenate([[0], np.cumsum(moment[:-1] - moment[1:] > _ALIKE * moment[0])])
    settled: list[Floats] = []
    for g in range(int(group[-1]) + 1):
        span = axes[group == g]
        left = span.T @ span
        for world in np.eye(3)[[2, 0, 1]]:
            near = left @ world
            length = float(np.linalg.norm(near))
            if length > 0.5:
                settled.append(near / length)
                left = left - np.outer(settled[-1], settled[-1])
    return np.array(settled)


def _try_planes(points: Floats, faces: Ints, area: Floats, height: Floats) -> tuple[Floats, Floats]:
    """Planes (S,) at heights that leave about the tried shares of the area below them, and their worth (S,)."""
    a, b, c = (height[faces[:, k]] for k in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    middle = a + b + c - low - high
    shifts = _heights_with_share_below(area, (a + b + c) / 3)
    worth = np.empty(len(shifts))
    for k, shift in enumerate(shifts):
        met = np.flatnonzero((low < shift) & (high >= shift))
        length = _cut_length(points[faces[met]], height[faces[met]] - shift)
        share = area @ (high < shift) + area[met] @ _part_below(low[met], middle[met], high[met], shift)
        worth[k] = min(share, area.sum() - share) / max(length, 1e-9)
    return shifts, worth


def _heights_with_share_below(area: Floats, height: Floats) -> Floats:
    """About the heights (S,) below which the tried shares of the area lie; good to a part of the extent."""
    low, extent = height.min(), np.ptp(height)
    row = ((height - low) * (_ROWS / max(extent, 1e-300))).astype(np.int64)
    held = np.bincount(row, area)
    at = np.bincount(row, area * height)[held > 0] / held[held > 0]
    below = (np.cumsum(held) - held / 2)[held > 0]
    heights: Floats = np.interp(_SHARES * area.sum(), below, at)
    return heights


def _part_below(low: Floats, middle: Floats, high: Floats, shift: float) -> Floats:
    """Which part of the area of triangles (F,) lies below a plane that meets them."""
    tip = np.where(shift < middle, shift - low, high - shift)
    side = np.where(shift < middle, middle - low, high - middle)
    part = np.divide(tip * tip, side * (high - low), out=np.zeros_like(tip), where=side > 0)
    below: Floats = np.where(shift < middle, part, 1 - part)
    return below


def _cut_length(p: Floats, a: Floats) -> float:
    """Length of the line in which a plane meets triangles (F, 3, 3) whose corners have heights (F, 3) over it."""
    q, b = np.roll(p, -1, axis=1), np.roll(a, -1, axis=1)
    way = (a >= 0) * 1.0 - (b >= 0)
    crossing = p + (q - p) * np.divide(a, a - b, out=np.zeros_like(a), where=a != b)[:, :, None]
    return float(np.linalg.norm((crossing * way[:, :, None]).sum(1), axis=1).sum())


def _without_specks(faces: Ints, area: Floats, level: Floats) -> Floats:
    """The level with small regions given to the other side, so that no small loop is cut about them."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    tail, head = halfedge_ends(faces)
    n, level = len(level), level.copy()
    for turn in range(2 * _MOST_NESTED):
        above = level >= 0
        same = above[tail] == above[head]
        links = coo_matrix((np.ones(int(same.sum()), bool), (tail[same], head[same])), shape=(n, n))
        region = connected_components(links, directed=False)[1]
        size = np.bincount(region[faces].ravel(), np.repeat(area / 3, 3))
        specks = size < LEAST_CUT_OFF * area.sum()
        if not specks.any():
            break
        turned = specks[region] & (above == (turn % 2 == 0))
        level[turned] = -1.0 if turn % 2 == 0 else 1.0
    return level


def _closed_parts(surface: SurfaceMesh) -> list[Ints]:
    """Faces (f, 3) of each connected part without a border."""
    part = surface.component_of_face
    is_open = np.zeros(int(part.max()) + 1, bool)
    is_open[part[np.flatnonzero(surface.twins == NO_TWIN) // 3]] = True
    order = np.argsort(part, kind="stable")
    offsets = offsets_of(np.bincount(part))
    return [surface.faces[order[offsets[k] : offsets[k + 1]]] for k in np.flatnonzero(~is_open)]


def _heights(vertices: Floats, plane: Plane) -> Floats:
    point, normal = (np.asarray(one, np.float64).reshape(-1) for one in plane)
    if point.shape != (3,) or normal.shape != (3,) or not np.isfinite([point, normal]).all() or not normal.any():
        raise Degenerate(
            "The cutting plane is no point and direction", remedy="Give (point, normal), three numbers each."
        )
    normal = normal / np.abs(normal).max()
    heights: Floats = (vertices - point) @ (normal / np.linalg.norm(normal))
    return heights


def _is_met(heights: Floats, size: float) -> bool:
    """Whether there is something on both sides of the plane, which may lie in a flat face."""
    return bool(heights.min() < -_TOUCH * size and heights.max() > _TOUCH * size)


# ----------------------------------------------------------------------
# A closed mesh cut along the zero line of a function of its vertices, so that the line is made of edges.
#
# The *level* of a vertex is the value there: its height over a plane, say.  An edge whose ends lie on
# both sides is *crossed*.  Where the line comes close to a vertex it goes through it, else a
# new vertex is put on the crossed edge.  Nothing moves: the shape stays as it is.


@dataclass(frozen=True, eq=False)
class Cut:
    """A mesh with edges along the cut.

    Parameters
    ----------
    vertices : (V, 3) float64
        Those of the mesh before, then the new ones.
    faces : (F, 3) int64
        Those that are not crossed, in their order, then the parts of the others.
    loops : tuple of int arrays
        Closed vertex loops without a common vertex, with the side above zero on their left.
    """

    vertices: Floats
    faces: Ints
    loops: tuple[Ints, ...]


def cut_along(vertices: Floats, faces: Ints, twins: Ints, level: Floats) -> Cut:
    """Split the faces along the line where the level is 0.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Oriented and manifold; the line meets no border.
    twins : (3F,) int64
    level : (V,) float64
        Vertices of level 0 count as above where the line cannot go through them.
    """
    tail, head = halfedge_ends(faces)
    part = _crossing_part(level[tail], level[head])
    side = _sides(faces, twins, level, part)
    crossed = np.flatnonzero(side[tail] * side[head] < 0)
    first = crossed[crossed < twins[crossed]]
    at = np.clip(part[first], CUT_FROM_VERTEX, 1 - CUT_FROM_VERTEX)[:, None]
    new = vertices[tail[first]] * (1 - at) + vertices[head[first]] * at
    middle = np.full(len(tail), -1, np.int64)
    middle[first] = middle[twins[first]] = len(vertices) + np.arange(len(first))
    points = np.concatenate([vertices, new])
    parts = _split(points, faces, middle.reshape(-1, 3))
    return Cut(points, parts, _loops(parts, np.concatenate([side, np.zeros(len(new), np.int64)])))


def _crossing_part(a: Floats, b: Floats) -> Floats:
    """Where a level that goes from a to b is 0, as a part of the way."""
    part: Floats = np.divide(a, a - b, out=np.full(len(a), 0.5), where=a != b)
    return part


def _sides(faces: Ints, twins: Ints, level: Floats, part: Floats) -> Ints:
    """1 above, -1 below, 0 for vertices (V,) that the line goes through.

    The line may go through vertices that it comes close to where it then passes each just
    once, and neither branches nor ends; the others go back to their side.
    """
    tail, head = halfedge_ends(faces)
    sign = np.where(level >= 0, 1, -1)
    crossed = sign[tail] * sign[head] < 0
    near = np.zeros(len(level), bool)
    near[tail[crossed & (part < CUT_FROM_VERTEX)]] = True
    near[head[crossed & (part > 1 - CUT_FROM_VERTEX)]] = True
    while True:
        side = np.where(near, 0, sign)
        wrong = near & _branches(faces, twins, side)
        if not wrong.any():
            return side
        near &= ~wrong


def _branches(faces: Ints, twins: Ints, side: Ints) -> Bools:
    """Vertices (V,) on the line where other than no or two pieces of it meet.

    A face that lies in the line with all its corners counts as below.
    """
    tail, head = halfedge_ends(faces)
    opposite = faces[:, [2, 0, 1]].ravel()
    into_face = side[head] * side[opposite] < 0
    along_edge = (side[head] == 0) & ((side[opposite] > 0) != (side[opposite[twins]] > 0))
    pieces = np.bincount(tail[(side[tail] == 0) & (into_face | along_edge)], minlength=len(side))
    wrong: Bools = (pieces != 0) & (pieces != 2)
    return wrong


def _split(points: Floats, faces: Ints, middle: Ints) -> Ints:
    """Faces with those that have a vertex in the middle of one or two edges in parts.

    ``middle`` (F, 3) is that vertex for the edge from corner k to k + 1, or -1.
    """
    n_crossed = (middle >= 0).sum(1)
    one, two = np.flatnonzero(n_crossed == 1), np.flatnonzero(n_crossed == 2)
    k = middle[one].argmax(1)
    a, b, c = (faces[one, (k + i) % 3] for i in range(3))
    m = middle[one, k]
    halves = np.stack([np.stack([a, m, c], 1), np.stack([m, b, c], 1)], 1).reshape(-1, 3)
    k = (middle[two].argmin(1) + 2) % 3
    a, b, c = (faces[two, (k + i) % 3] for i in range(3))
    p, q = middle[two, k], middle[two, (k + 2) % 3]
    tips = np.stack([a, p, q], 1)
    rests = split_quads(points, np.stack([p, b, c, q], 1)).reshape(-1, 3)
    return np.concatenate([faces[n_crossed == 0], halves, tips, rests])


def _loops(faces: Ints, side: Ints) -> tuple[Ints, ...]:
    above = side[faces].sum(1) > 0
    twins = find_twins(faces, len(side))
    is_cut = np.repeat(above, 3) & ~above[twins // 3] & (twins != NO_TWIN)
    return tuple(border_loops(faces, np.where(is_cut, NO_TWIN, 0)))
