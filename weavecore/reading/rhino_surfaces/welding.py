"""Patches welded by name into one mesh, without doubled edges."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.rhino_surfaces.patches import Patches, collapsed, split_edges

_MOST_SPLITS = 8


def welded(patches: Patches) -> tuple[Floats, Ints]:
    """Vertices and faces of one mesh: points of one name become one vertex, collapsed triangles go."""
    for _ in range(_MOST_SPLITS):
        doubled = _doubled_edges(patches)
        if len(doubled) == 0:
            break
        patches = split_edges(patches, doubled)
    turned = np.array([face.is_reversed for face in patches.surfaces])[patches.owner[patches.faces[:, 0]]]
    named = patches.names[patches.faces]
    named[turned] = named[turned][:, [0, 2, 1]]
    named = named[~collapsed(named)]
    used, faces = np.unique(named, return_inverse=True)
    place = np.zeros((int(patches.names.max()) + 1, 3))
    place[patches.names] = patches.points
    return place[used], faces.reshape(-1, 3)


def _doubled_edges(p: Patches) -> Ints:
    """Inner edges (K, 2) of patches that join two vertices which another edge joins as well.

    An edge inside one patch whose two ends lie on its border can be an edge of another patch too.
    """
    faces = p.faces[~collapsed(p.names[p.faces])]
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    local, times = np.unique(sides, axis=0, return_counts=True)
    named = np.sort(p.names[local], axis=1)
    _, group, joins = np.unique(named, axis=0, return_inverse=True, return_counts=True)
    total = np.bincount(group.ravel(), times)[group.ravel()]
    doubled: Ints = local[(times == 2) & ((joins[group.ravel()] > 1) | (total > 2))]
    return doubled
