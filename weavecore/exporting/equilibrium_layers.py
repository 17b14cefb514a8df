"""The layers of a .3dm that show a weave at rest.

::

    equilibrium::rods::FAMILY    rods at rest as NURBS curves, coloured by their largest utilisation
    equilibrium::stress          points along the rods as one cloud, coloured by utilisation
    equilibrium::nodes           nodes at rest as one cloud, coloured by departure
    equilibrium::departure       an arrow from where each node was drawn to where it rests, in true size
    equilibrium::supports        nodes that are held as one cloud
    equilibrium::reactions       an arrow for the force of the support on each of them
    equilibrium::loads           an arrow for the loads on each node
    equilibrium::legend          dots: what the colours mean, and where the extremes are

Arrows of forces have their newtons, and the length that stands for one newton, as user text.  Colours run from blue
at 0 to red at the allowable stress, or at the largest departure.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from weavecore.exporting.rhino_builder import RhinoFileBuilder
from weavecore.geometry.arrays import Floats
from weavecore.model import Equilibrium
from weavecore.palette import LONGITUDES, NODES, POCKETS, utilisation_colours
from weavecore.units import with_unit

ROD_LAYERS = {"L": "latitudes", "A": "longitudes forward", "B": "longitudes back", "P": "pockets"}
"""Layer of a rod by the first letter of its name."""

ROD_LAYER_COLOUR = (90, 90, 96)
"""Colour of these layers; each rod has one of its own, by utilisation."""

_LONGEST_ARROW = 0.1
"""Length of the arrow of the largest force, in diagonals of the bounding box: visible, and shorter than the weave."""

_LEAST_ARROW = 1e-3
"""Departures and forces below this part of the largest one get no arrow: it would be shorter than its head."""


def add_equilibrium(builder: RhinoFileBuilder, equilibrium: Equilibrium) -> None:
    """Add all layers of a weave at rest.

    Parameters
    ----------
    builder : RhinoFileBuilder
    equilibrium : Equilibrium
    """
    _add_rods(builder, equilibrium)
    _add_stress(builder, equilibrium)
    _add_departure(builder, equilibrium)
    at_rest = equilibrium.weave.lattice.nodes + equilibrium.node_move
    held = equilibrium.is_supported
    if held.any():
        texts = {"supports": equilibrium.supports, "loads": equilibrium.loads}
        builder.add_points(at_rest[held], builder.layer("equilibrium::supports", POCKETS), "supports", texts)
    _add_forces(builder, equilibrium.reaction, at_rest, "reactions", POCKETS)
    _add_forces(builder, equilibrium.load, at_rest, "loads", LONGITUDES)
    _add_legend(builder, equilibrium, at_rest)


def _add_rods(builder: RhinoFileBuilder, equilibrium: Equilibrium) -> None:
    from scipy.interpolate import make_interp_spline

    weave, offsets = equilibrium.weave, equilibrium.offsets
    utilisation = equilibrium.greatest_of_rods(equilibrium.utilisation)
    figures = {
        "stress_mpa": equilibrium.greatest_of_rods(equilibrium.stress),
        "utilisation": utilisation,
        "axial_force_n": equilibrium.greatest_of_rods(np.abs(equilibrium.axial_force)),
        "moment_nm": equilibrium.greatest_of_rods(equilibrium.moment),
        "departure": equilibrium.rod_departure,
    }
    colours = utilisation_colours(utilisation).tolist()
    for s, name in enumerate(weave.ids):
        layer = builder.layer(f"equilibrium::rods::{ROD_LAYERS[name[0]]}", ROD_LAYER_COLOUR)
        points, is_closed = equilibrium.points[offsets[s] : offsets[s + 1]], bool(weave.strands.closed[s])
        through = np.concatenate([points, points[:1]]) if is_closed else points
        at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))])
        curve: Any = make_interp_spline(at, through, k=3, bc_type="periodic" if is_closed else "natural")
        texts = {"id": name, **{key: float(values[s]) for key, values in figures.items()}}
        builder.add_curve(curve.t, curve.c, layer, f"{name} at rest", texts, tuple(colours[s]))


def _add_stress(builder: RhinoFileBuilder, equilibrium: Equilibrium) -> None:
    material = equilibrium.weave.material
    texts = {
        "stress_max_mpa": equilibrium.stress_max,
        "allowable_stress_mpa": material.strength / material.factor,
        "utilisation_max": equilibrium.utilisation_max,
    }
    layer = builder.layer("equilibrium::stress", ROD_LAYER_COLOUR)
    builder.add_points(equilibrium.points, layer, "stress", texts, utilisation_colours(equilibrium.utilisation))


def _add_departure(builder: RhinoFileBuilder, equilibrium: Equilibrium) -> None:
    drawn, move = equilibrium.weave.lattice.nodes, equilibrium.node_move
    departure, largest = equilibrium.departure, equilibrium.departure_max
    colours = utilisation_colours(departure / max(largest, np.finfo(float).tiny))
    texts = {
        "departure_mean": equilibrium.departure_mean,
        "departure_p95": equilibrium.departure_p95,
        "departure_max": largest,
    }
    builder.add_points(drawn + move, builder.layer("equilibrium::nodes", NODES), "nodes at rest", texts, colours)
    layer = builder.layer("equilibrium::departure", NODES)
    for node in np.flatnonzero(departure > _LEAST_ARROW * largest).tolist():
        arrow = np.stack([drawn[node], drawn[node] + move[node]])
        of_node = {"node": node, "departure": float(departure[node])}
        builder.add_polyline(arrow, layer, f"node {node}", of_node, tuple(colours[node].tolist()), is_arrow=True)


def _add_forces(
    builder: RhinoFileBuilder, forces: Floats, at_rest: Floats, name: str, colour: tuple[int, int, int]
) -> None:
    """Add an arrow for each force (N, 3): reactions push with their heads at the node, loads begin at it."""
    size = np.linalg.norm(forces, axis=1)
    largest = float(size.max(initial=0.0))
    if largest == 0.0:
        return
    scale = _LONGEST_ARROW * float(np.linalg.norm(np.ptp(at_rest, axis=0))) / largest
    layer = builder.layer(f"equilibrium::{name}", colour)
    for node in np.flatnonzero(size > _LEAST_ARROW * largest).tolist():
        reach = scale * forces[node]
        ends = [at_rest[node] - reach, at_rest[node]] if name == "reactions" else [at_rest[node], at_rest[node] + reach]
        x, y, z = forces[node].tolist()
        texts = {"node": node, "force_n": float(size[node]), "x_n": x, "y_n": y, "z_n": z, "length_of_1_n": scale}
        builder.add_polyline(np.stack(ends), layer, f"node {node}", texts, is_arrow=True)


def _add_legend(builder: RhinoFileBuilder, equilibrium: Equilibrium, at_rest: Floats) -> None:
    """Add dots at the extremes, with what the colours mean."""
    weave, unit = equilibrium.weave, equilibrium.weave.lattice.latitudes.surface.unit
    layer = builder.layer("equilibrium::legend", NODES)
    worst, furthest = int(np.argmax(equilibrium.stress)), int(np.argmax(equilibrium.departure))
    allowable = weave.material.strength / weave.material.factor
    rod = weave.ids[int(equilibrium.rod[worst])]
    stress = f"stress at most {equilibrium.stress_max:.0f} MPa in {rod}; red: {allowable:.0f} MPa, the allowable one"
    builder.add_dot(equilibrium.points[worst], layer, stress)
    departure = f"departure at most {with_unit(equilibrium.departure_max, unit, digits=3)} (red)"
    builder.add_dot(at_rest[furthest], layer, departure)
    forces = np.linalg.norm(equilibrium.reaction, axis=1)
    if forces.any():
        node = int(np.argmax(forces))
        builder.add_dot(at_rest[node], layer, f"reaction at most {forces[node]:.3g} N")
