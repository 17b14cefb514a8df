"""Bending: the least radius of every rod, and what its material says to it.

A straight rod of diameter d that is bent to radius R carries the stress E·d / (2R), so it is
admissible while R ≥ E·d / (2σ).
"""

from __future__ import annotations

import csv
from functools import lru_cache
from importlib import resources

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, rows_of
from weavecore.geometry.splines import mean_curvature, points_at_stations
from weavecore.model.bending import Bending, Material
from weavecore.model.rod_axes import RodAxes
from weavecore.units import METRES

WINDOW_DIAMETERS, WINDOW_METRES = 5.0, 0.050
"""The curvature is taken over so many diameters, and over 50 mm at least."""

_SAMPLES_PER_WINDOW = 8


def bending_window(rod_diameter: float, unit: str) -> float:
    """The arc length that curvature is taken over; without a known unit 50 mm mean nothing and are left out."""
    window = WINDOW_DIAMETERS * rod_diameter
    return max(window, WINDOW_METRES / METRES[unit]) if unit in METRES else window


def measure_bending(axes: RodAxes, *, rod_diameter: float, material: Material, unit: str) -> Bending:
    """Find the sharpest bend of every rod.

    Parameters
    ----------
    axes : RodAxes
    rod_diameter : float
        In the model's unit.
    material : Material
    unit : str
        Rhino's name of the model's unit.
    """
    window = bending_window(rod_diameter, unit)
    samples = axes.samples(window / _SAMPLES_PER_WINDOW)
    curvature, middle = mean_curvature(samples, axes.closed, window)
    sharpest = _first_greatest(curvature, samples.offsets)
    station = np.where(axes.closed, middle[sharpest] % axes.lengths, middle[sharpest])
    with np.errstate(divide="ignore"):
        radius = 1.0 / curvature[sharpest]
    return Bending(
        window=window,
        min_radius=radius,
        station_at_min=station,
        point_at_min=points_at_stations(samples, np.arange(len(axes)), station),
        utilisation=material.least_bend * rod_diameter / radius,
        largest_diameter=radius / material.least_bend,
    )


def _first_greatest(values: Floats, offsets: Ints) -> Ints:
    """Index of the greatest value of each row, the first of equals."""
    row = rows_of(offsets)
    is_greatest = np.flatnonzero(values == np.maximum.reduceat(values, offsets[:-1])[row])
    _, first = np.unique(row[is_greatest], return_index=True)
    return is_greatest[first]


# ----------------------------------------------------------------------
# The table of materials, ``materials.csv``: one row each, with where its figures come from.
#
# A material of one's own is a `Material` made with the same figures.


@lru_cache(maxsize=1)
def known_materials() -> dict[str, Material]:
    """All materials of the table by name."""
    text = resources.files("weavecore.weaving").joinpath("materials.csv").read_text("utf-8")
    return {
        row["name"]: Material(
            row["name"],
            modulus=float(row["modulus_gpa"]),
            strength=float(row["strength_mpa"]),
            factor=float(row["factor"]),
            density=float(row["density_kg_m3"]),
            source=row["source"],
        )
        for row in csv.DictReader(text.splitlines())
    }


def material_named(name: str) -> Material:
    """The material of that name.

    Raises
    ------
    Unsupported
        When the table has none.
    """
    known = known_materials()
    if name not in known:
        raise Unsupported(
            f"There is no material {name!r}",
            remedy=f"Take one of: {', '.join(known)}; or give a Material of your own.",
        )
    return known[name]
