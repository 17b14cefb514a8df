"""Rhino's .3dm: curves, points and mesh on named layers.

::

    weave::latitudes::00, 01, …     polylines by generation
    weave::longitudes::00, 01, …    strands by the least generation they touch
    weave::pockets                  strands of pockets
    weave::rods::FAMILY             axes of the rods as NURBS curves, coloured by utilisation (of a weave)
    equilibrium::…                  rods at rest, stress, departure and forces: `weavecore.exporting.equilibrium_layers`
    weave::nodes, weave::lattice    nodes as one point cloud, faces as one mesh
    weave::surface                  the mesh of a surface alone

Objects have the colours of their layers, except rods.  Closed polylines repeat their first point, as Rhino's do.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np

from weavecore.exporting.equilibrium_layers import ROD_LAYER_COLOUR, ROD_LAYERS, add_equilibrium
from weavecore.exporting.polygons import faces_of
from weavecore.exporting.product import Product, strand_lengths
from weavecore.exporting.rhino_builder import RhinoFileBuilder
from weavecore.geometry.arrays import Floats
from weavecore.model import (
    FAMILIES,
    LATITUDINAL,
    LONGITUDINAL,
    Latitudes,
    Lattice,
    Strands,
    Weave,
    first_generations,
)
from weavecore.palette import LONGITUDES, NODES, POCKETS, SURFACE, latitude_colours, utilisation_colours
from weavecore.polling import each


def encode_3dm(product: Product) -> bytes:
    """Write a .3dm file.

    Parameters
    ----------
    product : Product

    Returns
    -------
    bytes

    Raises
    ------
    NotWritten
        Where rhino3dm rejects an object, without a reason.
    """
    builder = RhinoFileBuilder(product.surface.unit, product.surface.tolerance, seed=_fingerprint(product))
    if product.latitudes is None:
        _add_faces(builder, product, "surface", product.surface.name or "surface")
        return builder.encode()
    _add_latitudes(builder, product.latitudes)
    if product.lattice is not None:
        if product.strands is not None:
            _add_strands(builder, product.strands, product.lattice)
        if product.weave is not None:
            _add_rods(builder, product.weave)
        if product.equilibrium is not None:
            add_equilibrium(builder, product.equilibrium)
        texts = {"pattern": product.lattice.pattern, "edge_length": product.lattice.edge_length}
        builder.add_points(product.lattice.nodes, builder.layer("weave::nodes", NODES), "nodes", texts)
        _add_faces(builder, product, "lattice", "lattice")
    return builder.encode()


def _layer_of(family: str, generation: int, latitudes: Latitudes) -> str:
    """The full path of a generation's layer, with leading zeros so that names sort as numbers do."""
    digits = max(2, len(str(latitudes.n_generations - 1)))
    return f"weave::{family}::{generation:0{digits}d}"


def _add_latitudes(builder: RhinoFileBuilder, latitudes: Latitudes) -> None:
    parents: dict[int, list[int]] = {}
    for parent, child in latitudes.parents.tolist():
        parents.setdefault(child, []).append(parent)
    colours = latitude_colours(np.arange(latitudes.n_generations), latitudes.n_generations).tolist()
    figures = zip(latitudes.generation.tolist(), latitudes.distance.tolist(), latitudes.polylines.lengths.tolist())
    for p, (generation, distance, length) in each(enumerate(figures)):
        layer = builder.layer(_layer_of("latitudes", generation, latitudes), tuple(colours[generation]))
        texts = {
            "id": p,
            "family": FAMILIES[LATITUDINAL],
            "generation": generation,
            "parents": " ".join(map(str, parents.get(p, []))),
            "distance": distance,
            "length": length,
        }
        points = _closed_points(latitudes.polylines.polyline(p), is_closed=bool(latitudes.polylines.closed[p]))
        builder.add_polyline(points, layer, f"latitude {p}", texts)


def _add_strands(builder: RhinoFileBuilder, strands: Strands, lattice: Lattice) -> None:
    """Add all strands but the latitudinal ones, which run along the latitudes."""
    begins = first_generations(strands, lattice).tolist()
    lengths = strand_lengths(strands, lattice).tolist()
    for s in each(np.flatnonzero(strands.family != LATITUDINAL).tolist()):
        family = int(strands.family[s])
        if family == LONGITUDINAL:
            layer = builder.layer(_layer_of("longitudes", begins[s], lattice.latitudes), LONGITUDES)
        else:
            layer = builder.layer("weave::pockets", POCKETS)
        texts = {"id": s, "family": FAMILIES[family], "generation": begins[s], "length": lengths[s]}
        points = _closed_points(lattice.nodes[strands.strand(s)], is_closed=bool(strands.closed[s]))
        builder.add_polyline(points, layer, f"strand {s}", texts)


def _closed_points(points: Floats, *, is_closed: bool) -> Floats:
    """The points (n, 3), with the first one again at the end of a closed polyline."""
    return np.concatenate([points, points[:1]]) if is_closed else points


def _add_rods(builder: RhinoFileBuilder, weave: Weave) -> None:
    """Add the axes as NURBS curves of degree 3, one layer a family, coloured by utilisation."""
    colours = utilisation_colours(weave.bending.utilisation).tolist()
    for s, name in each(enumerate(weave.ids)):
        layer = builder.layer(f"weave::rods::{ROD_LAYERS[name[0]]}", ROD_LAYER_COLOUR)
        knots, controls = weave.axes.bspline(s)
        builder.add_curve(knots, controls, layer, name, rod_texts(weave, s), tuple(colours[s]))


def rod_texts(weave: Weave, s: int) -> dict[str, Any]:
    """What the user text of a rod says, by its keys.

    Parameters
    ----------
    weave : Weave
    s : int
        The rod.
    """
    bending = weave.bending
    return {
        "id": weave.ids[s],
        "family": FAMILIES[int(weave.strands.family[s])],
        "length": float(weave.axes.lengths[s]),
        "diameter": float(weave.diameters[s]),
        "material": weave.material.name,
        "min_radius": float(bending.min_radius[s]),
        "station_at_min": float(bending.station_at_min[s]),
        "utilisation": float(bending.utilisation[s]),
    }


def _add_faces(builder: RhinoFileBuilder, product: Product, layer: str, name: str) -> None:
    """Add the mesh, with the options of the result."""
    index = builder.layer(f"weave::{layer}", SURFACE)
    builder.add_mesh(faces_of(product, ".3dm"), index, name, product.parameters)


def _fingerprint(product: Product) -> str:
    """A hash of the coordinates, which differs from result to result."""
    digest = hashlib.sha256(product.surface.vertices.tobytes())
    if product.latitudes is not None:
        digest.update(product.latitudes.polylines.points.tobytes())
    if product.lattice is not None:
        digest.update(product.lattice.nodes.tobytes())
    if product.weave is not None:
        digest.update(product.weave.axes.points.tobytes())
    if product.equilibrium is not None:
        digest.update(product.equilibrium.points.tobytes())
    return digest.hexdigest()
