"""Nasty meshes as they come out of files: what must be refused, with which code, and what must be mended.

``NASTY[name]`` is (vertices, faces, code); the code is None where the mesh is mended and woven.
"""

from __future__ import annotations

import numpy as np

from planar_meshes import circle, plate
from tough_register import grid, joined

NASTY = {}


def dome():
    """A cap of a sphere, for spoiling: 1 border."""
    vertices, faces = plate([circle(1.0, n=36)], 0.16)
    vertices[:, 2] = 0.8 - 0.5 * (vertices[:, :2] ** 2).sum(1)
    return vertices, faces


def enter(name, code, vertices, faces):
    NASTY[name] = (vertices, faces, code)


def _spoil_numbers():
    for name, bad in (("a NaN", np.nan), ("an infinite coordinate", np.inf)):
        vertices, faces = dome()
        vertices[17, 1] = bad
        enter(name, "NON_FINITE", vertices, faces)
    vertices, faces = dome()
    enter("a NaN in a vertex that no face uses", "NON_FINITE", np.concatenate([vertices, [[np.nan, 0, 0]]]), faces)
    enter("all coordinates NaN", "NON_FINITE", np.full_like(vertices, np.nan), faces)
    enter("so far away that nothing is left of its shape", "TOO_FAR_FROM_ORIGIN", vertices + 1e15, faces)
    enter("coordinates whose squares overflow", "TOO_FAR_FROM_ORIGIN", vertices * 1e200, faces)


def _spoil_indices():
    vertices, faces = dome()
    for name, bad in (("an index beyond the vertices", len(vertices)), ("a negative index", -3)):
        broken = faces.copy()
        broken[5, 2] = bad
        enter(name, "BAD_INDEX", vertices, broken)
    enter("no faces", "DEGENERATE", vertices, np.empty((0, 3), np.int64))
    enter("nothing at all", "DEGENERATE", np.empty((0, 3)), np.empty((0, 3), np.int64))


def _take_the_area():
    vertices, faces = dome()
    enter("all vertices in one place", "DEGENERATE", np.ones_like(vertices), faces)
    enter("all vertices on a line", "DEGENERATE", vertices * [1.0, 0, 0], faces)
    enter("each face names one vertex three times", "DEGENERATE", vertices, faces[:, [0, 0, 0]])
    specks = np.concatenate([faces, faces[::7][:, [0, 1, 1]], faces[::5][:, [2, 2, 2]]])
    enter("faces without area among others", None, vertices, specks)


def _spoil_topology():
    vertices, faces = dome()
    fin = np.concatenate([vertices, [[0.0, 0.0, 3.0]]])
    inner = faces[len(faces) // 2]
    enter("three faces on an edge", "NON_MANIFOLD", fin, np.concatenate([faces, [[*inner[:2], len(vertices)]]]))
    n = 30
    half = np.pi * np.arange(n) / n
    across = np.stack([np.cos(half), 0 * half, np.sin(half)], axis=1)
    turned = np.stack([across[:, 0] * np.cos(2 * half), across[:, 0] * np.sin(2 * half), across[:, 2]], axis=1)
    middle = 3 * np.stack([np.cos(2 * half), np.sin(2 * half), 0 * half], axis=1)
    strip = np.stack([middle - turned, middle, middle + turned], axis=1).reshape(-1, 3)
    seam = grid(n + 1, 3)
    last = seam >= 3 * n
    seam[last] = 2 - (seam[last] - 3 * n)  # joined up the other way round
    enter("a Moebius strip", "NOT_ORIENTABLE", strip, seam)


def _leave_to_be_mended():
    vertices, faces = dome()
    mixed = faces.copy()
    mixed[::3] = mixed[::3, ::-1]
    enter("faces that look to both sides", None, vertices, mixed)
    enter("looking down", None, vertices, faces[:, ::-1])
    enter(
        "each face with vertices of its own",
        None,
        vertices[faces].reshape(-1, 3),
        np.arange(3 * len(faces)).reshape(-1, 3),
    )
    enter("given twice", None, *joined((vertices, faces), (vertices, faces)))
    enter("with vertices that no face uses", None, np.concatenate([vertices, vertices + 5]), faces)
    enter("single precision", None, vertices.astype(np.float32), faces.astype(np.int32))
    enter("unsigned indices", None, vertices, faces.astype(np.uint32))
    enter("not contiguous and read only", None, np.asfortranarray(vertices)[:, ::-1][:, ::-1], np.asfortranarray(faces))
    enter("plain lists", None, vertices.tolist(), faces.tolist())
    halves = vertices[faces].mean(1)[:, 0] > 0
    enter(
        "two halves not joined along their seam", None, *joined((vertices, faces[halves]), (vertices, faces[~halves]))
    )
    enter("minus zero beside zero", None, *_signed_zeros())
    enter("quads", None, *_quads())


def _signed_zeros():
    vertices, faces = plate([circle(1.0, n=24)], 0.25)
    loose = vertices[faces].reshape(-1, 3)
    loose[::2, 2] = -0.0
    return loose, np.arange(len(loose)).reshape(-1, 3)


def _quads():
    x, y = np.meshgrid(np.arange(9.0), np.arange(7.0), indexing="ij")
    corner = (np.arange(8)[:, None] * 7 + np.arange(6)).ravel()
    quads = np.stack([corner, corner + 7, corner + 8, corner + 1], axis=1)
    quads[5, 3] = quads[5, 2]  # a triangle among them, as Rhino writes one
    return np.stack([x, y, 0.1 * x * y], axis=-1).reshape(-1, 3), np.concatenate([quads, [[*quads[5, [0, 2]], 6, 6]]])


for fill in (_spoil_numbers, _spoil_indices, _take_the_area, _spoil_topology, _leave_to_be_mended):
    fill()
