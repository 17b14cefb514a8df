"""Front propagation: latitudes by offsetting one polyline after the other (Yan, Huang and Song 2016, §4).

This is the method that users name `fronts`.  A *front* is a polyline with the unswept surface on its left; its
*children* are the fronts one spacing further on::

    generation 0        sources: borders, cuts, chosen curves
        |   ray_directions      n × t at each vertex, resampled                §4.1, §4.2
        |   offset_vertices     one spacing along straightest geodesics        §4.2
        |   child_curves        chords between the ends, embedded in the mesh  §4.2
        |   intersections       the four-angle test                            §4.3
        |   uncrossing          followers exchanged at every crossing          §4.3, §4.4
        v   child_filter        what was swept already; the grandchild test    §4.5
    generation 1, and so on until no child is left                             §4.6

Where free borders, from which no distance starts, are in the way of rays, `obstacle_shadows` and `diffraction` add what
the paper leaves open.  `assembly` makes `Latitudes` of the fronts.

No distance field is measured: this method and `level_sets` share the walking over the mesh, and nothing else that
decides where a polyline lies.  Each generation costs time linear in the length of its fronts, in median edges.
"""

from __future__ import annotations

import contextlib
from typing import Callable, Optional

import numpy as np

from weavecore.errors import Degenerate, SpacingTooLarge, TooMuchWork
from weavecore.geometry.arrays import Ints, rows_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.isolines.cut_mesh import split_vertices_at_cuts
from weavecore.offsetting.isolines.extract import prune_beside_free_borders, refuse_too_many_points, too_large
from weavecore.offsetting.preparation import refine_for_spacing, refuse_closed
from weavecore.offsetting.propagation.assembly import assemble_latitudes
from weavecore.offsetting.propagation.child_curves import embed_children
from weavecore.offsetting.propagation.child_filter import (
    filter_by_grandchild,
    find_uncovered_loops,
    measure_nearness,
    stop_at_fronts,
)
from weavecore.offsetting.propagation.chords import remove_folds
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.intersections import find_intersections, find_intersections_with
from weavecore.offsetting.propagation.offset_vertices import FrontRays, cast_rays, offset_vertices
from weavecore.offsetting.propagation.ray_directions import start_on_boundary, start_on_curves
from weavecore.offsetting.propagation.surface_curves import SurfaceCurves
from weavecore.offsetting.propagation.uncrossing import reconnect_at_crossings
from weavecore.offsetting.spacing import LevelSchedule, Spacing
from weavecore.tolerances import MIN_FREE_BORDER_GAP

VERTICES_PER_SPACING = 10.0
"""Vertices of a front on a length of one spacing, about; docs/methods.md shows the error that is left."""

_MOST_PARTS = 4
"""A surface that is too sharp for whole steps is offset in parts of steps, up to so many: the mesh of four parts may
have sixteen times the faces."""

_MOST_HALVINGS = 60
"""Halvings of a spacing that is too large: down to 1e-18 of it."""

_MOST_ROUNDS = 5
"""Rounds of uncrossing: where several curves cross in one place, rounding may leave a pair."""

Progress = Optional[Callable[[float, str], None]]


