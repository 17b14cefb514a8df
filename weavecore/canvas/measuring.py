"""`measure`: the figures of a result that a designer looks at, taken from the result itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.model import Latitudes, Lattice, Weave
from weavecore.viewing.summary import regular_share

Measured = Union[Latitudes, Lattice, Weave]

_NEAR = 4
"""So many points of the parents are looked at beside each point of a child."""


@dataclass(frozen=True, eq=False)
class Measures:
    """Figures in the model's unit; None where the result does not go so far.

    Parameters
    ----------
    spacing : (R,) float64
        Mean straight distance of each polyline but the borders from its parents.
    edges : (E,) float64, optional
        Straight lengths of the edges of the lattice.
    regular : float, optional
        Part of the inner nodes with as many edges as the pattern has.
    least_radius : float, optional
        Of the sharpest bend of any rod.
    utilisation : float, optional
        The largest of any rod; above 1 exceeds the allowable stress.
    """

    spacing: Floats
    edges: Optional[Floats] = None
    regular: Optional[float] = None
    least_radius: Optional[float] = None
    utilisation: Optional[float] = None


def measure(value: Measured) -> Measures:
    """Measure a result.

    Parameters
    ----------
    value : Latitudes, Lattice or Weave

    Raises
    ------
    Unsupported
        Where it is none of them.
    """
    weave = value if isinstance(value, Weave) else None
    lattice = value.lattice if isinstance(value, Weave) else value
    latitudes = lattice.latitudes if isinstance(lattice, Lattice) else lattice
    if not isinstance(latitudes, Latitudes):
        raise Unsupported(
            f"There is nothing to measure of a {type(value).__name__}", remedy="Give latitudes, a lattice or a weave."
        )
    return Measures(
        spacing=_spacings(latitudes),
        edges=lattice.edge_lengths if isinstance(lattice, Lattice) else None,
        regular=regular_share(lattice) if isinstance(lattice, Lattice) else None,
        least_radius=float(weave.bending.min_radius.min(initial=np.inf)) if weave else None,
        utilisation=float(weave.bending.utilisation.max(initial=0.0)) if weave else None,
    )


def measures_caption(measures: Measures) -> str:
    """The figures in one line."""
    parts = [] if measures.regular is None else [f"{measures.regular:.0%} regular"]
    if measures.least_radius is not None:
        parts.append(f"least radius {measures.least_radius:.4g}")
    if not parts and len(measures.spacing):
        parts.append(f"spacing {measures.spacing.mean():.4g}")
    return ", ".join(parts)


def _spacings(latitudes: Latitudes) -> Floats:
    """Mean distance of each child from its parents' segments, straight through space."""
    from scipy.spatial import cKDTree

    lines = latitudes.polylines
    spacings = []
    for child in np.unique(latitudes.parents[:, 1]).tolist():
        parents = latitudes.parents[latitudes.parents[:, 1] == child, 0].tolist()
        starts = np.concatenate([lines.polyline(p) for p in parents])
        ends = np.concatenate([np.roll(lines.polyline(p), -1, axis=0) for p in parents])
        points = lines.polyline(child)
        near = np.atleast_2d(cKDTree((starts + ends) / 2).query(points, k=min(_NEAR, len(starts)))[1])
        near = near.reshape(len(points), -1)
        spacings.append(float(_distance(points[:, None], starts[near], ends[near]).min(1).mean()))
    return np.array(spacings)


def _distance(points: Floats, starts: Floats, ends: Floats) -> Floats:
    """Distance of points from segments, all (…, 3)."""
    along = ends - starts
    square = np.maximum((along * along).sum(-1), np.finfo(float).tiny)
    part = np.clip(((points - starts) * along).sum(-1) / square, 0.0, 1.0)
    distances: Floats = np.linalg.norm(points - starts - part[..., None] * along, axis=-1)
    return distances
