"""Rings too small to be bent: which are left out, and that the lattice stays whole without them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import weavecore as wc
from bound_rings import hemisphere
from weavecore.linking.small_rings import FEWEST_EDGES, leave_out_small_rings
from weavecore.model import Latitudes, SurfaceMesh
from weavecore.validating import validate

SPACING = 0.2


@cache
def dome() -> Latitudes:
    return wc.offset(SurfaceMesh(*hemisphere()), spacing=SPACING)


def test_only_rings_with_too_few_edges_are_left_out() -> None:
    kept = leave_out_small_rings(dome(), SPACING)
    edges = dome().polylines.lengths / SPACING
    assert 0 < len(kept.latitudes) < len(dome())
    assert edges[kept.polyline].min() >= FEWEST_EDGES
    assert np.delete(edges, kept.polyline).max() < FEWEST_EDGES


def test_borders_and_all_but_two_rings_around_a_pocket_are_kept() -> None:
    kept = leave_out_small_rings(dome(), 1000.0)
    assert kept.polyline.tolist() == list(range(len(dome()) - 2))
    few = wc.offset(SurfaceMesh(*hemisphere()), spacing=0.7)
    assert leave_out_small_rings(few, 1000.0).latitudes.generation.tolist() == [0]


def test_the_bands_beside_a_ring_become_one() -> None:
    kept = leave_out_small_rings(dome(), SPACING).latitudes
    n_out = len(dome()) - len(kept)
    assert len(kept.bands) == len(dome().bands) - n_out
    assert kept.bands.euler.sum() == dome().bands.euler.sum()
    assert kept.bands.depth.max() == dome().bands.depth.max()
    last = kept.bands.offsets[:-1][np.diff(kept.bands.offsets) == 1]
    assert kept.bands.is_parent[last].all()


@pytest.mark.parametrize("pattern", ["triangular", "plain", "twill"])
def test_no_ring_of_the_lattice_is_too_small_to_be_bent(pattern: str) -> None:
    lattice = wc.link(dome(), pattern=pattern)
    assert validate(lattice).holds
    weave = wc.weave(lattice)
    counts = np.diff(weave.strands.offsets)[weave.strands.closed]
    assert counts.min() >= FEWEST_EDGES
    assert np.bincount(weave.joints.strand).min() > 3


def test_kagome_keeps_nodes_on_the_smallest_ring() -> None:
    lattice = wc.link(dome(), pattern="kagome")
    assert lattice.node_latitude.max() == len(dome()) - 1
