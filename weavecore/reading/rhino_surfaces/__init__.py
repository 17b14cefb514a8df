"""Any surface of a Rhino file as one welded triangle mesh, without Rhino."""

from weavecore.reading.rhino_surfaces.blocks import BlockPart, expand_reference
from weavecore.reading.rhino_surfaces.meshed import MeshedObject
from weavecore.reading.rhino_surfaces.objects import MESHED_KINDS, mesh_object, mesh_objects
from weavecore.reading.rhino_surfaces.stitching import join_meshes

__all__ = [
    "MESHED_KINDS",
    "BlockPart",
    "MeshedObject",
    "expand_reference",
    "join_meshes",
    "mesh_object",
    "mesh_objects",
]
