"""Generation after generation, until the surface is covered (Yan et al. 2016, §4.2 to §4.6)."""

from __future__ import annotations

from typing import Callable, Optional

from weavecore.offsetting.fronts.ground import Curves, Ground
from weavecore.offsetting.fronts.judging import find_room, find_uncovered
from weavecore.offsetting.fronts.laying import lay_children
from weavecore.offsetting.fronts.meeting import meet_themselves
from weavecore.offsetting.fronts.rays import Rays, cast_rays, end_steps
from weavecore.offsetting.fronts.regrouping import regroup
from weavecore.offsetting.fronts.seeds import seed_curves, seed_walls

STEPS_PER_SPACING = 10.0
"""A front has about so many vertices on a length of one spacing."""

Progress = Optional[Callable[[float, str], None]]


def cover(ground: Ground, *, spacing: float, progress: Progress = None) -> list[Curves]:
    """The children of each generation, from 1 on, each with what is not yet covered on its left.

    Parameters
    ----------
    spacing : float
        In units of the ground.
    """
    step = spacing / STEPS_PER_SPACING
    generations: list[Curves] = []
    rays = cast_rays(ground, seed_walls(ground, step=step), spacing=spacing)
    while True:
        children = _children(ground, rays)
        if len(children) == 0:
            return generations
        rays = cast_rays(ground, seed_curves(ground, children, step=step), spacing=spacing)
        stays, rays = find_room(ground, rays, children, generations[-1] if generations else None)
        if not stays.any():
            return generations
        generations.append(children.take(stays))
        if progress is not None:
            progress(0.5, f"generation {len(generations)}")


def _children(ground: Ground, rays: Rays) -> Curves:
    ends = end_steps(ground, rays)
    raw = lay_children(ground, rays, ends)
    regrouped = regroup(ground, raw, meet_themselves(ground, raw))
    return regrouped.curves.take(find_uncovered(ground, rays, ends, raw, regrouped))
