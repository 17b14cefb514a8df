"""Surfaces that Rhino holds in memory as meshes, made by Rhino itself."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any, Optional

from weavecore.errors import Degenerate
from weavecore.rhino_geometry.conversion import is_rhino_mesh

_EDGES_ALONG, _CHORDS_ALONG = 50.0, 1000.0
"""By default an edge is this part of the size, and the distance from the surface that part."""

_SUBD_FACES = 8000.0
"""A SubD is divided until it has about so many faces."""

_MOST_DENSE = 5


def is_to_be_meshed(geometry: Any) -> bool:
    """Whether it is a Brep, a surface, an extrusion or a SubD that Rhino, not rhino3dm, holds in memory."""
    if is_rhino_mesh(geometry) or not hasattr(geometry, "GetType"):
        return False
    return hasattr(geometry, "ToBrep") or hasattr(geometry, "Loops")


def mesh_in_rhino(geometry: Any, *, edge_target: Optional[float] = None) -> list[Any]:
    """Mesh a Brep, a surface, an extrusion or a SubD of RhinoCommon.

    Seams are meshed alike from both sides, so that the meshes of the faces fit to one another.

    Parameters
    ----------
    geometry : Rhino.Geometry.Brep, BrepFace, Surface, Extrusion or SubD
    edge_target : float, optional
        Longest wanted edge, in the model's unit; a fiftieth of the size where it is not given.

    Returns
    -------
    list of Rhino.Geometry.Mesh
        One for each face of a Brep.

    Raises
    ------
    Degenerate
        Where Rhino makes no mesh of it.
    """
    rg: Any = import_module("Rhino.Geometry")
    if hasattr(geometry, "Subdivide"):
        meshes = [rg.Mesh.CreateFromSubD(geometry, _density(geometry))]
    else:
        brep = _brep_of(geometry)
        meshes = list(rg.Mesh.CreateFromBrep(brep, _parameters(rg, brep, edge_target)) or ())
    meshes = [mesh for mesh in meshes if mesh is not None]
    if not meshes:
        raise Degenerate(
            f"Rhino makes no mesh of this {type(geometry).__name__}",
            remedy="Look with Rhino's command Check at what is wrong with it, or give a mesh.",
        )
    return meshes


def _brep_of(geometry: Any) -> Any:
    """The Brep of a surface, with its trims; an extrusion is asked to split its kinks, so that faces are smooth."""
    if hasattr(geometry, "DuplicateFace"):
        return geometry.DuplicateFace(False)
    if hasattr(geometry, "Loops"):
        return geometry
    return geometry.ToBrep(True) if hasattr(geometry, "PathTangent") else geometry.ToBrep()


def _parameters(rg: Any, brep: Any, edge_target: Optional[float]) -> Any:
    size = brep.GetBoundingBox(True).Diagonal.Length
    parameters = rg.MeshingParameters()
    parameters.JaggedSeams = False
    parameters.SimplePlanes = False
    parameters.RefineGrid = True
    parameters.MaximumEdgeLength = edge_target or size / _EDGES_ALONG
    parameters.Tolerance = size / _CHORDS_ALONG
    return parameters


def _density(subd: Any) -> int:
    """How often the faces of a SubD are halved."""
    halvings = math.log2(_SUBD_FACES / max(subd.Faces.Count, 1)) / 2.0
    return min(max(round(halvings), 1), _MOST_DENSE)
