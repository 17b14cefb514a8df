"""A SubD as a mesh of its limit surface: refined, sampled strip by strip, each vertex at its limit position.

rhino3dm refines a SubD and gives the limit position of each vertex.  All quads are refined alike; of the refinement
each *strip* keeps only as many divisions as it needs.  A strip is a row of quads side by side, each sharing two
opposite edges with its neighbours; all edges across it are divided alike, so that quads fit together without hanging
vertices::

    ┌───┬───┬───┐        a *grid* (Q, m + 1, m + 1) holds for every quad the vertices of the refinement
    │ · │ · │ · │ strip   that lie in it; dividing a strip n times is taking every (m / n)-th of its rows
    └───┴───┴───┘

Long quads are divided more often lengthwise, and bent ones more often than flat ones.  Then single triangles that
are too long or leave the surface are bisected at their longest edges, which keeps their angles from getting small
(Rivara 1984), at the vertex of the grid in the middle of the edge.  Linear in the quads of the refinement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.errors import Degenerate, NonFinite, TooMuchWork, Unreadable
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.reading.nurbs_mesher.meshed_object import MeshedObject
from weavecore.reading.nurbs_mesher.sizing import DEFAULT_FINENESS, Fineness
from weavecore.reading.polygon_triangulation import split_quads

_MOST_QUADS = 400_000
"""Quads of a refinement that was asked for by name; beyond, it is too much work."""

_USUAL_QUADS = 100_000
"""Quads of a refinement that was not asked for."""


_TOO_LONG = 1.3
"""Sides of quads longer than this in wanted lengths are divided: about √2, where halves are as far off as the
whole."""

_LONGEST_SIDE = _TOO_LONG * float(np.sqrt(2.0))
"""Longest side of a triangle in wanted lengths: the diagonal of a square that is not divided."""

_MOST_UNFIT = 0.25
"""A strip is divided if more than this part of its quads need it; single ones are bisected later."""

_QUANTILE = 0.995
"""Part of the quads that decide how far to refine: a few that are drawn out must not refine all the others."""


_LONG_QUAD = 0.5
"""A strip is divided where its quads are on average longer than wide by 2 to this power: 1.41 times."""

_MOST_ROUNDS = 40
"""Rounds of bisection; each halves the sides that are too long, and the grid has at most ten levels."""


_MOST_PASSES = 50
"""Passes that mark longest sides from triangle to triangle; chains of growing edges are short."""


_ALIKE = 1.0 - 1e-9
"""Sides whose lengths differ by less are equally long: rounding must not decide."""


_NEARLY_LONGEST = 0.8
"""Sides shorter than this in longest sides are not bisected: that makes needles."""


def mesh_subd(
    subd: Any,
    *,
    fineness: Fineness = DEFAULT_FINENESS,
    transform: Floats | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeshedObject:
    """Mesh the limit surface of a SubD.

    Parameters
    ----------
    subd : rhino3dm.SubD
    fineness : Fineness
        Unless an edge length or chord error is asked for, it is refined to 100,000 quads at most.
    transform : (4, 4) float64, optional
        Applied to it.
    progress : callable, optional
        Called with a fraction and a label; may raise to cancel.

    Returns
    -------
    MeshedObject

    Raises
    ------
    Degenerate, NonFinite, TooMuchWork, Unreadable
    """
    moved = np.eye(4) if transform is None else transform
    if subd.FaceCount == 0:
        raise Degenerate("The SubD has no faces", remedy="Give a surface that has an area.")
    points, base = _refined(subd, 1, moved, progress)
    strips = _strips_of(base)
    grid, cells, quads, level = base[:, [[0, 3], [1, 2]]], np.arange(len(base)).reshape(-1, 1, 1), base, 1
    steps = 1
    while steps:
        level += 1
        points, finer = _refined(subd, level, moved, progress)
        grid, cells = _finer_grid(grid, cells, quads, finer)
        quads = finer
        limits = fineness.limits(float(np.linalg.norm(np.ptp(points, axis=0))))
        division = _divide_strips(points[grid], strips, limits.edge, limits.chord)
        steps = _steps_to_go(division, len(quads), fineness)
    owner, places = _sampled_quads(grid, strips, division.times)
    split = split_quads(
        points[grid[owner[:, None], places[..., 0], places[..., 1]]].reshape(-1, 3), _counted(len(owner))
    )
    corners = places.reshape(-1, 2)[split].reshape(-1, 3, 2)
    faces, rise = _bisected(points, grid, np.repeat(owner, 2), corners, _LONGEST_SIDE * limits.edge, limits.chord)
    used, named = np.unique(faces, return_inverse=True)
    faces = named.reshape(-1, 3)
    if np.linalg.det(moved[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return MeshedObject(points[used], faces, _border_loops(subd), max(rise, division.rise_left))


def _steps_to_go(division: Division, n_quads: int, fineness: Fineness) -> int:
    """How many refinements are still wanted.

    Raises
    ------
    TooMuchWork
        Where what was asked for takes too many.
    """
    asked = max(
        division.steps_by_edge if fineness.edge_target else 0,
        division.steps_by_chord if fineness.chord else 0,
    )
    if asked and n_quads * 4**asked > _MOST_QUADS:
        raise TooMuchWork("The SubD would take too many faces", remedy="Give a longer edge target.")
    room = int(np.log(_USUAL_QUADS / n_quads) / np.log(4)) if n_quads < _USUAL_QUADS else 0
    return max(asked, min(max(division.steps_by_edge, division.steps_by_chord), room))


def _counted(n_quads: int) -> Ints:
    return np.arange(4 * n_quads).reshape(-1, 4)


def _refined(
    subd: Any, level: int, moved: Floats, progress: Callable[[float, str], None] | None
) -> tuple[Floats, Ints]:
    """Limit points and faces after so many refinements."""
    if progress is not None:
        progress(1 - 0.6 ** (level - 1), "Refining the SubD")
    refined = subd.Duplicate()
    refined.Subdivide(level)
    return _limit_quads(refined, moved)


def _limit_quads(subd: Any, moved: Floats) -> tuple[Floats, Ints]:
    """Limit points (V, 3) and faces (Q, 4): after one refinement all faces have four corners."""
    vertices = list(subd.Vertices)
    points = list(map(attrgetter("X", "Y", "Z"), [vertex.SurfacePoint for vertex in vertices]))
    limit_points = np.array(points, np.float64).reshape(-1, 3)
    if not np.isfinite(limit_points).all():
        raise NonFinite("Points of a SubD that are not finite", remedy="Repair the object in Rhino.")
    quads = _net_quads(subd)
    if quads is None or len(quads) == 0 or quads.min() < 0 or quads.max() >= len(vertices):
        index = {vertex.Id: k for k, vertex in enumerate(vertices)}
        quads = np.array([[index[face.Vertex(k).Id] for k in range(4)] for face in subd.Faces], np.int64)
    return limit_points @ moved[:3, :3].T + moved[:3, 3], quads


def _net_quads(subd: Any) -> Ints | None:
    """The faces from a mesh of the control net, which numbers vertices alike and is faster; else None."""
    import rhino3dm

    of_rhino: Any = rhino3dm
    if not isinstance(subd, of_rhino.SubD):
        return None
    mesh = of_rhino.Mesh.CreateFromSubDControlNet(subd, False)
    if mesh is None or len(mesh.Vertices) != len(subd.Vertices) or len(mesh.Faces) != len(subd.Faces):
        return None
    return np.array(list(mesh.Faces), np.int64).reshape(-1, 4)


def _border_loops(subd: Any) -> int:
    """Number of loops of the control net's edges that have one face."""
    root: dict[int, int] = {}

    def find(v: int) -> int:
        while root.setdefault(v, v) != v:
            root[v] = root[root[v]]
            v = root[v]
        return v

    for edge in subd.Edges:
        if edge.FaceCount == 1:
            root[find(edge.VertexId(0))] = find(edge.VertexId(1))
    return len({find(v) for v in list(root)})


