"""The paper's own method: latitudes by offsetting one polyline after the other."""

from __future__ import annotations

import contextlib
from typing import Callable, Optional

import numpy as np

from weavecore.errors import Degenerate, SpacingTooLarge, TooMuchWork
from weavecore.geometry.arrays import Bools, Ints, rows_of
from weavecore.geometry.halfedges import NO_TWIN
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.isolines.cut_mesh import part_vertices
from weavecore.offsetting.isolines.extract import drop_shallow, refuse_too_many_points, too_large
from weavecore.offsetting.preparation import refine_for, refuse_closed
from weavecore.offsetting.propagation.assembly import assemble
from weavecore.offsetting.propagation.child_curves import lay_children
from weavecore.offsetting.propagation.chords import unfold
from weavecore.offsetting.propagation.curves import Curves, Ground
from weavecore.offsetting.propagation.filter import find_room, find_uncovered, measure_nearness, stop_at
from weavecore.offsetting.propagation.intersections import curves_meet, lengths_of, meet_themselves, regroup
from weavecore.offsetting.propagation.ray_directions import seed_curves, seed_walls
from weavecore.offsetting.propagation.steps import Rays, cast_rays, end_steps
from weavecore.offsetting.spacing import Ladder, Spacing
from weavecore.tolerances import LEAST_CAP, LEAST_HEM

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


# ----------------------------------------------------------------------
# Generation after generation, until the surface is covered (Yan et al. 2016, §4.2 to §4.6).

STEPS_PER_SPACING = 10.0
"""A front has about so many vertices on a length of one spacing."""

_STEPS_PER_CAP = 4.0

_SHORT = 3.0
"""Spacings along a child up to which it may be too shallow whatever room some of its rays find."""

_MOST_ROUNDS = 5


def cover(ground: Ground, *, spacing: Spacing, parts: int = 1, progress: Progress = None) -> list[Curves]:
    """The children of each generation, from 1 on, each with what is not yet covered on its left.

    Parameters
    ----------
    spacing : float or sequence of float
        In units of the ground; of several the last goes on.
    parts : int
        Each step is made in so many, one after the other.

    Raises
    ------
    Degenerate
        When children cross, lie too near to their parents, or end inside the surface.
    """
    generations: list[Curves] = []
    ladder = Ladder.of(spacing)
    rays = _cast_from_walls(ground, ladder.step_after(0))
    covered = 0.0
    while True:
        parents = generations[-1] if generations else None
        step, step_on = (ladder.step_after(len(generations) + further) for further in (0, 1))
        children, rays_on = _step_in_parts(ground, rays, parents, step=step, step_on=step_on, parts=parts)
        if len(children) == 0:
            return generations
        generations.append(children)
        covered += step_on * float(children.lengths.sum())
        rays = stop_at(ground, rays_on, children)
        if progress is not None:
            progress(min(covered / ground.area, 1.0), "offsetting the borders")


def has_children(ground: Ground, *, spacing: float) -> bool:
    """Whether there is room for one generation."""
    return len(_children(ground, _cast_from_walls(ground, spacing), None, spacing, grandparents=None)[0]) > 0


def _cast_from_walls(ground: Ground, spacing: float) -> Rays:
    return cast_rays(ground, seed_walls(ground, step=spacing / STEPS_PER_SPACING), spacing=spacing)


def _cast_from(ground: Ground, fronts: Curves, spacing: float) -> Rays:
    return cast_rays(ground, seed_curves(ground, fronts, step=spacing / STEPS_PER_SPACING), spacing=spacing)


def _step_in_parts(
    ground: Ground, rays: Rays, parents: Curves | None, *, step: float, step_on: float, parts: int
) -> tuple[Curves, Rays]:
    """The children of some fronts, by a step in parts; and their own rays, as long as the step on.

    Fronts on the way are resampled, so that what lies between steps that part behind a saddle is offset as well.
    """
    fronts, part = parents, step / parts
    if parts > 1:
        rays = _cast_from_walls(ground, part) if parents is None else _cast_from(ground, parents, part)
        rays = rays if parents is None else stop_at(ground, rays, parents)
    for _ in range(parts - 1):
        fronts, rays = _children(ground, rays, fronts, part, grandparents=fronts)
        if len(fronts) == 0:
            return fronts, rays
        rays = stop_at(ground, rays, fronts)
    return _children(ground, rays, fronts, step_on, grandparents=parents)


def _children(
    ground: Ground, rays: Rays, parents: Curves | None, spacing: float, *, grandparents: Curves | None
) -> tuple[Curves, Rays]:
    """The children that have room before them (§4.5), and their own rays, as long as the spacing."""
    children = offset_once(ground, rays, parents)
    refuse_near(ground, rays, children)
    refuse_loose_ends(ground, children)
    rays = _cast_from(ground, children, spacing)
    if len(children) == 0:
        return children, rays
    refuse_crossings(ground, children, parents)
    stays, gone = find_room(ground, rays, children, grandparents)
    doubtful = (~stays | (lengths_of(children) < _SHORT * spacing)) & ~gone
    stays[doubtful] = _are_deep(ground, children.take(doubtful), spacing=spacing)
    return children.take(stays), rays.take(stays)


