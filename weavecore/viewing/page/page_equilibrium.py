"""What the page shows of a weave at rest: how far each sample of the drawn rods moves, and the stress there.

The move along a rod is a cubic spline by arc length through those of the points of the equilibrium and goes on straight
beyond the outermost joints; the stress is linear between these points.  The page draws `drawn + amount · move`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from weavecore.geometry.arrays import Floats, Ints, next_in_loop
from weavecore.model import Equilibrium
from weavecore.viewing.page.page_curves import PageCurves


def stations_at_points(equilibrium: Equilibrium) -> Floats:
    """(n,) where the points of the equilibrium lie on the drawn axes: at equal steps between two joints.

    Parameters
    ----------
    equilibrium : Equilibrium
    """
    weave, index = equilibrium.weave, np.arange(len(equilibrium.points))
    axes, visits = weave.axes, equilibrium.point_of_visit
    before = np.searchsorted(visits, index, side="right") - 1
    after = next_in_loop(weave.strands.offsets)[before]
    is_wrap = after <= before
    end = np.where(is_wrap, axes.lengths[equilibrium.rod], axes.stations[after])
    point_after = np.where(is_wrap, equilibrium.offsets[equilibrium.rod + 1], visits[after])
    part = (index - visits[before]) / np.maximum(point_after - visits[before], 1)
    stations: Floats = axes.stations[before] + part * (end - axes.stations[before])
    return stations


def moves_of_samples(equilibrium: Equilibrium, curves: PageCurves) -> tuple[Floats, Floats]:
    """How far each sample of the rods moves, and the utilisation there.

    Parameters
    ----------
    equilibrium : Equilibrium
    curves : PageCurves
        Of its weave.

    Returns
    -------
    moves : (N, 3) float64
    utilisation : (N,) float64
    """
    at, move = stations_at_points(equilibrium), equilibrium.points - equilibrium.drawn
    used = equilibrium.utilisation
    moves, utilisation = np.zeros(curves.points.shape), np.zeros(len(curves.points))
    for s, is_closed in enumerate(curves.closed.tolist()):
        of_points = np.arange(equilibrium.offsets[s], equilibrium.offsets[s + 1])
        part = slice(curves.offsets[s], curves.offsets[s + 1])
        known, values, stress = at[of_points], move[of_points], used[of_points]
        if is_closed:
            known = np.append(known, known[0] + curves.lengths[s])
            values, stress = (np.concatenate([rows, rows[:1]]) for rows in (values, stress))
        wanted = curves.stations[part]
        moves[part] = _along(known, values, wanted, is_closed=is_closed)
        utilisation[part] = np.interp(wanted, known, stress)
    return moves, utilisation


def _along(known: Floats, values: Floats, wanted: Floats, *, is_closed: bool) -> Floats:
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(known, values, bc_type="periodic" if is_closed else "natural")
    inside = np.clip(wanted, known[0], known[-1])
    straight: Floats = spline(inside) + (wanted - inside)[:, None] * spline(inside, 1)
    return straight


def equilibrium_figures(equilibrium: Equilibrium) -> dict[str, Any]:
    """Numbers for the legend, and the extremes of each rod.

    Parameters
    ----------
    equilibrium : Equilibrium

    Returns
    -------
    dict
        JSON values and arrays.
    """
    material = equilibrium.weave.material
    return {
        "allowableStress": material.strength / material.factor,
        "largestMove": equilibrium.departure_max,
        "rodUtilisation": equilibrium.greatest_of_rods(equilibrium.utilisation),
        "rodStress": equilibrium.greatest_of_rods(equilibrium.stress),
        "rodForce": _furthest_from_zero(equilibrium.axial_force, equilibrium.offsets),
        "rodMove": equilibrium.rod_departure,
    }


def _furthest_from_zero(values: Floats, offsets: Ints) -> Floats:
    high, low = np.maximum.reduceat(values, offsets[:-1]), np.minimum.reduceat(values, offsets[:-1])
    return np.where(high >= -low, high, low)
