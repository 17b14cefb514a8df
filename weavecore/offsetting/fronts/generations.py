"""Generation after generation, until the surface is covered (Yan et al. 2016, §4.2 to §4.6)."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from weavecore.geometry.arrays import Bools
from weavecore.offsetting.fronts.checking import refuse_crossings, refuse_loose_ends, refuse_near
from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.judging import find_room, find_uncovered, stop_at
from weavecore.offsetting.fronts.laying import lay_children
from weavecore.offsetting.fronts.meeting import curves_meet, meet_themselves
from weavecore.offsetting.fronts.rays import Rays, cast_rays, end_steps
from weavecore.offsetting.fronts.regrouping import lengths_of, regroup
from weavecore.offsetting.fronts.seeds import seed_curves, seed_walls
from weavecore.offsetting.fronts.unfolding import unfold
from weavecore.offsetting.ladder import Ladder, Spacing
from weavecore.tolerances import LEAST_CAP

STEPS_PER_SPACING = 10.0
"""A front has about so many vertices on a length of one spacing."""

_STEPS_PER_CAP = 4.0

_SHORT = 3.0
"""Spacings along a child up to which it may be too shallow whatever room some of its rays find."""

_MOST_ROUNDS = 5

Progress = Optional[Callable[[float, str], None]]


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
        children, rays_on = _offset_in_parts(ground, rays, parents, step=step, step_on=step_on, parts=parts)
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


def _offset_in_parts(
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