def _finer_grid(grid: Ints, cells: Ints, quads: Ints, finer: Ints) -> tuple[Ints, Ints]:
    """The grid over a refinement that is finer by one step.

    Parameters
    ----------
    grid : (Q, m + 1, m + 1)
        Vertices of ``quads`` in each of the first quads; (0, 0), (m, 0), (m, m), (0, m) are its corners in order.
    cells : (Q, m, m)
        Which of ``quads`` lies in each cell.
    quads : (K, 4)
    finer : (4K, 4)
        The four quads of each, in the order of its corners.

    Returns
    -------
    grid (Q, 2m + 1, 2m + 1), cells (Q, 2m, 2m)
        Of ``finer``.

    Raises
    ------
    Unreadable
        Where ``finer`` is in another order.
    """
    corner, middle, centre = _children(quads, finer)
    turn = np.argmax(quads[cells] == grid[:, :-1, :-1, None], axis=3)
    n, m = len(grid), cells.shape[1]
    fine = np.full((n, 2 * m + 1, 2 * m + 1), -1)
    fine_cells = np.empty((n, 2 * m, 2 * m), np.int64)
    for k, (i, j) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        at = (turn + k) % 4
        fine_cells[:, i::2, j::2] = 4 * cells + at
        fine[:, 2 * i : 2 * m + 2 * i : 2, 2 * j : 2 * m + 2 * j : 2] = corner[cells, at]
    for k, (i, j) in enumerate(((1, 0), (2, 1), (1, 2), (0, 1))):
        fine[:, i : 2 * m + i : 2, j : 2 * m + j : 2] = middle[cells, (turn + k) % 4]
    fine[:, 1::2, 1::2] = centre[cells]
    return fine, fine_cells


