"""How far a mesh lies from the surface that it stands for."""

from __future__ import annotations

import numpy as np

from weavecore.geometry.arrays import Bools, Floats
from weavecore.geometry.nurbs import surface_jet, surface_points
from weavecore.reading.rhino_surfaces.patches import Patches
from weavecore.reading.rhino_surfaces.shape import NO_EDGE


def chord_error(patches: Patches) -> float:
    """The greatest distance between triangles and surface, measured in their middles and those of their edges.

    It is measured along the surface's normal, at the mean of the corners' parameters.  Triangles at
    a side that is a single point are left out: their parameters say nothing.
    """
    weights = np.array([[1, 1, 1], [1.5, 1.5, 0], [0, 1.5, 1.5], [1.5, 0, 1.5]]) / 3
    worst = 0.0
    whole = ~_at_singular(patches)
    owner = patches.owner[patches.faces[:, 0]]
    for i, face in enumerate(patches.surfaces):
        corners = patches.faces[(owner == i) & whole]
        if len(corners) == 0:
            continue
        uv = np.einsum("kc,fcx->kfx", weights, patches.uv[corners]).reshape(-1, 2)
        flat = np.einsum("kc,fcx->kfx", weights, patches.points[corners]).reshape(-1, 3)
        jet = surface_jet(face.surface, uv)
        normal = np.cross(jet.du, jet.dv)
        length = np.linalg.norm(normal, axis=1)
        rise = np.abs(np.einsum("ij,ij->i", jet.point - flat, normal)) / np.maximum(length, 1e-300)
        worst = max(worst, float(rise.max()))
    return worst


def _at_singular(patches: Patches) -> Bools:
    """Faces with a corner whose vertex has several places in the plane of one face, at a singular side."""
    singular = np.zeros(int(patches.names.max()) + 1, bool)
    for face in patches.surfaces:
        for trim in (t for loop in face.loops for t in loop if t.edge == NO_EDGE):
            singular[trim.vertices[0]] = True
    at: Bools = np.any(singular[patches.names[patches.faces]], axis=1)
    return at


def border_gap(patches: Patches) -> tuple[float, int]:
    """How far the edges lie from the faces that they bound, at the mesh's vertices, and the face where most."""
    worst, where = 0.0, 0
    along = _border_directions(patches)
    for i, face in enumerate(patches.surfaces):
        border = np.flatnonzero((patches.owner == i) & ~patches.inner)
        lifted = surface_points(face.surface, patches.uv[border])
        apart = lifted - patches.points[border]
        # A vertex may be a little further along the trim than along the edge: that is no gap.
        apart -= np.einsum("ij,ij->i", apart, along[border])[:, None] * along[border]
        gap = float(np.linalg.norm(apart, axis=1).max(initial=0.0))
        if gap > worst:
            worst, where = gap, i
    return worst, where


def _border_directions(patches: Patches) -> Floats:
    """Unit vectors (N, 3) along the border at the border's points; zero elsewhere."""
    tail, head = patches.faces.ravel(), patches.faces[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head) * np.int64(len(patches.uv)) + np.maximum(tail, head)
    _, index, times = np.unique(key, return_index=True, return_counts=True)
    a, b = tail[index[times == 1]], head[index[times == 1]]
    along = np.zeros_like(patches.points)
    step = patches.points[b] - patches.points[a]
    np.add.at(along, a, step)
    np.add.at(along, b, step)
    directions: Floats = along / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    return directions
