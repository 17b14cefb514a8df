"""The default method: latitudes as level sets of the distance from the origins.

The paper moves one polyline after the other and repairs where they cross (Yan et al. 2016, §4.3, §4.4).  Here the
distance d from the origins is measured once, and generation g is the level set d = d_g: wherever several fronts arrive,
the first one defines d, so level sets never cross.

    distance/   d and its gradient at the vertices
    isolines/   level sets of d, their simplification, and the bands between them

Work: linear in the faces of the refined mesh.
"""

from __future__ import annotations

from typing import Callable, Optional

from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.solver import measure_distance
from weavecore.offsetting.isolines.extract import prune_beside_free_borders, trace_latitudes
from weavecore.offsetting.phase import note_phase
from weavecore.offsetting.preparation import refine_for_spacing, refuse_closed
from weavecore.offsetting.spacing import LevelSchedule, Spacing

Progress = Optional[Callable[[float, str], None]]


def offset_levels(surface: SurfaceMesh, *, spacing: Spacing, progress: Progress = None) -> Latitudes:
    """Offset the origins of a surface until the polylines fill it (Yan et al. 2016, §4).

    Parameters
    ----------
    surface : SurfaceMesh
        Every component has an origin.
    spacing : float or sequence of float
        Distance from one polyline to the next along the surface, in the model's unit; of several the first is
        that from the origins, and the last is repeated.
    progress : callable, optional
        Called with a fraction and a label.

    Returns
    -------
    Latitudes
        On this surface, or on a finer mesh of it with the same borders and cuts where it was too coarse for the
        spacing.

    Raises
    ------
    Unsupported
        If the spacing is not a positive number, or a component is closed and not cut.
    SpacingTooLarge
        If no level lies inside the surface.
    TooMuchWork
        If the mesh for this spacing would be too large.
    """
    schedule = LevelSchedule.of(spacing)
    refuse_closed(surface)
    fine = refine_for_spacing(surface, schedule.least_spacing)
    field = measure_distance(fine, progress=progress)
    if len(schedule.levels) == 1:
        fine = note_phase(fine, field, schedule.last_spacing)
    return prune_beside_free_borders(trace_latitudes(fine, field, spacing=spacing))
