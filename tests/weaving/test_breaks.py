from __future__ import annotations

import numpy as np

from weavecore.model.lattice import LATITUDINAL, LONGITUDINAL
from weavecore.model.strands import Strands
from weavecore.weaving.breaks import break_strands, find_breaks
from weavecore.weaving.strands import families_along
from woven_tube import tube_lattice, tube_strands


def strands_of(*rows: list[int], closed: tuple[bool, ...]) -> Strands:
    offsets = np.r_[0, np.cumsum([len(row) for row in rows])]
    family = np.where(closed, LATITUDINAL, LONGITUDINAL)
    return Strands(offsets, np.concatenate(rows), family, np.array(closed))


def edges_of(strands: Strands) -> set[tuple[int, int]]:
    found = set()
    for s in range(len(strands)):
        path = strands.strand(s).tolist()
        path += path[:1] * bool(strands.closed[s])
        found |= {tuple(sorted(edge)) for edge in zip(path, path[1:])}
    return found


def test_a_ring_broken_once_runs_around_and_past_itself() -> None:
    ring = strands_of([4, 5, 6, 7, 8, 9], closed=(True,))
    broken = break_strands(ring, np.arange(6) == 2)
    assert broken.strand(0).tolist() == [6, 7, 8, 9, 4, 5, 6]
    assert broken.closed.tolist() == [False]
    assert edges_of(broken) == edges_of(ring)


def test_both_pieces_of_a_broken_rod_pass_the_node_of_the_break() -> None:
    rod = strands_of(list(range(9)), [20, 21, 22], closed=(False, False))
    broken = break_strands(rod, np.isin(np.arange(12), [4]))
    assert [broken.strand(s).tolist() for s in range(3)] == [[0, 1, 2, 3, 4], [4, 5, 6, 7, 8], [20, 21, 22]]
    assert edges_of(broken) == edges_of(rod)


def test_neighbouring_sharp_places_are_one_break_at_the_sharpest() -> None:
    rod = strands_of(list(range(12)), closed=(False,))
    largest = np.full(12, 5.0)
    largest[[5, 6, 7]] = 0.8, 0.5, 0.9
    assert np.flatnonzero(find_breaks(rod, largest, np.ones(1))).tolist() == [6]
    assert not find_breaks(rod, largest, np.full(1, 0.4)).any()


def test_no_piece_is_left_with_fewer_than_four_joints() -> None:
    rng = np.random.default_rng(5)
    for n in range(4, 40):
        rod = strands_of(list(range(n)), closed=(bool(n % 2),))
        pieces = break_strands(rod, find_breaks(rod, rng.uniform(0.2, 1.2, n), np.ones(1)))
        assert np.diff(pieces.offsets).min() >= 4


def test_a_piece_along_a_ring_alone_is_latitudinal() -> None:
    lattice, strands = tube_lattice(), tube_strands()
    ring = next(strands.strand(s) for s in range(len(strands)) if strands.closed[s]).tolist()
    link = next(edge for edge, family in zip(lattice.edges.tolist(), lattice.edge_family) if family == LONGITUDINAL)
    on_ring = next(k for k in (0, 1) if lattice.node_latitude[link[k]] == lattice.node_latitude[ring[0]])
    turned = np.roll(ring, 3 - ring.index(link[on_ring])).tolist()
    rod = strands_of([*turned[:4], link[1 - on_ring]], closed=(False,))
    pieces = break_strands(rod, np.arange(5) == 3)
    assert families_along(rod, lattice).tolist() == [LONGITUDINAL]
    assert families_along(pieces, lattice).tolist() == [LATITUDINAL, LONGITUDINAL]
