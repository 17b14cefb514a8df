"""Weaves to be tested: a tube of any measures, and the sample files."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Optional

import numpy as np
from scipy.interpolate import BSpline

from weavecore import pipeline
from weavecore.model import Latitudes, SurfaceMesh, Weave

FOLDER = Path(__file__).resolve().parents[1] / "sample_files"


@cache
def tube_latitudes(radius: float = 300.0, height: float = 540.0, spacing: float = 60.0) -> Latitudes:
    """The latitudes of an upright tube in millimetres."""
    columns, rows = 144, 55
    turn = 2 * np.pi * np.arange(columns) / columns
    circle = radius * np.c_[np.cos(turn), np.sin(turn)]
    vertices = np.concatenate([np.c_[circle, np.full(columns, z)] for z in np.linspace(0, height, rows)])
    r, j = (part.ravel() for part in np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij"))
    a, b = r * columns + j, r * columns + (j + 1) % columns
    faces = np.concatenate([np.c_[a, b, b + columns], np.c_[a, b + columns, a + columns]])
    return pipeline.offset(SurfaceMesh(vertices, faces, unit="Millimeters"), spacing=spacing)


@cache
def woven_tube(pattern: str, rod_diameter: float = 5.0, over_under: Optional[str] = None) -> Weave:
    lattice = pipeline.link(tube_latitudes(), pattern=pattern)
    return pipeline.weave(lattice, rod_diameter=rod_diameter, over_under=over_under)


@cache
def sample_latitudes(name: str, coarser: float) -> Latitudes:
    """The latitudes of a sample file, so many times as far apart as is suggested."""
    surface = pipeline.read_surface(FOLDER / f"{name}.3dm")
    return pipeline.offset(surface, spacing=coarser * pipeline.suggest_spacing(surface))


@cache
def woven_sample(name: str, pattern: str, rod_diameter: Optional[float] = None, coarser: float = 2.0) -> Weave:
    lattice = pipeline.link(sample_latitudes(name, coarser), pattern=pattern)
    return pipeline.weave(lattice, rod_diameter=rod_diameter)


def curve_of(weave: Weave, s: int) -> BSpline:
    """The axis of a strand as SciPy evaluates it."""
    return BSpline(*weave.axes.bspline(s), 3)


def sides_along(weave: Weave, s: int) -> list[int]:
    """1 over, -1 under and 0 between, at the joints along a strand, read off the order at each joint."""
    joints = weave.joints
    place = {visit: k for k, visit in enumerate(joints.visit.tolist())}
    found = []
    for visit in range(weave.strands.offsets[s], weave.strands.offsets[s + 1]):
        if visit in place:
            j = joints.joint[place[visit]]
            last = joints.offsets[j + 1] - joints.offsets[j] - 1
            rank = joints.rank[place[visit]]
            found.append(-1 if rank == 0 else 1 if rank == last else 0)
    return found
