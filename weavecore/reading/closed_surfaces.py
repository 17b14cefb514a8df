"""Bisection of closed meshes: a closed surface has no border, so it is cut in two first (Yan et al. 2016, §4.1).

*Which plane.*  Planes across the principal axes of the surface, and across the lines between them, are tried at
several heights; the cut with the least ratio of its length to the area of its smaller side is taken.  That is
Cheeger's isoperimetric ratio: short and balanced at once.  A planar cut is smooth, may have several loops (a torus
gives two), and rotates with the surface.  Each plane costs O(faces that it crosses) after O(faces) for each axis.

*How.*  The mesh is split along the zero line of a function of its vertices, the *level*: their height over a plane,
say. An edge whose ends lie on both sides is *crossed*.  Where the line comes close to a vertex it is led through it,
else a new vertex is put on the crossed edge::

          + ────── +                + ────── +
           ╲      ╱ ╲                ╲      ╱ ╲
        ─ ─ ╲ ─ ─╱─ ─╲─ ─  ──▶        p────q───r        p, q, r: new vertices; p q and q r are edges of the cut
             ╲  ╱     ╲                ╲  ╱ ╲   ╲
              - ────── -                - ────── -

No vertex moves, so the shape stays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN, border_loops, find_twins, halfedge_ends
from weavecore.model import Note, SurfaceMesh
from weavecore.reading.polygon_triangulation import split_quads
from weavecore.reading.raw import Plane, counted
from weavecore.tolerances import CUT_FROM_VERTEX, LEAST_CUT_OFF

_SHARES = 0.5 + 0.04 * np.array([0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5])
"""Parts of the area below the planes that are tried, the balanced ones first: from 0.3 to 0.7, so that
both halves have room for rings."""

_ROWS = 256
"""Rows of a histogram of the area over the height: heights are good to 1/256 of the extent, the tried ones are 1/25
of the area apart."""

_MOST_NESTED = 4
"""How deep small regions may lie in one another (a speck in a speck …); each level takes two passes."""

_TOUCHING = 1e-9
"""A plane that has less than this part of the size on one side only touches the surface, as one in a flat face
does."""


_ALIKE = 0.01
"""Cuts whose ratios differ by less are alike, and the first is taken; so are principal axes with such moments.
Larger than the effect of meshing, so that the choice does not depend on it."""


def cut_closed_parts(surface: SurfaceMesh, *, plane: Optional[Plane] = None) -> SurfaceMesh:
    """Cut each closed component of a surface in two.

    Parameters
    ----------
    surface : SurfaceMesh
    plane : (point, normal), optional
        Cuts the closed components that lie on both sides of it.

    Returns
    -------
    SurfaceMesh
        The same one if no component is closed and no plane is given.

    Raises
    ------
    Degenerate
        Where the plane has no normal, or intersects no closed component.
    """
    heights = None if plane is None else _signed_distances(surface.vertices, plane)
    parts = _closed_parts(surface)
    if not parts:
        if plane is None:
            return surface
        unused = Note("UNUSED", "The cutting plane was not used: no part of the surface is closed.")
        return surface.with_notes((*surface.notes, unused))
    level, n_crossed = np.ones(surface.n_vertices), 0
    for faces in parts:
        used, local = np.unique(faces, return_inverse=True)
        if heights is not None and _is_crossed(heights[used], surface.size):
            level[used] = heights[used]
            n_crossed += 1
        else:
            level[used] = _balanced_level(surface.vertices[used], local.reshape(-1, 3))
    if heights is not None and n_crossed == 0:
        raise Degenerate("The plane intersects no closed part of the surface", remedy="Move or omit it.")
    cut = cut_along(surface.vertices, surface.faces, surface.twins, level)
    text = f"Cut {counted(len(parts), 'closed part')} in two along {counted(len(cut.loops), 'loop')}."
    note = Note("CUT", text, {"parts": len(parts), "loops": len(cut.loops)})
    return replace(surface, vertices=cut.vertices, faces=cut.faces, cuts=cut.loops, notes=(*surface.notes, note))


def _balanced_level(vertices: Floats, faces: Ints) -> Floats:
    """A function (V,) of the vertices of a closed connected mesh whose zero line is a short, balanced cut."""
    vertices = (vertices - vertices.mean(0)) / np.ptp(vertices, axis=0).max()
    corners = vertices[faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    axes = _candidate_axes(corners.mean(1), area)
    shifts, ratio = zip(*(_try_planes(vertices, faces, area, vertices @ axis) for axis in axes))
    is_best = np.concatenate(ratio) >= (1 - _ALIKE) * np.max(ratio)
    axis, share = divmod(int(np.argmax(is_best)), len(_SHARES))
    return _without_small_regions(faces, area, vertices @ axes[axis] - shifts[axis][share])


def _candidate_axes(vertices: Floats, weight: Floats) -> Floats:
    """Directions (9, 3) across which planes are tried: the principal axes, longest first, then their sums."""
    offset = vertices - np.average(vertices, axis=0, weights=weight)
    moment, axes = np.linalg.eigh((offset * weight[:, None]).T @ offset)
    axes = _canonical_axes(moment[::-1], axes[:, ::-1].T)
    sums = [axes[i] + sign * axes[j] for i, j in ((0, 1), (0, 2), (1, 2)) for sign in (1, -1)]
    return np.concatenate([axes, np.array(sums) / np.sqrt(2)])


def _canonical_axes(moment: Floats, axes: Floats) -> Floats:
    """Principal axes (3, 3) made unique: what the moments leave open is chosen as near to z, x or y as possible."""
    group = np.concatenate([[0], np.cumsum(moment[:-1] - moment[1:] > _ALIKE * moment[0])])
    canonical: list[Floats] = []
    for g in range(int(group[-1]) + 1):
        span = axes[group == g]
        left = span.T @ span
        for world in np.eye(3)[[2, 0, 1]]:
            near = left @ world
            length = float(np.linalg.norm(near))
            if length > 0.5:
                canonical.append(near / length)
                left = left - np.outer(canonical[-1], canonical[-1])
    return np.array(canonical)


def _try_planes(vertices: Floats, faces: Ints, area: Floats, height: Floats) -> tuple[Floats, Floats]:
    """Planes (S,) at heights that leave the tried shares of the area below them, and area over length (S,) of
    each.
    """
    a, b, c = (height[faces[:, k]] for k in range(3))
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    middle = a + b + c - low - high
    shifts = _heights_with_share_below(area, (a + b + c) / 3)
    ratio = np.empty(len(shifts))
    for k, shift in enumerate(shifts):
        crossed = np.flatnonzero((low < shift) & (high >= shift))
        length = _cut_length(vertices[faces[crossed]], height[faces[crossed]] - shift)
        share = area @ (high < shift) + area[crossed] @ _part_below(low[crossed], middle[crossed], high[crossed], shift)
        ratio[k] = min(share, area.sum() - share) / max(length, 1e-9)
    return shifts, ratio


def _heights_with_share_below(area: Floats, height: Floats) -> Floats:
    """Approximate heights (S,) below which the tried shares of the area lie."""
    low, extent = height.min(), np.ptp(height)
    row = ((height - low) * (_ROWS / max(extent, 1e-300))).astype(np.int64)
    held = np.bincount(row, area)
    at = np.bincount(row, area * height)[held > 0] / held[held > 0]
    below = (np.cumsum(held) - held / 2)[held > 0]
    heights: Floats = np.interp(_SHARES * area.sum(), below, at)
    return heights


def _part_below(low: Floats, middle: Floats, high: Floats, shift: float) -> Floats:
    """Which part of the area of triangles (F,) lies below a plane that crosses them."""
    depth = np.where(shift < middle, shift - low, high - shift)
    side = np.where(shift < middle, middle - low, high - middle)
    part = np.divide(depth * depth, side * (high - low), out=np.zeros_like(depth), where=side > 0)
    below: Floats = np.where(shift < middle, part, 1 - part)
    return below


def _cut_length(p: Floats, a: Floats) -> float:
    """Length of the line in which a plane cuts triangles (F, 3, 3) whose corners have heights (F, 3) over it."""
    q, b = np.roll(p, -1, axis=1), np.roll(a, -1, axis=1)
    way = (a >= 0) * 1.0 - (b >= 0)
    crossing = p + (q - p) * np.divide(a, a - b, out=np.zeros_like(a), where=a != b)[:, :, None]
    return float(np.linalg.norm((crossing * way[:, :, None]).sum(1), axis=1).sum())


def _without_small_regions(faces: Ints, area: Floats, level: Floats) -> Floats:
    """The level with regions below `LEAST_CUT_OFF` given to the other side, so that no small loop is cut."""
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
        is_small = size < LEAST_CUT_OFF * area.sum()
        if not is_small.any():
            break
        turned = is_small[region] & (above == (turn % 2 == 0))
        level[turned] = -1.0 if turn % 2 == 0 else 1.0
    return level


def _closed_parts(surface: SurfaceMesh) -> list[Ints]:
    """Faces (f, 3) of each connected component without a border."""
    part = surface.component_of_face
    is_open = np.zeros(int(part.max()) + 1, bool)
    is_open[part[np.flatnonzero(surface.twins == NO_TWIN) // 3]] = True
    order = np.argsort(part, kind="stable")
    offsets = offsets_of(np.bincount(part))
    return [surface.faces[order[offsets[k] : offsets[k + 1]]] for k in np.flatnonzero(~is_open)]


def _signed_distances(vertices: Floats, plane: Plane) -> Floats:
    point, normal = (np.asarray(one, np.float64).reshape(-1) for one in plane)
    if point.shape != (3,) or normal.shape != (3,) or not np.isfinite([point, normal]).all() or not normal.any():
        raise Degenerate(
            "The cutting plane is not a point and a direction", remedy="Give (point, normal), three numbers each."
        )
    normal = normal / np.abs(normal).max()
    heights: Floats = (vertices - point) @ (normal / np.linalg.norm(normal))
    return heights


def _is_crossed(heights: Floats, size: float) -> bool:
    """Whether there are vertices on both sides of the plane, which may lie in a flat face."""
    return bool(heights.min() < -_TOUCHING * size and heights.max() > _TOUCHING * size)


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
        Disjoint closed vertex loops, the positive side on their left.
    """

    vertices: Floats
    faces: Ints
    loops: tuple[Ints, ...]


