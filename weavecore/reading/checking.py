"""What is refused before anything is mended: bad numbers, bad indices, coordinates without resolution."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import BadIndex, Degenerate, NonFinite, TooFarFromOrigin
from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.raw import RawMesh

_LARGEST, _SMALLEST = 1e50, 1e-50
"""Beyond these an area squared, or a volume, is no number any more."""

_COARSEST = 0.01


def checked_vertices(vertices: NDArray[Any]) -> Floats:
    """The vertices as float64 (V, 3).

    Raises
    ------
    NonFinite, TooFarFromOrigin, Degenerate
    """
    array = np.asarray(vertices)
    if array.dtype.kind not in "iuf":
        raise NonFinite("Coordinates that are no numbers", remedy="Give three numbers for each vertex.")
    if array.ndim != 2 or array.shape[1:] != (3,):
        if array.size == 0:
            raise Degenerate("The mesh has no vertices", remedy="Give a surface that has an area.")
        raise Degenerate(
            f"Vertices of shape {array.shape} instead of (V, 3)", remedy="Give three coordinates for each vertex."
        )
    points = array.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(points).all(1))
    if len(bad):
        raise NonFinite(
            "Coordinates that are not finite numbers",
            remedy="Repair or delete these vertices.",
            ids=bad.tolist(),
            kind="vertex",
        )
    bad = np.flatnonzero((np.abs(points) > _LARGEST).any(1))
    if len(bad):
        raise TooFarFromOrigin(
            f"Coordinates beyond {_LARGEST:g}",
            remedy="Move the surface nearer to the origin, or use a larger unit.",
            ids=bad.tolist(),
            kind="vertex",
        )
    return points


def checked_faces(raw: RawMesh) -> tuple[Ints, Ints]:
    """The faces as int64 (F, 3 or 4) and the number of each for the user (F,).

    Raises
    ------
    BadIndex, Degenerate
    """
    faces = np.asarray(raw.faces)
    if faces.size == 0:
        raise Degenerate("The mesh has no faces", remedy="Give a surface that has an area.")
    if faces.ndim != 2 or faces.shape[1] not in (3, 4) or faces.dtype.kind not in "iuf":
        raise BadIndex(
            f"Faces of shape {faces.shape} and kind {faces.dtype} instead of (F, 3) or (F, 4) whole numbers",
            remedy="Give triangles or quads.",
        )
    whole = np.asarray(faces, np.float64)
    ids = np.arange(len(faces)) if raw.face_ids is None else np.asarray(raw.face_ids, np.int64)
    n = len(raw.vertices)
    outside = (whole < 0) | (whole >= n) | (whole != np.floor(whole))
    if faces.shape[1] == 4:
        outside[:, 3] &= whole[:, 3] != -1
    bad = np.flatnonzero(outside.any(1))
    if len(bad):
        raise BadIndex(
            f"Faces that name vertices beyond the {n} that there are",
            remedy="Repair the mesh: its face list does not fit its vertices.",
            ids=np.unique(ids[bad]).tolist(),
            kind="face",
        )
    return faces.astype(np.int64), ids


def check_resolution(points: Floats, triangles: Ints, epsilon: float) -> None:
    """Refuse a mesh whose coordinates are too coarse for the length of its edges.

    The step between two neighbouring numbers grows with their distance from 0.

    Raises
    ------
    TooFarFromOrigin, Degenerate
    """
    ends = points[triangles]
    furthest, extent = float(np.abs(ends).max()), float(np.ptp(ends, axis=(0, 1)).max())
    if extent < _SMALLEST:
        raise Degenerate(f"The surface is only {extent:.2g} large", remedy="Give a surface that has an area.")
    step = epsilon * furthest
    lengths = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2)
    edge = float(np.median(lengths[lengths > 0])) if lengths.any() else np.inf  # no edge is too short for its place
    if step > _COARSEST * edge:
        raise TooFarFromOrigin(
            f"Coordinates up to {furthest:.3g} are kept in steps of {step:.2g}, too coarse for edges of {edge:.3g}",
            remedy="Move the surface nearer to the origin before saving it.",
        )
