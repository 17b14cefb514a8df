"""Surfaces whose distances start at a part of their borders."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weavecore.model.surface import Origins


def starting_where(surface, *tests):
    """Distances start at the border where a test holds of its points: a whole loop, or one run of it for each test."""
    paths, closed = [], []
    for test in tests:
        for loop in surface.borders:
            on = test(surface.vertices[loop])
            if on.sum() > 1:
                begin = 0 if on.all() else np.flatnonzero(on & ~np.roll(on, 1))[0]
                paths.append(np.roll(loop, -begin)[: on.sum()])
                closed.append(bool(on.all()))
    return replace(surface, starts=Origins(tuple(paths), np.array(closed)))


def left_of(x):
    return lambda points: points[:, 0] < x
