"""What both methods ask of a surface before they offset its borders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.refine import refine_faces
from weavecore.model.surface import SurfaceMesh

EDGES_PER_SPACING = 2.0
"""The mesh is refined until every inner edge is at most this part of the spacing."""


def refuse_closed(surface: SurfaceMesh) -> None:
    """Raise `Unsupported` where no origin lies on a component: no border, no cut, and nothing that is chosen."""
    start = np.flatnonzero(surface.is_origin) // 3
    closed = ~np.isin(surface.component_of_face, surface.component_of_face[start])
    if not closed.any():
        return
    if surface.starts is None:
        what, remedy = "A closed component with no border to start from and no cut", "Cut it in two first, by a plane."
    else:
        what = "A component on which none of the borders and curves lies that distances start at"
        remedy = "Choose one on it as well, or leave the component away."
    raise Unsupported(what, remedy=remedy, ids=np.flatnonzero(closed).tolist(), kind="face")


def refine_for(surface: SurfaceMesh, spacing: float) -> SurfaceMesh:
    """The surface with no edge too long for the spacing, but for those of its origins; itself if there is none."""
    longest = spacing / EDGES_PER_SPACING
    if surface.edge_lengths.max() <= longest:
        return surface
    refined = refine_faces(
        surface.vertices, surface.faces, longest=longest, protected=surface.is_cut, yielding=surface.is_selvedge
    )
    if len(refined.faces) == surface.n_faces:
        return surface
    return replace(surface, vertices=refined.vertices, faces=refined.faces)
