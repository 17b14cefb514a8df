"""A weave at rest on the canvas: places and forces from wires, and what ``Weave_Simulate`` puts out."""

from __future__ import annotations

from typing import Any, NamedTuple, Optional

import numpy as np
from scipy.interpolate import make_interp_spline

from weavecore import pipeline
from weavecore.canvas.inputs import coordinates, referenced
from weavecore.canvas.results import family_branches
from weavecore.canvas.solve import Run
from weavecore.canvas.trees import grouped
from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.model import Equilibrium, Weave
from weavecore.model.springs import springs_of
from weavecore.units import METRES, NO_UNIT, millimetres_in, with_unit

_RODS_A_POLL = 32
"""Rods that are drawn before Escape is polled again: a few milliseconds each."""


class EquilibriumResults(NamedTuple):
    """Rods at rest, departures, utilisations, supports and reactions, and the weave as springs."""

    rods: Any
    departure: list[float]
    utilisation: Any
    held: list[Any]
    reactions: list[Any]
    stable: bool
    springs: Any
    lengths: Any
    strengths: Any
    ties: list[Any]


def unit_of(run: Run, weave: Weave) -> Optional[str]:
    """The unit of the document, where the weave states none; None where it does, or where neither is known.

    Parameters
    ----------
    run : Run
    weave : Weave
    """
    is_stated = weave.lattice.latitudes.surface.unit in METRES
    return None if is_stated or run.document.unit == NO_UNIT else run.document.unit


def read_places(run: Run, values: Any) -> list[Floats]:
    """Points and curves that come to an input of list access.

    Parameters
    ----------
    run : Run
    values : iterable
        Points and curves of Rhino, or the ids of such objects.

    Returns
    -------
    list of (n, 3) float64
        A single row for a point.

    Raises
    ------
    WeaveError
        As `weavecore.reading.curves_from`.
    """
    found = [referenced(value) for value in values or () if value is not None]
    points = [coordinates(value) for value in found]
    curves = [value for value, point in zip(found, points) if point is None]
    sampled = iter(pipeline.curves_from(curves, tolerance=run.document.tolerance))
    return [next(sampled) if point is None else point[None] for point in points]


def read_loads(points: Any, forces: Any) -> list[tuple[Floats, Floats]]:
    """Forces in N on points; the last force is taken for the points that have none.

    Parameters
    ----------
    points, forces : iterable
        Points and vectors of Rhino.

    Returns
    -------
    list of ((3,), (3,))

    Raises
    ------
    Unsupported
        Where there are points without forces, or forces without points, or one of them is neither.
    """
    places = [coordinates(referenced(value)) for value in points or () if value is not None]
    vectors = [coordinates(value) for value in forces or () if value is not None]
    if any(one is None for one in (*places, *vectors)):
        raise Unsupported("The points must be points and the forces vectors", remedy="Wire points and vectors.")
    if bool(places) != bool(vectors):
        raise Unsupported("Points need forces, and forces points", remedy="Wire both, or none.")
    if len(vectors) > len(places):
        raise Unsupported(
            f"There are {len(vectors)} forces for {len(places)} points", remedy="Wire a point for each force."
        )
    vectors += vectors[-1:] * (len(places) - len(vectors))
    return [(place, vector) for place, vector in zip(places, vectors) if place is not None and vector is not None]


def draw_equilibrium(run: Run, equilibrium: Equilibrium) -> EquilibriumResults:
    """Draw a weave at rest.

    Parameters
    ----------
    run : Run
    equilibrium : Equilibrium

    Returns
    -------
    EquilibriumResults
    """
    weave, drawing = equilibrium.weave, run.drawing
    branch, curves = family_branches(weave), []
    for s in range(len(weave)):
        if s % _RODS_A_POLL == 0:
            run.progress(s / len(weave), "drawing")
        curves.append(drawing.spline(*curve_at_rest(equilibrium, s)))
    used = equilibrium.greatest_of_rods(equilibrium.utilisation).tolist()
    held = equilibrium.is_supported
    metres = millimetres_in(weave.lattice.latitudes.surface.unit, unit_of(run, weave)) / 1000.0
    springs = springs_of(weave, metres=metres)
    lines = drawing.lines(springs.starts, springs.ends)
    return EquilibriumResults(
        rods=run.tree(grouped(branch, curves)),
        departure=equilibrium.departure.tolist(),
        utilisation=run.tree(grouped(branch, used)),
        held=list(drawing.points(weave.lattice.nodes[held])),
        reactions=drawing.vectors(equilibrium.reaction[held]),
        stable=equilibrium.is_stable,
        springs=run.tree(grouped(springs.rod.tolist(), lines)),
        lengths=run.tree(grouped(springs.rod.tolist(), springs.rest_length.tolist())),
        strengths=run.tree(grouped(springs.rod.tolist(), springs.stiffness.tolist())),
        ties=drawing.lines(springs.tie_starts, springs.tie_ends),
    )


def curve_at_rest(equilibrium: Equilibrium, rod: int) -> tuple[Floats, Floats]:
    """Knots and control points of a cubic through the points of a rod.

    Parameters
    ----------
    equilibrium : Equilibrium
    rod : int
    """
    points = equilibrium.points[equilibrium.offsets[rod] : equilibrium.offsets[rod + 1]]
    is_closed = bool(equilibrium.weave.strands.closed[rod])
    through = np.concatenate([points, points[:1]]) if is_closed else points
    at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))])
    curve: Any = make_interp_spline(at, through, k=3, bc_type="periodic" if is_closed else "natural")
    return curve.t, curve.c


def equilibrium_caption(equilibrium: Equilibrium) -> str:
    """Departure and utilisation in one line.

    Parameters
    ----------
    equilibrium : Equilibrium
    """
    largest = with_unit(equilibrium.departure_max, equilibrium.weave.lattice.latitudes.surface.unit, digits=3)
    return f"departs by {largest} at most, utilisation {equilibrium.utilisation_max:.2f}"


def equilibrium_concerns(equilibrium: Equilibrium) -> list[str]:
    """List what speaks against building it so.

    Parameters
    ----------
    equilibrium : Equilibrium

    Returns
    -------
    list of str
        One sentence each; empty where nothing is wrong.
    """
    said = []
    if not equilibrium.is_stable:
        said.append("The weave does not stay at rest. Hold more nodes, or reduce the loads.")
    if equilibrium.utilisation_max > 1:
        rod = equilibrium.weave.ids[int(equilibrium.rod[np.argmax(equilibrium.stress)])]
        stress = f"{equilibrium.utilisation_max:.2f} times the allowable stress in {rod}"
        said.append(f"At rest there is {stress}. Take thinner rods, another material or a larger spacing.")
    return said
