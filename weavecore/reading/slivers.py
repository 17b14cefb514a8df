"""Faces without area, taken out so that no crack opens.

A face with two corners in one place goes: its two other edges lie in the same place and
become one.  Three corners on a line are a *cap*: the middle one lies on the edge that
joins the other two.  To drop a cap would leave a slit there, with a neighbour that has one
edge on one side and a neighbour each for its two halves on the other.  So the cap is flipped:
the face beyond its long edge is split at the middle corner, and the cap is gone.
"""

from __future__ import annotations

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.reading.orientation import ALONE, find_mates

_MOST_ROUNDS = 200
_STEPS = 4


def drop_slivers(points: Floats, faces: Ints, place: Ints, ids: Ints) -> tuple[Ints, Ints, Ints, int]:
    """Faces (F, 3) that all have an area, their ids and places, and how many faces without area there were.

    A corner of a cap that is as near to another as the coordinates can tell is taken to be in its place.

    Raises
    ------
    Degenerate
        Where caps lie in such a tangle that flipping comes to no end, or nothing is left.
    """
    step = _STEPS * float(np.finfo(np.float64).eps) * float(np.abs(points[faces]).max(initial=0.0))
    is_cap = _find_caps(points, faces, step)
    place = _needle_welds(points, faces[is_cap], place, step)
    keep = _in_three_places(faces, place)
    n_dropped = int((~keep | is_cap).sum())
    faces, ids, is_cap = faces[keep], ids[keep], is_cap[keep]
    if is_cap.any():
        faces, ids = _flip_caps(points, faces, place, ids, _touching(faces, place, is_cap), step)
    if len(faces) == 0:
        raise Degenerate("No face has an area", remedy="Give a surface that has an area.")
    return faces, ids, place, n_dropped


def _in_three_places(faces: Ints, place: Ints) -> Bools:
    a, b, c = place[faces].T
    distinct: Bools = (a != b) & (b != c) & (c != a)
    return distinct


def _find_caps(points: Floats, faces: Ints, step: float) -> Bools:
    """Which faces (F,) are thinner than the coordinates can tell from a line."""
    onward = np.roll(points[faces], -1, axis=1) - points[faces]
    longest = np.linalg.norm(onward, axis=2).max(1)
    doubled_area = np.linalg.norm(np.cross(onward[:, 0], onward[:, 1]), axis=1)
    thin: Bools = doubled_area <= longest * step
    return thin


def _needle_welds(points: Floats, caps: Ints, place: Ints, step: float) -> Ints:
    """Places (V,) with the ends of edges of caps that are no longer than ``step`` made one."""
    onward = np.linalg.norm(np.roll(points[caps], -1, axis=1) - points[caps], axis=2)
    row, corner = np.nonzero(onward <= step)
    start, end = place[caps[row, corner]], place[caps[row, (corner + 1) % 3]]
    return _joined(place, start, end) if (start != end).any() else place


def _flip_caps(points: Floats, faces: Ints, place: Ints, ids: Ints, near: Bools, step: float) -> tuple[Ints, Ints]:
    """Faces and their ids without caps; ``near`` (F,) are those that a cap touches, and caps."""
    work, work_ids = faces[near], ids[near]
    for _ in range(_MOST_ROUNDS):
        caps = np.flatnonzero(_find_caps(points, work, step))
        if len(caps) == 0:
            return np.concatenate([faces[~near], work]), np.concatenate([ids[~near], work_ids])
        work, work_ids = _flip_round(points, work, place, work_ids, caps)
    raise Degenerate(
        "Faces without area that lie on each other in a tangle",
        remedy="Rebuild the mesh there.",
        ids=np.unique(work_ids[caps]).tolist(),
        kind="face",
    )


def _touching(faces: Ints, place: Ints, caps: Bools) -> Bools:
    """Faces (F,) with a corner in a place where a cap has one."""
    marked = np.zeros(len(place), bool)
    marked[place[faces[caps]]] = True
    a, b, c = marked[place[faces]].T
    touching: Bools = a | b | c
    return touching


def _flip_round(points: Floats, faces: Ints, place: Ints, ids: Ints, caps: Ints) -> tuple[Ints, Ints]:
    """Flip caps of which no two share a face; drop those with nothing beyond their long edge."""
    length = np.linalg.norm(np.roll(points[faces[caps]], -1, axis=1) - points[faces[caps]], axis=2)
    k = length.argmax(1)
    mate = find_mates(faces, place)[0][3 * caps + k]
    beyond = np.where(mate == ALONE, caps, mate // 3)
    rank = np.argsort(np.argsort(_scattered(caps), kind="stable"), kind="stable")
    best = np.full(len(faces), len(caps))
    np.minimum.at(best, caps, rank)
    np.minimum.at(best, beyond, rank)
    chosen = (best[caps] == rank) & (best[beyond] == rank)
    gone = np.zeros(len(faces), bool)
    gone[caps[chosen]] = gone[beyond[chosen]] = True
    flips = chosen & (mate != ALONE)
    made, made_ids = _split_beyond(faces, place, ids, caps[flips], k[flips], mate[flips])
    new = np.concatenate([faces[~gone], made])
    new_ids = np.concatenate([ids[~gone], made_ids])
    keep = _in_three_places(new, place)
    return new[keep], new_ids[keep]


def _split_beyond(faces: Ints, place: Ints, ids: Ints, caps: Ints, k: Ints, mate: Ints) -> tuple[Ints, Ints]:
    """The faces beyond the caps split at the caps' middle corners."""
    a, c, b = (faces[caps, (k + i) % 3] for i in range(3))
    other, j = mate // 3, mate % 3
    tail, apex = faces[other, j], faces[other, (j + 2) % 3]
    forward = place[tail] == place[a]
    start, end = np.where(forward, a, c), np.where(forward, c, a)
    made = np.stack([np.stack([start, b, apex], 1), np.stack([b, end, apex], 1)], 1).reshape(-1, 3)
    return made, np.repeat(ids[other], 2)


def _scattered(numbers: Ints) -> Ints:
    """A fixed shuffle, so that a long chain of caps is flipped in few rounds."""
    scattered: Ints = (numbers * 2654435761) % 4294967291
    return scattered


def _joined(place: Ints, start: Ints, end: Ints) -> Ints:
    """Places with each pair (start, end) made one: the least of all that hang together."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    n = len(place)
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(n, n))
    label = connected_components(links, directed=False)[1]
    _, least = np.unique(label, return_index=True)
    joined: Ints = least[label[place]]
    return joined
