"""Rhino's .3dm: curves, points and mesh on named layers, ready to work on.

Layers: ``weave::latitudes::00`` and on by generation; ``weave::longitudes::00`` and on by the
generation at which a strand begins; ``weave::pockets``; ``weave::nodes``; ``weave::lattice``.
Of a weave, ``weave::rods::`` and a family have the axes of the rods too, coloured by how much they are
bent.  A surface alone lies on ``weave::surface``.  Layers carry the colours, objects follow them.
Closed polylines repeat their first point, as Rhino's do.
"""

from __future__ import annotations

import hashlib

import numpy as np

from weavecore.exporting.product import Product, polygons_of, strand_lengths
from weavecore.exporting.relaxed import add_relaxed
from weavecore.exporting.rhino_document import Document
from weavecore.exporting.woven import add_rods
from weavecore.geometry.arrays import Floats
from weavecore.model import FAMILIES, LATITUDINAL, LONGITUDINAL, Latitudes, Lattice, Strands, first_generations
from weavecore.palette import LONGITUDES, NODES, POCKETS, SURFACE, latitude_colours


def encode_3dm(product: Product) -> bytes:
    """The bytes of a .3dm file.

    Raises
    ------
    NotWritten
        Where Rhino's library does not take an object, of which it says no more.
    """
    document = Document(product.surface.unit, product.surface.tolerance, seed=_fingerprint(product))
    if product.latitudes is None:
        _add_faces(document, product, "surface", product.surface.name or "surface")
        return document.encode()
    _add_latitudes(document, product.latitudes)
    if product.lattice is not None:
        if product.strands is not None:
            _add_strands(document, product.strands, product.lattice)
        if product.weave is not None:
            add_rods(document, product.weave)
        if product.equilibrium is not None:
            add_relaxed(document, product.equilibrium)
        texts = {"pattern": product.lattice.pattern, "edge_length": product.lattice.edge_length}
        document.add_points(product.lattice.nodes, document.layer("weave::nodes", NODES), "nodes", texts)
        _add_faces(document, product, "lattice", "lattice")
    return document.encode()


def _fingerprint(product: Product) -> str:
    """A text that tells this result from others, from the coordinates alone."""
    digest = hashlib.sha256(product.surface.vertices.tobytes())
    if product.latitudes is not None:
        digest.update(product.latitudes.polylines.points.tobytes())
    if product.lattice is not None:
        digest.update(product.lattice.nodes.tobytes())
    if product.weave is not None:
        digest.update(product.weave.axes.points.tobytes())
    return digest.hexdigest()


def _add_faces(document: Document, product: Product, layer: str, name: str) -> None:
    """Add the mesh, with the options that led to it."""
    index = document.layer(f"weave::{layer}", SURFACE)
    document.add_mesh(polygons_of(product, ".3dm"), index, name, product.parameters)


def _layer_of(family: str, generation: int, latitudes: Latitudes) -> str:
    """The full path of a generation's layer, with so many digits that names sort as numbers do."""
    digits = max(2, len(str(latitudes.n_generations - 1)))
    return f"weave::{family}::{generation:0{digits}d}"


def _add_latitudes(document: Document, latitudes: Latitudes) -> None:
    parents: dict[int, list[int]] = {}
    for parent, child in latitudes.parents.tolist():
        parents.setdefault(child, []).append(parent)
    colours = latitude_colours(np.arange(latitudes.n_generations), latitudes.n_generations).tolist()
    figures = zip(latitudes.generation.tolist(), latitudes.distance.tolist(), latitudes.polylines.lengths.tolist())
    for p, (generation, distance, length) in enumerate(figures):
        layer = document.layer(_layer_of("latitudes", generation, latitudes), tuple(colours[generation]))
        texts = {
            "id": p,
            "family": FAMILIES[LATITUDINAL],
            "generation": generation,
            "parents": " ".join(map(str, parents.get(p, []))),
            "distance": distance,
            "length": length,
        }
        points = _drawn(latitudes.polylines.polyline(p), is_closed=bool(latitudes.polylines.closed[p]))
        document.add_polyline(points, layer, f"latitude {p}", texts)


def _add_strands(document: Document, strands: Strands, lattice: Lattice) -> None:
    """Add the strands that bind the latitudes; the latitudinal ones run along the latitudes, which are there."""
    begins = first_generations(strands, lattice).tolist()
    lengths = strand_lengths(strands, lattice).tolist()
    for s in np.flatnonzero(strands.family != LATITUDINAL).tolist():
        family = int(strands.family[s])
        if family == LONGITUDINAL:
            layer = document.layer(_layer_of("longitudes", begins[s], lattice.latitudes), LONGITUDES)
        else:
            layer = document.layer("weave::pockets", POCKETS)
        texts = {"id": s, "family": FAMILIES[family], "generation": begins[s], "length": lengths[s]}
        points = _drawn(lattice.nodes[strands.strand(s)], is_closed=bool(strands.closed[s]))
        document.add_polyline(points, layer, f"strand {s}", texts)


def _drawn(points: Floats, *, is_closed: bool) -> Floats:
    return np.concatenate([points, points[:1]]) if is_closed else points
