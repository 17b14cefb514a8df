"""What both methods require of a surface before they offset its borders: somewhere to start, and fine enough faces."""

from __future__ import annotations

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.refine import refine_faces
from weavecore.model.surface import SurfaceMesh

MIN_EDGES_PER_SPACING = 2.0
"""The mesh is refined until its inner edges are at most the spacing over this: with fewer edges between two levels,
what lies between them could not be resolved.  (A spacing that the program suggests is wider: see `spacing`.)"""


def refuse_closed(surface: SurfaceMesh) -> None:
    """Refuse a surface with a component on which nothing starts: no border, no cut and no chosen curve.

    Parameters
    ----------
    surface : SurfaceMesh

    Raises
    ------
    Unsupported
        With the faces of such components.
    """
    start = np.flatnonzero(surface.is_origin) // 3
    closed = ~np.isin(surface.component_of_face, surface.component_of_face[start])
    if not closed.any():
        return
    if surface.starts is None:
        what, remedy = "A closed component with no border to start from and no cut", "Cut it in two first, by a plane."
    else:
        what = "A component without any of the borders and curves from which distances start"
        remedy = "Choose one on it as well, or remove the component."
    raise Unsupported(what, remedy=remedy, ids=np.flatnonzero(closed).tolist(), kind="face")


def refine_for_spacing(surface: SurfaceMesh, spacing: float) -> SurfaceMesh:
    """Refine a surface until no edge is too long for the spacing, except those of its origins.

    Parameters
    ----------
    surface : SurfaceMesh
    spacing : float
        The least distance between two levels, in the model's unit.

    Returns
    -------
    SurfaceMesh
        The surface itself if it is fine enough.

    Raises
    ------
    TooMuchWork, TooFarFromOrigin
        As `refine_faces`.
    """
    longest = spacing / MIN_EDGES_PER_SPACING
    if surface.edge_lengths.max() <= longest:
        return surface
    refined = refine_faces(
        surface.vertices, surface.faces, longest=longest, protected=surface.is_cut, splittable=surface.is_free_border
    )
    if len(refined.faces) == surface.n_faces:
        return surface
    return surface.refined(refined)
