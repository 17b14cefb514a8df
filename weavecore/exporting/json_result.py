"""The JSON result: one object with the value of every stage, for programs to read.

`result.schema.json` beside this file describes every key, with shapes and units; `result_schema` reads it.
`weavecore.reading.formats.result_json` gives the same values back.  Floats are the shortest text that reads back to the
same bits; keys have a fixed order; there is no white space.  Indices count from 0.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import resources
from typing import Any, Optional

import numpy as np

from weavecore.exporting.product import Product, strand_lengths
from weavecore.geometry.splines import DEGREE
from weavecore.model import FAMILIES, Equilibrium, Latitudes, Lattice, Note, Strands, SurfaceMesh, Weave
from weavecore.polling import each, poll
from weavecore.texts import printable

FORMAT, VERSION = "weavecore", 1
"""Keys ``format`` and ``version``; the version rises when a key changes its meaning."""

_ITEMS_AT_ONCE = 200
"""Items of a list that are written between two polls."""

_SCHEMA = "result.schema.json"


def result_schema() -> dict[str, Any]:
    """The JSON schema (draft 2020-12) of the JSON result."""
    schema: dict[str, Any] = json.loads(resources.files("weavecore.exporting").joinpath(_SCHEMA).read_text("utf-8"))
    return schema


def encode_json(product: Product) -> bytes:
    """Write the JSON result.

    Parameters
    ----------
    product : Product

    Returns
    -------
    bytes

    Raises
    ------
    ValueError
        Where a number is not finite: JSON has none.
    """
    parts: list[bytes] = []
    for key, value in _entries(product):
        parts.append((f',"{key}":' if parts else f'{{"{key}":').encode())
        parts.extend(_parts_of(value))
    return b"".join([*parts, b"}"])


def _entries(product: Product) -> Iterator[tuple[str, Any]]:
    """The keys of the document and their values, in order."""
    yield "format", FORMAT
    yield "version", VERSION
    yield "unit", product.surface.unit
    yield "tolerance", product.surface.tolerance
    yield "parameters", _without_hidden(dict(product.parameters))
    yield "notes", [_note(note) for note in product.surface.notes]
    yield "surface", _surface(product.surface)
    if product.latitudes is not None:
        yield "latitudes", _latitudes(product.latitudes)
    if product.lattice is not None:
        yield "lattice", _lattice(product.lattice)
        if product.strands is not None:
            yield "strands", _strands(product.strands, product.lattice, product.weave)
    if product.weave is not None:
        yield "crossings", _crossing_entries(product.weave)
        yield "joints", _joint_entries(product.weave)
        yield "weave", _weave_entry(product.weave)
    if product.equilibrium is not None:
        yield "equilibrium", _equilibrium_entry(product.equilibrium)


def _parts_of(value: Any) -> Iterator[bytes]:
    """The value as JSON, in parts that the C encoder writes in a fraction of a second."""
    if isinstance(value, dict):
        for k, (key, one) in enumerate(value.items()):
            yield ("," if k else "{").encode() + _text_of(key) + b":"
            yield from _parts_of(one)
        yield b"}" if value else b"{}"
    elif isinstance(value, (list, np.ndarray)) and len(value) > _ITEMS_AT_ONCE:
        for k in each(range(0, len(value), _ITEMS_AT_ONCE)):
            yield b"," if k else b"["
            yield _text_of(value[k : k + _ITEMS_AT_ONCE])[1:-1]
        yield b"]"
    else:
        yield _text_of(value)


def _text_of(value: Any) -> bytes:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    # Without an indent, which would leave the C encoder unused.
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


def _without_hidden(value: Any) -> Any:
    """The value with only characters in its texts that can be shown."""
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, dict):
        return {key: _without_hidden(one) for key, one in value.items()}
    return [_without_hidden(one) for one in value] if isinstance(value, (list, tuple)) else value


def _note(note: Note) -> dict[str, Any]:
    poll()
    return {
        "code": note.code,
        "text": note.text,
        "is_doubt": note.is_doubt,
        "numbers": dict(note.numbers),
        "points": np.reshape(note.points, (-1, 3)).tolist(),
    }


def _surface(surface: SurfaceMesh) -> dict[str, Any]:
    poll()
    entry: dict[str, Any] = {
        "name": printable(surface.name),
        "vertices": surface.vertices,
        "faces": surface.faces,
    }
    if surface.cuts:
        entry["cut"] = [loop.tolist() for loop in surface.cuts]
    if surface.starts is not None:
        paths, closed = surface.starts.paths, surface.starts.closed.tolist()
        entry["origins"] = [{"vertices": path.tolist(), "closed": c} for path, c in zip(paths, closed)]
    return entry


def _latitudes(latitudes: Latitudes) -> dict[str, Any]:
    poll()
    return {
        "points": latitudes.polylines.points,
        "offsets": latitudes.polylines.offsets,
        "closed": latitudes.polylines.closed,
        "generation": latitudes.generation,
        "distance": latitudes.distance,
        "parents": latitudes.parents,
        "face": latitudes.polylines.face,
        "barycentric": latitudes.polylines.barycentric,
        "bands": {
            "offsets": latitudes.bands.offsets,
            "polyline": latitudes.bands.polyline,
            "is_parent": latitudes.bands.is_parent,
            "is_left": latitudes.bands.is_left,
            "euler": latitudes.bands.euler,
            "depth": latitudes.bands.depth,
        },
        "vertex_distance": latitudes.vertex_distance,
    }


def _lattice(lattice: Lattice) -> dict[str, Any]:
    poll()
    corners, starts = lattice.face_nodes.tolist(), lattice.face_offsets.tolist()
    return {
        "nodes": lattice.nodes,
        "faces": [corners[start:end] for start, end in zip(starts, starts[1:])],
        "edges": lattice.edges,
        "edge_family": [FAMILIES[family] for family in lattice.edge_family.tolist()],
        "node_latitude": lattice.node_latitude,
        "node_station": lattice.node_station,
        "off_latitudes": lattice.off_latitudes,
    }


def _strands(strands: Strands, lattice: Lattice, weave: Optional[Weave]) -> list[dict[str, Any]]:
    """The strands, numbered, or of a weave with their names and what is known of them as rods."""
    poll()
    rows = zip(strands.family.tolist(), strands.closed.tolist(), strand_lengths(strands, lattice).tolist())
    entries = [
        {"id": s, "family": FAMILIES[family], "nodes": strands.strand(s).tolist(), "closed": closed, "length": length}
        for s, (family, closed, length) in enumerate(rows)
    ]
    if weave is None:
        return entries
    return [{**entry, "id": name, **rod} for entry, name, rod in zip(entries, weave.ids, _rod_entries(weave))]


def _rod_entries(weave: Weave) -> list[dict[str, Any]]:
    """The axis of each strand, and how it is bent."""
    axes, bending = weave.axes, weave.bending
    rows = []
    for s in each(range(len(weave))):
        knots, controls = axes.bspline(s)
        part = slice(axes.offsets[s], axes.offsets[s + 1])
        radius, largest = float(bending.min_radius[s]), float(bending.largest_diameter[s])
        rows.append(
            {
                "diameter": float(weave.diameters[s]),
                "axis_length": float(axes.lengths[s]),
                "axis": {"degree": DEGREE, "knots": knots.tolist(), "controls": controls.tolist()},
                "overhangs": axes.overhangs[s].tolist(),
                "stations": axes.stations[part].tolist(),
                "layer_offsets": axes.layer_offsets[part].tolist(),
                # The radius of a straight rod is infinite, which JSON cannot hold.
                "min_radius": radius if np.isfinite(radius) else None,
                "station_at_min": float(bending.station_at_min[s]),
                "point_at_min": bending.point_at_min[s].tolist(),
                "utilisation": float(bending.utilisation[s]),
                "largest_diameter": largest if np.isfinite(largest) else None,
            }
        )
    return rows


def _crossing_entries(weave: Weave) -> list[dict[str, Any]]:
    """Each pair of rods at a joint."""
    return [
        {"node": node, "over": weave.ids[over], "under": weave.ids[under]}
        for node, over, under in weave.crossings.tolist()
    ]


def _joint_entries(weave: Weave) -> list[dict[str, Any]]:
    """The rods at each node from the innermost outwards, and the normal."""
    joints, strands = weave.joints, weave.strands
    normals = weave.normals[joints.node].tolist()
    ids = [weave.ids[s] for s in joints.strand.tolist()]
    place = (joints.visit - strands.offsets[joints.strand]).tolist()
    starts = joints.offsets.tolist()
    return [
        {"node": node, "normal": normals[j], "order": ids[a:b], "places": place[a:b]}
        for j, (node, a, b) in enumerate(zip(joints.node.tolist(), starts, starts[1:]))
    ]


def _weave_entry(weave: Weave) -> dict[str, Any]:
    """What is common to all rods."""
    material = weave.material
    return {
        "rod_diameter": weave.rod_diameter,
        "over_under": weave.over_under,
        "material": {
            "name": printable(material.name),
            "modulus": material.modulus,
            "strength": material.strength,
            "factor": material.factor,
            "density": material.density,
            "source": printable(material.source),
        },
        "normals": weave.normals,
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


def _equilibrium_entry(equilibrium: Equilibrium) -> dict[str, Any]:
    """The rods at rest, the forces in them, and how far they moved."""
    held = np.flatnonzero(equilibrium.is_supported)
    factor = equilibrium.buckling_factor
    return {
        "converged": equilibrium.is_converged,
        "stable": equilibrium.is_stable,
        "negative_modes": equilibrium.n_negative,
        "supports": printable(equilibrium.supports),
        "loads": printable(equilibrium.loads),
        "departure": {
            "mean": equilibrium.departure_mean,
            "p95": equilibrium.departure_p95,
            "max": equilibrium.departure_max,
            "nodes": equilibrium.departure,
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
        "axes": _relaxed_entries(equilibrium),
        "tie_forces": equilibrium.tie_force,
        "reactions": [
            {"node": node, "force": force} for node, force in zip(held.tolist(), equilibrium.reaction[held].tolist())
        ],
        "node_loads": equilibrium.load,
        "spread": list(equilibrium.spread),
    }


def _relaxed_entries(equilibrium: Equilibrium) -> list[dict[str, Any]]:
    """Points and forces along each rod."""
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
