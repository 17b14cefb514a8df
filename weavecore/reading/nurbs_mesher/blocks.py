"""What a block reference stands for: the surfaces of its definition, transformed; nested blocks as well.

A reference with transform T to a definition that holds a reference with transform S places its objects by T S.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from weavecore.errors import NoSurface, TooMuchWork, Unreadable, WeaveError
from weavecore.geometry.arrays import Floats
from weavecore.reading.nurbs_mesher.meshed_object import MeshedObject
from weavecore.reading.nurbs_mesher.objects import MESHED_KINDS, mesh_objects
from weavecore.rhino_geometry.conversion import is_rhino_mesh

_MOST_PARTS = 10_000
"""Objects of a block.  Nested arrays of blocks multiply: three levels of 100 are a million objects in a file of
some kilobytes."""


@dataclass(frozen=True, eq=False)
class BlockPart:
    """One object of a block: its rhino3dm geometry and the (4, 4) transform that brings it to its place."""

    geometry: Any
    transform: Floats


def expand_reference(source: Any, reference: Any) -> tuple[BlockPart, ...]:
    """The visible objects that a block reference stands for.

    Parameters
    ----------
    source : rhino3dm.File3dm
        The file that holds the reference and the definitions.
    reference : rhino3dm.InstanceReference

    Returns
    -------
    tuple of BlockPart
        In the order of the definitions; transforms are composed from the outside in.

    Raises
    ------
    Unreadable, NoSurface, TooMuchWork
    """
    parts: list[BlockPart] = []
    _expand(source, reference, np.eye(4), (), parts)
    if not parts:
        raise NoSurface(
            "A block holds no object, or its definition lies in another file",
            remedy="Embed the block in Rhino, or explode it.",
            ids=[str(reference.ParentIdefId)],
            kind="block",
        )
    return tuple(parts)


def holds_surface(source: Any, reference: Any) -> bool:
    """Whether a block reference stands for at least one surface.

    Parameters
    ----------
    source : rhino3dm.File3dm
    reference : rhino3dm.InstanceReference
    """
    try:
        return any(_is_surface(part.geometry) for part in expand_reference(source, reference))
    except WeaveError:
        return False


def surfaces_of_reference(source: Any, reference: Any) -> tuple[BlockPart, ...]:
    """Those parts of `expand_reference` that are surfaces.

    Parameters
    ----------
    source : rhino3dm.File3dm
    reference : rhino3dm.InstanceReference

    Returns
    -------
    tuple of BlockPart

    Raises
    ------
    NoSurface
        Where there is none; else as `expand_reference`.
    """
    parts = tuple(part for part in expand_reference(source, reference) if _is_surface(part.geometry))
    if not parts:
        raise NoSurface("A block holds no surface", remedy="Choose an object that is a surface or a mesh.")
    return parts


def mesh_block(
    source: Any,
    reference: Any,
    *,
    tolerance: float,
    edge_target: float | None = None,
    spacing: float | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeshedObject:
    """Mesh the surfaces that a block reference stands for, joined where their edges coincide.

    Curves, points and texts in the block are ignored.

    Parameters
    ----------
    source : rhino3dm.File3dm
    reference : rhino3dm.InstanceReference
    tolerance, edge_target, spacing, progress
        As in `mesh_objects`.

    Returns
    -------
    MeshedObject

    Raises
    ------
    As `surfaces_of_reference` and `mesh_objects`.
    """
    parts = surfaces_of_reference(source, reference)
    return mesh_objects(
        [part.geometry for part in parts],
        transforms=[part.transform for part in parts],
        tolerance=tolerance,
        edge_target=edge_target,
        spacing=spacing,
        progress=progress,
    )


def _is_surface(geometry: Any) -> bool:
    return is_rhino_mesh(geometry) or geometry.ObjectType.name in MESHED_KINDS


def _expand(source: Any, reference: Any, outer: Floats, above: tuple[str, ...], parts: list[BlockPart]) -> None:
    key = str(reference.ParentIdefId)
    if key in above:
        raise Unreadable("A block holds itself", remedy="Explode it in Rhino.", ids=[key], kind="block")
    definition = source.InstanceDefinitions.FindId(reference.ParentIdefId)
    if definition is None:
        return
    placed = outer @ _transform_matrix(reference.Xform)
    for one in (source.Objects.FindId(str(i)) for i in definition.GetObjectIds()):
        if one is None or one.Geometry is None or not one.Attributes.Visible:
            continue
        if type(one.Geometry).__name__ == "InstanceReference":
            _expand(source, one.Geometry, placed, (*above, key), parts)
            continue
        parts.append(BlockPart(one.Geometry, placed))
        if len(parts) > _MOST_PARTS:
            raise TooMuchWork(
                f"A block stands for more than {_MOST_PARTS:,} objects",
                remedy="Explode it in Rhino and select the objects you need.",
                ids=[key],
                kind="block",
            )


def _transform_matrix(transform: Any) -> Floats:
    """A ``rhino3dm.Transform`` as an array (4, 4) that acts on columns."""
    return np.array(transform.ToFloatArray(True), np.float64).reshape(4, 4)