def _children(quads: Ints, finer: Ints) -> tuple[Ints, Ints, Ints]:
    """Vertices of the finer quads at the corners (K, 4), in the middles of the sides (K, 4), at the centres (K,)."""
    children = finer.reshape(-1, 4, 4)
    if len(children) != len(quads):
        raise _not_arranged()
    shared = (children[:, 0, :, None, None] == children[:, None]).any(3).all(2)
    centre = children[np.arange(len(quads)), 0, np.argmax(shared, axis=1)]
    place = np.argmax(children == centre[:, None, None], axis=2)
    turned = np.take_along_axis(children, (place[..., None] + np.arange(4)) % 4, axis=2)
    # From the centre on: the middle of the side before the corner, the corner, the middle of the side after it.
    before, corner, after = turned[..., 1], turned[..., 2], turned[..., 3]
    name = np.full(int(quads.max()) + 1, -1)
    name[quads] = corner
    fits = shared.any(1).all() and (turned[..., 0] == centre[:, None]).all() and (name[quads] == corner).all()
    if not (fits and (np.roll(before, -1, axis=1) == after).all()):
        raise _not_arranged()
    return corner, after, centre


def _not_arranged() -> Unreadable:
    return Unreadable(
        "The refinement of a SubD does not follow its faces",
        remedy="Repair the object in Rhino (SelBadObjects), or turn it into a mesh there.",
    )


def _strips_of(quads: Ints) -> Ints:
    """The strip (Q, 2) that sides 0 and 2 of each quad lie across, and that of sides 1 and 3."""
    tail, head = quads, np.roll(quads, -1, axis=1)
    key = np.minimum(tail, head) * np.int64(quads.max() + 1) + np.maximum(tail, head)
    edges, side = np.unique(key, return_inverse=True)
    side = side.reshape(-1, 4)
    a, b = np.concatenate([side[:, 0], side[:, 1]]), np.concatenate([side[:, 2], side[:, 3]])
    links = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(edges), len(edges)))
    strip: Ints = np.asarray(connected_components(links, directed=False)[1], np.int64)[side[:, :2]]
    return strip


@dataclass(frozen=True, eq=False)
class Division:
    """How strips are divided.

    Attributes
    ----------
    times : (S,) int64
        Into how many parts each strip is divided, a power of two.
    rise_left : float
        How far the surface rises over the quads of the grid itself.
    steps_by_edge, steps_by_chord : int
        How many refinements of the grid more the longest edge and the chord error ask for.
    """

    times: Ints
    rise_left: float
    steps_by_edge: int
    steps_by_chord: int


