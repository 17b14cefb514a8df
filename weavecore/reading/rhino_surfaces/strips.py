"""Quads of a refined SubD, sampled as densely as each strip of them needs.

A *strip* is a row of quads side by side, each sharing two opposite edges with its neighbours.  All edges across a
strip are divided alike, so that quads fit together without hanging vertices, and still long quads are divided
more often the long way and bent ones more often than flat ones.

Dividing is picking: a *grid* holds, for every quad, the vertices of a finer refinement that lie in it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.errors import Unreadable
from weavecore.geometry.arrays import Floats, Ints

_TOO_LONG = 1.3
LONGEST_SIDE = _TOO_LONG * float(np.sqrt(2.0))
"""How long a side of a triangle may be, in edges that are wanted: the diagonal of a square that is not divided."""

_MOST_UNFIT = 0.25
"""A strip is divided where more of its quads than this need it; single ones are divided by themselves."""

_MOST = 0.995
_LONG_QUAD = 0.5
"""A strip is divided where its quads are longer than wide by this power of two: 1.41 times."""


def finer_grid(grid: Ints, cells: Ints, quads: Ints, finer: Ints) -> tuple[Ints, Ints]:
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
        Where ``finer`` is not so arranged.
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
        "A SubD is not refined face by face, as it would be were it whole",
        remedy="Repair the object in Rhino (SelBadObjects), or turn it into a mesh there.",
    )


def strips_of(quads: Ints) -> Ints:
    """The strip (Q, 2) that the sides 0 and 2 of each quad lie across, and that of the sides 1 and 3."""
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


def divide_strips(points: Floats, strips: Ints, edge: float, chord: float) -> Division:
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
    # A few quads that are drawn out must not refine all the others.
    by_edge = np.log2(max(float(np.quantile(length, _MOST)), 1e-300) / (_TOO_LONG * edge))
    by_chord = np.log2(max(float(np.quantile(rise.sum(1), _MOST)), 1e-300) / chord) / 2
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
    """The greatest distance between the middles of parts and the surface; a quarter of that of parts twice as long."""
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


def picked_quads(grid: Ints, strips: Ints, times: Ints) -> tuple[Ints, Ints]:
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
