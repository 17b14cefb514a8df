"""Any surface of a Rhino file as one welded triangle mesh, without Rhino."""

from weavecore.reading.nurbs_mesher.blocks import (
    BlockPart,
    expand_reference,
    holds_surface,
    mesh_block,
    surfaces_of_reference,
)
from weavecore.reading.nurbs_mesher.meshed_object import MeshedObject
from weavecore.reading.nurbs_mesher.objects import MESHED_KINDS, mesh_object, mesh_objects
from weavecore.reading.nurbs_mesher.stitching import join_meshes

__all__ = [
    "MESHED_KINDS",
    "BlockPart",
    "MeshedObject",
    "expand_reference",
    "holds_surface",
    "join_meshes",
    "mesh_block",
    "mesh_object",
    "mesh_objects",
    "surfaces_of_reference",
]
