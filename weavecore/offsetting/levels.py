"""The default method: latitudes as level sets of the distance from the borders."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from weavecore.errors import Unsupported
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.tracing import trace_latitudes
from weavecore.offsetting.wavefront import measure_distance

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

    Raises
    ------
    Unsupported
        When the spacing is not a positive number.
    SpacingTooLarge
        When not one level lies inside the surface.
    TooMuchWork
        When the polylines would have more than 30 million points.
    """
    spacing = float(spacing)
    if not (np.isfinite(spacing) and spacing > 0):
        raise Unsupported(
            f"A spacing of {spacing:g} is no distance", remedy="Give a positive length in the surface's unit."
        )
    field = measure_distance(surface, progress=progress)
    return trace_latitudes(surface, field, spacing=spacing)