def offset_fronts(surface: SurfaceMesh, *, spacing: Spacing, progress: Progress = None) -> Latitudes:
    """Offset the sources of a surface, step by step, until their children fill it (Yan et al. 2016, §4).

    Sources are the borders and cuts, or what was chosen; free borders cut the children, which then are open.  Each
    vertex of a polyline is moved by one spacing along the surface at right angles to it, and joined to a child (§4.2).
    Where children cross themselves or each other they are reconnected (§4.3, §4.4); what lies where a front has passed
    is dropped, and a child without room before it is not offset again (§4.5).

    Where steps diverge behind a sharp saddle, so that children cross or leave a part of the surface bare, all steps
    are made in two parts, or three, or four; the fronts on the way are resampled, and not kept.

    Parameters
    ----------
    surface : SurfaceMesh
        Every component has a source.
    spacing : float or sequence of float
        Distance from one polyline to the next along the surface, in the model's unit; of several the first is that
        from the sources, and the last is repeated.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Latitudes
        On the given surface, or on a finer mesh of it with the same borders and cuts where it was too coarse for the
        spacing.

    Raises
    ------
    Unsupported
        When the spacing is not a positive number, or a component has no source.
    Degenerate
        When the surface is too sharp or too rough for steps of that length, and for parts of them.
    SpacingTooLarge
        When no child has room inside the surface.
    TooMuchWork
        When the mesh that the spacing asks for would be too large, or the polylines on it.
    """
    schedule = LevelSchedule.of(spacing)
    refuse_closed(surface)
    # About so many vertices, and as many places where polylines go from face to face.
    refuse_too_many_points(
        2.0 * VERTICES_PER_SPACING * surface.area / schedule.least_spacing**2, schedule.least_spacing
    )
    try:
        latitudes = _offset_in_parts(surface, schedule, 1, progress)
    except Degenerate as refusal:
        latitudes = _offset_in_more_parts(surface, schedule, refusal, progress)
    return prune_beside_free_borders(latitudes)


def _offset_in_more_parts(
    surface: SurfaceMesh, schedule: LevelSchedule, refusal: Degenerate, progress: Progress
) -> Latitudes:
    for parts in range(2, _MOST_PARTS + 1):
        with contextlib.suppress(Degenerate, SpacingTooLarge, TooMuchWork):
            return _offset_in_parts(surface, schedule, parts, progress)
    raise refusal


def _offset_in_parts(surface: SurfaceMesh, schedule: LevelSchedule, parts: int, progress: Progress) -> Latitudes:
    """Steps made in so many parts, on a mesh that is fine enough for one of them."""
    fine = refine_for_spacing(surface, schedule.least_spacing / parts)
    domain = Domain(fine)
    generations = propagate_fronts(domain, spacing=schedule.spacings / domain.scale, parts=parts, progress=progress)
    if not generations:
        raise too_large(schedule.spacing_after(0), _find_depth(domain, schedule.spacing_after(0)))
    latitudes = assemble_latitudes(fine, domain, generations, schedule=schedule)
    refuse_broken(latitudes)
    return latitudes


def _find_depth(domain: Domain, spacing: float) -> float:
    """About how deep a surface is for which a spacing is too large: half of that fits, by halving the spacing."""
    depth = spacing
    for _ in range(_MOST_HALVINGS):
        half = depth / 2 / domain.scale
        if len(_offset_and_filter(domain, _cast_from_sources(domain, half), None, half, grandparents=None)[0]):
            break
        depth /= 2
    return depth


def propagate_fronts(
    domain: Domain, *, spacing: Spacing, parts: int = 1, progress: Progress = None
) -> list[SurfaceCurves]:
    """The children of each generation, from 1 on, each with the unswept surface on its left.

    Parameters
    ----------
    domain : Domain
    spacing : float or sequence of float
        In the domain's unit; of several the last is repeated.
    parts : int
        Each step is made in so many, one after the other.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    list of SurfaceCurves
        Empty where no child has room.

    Raises
    ------
    Degenerate
        When children cross, lie too near to their parents, or end inside the surface.
    """
    generations: list[SurfaceCurves] = []
    schedule = LevelSchedule.of(spacing)
    rays = _cast_from_sources(domain, schedule.spacing_after(0))
    covered = 0.0
    while True:
        parents = generations[-1] if generations else None
        step, step_on = (schedule.spacing_after(len(generations) + further) for further in (0, 1))
        children, rays_on = _step_in_parts(domain, rays, parents, step=step, step_on=step_on, parts=parts)
        if len(children) == 0:
            return generations
        generations.append(children)
        covered += step_on * float(children.segment_lengths.sum())
        rays = stop_at_fronts(domain, rays_on, children)
        if progress is not None:
            progress(min(covered / domain.area, 1.0), "offsetting the borders")


