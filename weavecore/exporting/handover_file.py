"""A .3dm that hands a weave over to Kangaroo2 or Karamba: lines, joints, supports and loads with user text.

::

    handover::rods       a polyline through the joints of each rod    Kangaroo Rod
    handover::springs    a line from joint to joint                   Kangaroo Length(Line), Karamba Line to Beam
    handover::ties       a line between the axes that a tie holds     Kangaroo Length(Line), Karamba Line to Beam
    handover::supports   a point of each rod at a held node           Kangaroo Anchor, Karamba Support
    handover::loads      a point for the load on a node               Kangaroo Load, Karamba Point-Load

Keys of user text name the inputs of both: ``kangaroo_Length``, ``kangaroo_Strength``, ``karamba_Id``…  Geometry is as
drawn, in the model's unit; a strength is in N for one of that unit, what Karamba gets in its own units (kN, cm, m).
"""

from __future__ import annotations

import hashlib
from typing import Union

import numpy as np

from weavecore.exporting.rhino_builder import RhinoFileBuilder
from weavecore.geometry.arrays import Floats
from weavecore.model import Equilibrium, Weave
from weavecore.model.springs import Springs, springs_of
from weavecore.palette import LONGITUDES, NODES, POCKETS, WOVEN

_ANCHOR_STRENGTH = 1e3
"""Of an anchor against the stiffest spring: it gives way by less than a thousandth of what a rod does."""

_GPA_TO_KN_PER_CM2 = 100.0
_GRAVITY = 9.80665e-3
"""In kN for one kilogram."""


def encode_handover(value: Union[Weave, Equilibrium], *, metres: float) -> bytes:
    """Write the .3dm.

    Parameters
    ----------
    value : Weave or Equilibrium
        Supports and loads are those of an equilibrium.
    metres : float
        In one unit of the model.

    Returns
    -------
    bytes
    """
    weave = value.weave if isinstance(value, Equilibrium) else value
    surface = weave.lattice.latitudes.surface
    seed = hashlib.sha256(weave.axes.points.tobytes()).hexdigest()
    builder = RhinoFileBuilder(surface.unit, surface.tolerance, seed=f"handover {seed}")
    springs = springs_of(weave, metres=metres)
    _add_rods(builder, weave, springs)
    _add_springs(builder, weave, springs, metres)
    _add_ties(builder, weave, springs)
    if isinstance(value, Equilibrium):
        _add_supports(builder, value, float(springs.stiffness.max()))
        _add_loads(builder, value)
    return builder.encode()


def _add_rods(builder: RhinoFileBuilder, weave: Weave, springs: Springs) -> None:
    offsets = weave.strands.offsets
    layer = builder.layer("handover::rods", WOVEN["L"])
    for s, name in enumerate(weave.ids):
        points = weave.axes.points[offsets[s] : offsets[s + 1]]
        closed = bool(weave.strands.closed[s])
        through = np.concatenate([points, points[:1]]) if closed else points
        texts = {
            "id": name,
            "closed": "yes" if closed else "no",
            "length": float(weave.axes.lengths[s]),
            "bending_stiffness": float(springs.bending_stiffness[s]),
        }
        builder.add_polyline(through, layer, name, texts)


def _add_springs(builder: RhinoFileBuilder, weave: Weave, springs: Springs, metres: float) -> None:
    layer = builder.layer("handover::springs", LONGITUDES)
    material = weave.material
    common = {
        "karamba_E_kN_per_cm2": _GPA_TO_KN_PER_CM2 * material.modulus,
        "karamba_gamma_kN_per_m3": _GRAVITY * material.density,
    }
    number = np.arange(len(springs.rod)) - np.searchsorted(springs.rod, springs.rod)
    rows = zip(springs.rod.tolist(), number.tolist(), springs.rest_length.tolist(), springs.stiffness.tolist())
    for k, (rod, at, length, stiffness) in enumerate(rows):
        texts = {
            "id": weave.ids[rod],
            "kangaroo_Length": length,
            "kangaroo_Strength": stiffness,
            "karamba_Id": weave.ids[rod],
            "karamba_Diameter_cm": 100.0 * metres * float(weave.diameters[rod]),
            **common,
        }
        ends = np.stack([springs.starts[k], springs.ends[k]])
        builder.add_polyline(ends, layer, f"{weave.ids[rod]} {at}", texts)


def _add_ties(builder: RhinoFileBuilder, weave: Weave, springs: Springs) -> None:
    layer = builder.layer("handover::ties", NODES)
    joints = weave.joints
    lower, upper = joints.contacts.T
    gaps = np.linalg.norm(springs.tie_ends - springs.tie_starts, axis=1)
    for k, (a, b) in enumerate(zip(lower.tolist(), upper.tolist())):
        texts = {
            "node": int(joints.node[joints.joint[a]]),
            "lower_rod": weave.ids[joints.strand[a]],
            "upper_rod": weave.ids[joints.strand[b]],
            "kangaroo_Length": float(gaps[k]),
            "kangaroo_Strength": springs.tie_stiffness,
            "karamba_Id": "tie",
        }
        builder.add_polyline(np.stack([springs.tie_starts[k], springs.tie_ends[k]]), layer, f"tie {k}", texts)


def _add_supports(builder: RhinoFileBuilder, equilibrium: Equilibrium, stiffest: float) -> None:
    weave = equilibrium.weave
    visits = np.flatnonzero(equilibrium.is_supported[weave.strands.nodes])
    texts = {"kangaroo_Strength": _ANCHOR_STRENGTH * stiffest, "karamba_Conditions": "111000"}
    for visit in visits.tolist():
        node = int(weave.strands.nodes[visit])
        name = f"node {node} visit {visit}"
        builder.add_point(
            weave.axes.points[visit], builder.layer("handover::supports", POCKETS), name, {"node": node, **texts}
        )


def _add_loads(builder: RhinoFileBuilder, equilibrium: Equilibrium) -> None:
    """Add the load of each node at the first of its rods."""
    weave = equilibrium.weave
    place = np.full(weave.lattice.n_nodes, -1)
    place[weave.strands.nodes[::-1]] = np.arange(len(weave.strands.nodes))[::-1]
    for node in np.flatnonzero(equilibrium.load.any(axis=1) & (place >= 0)).tolist():
        force = equilibrium.load[node]
        texts = {
            "node": node,
            "kangaroo_Force_N": _vector(force),
            "karamba_ForceVec_kN": _vector(force / 1000.0),
        }
        layer = builder.layer("handover::loads", LONGITUDES)
        builder.add_point(weave.axes.points[place[node]], layer, f"node {node}", texts)


def _vector(force: Floats) -> str:
    return ", ".join(repr(part) for part in force.tolist())
