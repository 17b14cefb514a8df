"""Stock diameters: what rods are sold in, and the thickest that a weave can be bent from.

A rod passes a joint up to the diameter at which its bend there uses up the allowable stress.  The diameter that is
chosen is the thickest of a list with which all rods pass; where few joints ask for a much thinner rod than all others,
it is the thickest that passes nearly all joints, and the rods are broken at the few.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from importlib import resources
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.units import METRES, NO_UNIT

LEAST_SHARE = 0.99
"""Share of the joints at which rods of the chosen diameter can be bent: at the others they are broken."""

LEAST_OF_THICKEST = 0.5
"""So much of its thickness is given up rather than break a rod: half the diameter is a quarter of the material."""

LEAST_RODS = 0.98
"""Share of the rods that must pass once they are broken; else a thinner diameter of the stock is tried."""

MOST_SHORT = 0.01
"""Share of the rods that breaks may make shorter than four joints; else a thinner diameter of the stock is tried."""

_METRES = {"mm": 0.001, "in": 0.0254}
"""Metres in one unit of the table of stock diameters."""

_IN_INCHES = ("Inches", "Feet", "Yards", "Miles", "Microinches", "Mils")
"""Rhino's units in which rods are bought by the inch."""

_LIKE = {"gfrp-short": "gfrp"}
"""Materials that are sold in the diameters of another one: the same rods under a shorter load."""

_USUAL = "gfrp"
"""A material without a list of its own is taken to be sold as this one."""


def stock_diameters(material: str, unit: str) -> tuple[float, ...]:
    """Diameters in which a material is sold, rising, in the model's unit; none where the model has no unit.

    Parameters
    ----------
    material : str
    unit : str
        Rhino's name of the model's unit.
    """
    if unit == NO_UNIT:
        return ()
    table = _table()
    sizes = "in" if unit in _IN_INCHES else "mm"
    rows = table.get((_LIKE.get(material, material), sizes), table[_USUAL, sizes])
    scale = _METRES[sizes] / METRES[unit]
    return tuple(float(size) * scale for size in rows)


@lru_cache(maxsize=1)
def _table() -> dict[tuple[str, str], tuple[Fraction, ...]]:
    text = resources.files("weavecore.weaving").joinpath("stock_diameters.csv").read_text("utf-8")
    return {
        (row["material"], row["unit"]): tuple(map(Fraction, row["diameters"].split()))
        for row in csv.DictReader(text.splitlines())
    }


def choose_diameter(largest: Floats, stock: Sequence[float]) -> float:
    """The diameter for a weave, from what each of its joints allows.

    The thickest with which rods pass all joints, if that is at least `LEAST_OF_THICKEST` of the thickest with which
    they pass `LEAST_SHARE` of them; else the latter.  The thinnest of the stock where neither is in it.

    Parameters
    ----------
    largest : (M,) float64
        The largest diameter that passes at each visit of a rod to a joint.
    stock : sequence of float
        Rising, in the same unit; if it is empty any diameter of two digits will do.

    Returns
    -------
    float
    """
    rising = np.sort(largest)
    everywhere = _in_stock(float(rising[0]), stock)
    nearly = _in_stock(float(rising[int(np.floor((1.0 - LEAST_SHARE) * len(rising)))]), stock)
    return everywhere if everywhere >= LEAST_OF_THICKEST * nearly else nearly


def _in_stock(most: float, stock: Sequence[float]) -> float:
    """The thickest of the stock that is no thicker, else the thinnest; without a stock rounded down to two digits."""
    if len(stock):
        return max([size for size in stock if size <= most], default=min(stock))
    step = float(f"1e{Decimal(most).adjusted() - 1}")
    return float(np.floor(most / step) * step)


def next_thinner(diameter: float, stock: Sequence[float]) -> Optional[float]:
    """The next diameter of the stock below one, or None; without a stock there is none.

    Parameters
    ----------
    diameter : float
    stock : sequence of float
        In the same unit.
    """
    return max((size for size in stock if size < diameter), default=None)