def _cast_from_sources(domain: Domain, spacing: float) -> FrontRays:
    return cast_rays(domain, start_on_boundary(domain, step=spacing / VERTICES_PER_SPACING), spacing=spacing)


def _cast_from(domain: Domain, fronts: SurfaceCurves, spacing: float) -> FrontRays:
    return cast_rays(domain, start_on_curves(domain, fronts, step=spacing / VERTICES_PER_SPACING), spacing=spacing)


def _step_in_parts(
    domain: Domain, rays: FrontRays, parents: SurfaceCurves | None, *, step: float, step_on: float, parts: int
) -> tuple[SurfaceCurves, FrontRays]:
    """The children of some fronts, by a step in parts; and their own rays, as long as the step on.

    Fronts on the way are resampled, so that what lies between steps that diverge behind a saddle is offset as well.
    """
    fronts, part = parents, step / parts
    if parts > 1:
        rays = _cast_from_sources(domain, part) if parents is None else _cast_from(domain, parents, part)
        rays = rays if parents is None else stop_at_fronts(domain, rays, parents)
    for _ in range(parts - 1):
        fronts, rays = _offset_and_filter(domain, rays, fronts, part, grandparents=fronts)
        if len(fronts) == 0:
            return fronts, rays
        rays = stop_at_fronts(domain, rays, fronts)
    return _offset_and_filter(domain, rays, fronts, step_on, grandparents=parents)


def _offset_and_filter(
    domain: Domain,
    rays: FrontRays,
    parents: SurfaceCurves | None,
    spacing: float,
    *,
    grandparents: SurfaceCurves | None,
) -> tuple[SurfaceCurves, FrontRays]:
    """The children that have room before them (§4.5), and their own rays, as long as the spacing."""
    children = _offset_once(domain, rays, parents)
    refuse_near(domain, rays, children)
    refuse_loose_ends(domain, children)
    rays = _cast_from(domain, children, spacing)
    if len(children) == 0:
        return children, rays
    refuse_crossings(domain, children, parents)
    stays = filter_by_grandchild(domain, rays, children, grandparents)
    return children.take(stays), rays.take(stays)


def _offset_once(domain: Domain, rays: FrontRays, fronts: SurfaceCurves | None) -> SurfaceCurves:
    """The children of some fronts, reconnected until none crosses any (§4.3, §4.4), where no front has been."""
    vertices = offset_vertices(domain, rays)  # §4.2
    curves, _ = embed_children(domain, rays, vertices, fronts)
    crossings = find_intersections(domain, curves)  # §4.3
    for _ in range(_MOST_ROUNDS):
        uncrossed = reconnect_at_crossings(domain, curves, crossings)  # §4.3, §4.4
        uncovered = find_uncovered_loops(domain, rays, vertices, curves, uncrossed)  # §4.5
        curves = uncrossed.curves.take(uncovered)
        unfolded = remove_folds(domain, curves)
        if fronts is None or len(find_intersections_with(domain, unfolded, fronts)) == 0:
            curves = unfolded
        crossings = find_intersections(domain, curves)
        if len(crossings) == 0:
            break
    return curves


NEAREST = 0.75
"""Spacings between parent and child at least; a chord over a fan of rays or a saddle is less than the spacing."""

DEEPEST, FARTHEST = 1.05, 1.4
"""Spacings that a pocket may be deep, and another band, where a child may have come a little too far.

The first is 1 and `MIN_CAP_RISE`, with a hundredth for rounding."""


