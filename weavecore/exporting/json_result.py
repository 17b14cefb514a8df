"""The JSON result: one object with all that was made, for programs to read.

All that the stages know is there, so that `weavecore.reading.formats.result_json` gives the same values back.
Floats are written as the shortest text that reads back to the same bits; keys stand in a
fixed order; there is no white space.  Indices count from 0.

``latitudes.closed`` tells of each polyline whether it is closed; an open one begins and ends on a border edge from
which no distance starts, or is an open origin.  ``surface.origins`` is there only where origins were chosen: the
vertices of each in order, and whether it is closed; they are generation 0 of the latitudes.  Else that is the borders,
and the cuts of a closed surface, which ``surface.cut`` has.
"""

from __future__ import annotations

import json
from typing import Any

from weavecore.exporting.product import Product, strand_lengths
from weavecore.exporting.relaxed import equilibrium_entry
from weavecore.exporting.woven import crossing_entries, joint_entries, rod_entries, weave_entry
from weavecore.model import FAMILIES, Latitudes, Lattice, Strands, SurfaceMesh


def encode_json(product: Product) -> bytes:
    """The bytes of the JSON result.

    Raises
    ------
    ValueError
        Where a number is not finite: JSON has no word for it.
    """
    document: dict[str, Any] = {
        "format": "weavecore",
        "version": 1,
        "unit": product.surface.unit,
        "tolerance": product.surface.tolerance,
        "parameters": dict(product.parameters),
        "surface": _surface(product.surface),
    }
    if product.latitudes is not None:
        document["latitudes"] = _latitudes(product.latitudes)
    if product.lattice is not None:
        document["lattice"] = _lattice(product.lattice)
        if product.strands is not None:
            document["strands"] = _strands(product.strands, product.lattice)
    if product.weave is not None:
        rows = zip(document["strands"], product.weave.ids, rod_entries(product.weave))
        document["strands"] = [{**strand, "id": name, **rod} for strand, name, rod in rows]
        document["crossings"] = crossing_entries(product.weave)
        document["joints"] = joint_entries(product.weave)
        document["weave"] = weave_entry(product.weave)
    if product.equilibrium is not None:
        document["equilibrium"] = equilibrium_entry(product.equilibrium)
    # Ten megabytes a second slower with an indent, which also leaves the C encoder unused.
    return json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()


def _surface(surface: SurfaceMesh) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "name": surface.name,
        "mendings": list(surface.mendings),
        "vertices": surface.vertices.tolist(),
        "faces": surface.faces.tolist(),
    }
    if surface.cuts:
        entry["cut"] = [loop.tolist() for loop in surface.cuts]
    if surface.starts is not None:
        paths, closed = surface.starts.paths, surface.starts.closed.tolist()
        entry["origins"] = [{"vertices": path.tolist(), "closed": c} for path, c in zip(paths, closed)]
    return entry


def _latitudes(latitudes: Latitudes) -> dict[str, Any]:
    return {
        "points": latitudes.polylines.points.tolist(),
        "offsets": latitudes.polylines.offsets.tolist(),
        "closed": latitudes.polylines.closed.tolist(),
        "generation": latitudes.generation.tolist(),
        "distance": latitudes.distance.tolist(),
        "parents": latitudes.parents.tolist(),
        "face": latitudes.polylines.face.tolist(),
        "barycentric": latitudes.polylines.barycentric.tolist(),
        "bands": {
            "offsets": latitudes.bands.offsets.tolist(),
            "polyline": latitudes.bands.polyline.tolist(),
            "is_parent": latitudes.bands.is_parent.tolist(),
            "is_left": latitudes.bands.is_left.tolist(),
            "euler": latitudes.bands.euler.tolist(),
            "depth": latitudes.bands.depth.tolist(),
        },
        "vertex_distance": latitudes.vertex_distance.tolist(),
    }


def _lattice(lattice: Lattice) -> dict[str, Any]:
    corners, starts = lattice.face_nodes.tolist(), lattice.face_offsets.tolist()
    return {
        "nodes": lattice.nodes.tolist(),
        "faces": [corners[start:end] for start, end in zip(starts, starts[1:])],
        "edges": lattice.edges.tolist(),
        "edge_family": [FAMILIES[family] for family in lattice.edge_family.tolist()],
        "node_latitude": lattice.node_latitude.tolist(),
        "node_station": lattice.node_station.tolist(),
    }


def _strands(strands: Strands, lattice: Lattice) -> list[dict[str, Any]]:
    rows = zip(strands.family.tolist(), strands.closed.tolist(), strand_lengths(strands, lattice).tolist())
    return [
        {"id": s, "family": FAMILIES[family], "nodes": strands.strand(s).tolist(), "closed": closed, "length": length}
        for s, (family, closed, length) in enumerate(rows)
    ]
