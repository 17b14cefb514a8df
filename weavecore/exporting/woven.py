"""What the files hold of a weave: rods, joints and bending."""

from __future__ import annotations

from typing import Any

import numpy as np

from weavecore.exporting.rhino_document import Document
from weavecore.model import FAMILIES, Weave
from weavecore.palette import utilisation_colours

_LAYERS = {"L": "latitudes", "A": "longitudes forward", "B": "longitudes back", "P": "pockets"}
_LAYER_COLOUR = (90, 90, 96)


def weave_entry(weave: Weave) -> dict[str, Any]:
    """The key ``weave`` of the JSON result: what is common to all rods."""
    material = weave.material
    return {
        "rod_diameter": weave.rod_diameter,
        "over_under": weave.over_under,
        "material": {
            "name": material.name,
            "modulus": material.modulus,
            "strength": material.strength,
            "factor": material.factor,
            "density": material.density,
            "source": material.source,
        },
        "normals": weave.normals.tolist(),
        "ends_inside": weave.n_ends_inside,
        "median_length": weave.median_length,
        "conflicts": [
            {"strand": weave.ids[s], "node": node, "node_before": before}
            for s, node, before in weave.conflicts.tolist()
        ],
        "clashes": [
            {"strands": [weave.ids[a], weave.ids[b]], "distance": distance, "point": point}
            for (a, b), distance, point in zip(
                weave.clashes.strands.tolist(), weave.clashes.distance.tolist(), weave.clashes.point.tolist()
            )
        ],
    }


def rod_entries(weave: Weave) -> list[dict[str, Any]]:
    """What each strand of the JSON result has besides its nodes: the axis, and how it is bent."""
    axes, bending = weave.axes, weave.bending
    rows = []
    for s in range(len(weave)):
        knots, controls = axes.bspline(s)
        part = slice(axes.offsets[s], axes.offsets[s + 1])
        radius = float(bending.min_radius[s])
        rows.append(
            {
                "axis_length": float(axes.lengths[s]),
                "axis": {"degree": 3, "knots": knots.tolist(), "controls": controls.tolist()},
                "overhangs": axes.overhangs[s].tolist(),
                "stations": axes.stations[part].tolist(),
                "layer_offsets": axes.layer_offsets[part].tolist(),
                # A straight rod has no radius, and JSON no infinity.
                "min_radius": radius if np.isfinite(radius) else None,
                "station_at_min": float(bending.station_at_min[s]),
                "point_at_min": bending.point_at_min[s].tolist(),
                "utilisation": float(bending.utilisation[s]),
                "largest_diameter": float(bending.largest_diameter[s])
                if np.isfinite(bending.largest_diameter[s])
                else None,
            }
        )
    return rows


def crossing_entries(weave: Weave) -> list[dict[str, Any]]:
    """The key ``crossings``: each pair of rods at a joint."""
    return [
        {"node": node, "over": weave.ids[over], "under": weave.ids[under]}
        for node, over, under in weave.crossings.tolist()
    ]


def joint_entries(weave: Weave) -> list[dict[str, Any]]:
    """The key ``joints``: the rods at each node from the innermost out, and the direction out."""
    joints, strands = weave.joints, weave.strands
    normals = weave.normals[joints.node].tolist()
    ids = [weave.ids[s] for s in joints.strand.tolist()]
    place = (joints.visit - strands.offsets[joints.strand]).tolist()
    starts = joints.offsets.tolist()
    return [
        {"node": node, "normal": normals[j], "order": ids[a:b], "places": place[a:b]}
        for j, (node, a, b) in enumerate(zip(joints.node.tolist(), starts, starts[1:]))
    ]


def add_rods(document: Document, weave: Weave) -> None:
    """Add the axes as NURBS curves of degree 3, one layer a family, coloured by utilisation."""
    colours = utilisation_colours(weave.bending.utilisation).tolist()
    bending = weave.bending
    for s, name in enumerate(weave.ids):
        layer = document.layer(f"weave::rods::{_LAYERS[name[0]]}", _LAYER_COLOUR)
        knots, controls = weave.axes.bspline(s)
        texts = {
            "id": name,
            "family": FAMILIES[int(weave.strands.family[s])],
            "length": float(weave.axes.lengths[s]),
            "diameter": weave.rod_diameter,
            "material": weave.material.name,
            "min_radius": float(bending.min_radius[s]),
            "station_at_min": float(bending.station_at_min[s]),
            "utilisation": float(bending.utilisation[s]),
        }
        document.add_curve(knots, controls, layer, name, texts, tuple(colours[s]))