def _divide_strips(points: Floats, strips: Ints, edge: float, chord: float) -> Division:
    """Divide each strip as often as it needs, and as the grid lets it be.

    Parameters
    ----------
    points : (Q, m + 1, m + 1, 3)
        Places of the grid.
    strips : (Q, 2)
    edge, chord : float
        Longest edge and greatest chord error that are wanted.
    """
    most, times = points.shape[1] - 1, np.ones(int(strips.max()) + 1, np.int64)
    count = np.maximum(np.bincount(strips.ravel(), minlength=len(times)), 1)
    while True:
        length, rise = _sides(points, times[strips])
        # Over a diagonal the surface rises as far as over both sides together, unless these bend against each other.
        bent = (rise.sum(1) > chord)[:, None] & (rise >= rise[:, ::-1])
        share = np.bincount(strips.ravel(), ((length > _TOO_LONG * edge) | bent).ravel(), len(times)) / count
        wanted = share > _MOST_UNFIT
        stretch = np.log2(np.maximum(length, 1e-300) / np.maximum(length[:, ::-1], 1e-300))
        wanted |= np.bincount(strips.ravel(), stretch.ravel(), len(times)) / count > _LONG_QUAD
        wanted &= times < most
        if not wanted.any():
            break
        times[wanted] *= 2
    length, rise = _sides(points, np.full_like(strips, most))
    by_edge = np.log2(max(float(np.quantile(length, _QUANTILE)), 1e-300) / (_TOO_LONG * edge))
    by_chord = np.log2(max(float(np.quantile(rise.sum(1), _QUANTILE)), 1e-300) / chord) / 2
    steps = [max(int(np.ceil(by - 1e-9)), 0) for by in (by_edge, by_chord)]
    return Division(times, float(rise.sum(1).max()), *steps)