def cut_along(vertices: Floats, faces: Ints, twins: Ints, level: Floats) -> Cut:
    """Split the faces along the zero line of a function of the vertices.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Oriented and manifold; the line crosses no border.
    twins : (3F,) int64
    level : (V,) float64
        Vertices of level 0 count as positive where the line cannot be led through them.

    Returns
    -------
    Cut
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
    vertices = np.concatenate([vertices, new])
    parts = _split(vertices, faces, middle.reshape(-1, 3))
    return Cut(vertices, parts, _loops(parts, np.concatenate([side, np.zeros(len(new), np.int64)])))


def _crossing_part(a: Floats, b: Floats) -> Floats:
    """Where a level that goes linearly from a to b is 0, as a part of the edge."""
    part: Floats = np.divide(a, a - b, out=np.full(len(a), 0.5), where=a != b)
    return part


def _sides(faces: Ints, twins: Ints, level: Floats, part: Floats) -> Ints:
    """1 for positive vertices (V,), -1 for negative ones, 0 for those that the line is led through.

    The line may pass through vertices close to it if it then passes each just once, and neither branches nor ends;
    the others return to their side.
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

    A face that lies in the line with all its corners counts as negative.
    """
    tail, head = halfedge_ends(faces)
    opposite = faces[:, [2, 0, 1]].ravel()
    into_face = side[head] * side[opposite] < 0
    along_edge = (side[head] == 0) & ((side[opposite] > 0) != (side[opposite[twins]] > 0))
    pieces = np.bincount(tail[(side[tail] == 0) & (into_face | along_edge)], minlength=len(side))
    wrong: Bools = (pieces != 0) & (pieces != 2)
    return wrong


def _split(vertices: Floats, faces: Ints, middle: Ints) -> Ints:
    """The faces, those with new vertices on one or two edges split.

    ``middle`` (F, 3) is the new vertex on the edge from corner k to k + 1, or -1.
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
    corner_parts = np.stack([a, p, q], 1)
    opposite_parts = split_quads(vertices, np.stack([p, b, c, q], 1)).reshape(-1, 3)
    return np.concatenate([faces[n_crossed == 0], halves, corner_parts, opposite_parts])


def _loops(faces: Ints, side: Ints) -> tuple[Ints, ...]:
    above = side[faces].sum(1) > 0
    twins = find_twins(faces, len(side))
    is_cut = np.repeat(above, 3) & ~above[twins // 3] & (twins != NO_TWIN)
    return tuple(border_loops(faces, np.where(is_cut, NO_TWIN, 0)))
