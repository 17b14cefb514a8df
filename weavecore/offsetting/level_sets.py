"""The default method: latitudes as level sets of the distance from the borders."""

from __future__ import annotations

from typing import Callable, Optional

from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.solver import measure_distance
from weavecore.offsetting.isolines.extract import drop_shallow, trace_latitudes
from weavecore.offsetting.preparation import refine_for, refuse_closed
from weavecore.offsetting.spacing import Ladder, Spacing

Progress = Optional[Callable[[float, str], None]]


def offset_levels(surface: SurfaceMesh, *, spacing: Spacing, progress: Progress = None) -> Latitudes:
    """Offset the borders and cuts of a surface inwards until they fill it (Yan et al. 2016, §4).

    The paper moves one polyline after the other and mends where they cross (§4.3, §4.4).  Here
    the distance from the borders is measured once, and the polylines are its levels: what is
    first wins everywhere, so nothing ever crosses.

    Parameters
    ----------
    surface : SurfaceMesh
        Every component has a border or a cut.
    spacing : float or sequence of float
        Distance from one polyline to the next along the surface, in the model's unit; of several the first is
        that from the borders, and the last goes on.
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
    ladder = Ladder.of(spacing)
    refuse_closed(surface)
    fine = refine_for(surface, ladder.least)
    field = measure_distance(fine, progress=progress)
    return drop_shallow(trace_latitudes(fine, field, spacing=spacing))
