"""The default method: latitudes as level sets of the distance from the borders."""

from __future__ import annotations

from dataclasses import replace
from typing import Callable, Optional

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.geometry.refinement import refine_faces
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.tracing import trace_latitudes
from weavecore.offsetting.wavefront import measure_distance

EDGES_PER_SPACING = 2.0
"""The mesh is refined until every inner edge is at most this part of the spacing."""

Progress = Optional[Callable[[float, str], None]]


def offset_levels(surface: SurfaceMesh, *, spacing: float, progress: Progress = None) -> Latitudes:
    """Offset the borders and cuts of a surface inwards until they fill it (Yan et al. 2016, §4).

    The paper moves one polyline after the other and mends where they cross (§4.3, §4.4).  Here
    the distance from the borders is measured once, and the polylines are its levels: what is
    first wins everywhere, so nothing ever crosses.

    Parameters
    ----------
    surface : SurfaceMesh
        Every component has a border or a cut.
    spacing : float
        Distance from one polyline to the next along the surface, in the model's unit.
    progress : callable, optional
        Called with a fraction and a label.

    Returns
    -------
    Latitudes
        On the given surface, or on a finer mesh of it with the same borders and cuts where it
        was too coarse for the spacing.

    Raises
    ------
    Unsupported
        When the spacing is not a positive number, or a component is closed and not cut.
    SpacingTooLarge
        When not one level lies inside the surface.
    TooMuchWork
        When the mesh that the spacing asks for would be too large.
    """
    spacing = float(spacing)
    if not (np.isfinite(spacing) and spacing > 0):
        raise Unsupported(
            f"A spacing of {spacing:g} is no distance", remedy="Give a positive length in the surface's unit."
        )
    fine = _refine(surface, longest=spacing / EDGES_PER_SPACING)
    field = measure_distance(fine, progress=progress)
    if np.isinf(field.distance).any():
        raise _never_reached(surface)
    return trace_latitudes(fine, field, spacing=spacing)


def _never_reached(surface: SurfaceMesh) -> Unsupported:
    """Distances start at borders and cuts: there are components without."""
    start = np.flatnonzero((surface.twins == NO_TWIN) | surface.is_cut) // 3
    closed = ~np.isin(surface.component_of_face, surface.component_of_face[start])
    return Unsupported(
        "A closed component with no border to start from and no cut",
        remedy="Cut it in two first, by a plane or by itself.",
        ids=np.flatnonzero(closed).tolist(),
        kind="face",
    )


def _refine(surface: SurfaceMesh, *, longest: float) -> SurfaceMesh:
    """The surface with no edge longer than that, but for its borders and cuts; itself if there is none."""
    if surface.edge_lengths.max() <= longest:
        return surface
    refined = refine_faces(surface.vertices, surface.faces, longest=longest, protected=surface.is_cut)
    if len(refined.faces) == surface.n_faces:
        return surface
    return replace(surface, vertices=refined.vertices, faces=refined.faces)
