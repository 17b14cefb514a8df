"""Geometry of Rhino, of RhinoCommon and of rhino3dm alike, from and to arrays.

Both are recognised by their attributes and imported only where geometry is made: so the same functions run
inside Rhino, in a Python outside it that has loaded Rhino with ``rhinoinside``, and where
there is only rhino3dm.  .NET arrays are copied as blocks of memory in double precision, not point by point.
"""

from weavecore.rhino_geometry.conversion import (
    curve_in_rhino,
    curve_in_rhino_points,
    is_curve_in_rhino,
    is_rhino_curve,
    is_rhino_mesh,
    line_points,
    plane_from,
    rhino_faces,
    rhino_vertices,
)
from weavecore.rhino_geometry.document import DocumentUnit, document_unit
from weavecore.rhino_geometry.drawing import Drawing
from weavecore.rhino_geometry.meshing import is_to_be_meshed, mesh_in_rhino
from weavecore.rhino_geometry.net_arrays import rows_from

__all__ = [
    "DocumentUnit",
    "Drawing",
    "curve_in_rhino",
    "curve_in_rhino_points",
    "document_unit",
    "is_curve_in_rhino",
    "is_rhino_curve",
    "is_rhino_mesh",
    "is_to_be_meshed",
    "line_points",
    "mesh_in_rhino",
    "plane_from",
    "rhino_faces",
    "rhino_vertices",
    "rows_from",
]
