"""Several objects of a Rhino file as one surface, joined where their edges coincide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Optional

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Floats, Ints, connected
from weavecore.model import Note
from weavecore.model.notes import at
from weavecore.reading.choose import ambiguous_error
from weavecore.reading.coincident_faces import find_coincident
from weavecore.reading.formats.rhino_3dm import BLOCK, RhinoDocument, RhinoObject
from weavecore.reading.nurbs_mesher import MeshedObject, mesh_objects, surfaces_of_reference
from weavecore.reading.raw import RawMesh
from weavecore.texts import printable

_FOLDED_BACK = -np.cos(np.radians(5.0))
"""Faces whose normals are opposed to within 5 degrees lie on each other: two surfaces in one place, not a fold."""

_SLACK = 1e-3
"""Boxes may lie this part of the whole size apart and still count as connected: the exact test follows on the
mesh."""

_MOST_OBJECTS = 2_000
"""Objects of one layer whose boxes are compared in pairs (12 MB of flags); more are refused as ambiguous."""

_MOST_COMPARED = 50
"""Objects or pieces that are compared with each other."""


def join_objects(
    document: RhinoDocument,
    objects: Sequence[RhinoObject],
    *,
    must_connect: bool,
    edge_target: float | None = None,
    spacing: float | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> RawMesh:
    """The arrays of several objects as one mesh.

    Parameters
    ----------
    document : RhinoDocument
    objects : sequence of RhinoObject
    must_connect : bool
        Refuse them if their edges do not connect them to one piece, or if two lie on each other.
    edge_target, spacing : float, optional
        As in `mesh_object`, in the unit of the document.
    progress : callable, optional
        Called with a fraction and a label.

    Returns
    -------
    RawMesh

    Raises
    ------
    AmbiguousSurface
        Where they must connect and do not; else as `mesh_objects`.
    """
    if progress is not None:
        progress(0.0, "Reading the surfaces")
    lying: list[Note] = []
    if not must_connect:
        fineness = {"tolerance": document.tolerance, "edge_target": edge_target, "spacing": spacing}
        objects, lying = _without_lying(document, objects, fineness)
    parts = [part for one in objects for part in _parts(document, one)]
    if must_connect and (len(parts) > _MOST_OBJECTS or not _boxes_connect(document, objects)):
        raise ambiguous_error(document, objects)
    meshed = mesh_objects(
        [geometry for geometry, _ in parts],
        transforms=[transform for _, transform in parts],
        tolerance=document.tolerance,
        edge_target=edge_target,
        spacing=spacing,
        progress=progress,
    )
    gap, where = _gap(meshed)
    if must_connect and not _is_one_sheet(meshed):
        why = (
            ""
            if gap is None
            else f"their borders are {gap:.3g} apart at {at(where)}, the tolerance is {document.tolerance:g}"
        )
        raise ambiguous_error(document, objects, why or "two of them lie on each other")
    names = list(dict.fromkeys(one.name for one in objects if one.name))
    return RawMesh(
        meshed.vertices,
        meshed.faces,
        unit=document.unit,
        tolerance=document.tolerance,
        name=printable(", ".join(names) or Path(document.file_name).stem),
        notes=(*meshed.notes, *lying, *_joined_notes(objects, meshed, document.tolerance)),
    )


def _joined_notes(objects: Sequence[RhinoObject], meshed: MeshedObject, tolerance: float) -> list[Note]:
    """What was joined, and the gap where pieces stay apart."""
    n_pieces = _count_pieces(meshed.faces)
    text = f"Joined {len(objects)} objects where their edges coincide."
    joined = [Note("JOINED", text, {"objects": len(objects), "pieces": n_pieces})]
    gap, where = _gap(meshed)
    if gap is None or len(objects) == 1:
        return joined if len(objects) > 1 else []
    text = f"{n_pieces} pieces of {len(objects)} objects stay apart: borders are {gap:.3g} apart at {at(where)}, "
    text += f"more than the tolerance of {tolerance:g}; --weld {1.01 * gap:.3g} closes such a gap."
    apart = Note("GAP", text, {"gap": gap, "tolerance": tolerance, "pieces": n_pieces}, [where])
    return [*joined, apart] if n_pieces < len(objects) else [apart]


def _gap(meshed: MeshedObject) -> tuple[Optional[float], Floats]:
    """Shortest distance between vertices of two pieces, and where; None for one piece, or more than are compared."""
    from scipy.spatial import cKDTree

    first, second = _neighbours(meshed.faces)
    count, label = connected(first, second, len(meshed.faces))
    if not 1 < count <= _MOST_COMPARED:
        return None, np.zeros(3)
    gap, where = np.inf, np.zeros(3)
    for k in range(count - 1):
        own = meshed.vertices[np.unique(meshed.faces[label == k])]
        others = meshed.vertices[np.unique(meshed.faces[label > k])]
        distance = np.asarray(cKDTree(others).query(own)[0])
        if distance.min() < gap:
            gap, where = float(distance.min()), own[int(distance.argmin())]
    return gap, where


def _without_lying(
    document: RhinoDocument, objects: Sequence[RhinoObject], options: dict[str, Any]
) -> tuple[Sequence[RhinoObject], list[Note]]:
    """The objects without those that lie wholly on others, and a note for these."""
    if len(objects) > _MOST_COMPARED or not _boxes_contain(objects):
        return objects, []
    meshes = []
    for one in objects:
        parts = _parts(document, one)
        transforms = [transform for _, transform in parts]
        meshes.append(mesh_objects([geometry for geometry, _ in parts], transforms=transforms, **options))
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts)])
    owner = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    # No weld: objects are compared, and their rims would be one.
    found = find_coincident(vertices, faces, np.arange(len(vertices)), document.tolerance)
    is_out = np.bincount(owner, ~found.left_out, len(meshes)) == 0
    kept = [one for one, out in zip(objects, is_out.tolist()) if not out]
    notes = []
    for k in np.flatnonzero(is_out).tolist():
        others = " or ".join(one.name or one.id for one in kept)
        text = f"Left out {objects[k].name or objects[k].id}, which lies on {others}."
        n = len(meshes[k].faces)
        notes.append(Note("COINCIDENT", text, {"count": n}, meshes[k].vertices[:1]))
    return kept, notes


def _boxes_contain(objects: Sequence[RhinoObject]) -> bool:
    """Whether one object's bounding box lies in another's: a cheap test that lets most files pass."""
    if any(one.kind == BLOCK for one in objects):
        return True  # A block's box needs its definition.
    boxes = [one.geometry.GetBoundingBox() for one in objects]
    low, high = (np.array([(p.X, p.Y, p.Z) for p in ends]) for ends in zip(*((b.Min, b.Max) for b in boxes)))
    slack = _SLACK * float(np.ptp(np.concatenate([low, high]), axis=0).max())
    inside = ((low[:, None] >= low[None] - slack) & (high[:, None] <= high[None] + slack)).all(2)
    return bool(inside.sum() > len(objects))


def _count_pieces(faces: Ints) -> int:
    first, second = _neighbours(faces)
    links = coo_matrix((np.ones(len(first), bool), (first, second)), shape=(len(faces), len(faces)))
    return int(connected_components(links, directed=False)[0])


def _parts(document: RhinoDocument, one: RhinoObject) -> list[tuple[Any, Floats | None]]:
    """Geometry and its transform: those of the definition if the object is a block."""
    if one.kind == BLOCK:
        return [(part.geometry, part.transform) for part in surfaces_of_reference(document.source, one.geometry)]
    return [(one.geometry, None)]


def _boxes_connect(document: RhinoDocument, objects: Sequence[RhinoObject]) -> bool:
    """Whether the bounding boxes form one connected cluster: a cheap test that rejects most separate objects."""
    if any(one.kind == BLOCK for one in objects):
        return True  # A block's box needs its definition: the mesh decides.
    boxes = [one.geometry.GetBoundingBox() for one in objects]
    low, high = (np.array([(p.X, p.Y, p.Z) for p in ends]) for ends in zip(*((b.Min, b.Max) for b in boxes)))
    slack = document.tolerance + _SLACK * float(np.ptp(np.concatenate([low, high]), axis=0).max())
    reaches = (low[:, None] <= high[None] + slack).all(2)
    n_clusters, _ = connected_components(np.array(reaches & reaches.T, np.int8), directed=False)
    return int(n_clusters) == 1


def _is_one_sheet(meshed: MeshedObject) -> bool:
    """Whether a mesh is one component without faces folded back on each other where they join."""
    faces = meshed.faces
    first, second = _neighbours(faces)
    corners = meshed.vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    folded = np.einsum("ij,ij->i", normal[first], normal[second]) < _FOLDED_BACK
    return _count_pieces(faces) == 1 and not folded.any()


def _neighbours(faces: Ints) -> tuple[Ints, Ints]:
    """The two faces (E,), (E,) on each edge that has two."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head) * np.int64(faces.max() + 1) + np.maximum(tail, head)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    return order[same] // 3, order[same + 1] // 3
