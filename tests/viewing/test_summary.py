"""Results in a few lines of text."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from weavecore.model import Note
from weavecore.viewing.summary import describe_latitudes, describe_lattice, describe_surface, regular_share
from woven_tube import COLUMNS, tube_latitudes, tube_lattice, tube_strands, tube_surface


def test_the_figures_are_those_of_the_result() -> None:
    surface = replace(tube_surface(), name="Tube", notes=(Note("WELDED", "Welded 2 vertices."),))
    assert describe_surface(surface) == [
        ("surface", "Tube: 48 faces, 2 borders"),
        ("note", "WELDED: Welded 2 vertices."),
    ]
    lines = dict(describe_latitudes(tube_latitudes()))
    assert lines["spacing"] == "1 m"
    assert lines["latitudes"].startswith("6 polylines in 3 generations, ")
    lines = dict(describe_lattice(tube_lattice(), tube_strands()))
    assert lines["nodes"] == "72 nodes, 100% of the inner ones with 6 edges"
    assert lines["strands"] == f"{len(tube_strands())}"


def test_regular_nodes_are_counted_inside_alone() -> None:
    lattice = tube_lattice()
    assert regular_share(lattice) == 1.0
    flipped = np.array(lattice.edges)
    # An edge less at two inner nodes, as after a flip of a diagonal.
    inner = np.flatnonzero((flipped >= 2 * COLUMNS).all(axis=1))[0]
    fewer = replace(lattice, edges=np.delete(flipped, inner, axis=0), edge_family=np.delete(lattice.edge_family, inner))
    assert regular_share(fewer) == pytest.approx(1 - 2 / (4 * COLUMNS))
    assert regular_share(replace(lattice, pattern="something new")) is None
