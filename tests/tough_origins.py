"""Tough surfaces that are offset from a part of their borders only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.model import Origins, SurfaceMesh


def started(surface: SurfaceMesh, rng: np.random.Generator) -> SurfaceMesh:
    """The surface with distances that start at some borders of each component, or at a stretch of its only one."""
    component = np.zeros(surface.n_vertices, np.int64)
    component[surface.faces] = surface.component_of_face[:, None]
    paths, closed = [], []
    for c in range(int(component.max()) + 1):
        loops = [loop for loop in surface.borders if component[loop[0]] == c]
        if len(loops) > 1:
            chosen = rng.permutation(len(loops))[: rng.integers(1, len(loops))]
            paths += [loops[k] for k in sorted(chosen)]
            closed += [True] * len(chosen)
        elif loops:
            loop = np.roll(loops[0], rng.integers(len(loops[0])))
            paths.append(loop[: max(2, int(len(loop) * rng.uniform(0.1, 0.7)))])
            closed.append(False)
        else:
            own = [cut for cut in surface.cuts if component[cut[0]] == c]
            paths += own
            closed += [True] * len(own)
    return replace(surface, starts=Origins(tuple(paths), np.array(closed)), cuts=())
