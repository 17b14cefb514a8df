"""Faces without area, removed so that no crack opens.

A *needle* has two corners in one place: it is dropped, and its two other edges become one.  A *cap* has three
different corners on a line, the middle one b on the edge that joins the other two.  Dropping it would leave a slit
between the face across its long edge and the two faces on its short ones, so the long edge is flipped: the face
across it is split at b, and the cap is gone (Botsch and Kobbelt 2001, "A robust procedure to eliminate degenerate
faces")::

    a ────── b ────── c              a ────── b ────── c
     ╲_______________╱  cap           ╲      ╱ ╲      ╱
      ╲             ╱        ──▶       ╲    ╱   ╲    ╱
       ╲           ╱                    ╲  ╱     ╲  ╱
        ── apex ───                      ── apex ──

Each round flips caps of which no two share a face; O(n log n) a round.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.reading.orientation import NO_PARTNER, pair_edges

_MOST_ROUNDS = 200
"""Rounds of flips.  A chain of caps in one face takes about the logarithm of its length; 200 are reached only where
caps overlap in a cycle."""

_STEPS = 4
"""How many rounding steps of the largest coordinate the height of a face may have and still count as none: the four
operations of a cross product each lose up to one."""


def drop_slivers(vertices: Floats, faces: Ints, weld: Ints, ids: Ints) -> tuple[Ints, Ints, Ints, int]:
    """Remove the faces without area.

    Corners of a cap that are as near to each other as the coordinates resolve are taken to be in one place.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    weld : (V,) int64
        The least vertex in the same place as each vertex.
    ids : (F,) int64
        How errors number the faces.

    Returns
    -------
    faces : (G, 3) int64
        Those left and those that were split, all with an area.
    ids : (G,) int64
        The ids of the faces that they come from.
    weld : (V,) int64
    n_dropped : int
        How many faces without area there were.

    Raises
    ------
    Degenerate
        Where flipping does not end, or no face is left.
    """
    step = _STEPS * float(np.finfo(np.float64).eps) * float(np.abs(vertices[faces]).max(initial=0.0))
    is_cap = _find_caps(vertices, faces, step)
    weld = _weld_needles(vertices, faces[is_cap], weld, step)
    keep = has_three_places(faces, weld)
    n_dropped = int((~keep | is_cap).sum())
    faces, ids, is_cap = faces[keep], ids[keep], is_cap[keep]
    if is_cap.any():
        faces, ids = _flip_caps(vertices, faces, weld, ids, _touch_caps(faces, weld, is_cap), step)
    if len(faces) == 0:
        raise Degenerate("No face has an area", remedy="Give a surface that has an area.")
    return faces, ids, weld, n_dropped


def has_three_places(faces: Ints, weld: Ints) -> Bools:
    """Whether the corners of each face are in three places.

    Parameters
    ----------
    faces : (F, 3) int64
    weld : (V,) int64

    Returns
    -------
    (F,) bool
    """
    a, b, c = weld[faces].T
    distinct: Bools = (a != b) & (b != c) & (c != a)
    return distinct


def _find_caps(vertices: Floats, faces: Ints, step: float) -> Bools:
    """Which faces (F,) are thinner than the rounding of the coordinates."""
    onward = np.roll(vertices[faces], -1, axis=1) - vertices[faces]
    longest = np.linalg.norm(onward, axis=2).max(1)
    doubled_area = np.linalg.norm(np.cross(onward[:, 0], onward[:, 1]), axis=1)
    thin: Bools = doubled_area <= longest * step
    return thin


def _weld_needles(vertices: Floats, caps: Ints, weld: Ints, step: float) -> Ints:
    """The weld map (V,) with the two ends of each edge of a cap that is no longer than ``step`` made one."""
    onward = np.linalg.norm(np.roll(vertices[caps], -1, axis=1) - vertices[caps], axis=2)
    row, corner = np.nonzero(onward <= step)
    start, end = weld[caps[row, corner]], weld[caps[row, (corner + 1) % 3]]
    return _merged(weld, start, end) if (start != end).any() else weld


def _flip_caps(vertices: Floats, faces: Ints, weld: Ints, ids: Ints, nearby: Bools, step: float) -> tuple[Ints, Ints]:
    """Faces and their ids without caps; ``nearby`` (F,) are the caps and the faces that touch one."""
    work, work_ids = faces[nearby], ids[nearby]
    for _ in range(_MOST_ROUNDS):
        caps = np.flatnonzero(_find_caps(vertices, work, step))
        if len(caps) == 0:
            return np.concatenate([faces[~nearby], work]), np.concatenate([ids[~nearby], work_ids])
        work, work_ids = _flip_round(vertices, work, weld, work_ids, caps)
    raise Degenerate(
        "Faces without area that overlap each other",
        remedy="Rebuild the mesh there.",
        ids=np.unique(work_ids[caps]).tolist(),
        kind="face",
    )


def _touch_caps(faces: Ints, weld: Ints, caps: Bools) -> Bools:
    """Faces (F,) with a corner in the place of a corner of a cap."""
    marked = np.zeros(len(weld), bool)
    marked[weld[faces[caps]]] = True
    a, b, c = marked[weld[faces]].T
    touching: Bools = a | b | c
    return touching


def _flip_round(vertices: Floats, faces: Ints, weld: Ints, ids: Ints, caps: Ints) -> tuple[Ints, Ints]:
    """Flip caps of which no two share a face; drop those with no face across their long edge."""
    length = np.linalg.norm(np.roll(vertices[faces[caps]], -1, axis=1) - vertices[faces[caps]], axis=2)
    k = length.argmax(1)
    partner = pair_edges(faces, weld)[0][3 * caps + k]
    across = np.where(partner == NO_PARTNER, caps, partner // 3)
    rank = np.argsort(np.argsort(_shuffled(caps), kind="stable"), kind="stable")
    best = np.full(len(faces), len(caps))
    np.minimum.at(best, caps, rank)
    np.minimum.at(best, across, rank)
    chosen = (best[caps] == rank) & (best[across] == rank)
    gone = np.zeros(len(faces), bool)
    gone[caps[chosen]] = gone[across[chosen]] = True
    flips = chosen & (partner != NO_PARTNER)
    made, made_ids = _split_across(faces, weld, ids, caps[flips], k[flips], partner[flips])
    new = np.concatenate([faces[~gone], made])
    new_ids = np.concatenate([ids[~gone], made_ids])
    keep = has_three_places(new, weld)
    return new[keep], new_ids[keep]


def _split_across(faces: Ints, weld: Ints, ids: Ints, caps: Ints, k: Ints, partner: Ints) -> tuple[Ints, Ints]:
    """The faces across the long edges of caps, split at the caps' middle corners."""
    a, c, b = (faces[caps, (k + i) % 3] for i in range(3))
    other, j = partner // 3, partner % 3
    tail, apex = faces[other, j], faces[other, (j + 2) % 3]
    forward = weld[tail] == weld[a]
    start, end = np.where(forward, a, c), np.where(forward, c, a)
    made = np.stack([np.stack([start, b, apex], 1), np.stack([b, end, apex], 1)], 1).reshape(-1, 3)
    return made, np.repeat(ids[other], 2)


def _shuffled(numbers: Ints) -> Ints:
    """The numbers permuted in a fixed way, so that a long chain of caps is flipped in few rounds."""
    shuffled: Ints = (numbers * 2654435761) % 4294967291
    return shuffled


def _merged(weld: Ints, start: Ints, end: Ints) -> Ints:
    """The weld map with each pair (start, end) made one: the least vertex of each connected set."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(weld)
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(n, n))
    label = connected_components(links, directed=False)[1]
    _, least = np.unique(label, return_index=True)
    merged: Ints = least[label[weld]]
    return merged