def refuse_crossings(domain: Domain, children: SurfaceCurves, parents: SurfaceCurves | None) -> None:
    """Refuse children that cross each other or a parent.

    Behind sharp features steps diverge, and the surface between them is not offset (see docs/fronts.md).  That can
    leave fronts that cross, or a part of the surface without any (`refuse_broken`).

    Parameters
    ----------
    domain : Domain
    children : SurfaceCurves
    parents : SurfaceCurves or None

    Raises
    ------
    Degenerate
        With the faces in which they cross.
    """
    crossing = [find_intersections(domain, children)]
    if parents is not None:
        crossing.append(find_intersections_with(domain, children, parents))
    at = np.concatenate([crossings.first for crossings in crossing])
    if len(at):
        raise _too_sharp(children.face[at])


def refuse_near(domain: Domain, rays: FrontRays, children: SurfaceCurves) -> None:
    """Refuse children with a vertex that is much nearer to the parents than the spacing.

    Parameters
    ----------
    domain : Domain
    rays : FrontRays
        Of the parents.
    children : SurfaceCurves

    Raises
    ------
    Degenerate
        With the faces of these vertices.
    """
    vertex = np.flatnonzero(children.is_vertex)
    near = measure_nearness(domain, rays, children, vertex) < NEAREST
    if near.any():
        raise _too_sharp(children.face[vertex[near]])


def refuse_loose_ends(domain: Domain, children: SurfaceCurves) -> None:
    """Refuse open children that do not end on a free border.

    Parameters
    ----------
    domain : Domain
    children : SurfaceCurves

    Raises
    ------
    Degenerate
        With the faces of these ends.
    """
    at = np.concatenate(children.ends)
    loose = domain.find_free_borders(children.face[at], children.start[at])[0] == NO_TWIN
    if loose.any():
        raise _too_sharp(children.face[at[loose]])


def refuse_broken(latitudes: Latitudes) -> None:
    """Refuse latitudes whose bands do not make up the surface, with a child without parent or a part without ring.

    Parameters
    ----------
    latitudes : Latitudes

    Raises
    ------
    Degenerate
        With faces of the polylines concerned.
    """
    surface, bands = latitudes.surface, latitudes.bands
    orphans = np.setdiff1d(np.flatnonzero(latitudes.generation > 0), latitudes.parents[:, 1])
    steps = latitudes.generation[latitudes.parents[:, 1]] - latitudes.generation[latitudes.parents[:, 0]]
    band = rows_of(bands.offsets)
    top = np.zeros(len(bands))
    np.maximum.at(top, band[bands.is_parent], latitudes.distance[bands.polyline[bands.is_parent]])
    has_child = np.bincount(band[~bands.is_parent], minlength=len(bands)) > 0
    is_cut = np.bincount(band, ~latitudes.polylines.closed[bands.polyline], minlength=len(bands)) > 0
    deepest = np.where(is_cut, 1.0 + MIN_FREE_BORDER_GAP, DEEPEST)  # A child so near to a free border may be left out.
    too_deep = bands.depth > top + np.where(has_child, FARTHEST, deepest) * latitudes.spacing
    # Cut along its sources and all fronts the surface has one more for each open front.
    _, nodes = split_vertices_at_cuts(surface)
    parted = len(nodes) - surface.n_edges - int(surface.is_cut.sum()) // 2 + surface.n_faces
    n_open = int((~latitudes.polylines.closed[len(surface.origins) :]).sum())
    is_whole = int(bands.euler.sum()) == parted + n_open
    if len(orphans) or (steps != 1).any() or too_deep.any() or not is_whole:
        lines = np.concatenate([orphans, bands.polyline[too_deep[band]]])
        raise _too_sharp(latitudes.polylines.face[latitudes.polylines.offsets[lines]])


def _too_sharp(faces: Ints) -> Degenerate:
    return Degenerate(
        "Behind sharp features of the surface the polylines cannot be offset step by step",
        remedy='Take the method "levels", which passes sharp features, or another spacing.',
        ids=np.unique(faces).tolist(),
        kind="face",
    )
