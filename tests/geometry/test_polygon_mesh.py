"""The edge between two nodes is found from either end."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.polygon_mesh import edges_between


def test_edges_are_found_from_either_end_in_any_order() -> None:
    edges = np.array([[2, 5], [0, 3], [1, 5], [0, 1]])
    one, other = np.array([[5, 3], [1, 5]]), np.array([[2, 0], [0, 1]])
    assert edges_between(edges, one, other).tolist() == [[0, 1], [3, 2]]
