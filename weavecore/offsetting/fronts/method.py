"""The paper's own method: latitudes by offsetting one polyline after the other."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.fronts.assembling import assemble
from weavecore.offsetting.fronts.checking import refuse_broken
from weavecore.offsetting.fronts.generations import STEPS_PER_SPACING, cover, has_children
from weavecore.offsetting.fronts.ground import Ground
from weavecore.offsetting.ladder import Ladder, Spacing
from weavecore.offsetting.preparing import refine_for, refuse_closed
from weavecore.offsetting.shallow import drop_shallow
from weavecore.offsetting.tracing import refuse_too_many_points, too_large

_MOST_HALVINGS = 60

Progress = Optional[Callable[[float, str], None]]


def offset_fronts(surface: SurfaceMesh, *, spacing: Spacing, progress: Progress = None) -> Latitudes:
    """Offset the origins of a surface, step by step, until their children fill it (Yan et al. 2016, §4).

    Origins are its borders and cuts, or what was chosen; borders that are none cut the children, which then are open.
    Each polyline's vertices are moved by one spacing along the surface at right angles to it, and joined to
    a child (§4.2).  Where children cross themselves or each other they are regrouped (§4.3, §4.4); what lies where
    a front has passed is dropped, and a child without room before it is not offset again (§4.5).
    No distance field is measured: `offset_levels` and this method share the walking over the
    mesh, and nothing else that decides where a polyline lies.

    Parameters
    ----------
    surface : SurfaceMesh
        Every component has an origin.
    spacing : float or sequence of float
        Distance from one polyline to the next along the surface, in the model's unit; of several the first is
        that from the origins, and the last goes on.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Latitudes
        On the given surface, or on a finer mesh of it with the same borders and cuts where it
        was too coarse for the spacing.

    Raises
    ------
    Unsupported
        When the spacing is not a positive number, or a component has no origin.
    Degenerate
        When the surface is too sharp or too rough for steps of that length.
    SpacingTooLarge
        When not one child has room inside the surface.
    TooMuchWork
        When the mesh that the spacing asks for would be too large, or the polylines on it.
    """
    ladder = Ladder.of(spacing)
    refuse_closed(surface)
    fine = refine_for(surface, ladder.least)
    # About so many vertices, and as many places where polylines go from face to face.
    refuse_too_many_points(2.0 * STEPS_PER_SPACING * _area(fine) / ladder.least**2, ladder.least)
    ground = Ground(fine)
    generations = cover(ground, spacing=ladder.steps / ground.scale, progress=progress)
    if not generations:
        raise too_large(ladder.step_after(0), _find_depth(ground, ladder.step_after(0)))
    latitudes = assemble(fine, ground, generations, ladder=ladder)
    refuse_broken(latitudes)
    return drop_shallow(latitudes)


def _find_depth(ground: Ground, spacing: float) -> float:
    """About how deep a surface is for which a spacing is too large: half of that fits, halving on from the spacing."""
    depth = spacing
    for _ in range(_MOST_HALVINGS):
        if has_children(ground, spacing=depth / 2 / ground.scale):
            break
        depth /= 2
    return depth


def _area(surface: SurfaceMesh) -> float:
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
