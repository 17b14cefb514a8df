"""The paper's own method: latitudes by offsetting one polyline after the other."""

from __future__ import annotations

import contextlib
from typing import Callable, Optional

import numpy as np

from weavecore.errors import Degenerate, SpacingTooLarge, TooMuchWork
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

_MOST_PARTS = 4
"""A surface that is too sharp for whole steps is offset in parts of steps, up to so many."""

_MOST_HALVINGS = 60

Progress = Optional[Callable[[float, str], None]]


def offset_fronts(surface: SurfaceMesh, *, spacing: Spacing, progress: Progress = None) -> Latitudes:
    """Offset the origins of a surface, step by step, until their children fill it (Yan et al. 2016, §4).

    Origins are its borders and cuts, or what was chosen; borders that are none cut the children, which then are open.
    Each polyline's vertices are moved by one spacing along the surface at right angles to it, and joined to
    a child (§4.2).  Where children cross themselves or each other they are regrouped (§4.3, §4.4); what lies where
    a front has passed is dropped, and a child without room before it is not offset again (§4.5).
    Where steps part behind a sharp saddle, so that children cross or leave a part of the surface bare, all steps
    are made in two parts, or three, or four; the fronts on the way are resampled, and not kept.
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
        When the surface is too sharp or too rough for steps of that length, and for parts of them.
    SpacingTooLarge
        When not one child has room inside the surface.
    TooMuchWork
        When the mesh that the spacing asks for would be too large, or the polylines on it.
    """
    ladder = Ladder.of(spacing)
    refuse_closed(surface)
    # About so many vertices, and as many places where polylines go from face to face.
    refuse_too_many_points(2.0 * STEPS_PER_SPACING * _area(surface) / ladder.least**2, ladder.least)
    try:
        latitudes = _offset_in_parts(surface, ladder, 1, progress)
    except Degenerate as refusal:
        latitudes = _offset_in_some_parts(surface, ladder, refusal, progress)
    return drop_shallow(latitudes)


def _offset_in_some_parts(surface: SurfaceMesh, ladder: Ladder, refusal: Degenerate, progress: Progress) -> Latitudes:
    for parts in range(2, _MOST_PARTS + 1):
        with contextlib.suppress(Degenerate, SpacingTooLarge, TooMuchWork):
            return _offset_in_parts(surface, ladder, parts, progress)
    raise refusal


def _offset_in_parts(surface: SurfaceMesh, ladder: Ladder, parts: int, progress: Progress) -> Latitudes:
    """Steps made in so many parts, on a mesh that is fine enough for one of them."""
    fine = refine_for(surface, ladder.least / parts)
    ground = Ground(fine)
    generations = cover(ground, spacing=ladder.steps / ground.scale, parts=parts, progress=progress)
    if not generations:
        raise too_large(ladder.step_after(0), _find_depth(ground, ladder.step_after(0)))
    latitudes = assemble(fine, ground, generations, ladder=ladder)
    refuse_broken(latitudes)
    return latitudes


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