def offset_once(ground: Ground, rays: Rays, fronts: Curves | None) -> Curves:
    """The children of some fronts, regrouped until none crosses any (§4.3, §4.4), where no front has been."""
    ends = end_steps(ground, rays)
    curves, _ = lay_children(ground, rays, ends, fronts)
    meetings = meet_themselves(ground, curves)
    for _ in range(_MOST_ROUNDS):
        regrouped = regroup(ground, curves, meetings)
        curves = regrouped.curves.take(find_uncovered(ground, rays, ends, curves, regrouped))
        plain = unfold(ground, curves)
        if fronts is None or len(curves_meet(ground, plain, fronts)) == 0:
            curves = plain
        # Where several cross in one place, rounding may leave a pair.
        meetings = meet_themselves(ground, curves)
        if len(meetings) == 0:
            break
    return curves


def _are_deep(ground: Ground, fronts: Curves, *, spacing: float) -> Bools:
    """(C,) which fronts enclose what is deeper than the least cap: something is left when they are offset by it.

    A front of which nothing is left itself is judged with those that its child crosses.
    """
    if len(fronts) == 0:
        return np.zeros(0, bool)
    cap = LEAST_CAP * spacing
    rays = cast_rays(ground, seed_curves(ground, fronts, step=cap / _STEPS_PER_CAP), spacing=cap)
    rays = stop_at(ground, rays, fronts)
    ends = end_steps(ground, rays)
    raw, front = lay_children(ground, rays, ends, fronts)
    regrouped = regroup(ground, raw, meet_themselves(ground, raw))
    is_left = find_uncovered(ground, rays, ends, raw, regrouped)
    group = np.full(len(fronts), -1)
    group[front[raw.owner[regrouped.segment]]] = regrouped.group[regrouped.curves.owner]
    return np.isin(group, regrouped.group[is_left])


# ----------------------------------------------------------------------
# What must hold of fronts that were offset well; a surface on which it does not is refused.
#
# Behind sharp features steps part, and what lies between them is not offset (see docs/fronts.md).  That can leave
# fronts that cross or a part of the surface without any.

NEAREST = 0.75
"""Spacings between parent and child at least; a chord over a fan of rays or a saddle is less than the spacing."""

DEEPEST, FARTHEST = 1.05, 1.4
"""Spacings that a pocket may be deep, and another band, where a child may have come a little too far."""


def refuse_crossings(ground: Ground, children: Curves, parents: Curves | None) -> None:
    """Raise `Degenerate` where children cross each other or a parent."""
    crossing = [meet_themselves(ground, children)]
    if parents is not None:
        crossing.append(curves_meet(ground, children, parents))
    at = np.concatenate([meetings.first for meetings in crossing])
    if len(at):
        raise _too_sharp(children.face[at])


def refuse_near(ground: Ground, rays: Rays, children: Curves) -> None:
    """Raise `Degenerate` where a vertex of a child is much nearer to the parents than the spacing."""
    vertex = np.flatnonzero(children.is_vertex)
    near = measure_nearness(ground, rays, children, vertex) < NEAREST
    if near.any():
        raise _too_sharp(children.face[vertex[near]])


def refuse_loose_ends(ground: Ground, children: Curves) -> None:
    """Raise `Degenerate` where an open child does not end on a selvedge."""
    at = np.concatenate(children.ends)
    loose = ground.rims(children.face[at], children.start[at])[0] == NO_TWIN
    if loose.any():
        raise _too_sharp(children.face[at[loose]])


def refuse_broken(latitudes: Latitudes) -> None:
    """Raise `Degenerate` where the bands do not make up the surface, a child has no parent or a part no ring."""
    surface, bands = latitudes.surface, latitudes.bands
    orphans = np.setdiff1d(np.flatnonzero(latitudes.generation > 0), latitudes.parents[:, 1])
    steps = latitudes.generation[latitudes.parents[:, 1]] - latitudes.generation[latitudes.parents[:, 0]]
    band = rows_of(bands.offsets)
    top = np.zeros(len(bands))
    np.maximum.at(top, band[bands.is_parent], latitudes.distance[bands.polyline[bands.is_parent]])
    has_child = np.bincount(band[~bands.is_parent], minlength=len(bands)) > 0
    is_cut = np.bincount(band, ~latitudes.polylines.closed[bands.polyline], minlength=len(bands)) > 0
    deepest = np.where(is_cut, 1.0 + LEAST_HEM, DEEPEST)  # A child so near to a selvedge may be left out.
    too_deep = bands.depth > top + np.where(has_child, FARTHEST, deepest) * latitudes.spacing
    # Cut along its origins and all fronts the surface has one more for each open front.
    _, nodes = part_vertices(surface)
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
