"""`measure`: spacing, edge lengths, regularity and bending of a result, taken from the result itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional, Union

import numpy as np

from weavecore.errors import Unsupported
from weavecore.fabricating.needs import MaterialNeeds, estimate_needs
from weavecore.fabricating.workshop import Workshop
from weavecore.geometry.arrays import Floats
from weavecore.model import Latitudes, Lattice, Weave
from weavecore.polling import each
from weavecore.units import millimetres_in
from weavecore.viewing.summary import regular_share

Measured = Union[Latitudes, Lattice, Weave]

_NEAR = 4
"""Segments of the parents to which the distance of a point of a child is measured: those with the nearest middles."""


@dataclass(frozen=True, eq=False)
class Measures:
    """Figures in the model's unit; None where the result is that of an earlier stage.

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
    length : float, optional
        Of all rods together.
    n_joints : int, optional
    waste : float, optional
        Share of bars of the usual length that is left over; None where the unit is not known or rods cannot be cut.
    mass : float, optional
        Of all pieces in kg; None as the waste, or where the density is not known.
    """

    spacing: Floats
    edges: Optional[Floats] = None
    regular: Optional[float] = None
    least_radius: Optional[float] = None
    utilisation: Optional[float] = None
    length: Optional[float] = None
    n_joints: Optional[int] = None
    waste: Optional[float] = None
    mass: Optional[float] = None


def measure(value: Measured, unit: Optional[str] = None) -> Measures:
    """Measure a result.

    Parameters
    ----------
    value : Latitudes, Lattice or Weave
    unit : str, optional
        Of the value, where it states none.

    Returns
    -------
    Measures

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
    needs = _needs(weave, unit) if weave else None
    return Measures(
        spacing=_spacings(latitudes),
        edges=lattice.edge_lengths if isinstance(lattice, Lattice) else None,
        regular=regular_share(lattice) if isinstance(lattice, Lattice) else None,
        least_radius=float(weave.bending.min_radius.min(initial=np.inf)) if weave else None,
        utilisation=float(weave.bending.utilisation.max(initial=0.0)) if weave else None,
        length=float(weave.axes.lengths.sum()) if weave else None,
        n_joints=len(weave.joints) if weave else None,
        waste=needs.waste if needs else None,
        mass=needs.kilograms if needs else None,
    )


def _needs(weave: Weave, unit: Optional[str]) -> Optional[MaterialNeeds]:
    """What is cut from bars of the usual length; None where the unit is not known, or rods cannot be cut from them."""
    try:
        scale = millimetres_in(weave.lattice.latitudes.surface.unit, unit)
        return estimate_needs(weave, scale=scale, workshop=Workshop(templates=()))
    except Unsupported:
        return None


def measures_caption(measures: Measures) -> str:
    """The figures in one line.

    Parameters
    ----------
    measures : Measures

    Returns
    -------
    str
        Regularity and least radius, or for latitudes the mean spacing.
    """
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
    for child in each(np.unique(latitudes.parents[:, 1]).tolist()):
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