def _sides(points: Floats, times: Ints) -> tuple[Floats, Floats]:
    """Mean length (Q, 2) of the parts of each quad's sides, both ways, and how far the surface rises over them."""
    most = points.shape[1] - 1
    length, rise = np.zeros(times.shape), np.zeros(times.shape)
    for way in (0, 1):
        along = np.moveaxis(points, 1 + way, 1)
        for n in np.unique(times[:, way]).tolist():
            which = times[:, way] == n
            row = along[which][:, :: most // n]
            parts = np.linalg.norm(np.diff(row, axis=1), axis=3)
            length[which, way] = parts.mean((1, 2))
            rise[which, way] = _rise(along[which], n)
    return length, rise


def _rise(along: Floats, n: int) -> Floats:
    """The greatest distance between the middles of parts and the surface; a quarter of that of parts twice as
    long.
    """
    most = along.shape[1] - 1
    share = 1.0
    if n == most:
        n, share = n // 2, 0.25
    step = most // n
    ends, middle = along[:, ::step], along[:, step // 2 :: step]
    off = middle - (ends[:, 1:] + ends[:, :-1]) / 2
    chord = ends[:, 1:] - ends[:, :-1]
    along_it = np.einsum("...x,...x->...", off, chord) / np.maximum(np.einsum("...x,...x->...", chord, chord), 1e-300)
    apart = np.linalg.norm(off - along_it[..., None] * chord, axis=-1)
    rise: Floats = share * apart.max((1, 2))
    return rise


def _sampled_quads(grid: Ints, strips: Ints, times: Ints) -> tuple[Ints, Ints]:
    """The quads that are left of a grid where each strip is divided so many times.

    Returns
    -------
    owner (K,), places (K, 4, 2)
        The first quad in which each lies, and the grid indices of its corners.
    """
    most, owners, places = grid.shape[1] - 1, [], []
    both = times[strips]
    for pair in np.unique(both, axis=0).tolist():
        which = np.flatnonzero((both == pair).all(1))
        i, j = np.meshgrid(*(np.arange(n) * (most // n) for n in pair), indexing="ij")
        step = np.array([most // n for n in pair])
        low = np.column_stack([i.ravel(), j.ravel()])
        corners = low[:, None] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * step
        owners.append(np.repeat(which, len(corners)))
        places.append(np.tile(corners, (len(which), 1, 1)))
    return np.concatenate(owners), np.concatenate(places)


@dataclass(frozen=True, eq=False)
class _Sides:
    """The sides (F, 3) of triangles: which edge each is, its length, its middle in the grid or -1, its rise."""

    edge: Ints
    length: Floats
    middle: Ints
    rise: Floats


def _bisected(points: Floats, grid: Ints, owner: Ints, places: Ints, edge: float, chord: float) -> tuple[Ints, float]:
    """Triangles bisected until none is too long or too far from the surface, as far as the grid allows.

    Parameters
    ----------
    points : (V, 3)
    grid : (Q, m + 1, m + 1)
        Vertices by quad and place.
    owner : (F,)
        The quad in which each triangle lies.
    places : (F, 3, 2)
        Grid indices of its corners.
    edge, chord : float
        Longest edge and greatest chord error that are wanted.

    Returns
    -------
    faces : (T, 3)
        Vertices of the triangles.
    rise : float
        How far the surface still rises over an edge.
    """
    for _ in range(_MOST_ROUNDS):
        sides = _measured(points, grid, owner, places)
        marked = _with_longest(sides, (sides.middle >= 0) & ((sides.length > edge) | (sides.rise > chord)))
        chosen = _sides_to_bisect(sides, marked)
        if not chosen.any():
            break
        owner, places = _bisect_sides(owner, places, chosen)
    faces: Ints = grid[owner[:, None], places[..., 0], places[..., 1]]
    return faces, float(sides.rise.max())


def _measured(points: Floats, grid: Ints, owner: Ints, places: Ints) -> _Sides:
    faces = grid[owner[:, None], places[..., 0], places[..., 1]]
    onward = np.roll(faces, -1, axis=1)
    key = np.minimum(faces, onward) * np.int64(len(points)) + np.maximum(faces, onward)
    edge = np.unique(key, return_inverse=True)[1].reshape(-1, 3)
    total = places + np.roll(places, -1, axis=1)
    is_in_grid = (total % 2 == 0).all(2)
    half = total // 2
    middle = np.where(is_in_grid, grid[owner[:, None], half[..., 0], half[..., 1]], -1)
    along = points[onward] - points[faces]
    length = np.linalg.norm(along, axis=2)
    off = points[middle] - points[faces]
    part = np.einsum("fkx,fkx->fk", off, along) / np.maximum(length, 1e-300) ** 2
    rise = np.linalg.norm(off - part[..., None] * along, axis=2)
    return _Sides(edge, length, middle, np.where(is_in_grid, rise, 0.0))


def _with_longest(sides: _Sides, marked: Bools) -> Bools:
    """Edges marked, with the longest that can be halved of every triangle that has a marked one; by side (F, 3)."""
    # Bisecting a short side makes a needle.
    can = (sides.middle >= 0) & (sides.length >= _NEARLY_LONGEST * sides.length.max(1, keepdims=True))
    length = np.where(can, sides.length, 0.0)
    longest = can & (length >= _ALIKE * length.max(1, keepdims=True))
    is_marked = np.zeros(int(sides.edge.max()) + 1, bool)
    is_marked[sides.edge[marked]] = True
    for _ in range(_MOST_PASSES):
        count = is_marked.sum()
        touched = is_marked[sides.edge].any(1)
        lacks = touched & ~(longest & is_marked[sides.edge]).any(1)
        first = np.argmax(longest[lacks], axis=1)
        is_marked[sides.edge[lacks][np.arange(len(first)), first][longest[lacks].any(1)]] = True
        if is_marked.sum() == count:
            break
    marked_again: Bools = is_marked[sides.edge] & can
    return marked_again


def _sides_to_bisect(sides: _Sides, marked: Bools) -> Bools:
    """At most one side (F, 3) of each triangle: its longest marked one, if it is so for both of its triangles."""
    # Ties fall to the edge with the least number, in both triangles alike.
    rank = np.lexsort((sides.edge.ravel(), -sides.length.ravel()))
    order = np.empty(len(rank), np.int64)
    order[rank] = np.arange(len(rank))
    best = np.full(int(sides.edge.max()) + 1, len(rank))
    np.minimum.at(best, sides.edge.ravel(), order)
    place = np.where(marked, best[sides.edge], len(rank))
    first = marked & (place == place.min(1, keepdims=True))
    n_faces = np.bincount(sides.edge.ravel())
    ready = np.bincount(sides.edge.ravel(), first.ravel(), len(n_faces)) == n_faces
    chosen: Bools = first & ready[sides.edge]
    return chosen


def _bisect_sides(owner: Ints, places: Ints, chosen: Bools) -> tuple[Ints, Ints]:
    face, k = np.nonzero(chosen)
    a, b, c = (places[face, (k + i) % 3] for i in range(3))
    middle = (a + b) // 2
    places = places.copy()
    places[face] = np.stack([a, middle, c], axis=1)
    return np.concatenate([owner, owner[face]]), np.concatenate([places, np.stack([middle, b, c], axis=1)])
