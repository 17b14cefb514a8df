"""What must hold of `Strands`: every edge of the lattice lies in exactly one, and rings keep to themselves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import next_in_loop, rows_of
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.strands import Strands
from weavecore.validating.report import Finding, count


def check_strands(strands: Strands, lattice: Lattice) -> Iterator[Finding]:
    """All findings about strands and the lattice whose edges they part among them."""
    counts = np.diff(strands.offsets)
    yield count("strands_too_short", np.flatnonzero(counts < np.where(strands.closed, 3, 2)), "strand")
    owner = rows_of(strands.offsets)
    after = next_in_loop(strands.offsets)
    # An open strand has no step from its last node back to its first.
    step = np.flatnonzero(strands.closed[owner] | (after > np.arange(len(owner))))
    a, b, n = strands.nodes[step], strands.nodes[after[step]], lattice.n_nodes
    keys = lattice.edges @ (n, 1)
    order = np.argsort(keys, kind="stable")
    wanted = np.minimum(a, b) * n + np.maximum(a, b)
    at = np.minimum(np.searchsorted(keys, wanted, sorter=order), len(keys) - 1)
    edge = order[at]
    known = keys[edge] == wanted
    yield count("strands_off_edges", owner[step[~known]], "strand")
    edge, strand = edge[known], owner[step[known]]
    times = np.bincount(edge, minlength=lattice.n_edges)
    yield count("edges_not_in_one_strand", np.flatnonzero(times != 1), "edge")
    # A longitude may go on through a pocket; a ring keeps to itself.
    family = lattice.edge_family[edge]
    mixed = (family < strands.family[strand]) | ((strands.family[strand] == LATITUDINAL) & (family != LATITUDINAL))
    yield count("strands_of_mixed_families", strand[mixed], "strand")
