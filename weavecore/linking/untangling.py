"""Untangling: the nodes of inverted faces move to between their neighbours.

Where a fold of the surface is narrow, smoothing for bending cannot turn an inverted face back: on the way there its
corners get sharper.  Halfway to the mean of the neighbours (Laplacian smoothing, Field 1988) they need not.  In
patterns whose nodes go anywhere on the surface most of these faces come right in a round or two.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.geometry.arrays import rows_of
from weavecore.linking.bending_terms import edge_of_sides
from weavecore.model.lattice import Lattice
from weavecore.model.lattice_fit import inverted_faces
from weavecore.polling import each

_MOST_ROUNDS = 4
"""Rounds in which nodes move: later ones turned no more faces back."""


def untangle(lattice: Lattice) -> Lattice:
    """The lattice with fewer inverted faces, where moving their nodes on the surface leaves fewer; else the same.

    Parameters
    ----------
    lattice : Lattice
        Of a pattern whose nodes leave the latitudes.  Nodes on borders stay.
    """
    best = lattice
    if len(inverted_faces(lattice)) == 0:
        return best
    on_border = np.zeros(lattice.n_nodes, bool)
    on_border[lattice.edges[edge_of_sides(lattice)[1]]] = True
    face = rows_of(lattice.face_offsets)
    ends, others = lattice.edges.ravel(), lattice.edges[:, ::-1].ravel()
    n_neighbours = np.maximum(np.bincount(ends, minlength=lattice.n_nodes), 1)
    for _ in each(range(_MOST_ROUNDS)):
        at = np.unique(lattice.face_nodes[np.isin(face, inverted_faces(lattice))])
        at = at[~on_border[at]]
        sums = [np.bincount(ends, column[others], lattice.n_nodes) / n_neighbours for column in lattice.nodes.T]
        nodes = lattice.nodes.copy()
        nodes[at] = lattice.latitudes.surface.face_finder.find((nodes[at] + np.stack(sums, axis=1)[at]) / 2)[1]
        lattice = replace(lattice, nodes=nodes)
        if len(inverted_faces(lattice)) < len(inverted_faces(best)):
            best = lattice
        if len(inverted_faces(best)) == 0:
            break
    return best
