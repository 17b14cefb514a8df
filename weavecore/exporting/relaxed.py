"""What the files hold of an equilibrium: rods at rest, the forces in them, and how far they moved."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.interpolate import make_interp_spline

from weavecore.exporting.rhino_document import Document
from weavecore.model import Equilibrium
from weavecore.palette import utilisation_colours

_LAYERS = {"L": "latitudes", "A": "longitudes forward", "B": "longitudes back", "P": "pockets"}
_LAYER_COLOUR = (90, 90, 96)


def equilibrium_entry(equilibrium: Equilibrium) -> dict[str, Any]:
    """The key ``equilibrium`` of the JSON result."""
    held = np.flatnonzero(equilibrium.is_supported)
    factor = equilibrium.buckling_factor
    return {
        "converged": equilibrium.is_converged,
        "stable": equilibrium.is_stable,
        "negative_modes": equilibrium.n_negative,
        "supports": equilibrium.supports,
        "loads": equilibrium.loads,
        "departure": {
            "mean": equilibrium.departure_mean,
            "p95": equilibrium.departure_p95,
            "max": equilibrium.departure_max,
            "nodes": equilibrium.departure.tolist(),
        },
        "stress_max": equilibrium.stress_max,
        "utilisation_max": equilibrium.utilisation_max,
        "tie_force_max": float(equilibrium.tie_force_size.max(initial=0.0)),
        # JSON has no infinity: null where the loads never buckle the weave, and where no factor was asked for.
        "buckling_factor": factor if factor is not None and np.isfinite(factor) else None,
        "buckles": None if factor is None else bool(np.isfinite(factor)),
        "energies": dict(equilibrium.energies),
        "drawn_energy": equilibrium.drawn_energy,
        "steps": equilibrium.n_steps,
        "residual": equilibrium.residual,
        "axes": _axis_entries(equilibrium),
        "tie_forces": equilibrium.tie_force.tolist(),
        "reactions": [
            {"node": node, "force": force} for node, force in zip(held.tolist(), equilibrium.reaction[held].tolist())
        ],
    }


def _axis_entries(equilibrium: Equilibrium) -> list[dict[str, Any]]:
    weave, offsets = equilibrium.weave, equilibrium.offsets
    rows = []
    for s, name in enumerate(weave.ids):
        part = slice(offsets[s], offsets[s + 1])
        visits = slice(weave.strands.offsets[s], weave.strands.offsets[s + 1])
        rows.append(
            {
                "id": name,
                "points": equilibrium.points[part].tolist(),
                "drawn": equilibrium.drawn[part].tolist(),
                "joints": (equilibrium.point_of_visit[visits] - offsets[s]).tolist(),
                "axial_force": equilibrium.axial_force[part].tolist(),
                "moment": equilibrium.moment[part].tolist(),
                "stress": equilibrium.stress[part].tolist(),
            }
        )
    return rows


def add_relaxed(document: Document, equilibrium: Equilibrium) -> None:
    """Add the rods at rest as curves of degree 3, one layer a family, coloured by their largest utilisation."""
    weave, offsets = equilibrium.weave, equilibrium.offsets
    utilisation = np.maximum.reduceat(equilibrium.utilisation, offsets[:-1])
    force = np.maximum.reduceat(np.abs(equilibrium.axial_force), offsets[:-1])
    moment = np.maximum.reduceat(equilibrium.moment, offsets[:-1])
    move = np.linalg.norm(equilibrium.points - equilibrium.drawn, axis=1)
    departure = np.maximum.reduceat(move, offsets[:-1])
    colours = utilisation_colours(utilisation).tolist()
    for s, name in enumerate(weave.ids):
        layer = document.layer(f"equilibrium::rods::{_LAYERS[name[0]]}", _LAYER_COLOUR)
        points, is_closed = equilibrium.points[offsets[s] : offsets[s + 1]], bool(weave.strands.closed[s])
        through = np.concatenate([points, points[:1]]) if is_closed else points
        at = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))])
        curve: Any = make_interp_spline(at, through, k=3, bc_type="periodic" if is_closed else "natural")
        texts = {
            "id": name,
            "utilisation": float(utilisation[s]),
            "axial_force_n": float(force[s]),
            "moment_nm": float(moment[s]),
            "departure": float(departure[s]),
        }
        document.add_curve(curve.t, curve.c, layer, f"{name} at rest", texts, tuple(colours[s]))
    _add_supports(document, equilibrium)


def _add_supports(document: Document, equilibrium: Equilibrium) -> None:
    held = equilibrium.weave.lattice.nodes[equilibrium.is_supported]
    if len(held):
        texts = {"supports": equilibrium.supports, "loads": equilibrium.loads}
        document.add_points(held, document.layer("equilibrium::supports", _LAYER_COLOUR), "supports", texts)
