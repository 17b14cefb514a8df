"""Meshes of rhino3dm and of RhinoCommon, and of trimesh, as arrays.

They are told by what they have, so that none of these libraries is imported.
"""

from __future__ import annotations

from typing import Any

from weavecore.rhino_geometry.reading import is_rhino_mesh, rhino_faces, rhino_vertices

__all__ = ["is_array_mesh", "is_rhino_mesh", "rhino_faces", "rhino_vertices"]


def is_array_mesh(geometry: Any) -> bool:
    """Whether it has vertices and faces as arrays, as a trimesh.Trimesh and a `SurfaceMesh` do."""
    return hasattr(geometry, "vertices") and hasattr(geometry, "faces")
