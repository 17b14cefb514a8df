"""Making a surface minimal: no mean curvature, the border held."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import spsolve

from remesh import Array, Edges, Index, face_normals


def mean_curvature(vertices: Array, faces: Index) -> tuple[Array, Array]:
    """Mean and greater principal curvature at the inner vertices, from the cotangent formula and the angle defect."""
    stiffness, area, defect, normal = _operators(vertices, faces)
    inner = ~Edges(faces).border_vertices(len(vertices))
    mean = ((stiffness @ vertices) * normal).sum(1)[inner] / (2 * area[inner])
    return mean, np.sqrt(np.maximum(mean**2 - defect[inner] / area[inner], 0.0)) + np.abs(mean)


def make_minimal(vertices: Array, faces: Index, rounds: int = 4) -> Array:
    """Move the inner vertices along their normals to where the area is stationary.

    Newton's method on the second variation of the area, ``stiffness - area |A|^2``: unlike flowing down
    the area, it keeps to the surface nearby even where that is a saddle of the area.
    """
    inner = np.flatnonzero(~Edges(faces).border_vertices(len(vertices)))
    for _ in range(rounds):
        stiffness, _, defect, normal = _operators(vertices, faces)
        jacobian = stiffness - diags(np.maximum(-2 * defect, 0.0))
        pull = ((stiffness @ vertices) * normal).sum(1)
        move = np.zeros(len(vertices))
        move[inner] = spsolve(jacobian[inner][:, inner].tocsc(), -pull[inner])
        vertices = vertices + move[:, None] * normal
    return vertices


def _operators(vertices: Array, faces: Index) -> tuple[coo_matrix, Array, Array, Array]:
    """Cotangent stiffness, area, angle defect and unit normal of every vertex."""
    n = len(vertices)
    cross = face_normals(vertices, faces)
    double = np.linalg.norm(cross, axis=1)
    rows, columns, weights, defect = [], [], [], np.full(n, 2 * np.pi)
    for k in range(3):
        apex, a, b = (faces[:, (k + i) % 3] for i in range(3))
        dot = ((vertices[a] - vertices[apex]) * (vertices[b] - vertices[apex])).sum(1)
        half_cotangent = dot / double / 2
        rows += [a, b, a, b]
        columns += [b, a, a, b]
        weights += [-half_cotangent, -half_cotangent, half_cotangent, half_cotangent]
        defect -= np.bincount(apex, np.arctan2(double, dot), n)
    entries = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    stiffness = coo_matrix(entries, shape=(n, n)).tocsr()
    area = np.bincount(faces.ravel(), np.repeat(double / 6, 3), n)
    normal = np.stack([np.bincount(faces.ravel(), np.repeat(x, 3), n) for x in cross.T], axis=1)
    return stiffness, area, defect, normal / np.linalg.norm(normal, axis=1, keepdims=True)
