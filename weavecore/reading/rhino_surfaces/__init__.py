"""Any surface of a Rhino file as one welded triangle mesh, without Rhino."""

from weavecore.reading.rhino_surfaces.meshed import MeshedObject
from weavecore.reading.rhino_surfaces.objects import MESHED_KINDS, mesh_object

__all__ = ["MESHED_KINDS", "MeshedObject", "mesh_object"]
