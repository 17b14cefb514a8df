"""The stage: from a `Weave` to its `Equilibrium`.

Lengths are turned to metres on the way in and back on the way out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable, Optional

import numpy as np

from weavecore.errors import NotConverged, Unsupported
from weavecore.geometry.arrays import Bools, Floats
from weavecore.model import Equilibrium, Weave
from weavecore.simulating.boundary import (
    BORDERS,
    NONE,
    Loads,
    Supports,
    describe_supports,
    load_forces,
    loads_on_nodes,
    supported_nodes,
    three_point_gauge,
)
from weavecore.simulating.buckling import first_buckling_factor
from weavecore.simulating.discretise import RodPoints, elements_of, let_ties_slide, place_points, scissors_of
from weavecore.simulating.elements import half_angle_tangents, scissor_cosines
from weavecore.simulating.newton import Solution, find_equilibrium
from weavecore.simulating.structure import Structure
from weavecore.units import millimetres_in

Progress = Callable[[float, str], None]

SEGMENTS = 2
"""Between two joints: the fewest that let a rod bend between them."""

_SHEARS = 10.0
"""Degrees by which rods turn about their ties, from which on the error names a shear mechanism."""


def simulate_weave(
    weave: Weave,
    *,
    supports: Supports = BORDERS,
    loads: Optional[Loads] = None,
    segments: int = SEGMENTS,
    stations: Optional[Any] = None,
    tie_stiffness: float = 0.0,
    tie_friction: Optional[float] = None,
    unit: Optional[str] = None,
    buckling: bool = False,
    start: Optional[Floats] = None,
    most_steps: Optional[int] = None,
    progress: Optional[Progress] = None,
) -> Equilibrium:
    """Let the rods of a weave spring to where they rest.

    Parameters
    ----------
    weave : Weave
    supports : str or sequence of (n, 3) array_like
        ``"none"``, ``"borders"``, or points and polylines at which nodes are held.
    loads : Loads, optional
        By default the rods' weight along -z, or nothing without supports.
    segments : int
        Straight segments between two joints, 2 at least.
    stations : (M,) array_like, optional
        Marks at each visit along its rod, in the model's unit, instead of the drawn ones.
    tie_stiffness : float
        Of each tie against the turn of its rods about it, in N·m/rad; without it they turn freely.
    tie_friction : float, optional
        Force in N at which a tie slides along a rod; by default ties keep to their marks.
    unit : str, optional
        Unit of the weave where it states none: ``"mm"``, ``"m"``…
    buckling : bool
        Whether the first buckling factor of the loads is found; takes about as long again.
    start : (n, 3) float64, optional
        Points along the rods, in the model's unit, from which the equilibrium is searched; by default the drawn ones.
    most_steps : int, optional
        Factorisations after which the search ends, 300 at most.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Raises
    ------
    Unsupported
    NotConverged
        With the state that was reached.
    """
    if segments < 2:
        raise Unsupported(f"Rods cannot bend with {segments} segments an edge", remedy="Use 2 or more.")
    if not 0 <= tie_stiffness < np.inf:
        raise Unsupported(f"The stiffness of ties is {tie_stiffness:g}", remedy="Use 0 or more, in N·m/rad.")
    if tie_friction is not None and not 0 <= tie_friction < np.inf:
        raise Unsupported(f"The friction of ties is {tie_friction:g}", remedy="Use 0 or more, in N, or leave it out.")
    metres = millimetres_in(weave.lattice.latitudes.surface.unit, unit) / 1000.0
    held = supported_nodes(weave, supports)
    loads = loads or Loads(gravity=(0.0, 0.0, -1.0) if held.any() else None)
    if not held.any() and str(loads) != NONE:
        raise Unsupported("A weave without supports cannot carry loads", remedy="Choose supports, or no loads.")
    rods = place_points(weave.axes, segments=segments, metres=metres, stations=stations)
    diameter = weave.diameters[rods.rod] * metres
    structure = structure_of(weave, rods, held, loads, diameter=diameter, metres=metres)
    scissors = scissors_of(rods.points, structure.ties, tie_stiffness)
    structure = replace(structure, scissors=scissors, ties=let_ties_slide(rods, structure.ties, tie_friction))
    first = rods.points if start is None else np.where(structure.is_fixed, rods.points, start * metres)
    found = find_equilibrium(structure, first, most_steps=most_steps, progress=progress)
    words = describe_supports(weave, supports, held)
    at_rest = _results_of(weave, rods, structure, found, held, diameter=diameter, metres=metres)
    at_rest = replace(at_rest, supports=words, loads=str(loads))
    if not found.is_converged:
        raise _not_converged(structure, rods, found, at_rest)
    if buckling and str(loads) != NONE:
        factor = first_buckling_factor(structure, found, progress=progress)
        at_rest = replace(at_rest, buckling_factor=factor)
    return at_rest


def _not_converged(structure: Structure, rods: RodPoints, found: Solution, reached: Equilibrium) -> NotConverged:
    """The error of a search without an equilibrium, which says where rods shear."""
    what = f"No equilibrium was found in {found.n_steps} steps (residual force {found.residual:.3g} N)"
    remedy = "Look for sharp bends in the rods, or hold more nodes; the error's `reached` has the last state."
    beside = structure.ties.points[:, 2:]
    drawn, now = (np.arccos(np.clip(scissor_cosines(x, beside), -1.0, 1.0)) for x in (rods.points, found.points))
    turned = float(np.degrees(np.abs(now - drawn).max(initial=0.0)))
    if turned > _SHEARS:
        what += f": it shears, rods turned about their ties by up to {turned:.0f}°"
        remedy = "Hold more nodes, or give the ties a stiffness; the error's `reached` has the last state."
    return NotConverged(what, remedy=remedy, reached=reached)


def structure_of(
    weave: Weave, rods: RodPoints, held: Bools, loads: Loads, *, diameter: Floats, metres: float
) -> Structure:
    """Elements, loads and supports of a weave in SI units; the diameter is in metres, of which so many make a unit."""
    bends, stretches, ties = elements_of(weave, rods, diameter=diameter)
    if held.any():
        fixed = np.zeros((len(rods.points), 3), bool)
        fixed[rods.of_visit[held[weave.strands.nodes]]] = True
    else:
        fixed = three_point_gauge(rods.points)
    forces = load_forces(weave, rods, loads, diameter=diameter, metres=metres)
    return Structure(len(rods.points), bends, stretches, ties, forces, fixed)


def _results_of(
    weave: Weave,
    rods: RodPoints,
    structure: Structure,
    found: Solution,
    held: Bools,
    *,
    diameter: Floats,
    metres: float,
) -> Equilibrium:
    x = found.points
    modulus = weave.material.modulus * 1e9
    area, section = np.pi * diameter**2 / 4, np.pi * diameter**3 / 32
    forces = structure.forces(x)
    ends = rods.segments
    count = np.maximum(np.bincount(ends.ravel(), minlength=len(x)), 1)
    axial = np.bincount(ends.ravel(), np.repeat(forces.axial, 2), len(x)) / count
    moment = np.zeros(len(x))
    inertia = np.pi * diameter**4 / 64
    moment[rods.inner] = (
        modulus * inertia[rods.inner] * half_angle_tangents(x, structure.bends) / rods.widths[rods.inner]
    )
    nodes = weave.strands.nodes
    left = structure.gradient(x)[rods.of_visit]
    reaction = np.stack([np.bincount(nodes, left[:, d], weave.lattice.n_nodes) for d in range(3)], axis=1)
    shown = x if held.any() else laid_over(x, rods.points, weights=rods.widths)
    return Equilibrium(
        weave=weave,
        points=shown / metres,
        drawn=rods.points / metres,
        offsets=rods.offsets,
        point_of_visit=rods.of_visit,
        axial_force=axial,
        moment=moment,
        stress=(np.abs(axial) / area + moment / section) / 1e6,
        tie_force=forces.tie,
        reaction=np.where(held[:, None], reaction, 0.0),
        load=loads_on_nodes(weave, rods, structure.loads),
        is_supported=held,
        is_converged=found.is_converged,
        n_negative=found.n_negative,
        n_steps=found.n_steps,
        residual=found.residual,
        energies=structure.energies(x),
        drawn_energy=structure.elastic_energy(rods.points),
    )


def laid_over(points: Floats, onto: Floats, *, weights: Floats) -> Floats:
    """Points (n, 3) moved as a rigid body so that they fit others best in weighted squares (Kabsch 1976)."""
    weights = (weights / weights.sum())[:, None]
    centre, target = (weights * points).sum(0), (weights * onto).sum(0)
    u, _, vt = np.linalg.svd((weights * (points - centre)).T @ (onto - target))
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    moved: Floats = (points - centre) @ (u * sign) @ vt + target
    return moved
