"""Stage 3: from the latitudes to the lattice (Yan et al. 2016, §5)."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.linking.assembling import assemble
from weavecore.linking.division import count_nodes, points_at
from weavecore.linking.feet import find_feet
from weavecore.linking.patterns import pattern_named
from weavecore.linking.phases import place_nodes
from weavecore.linking.pockets import Filling, fill_bands
from weavecore.linking.rings import zip_band
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice

Progress = Optional[Callable[[float, str], None]]


def link_latitudes(
    latitudes: Latitudes,
    *,
    edge_length: Optional[float] = None,
    pattern: str = "triangular",
    progress: Progress = None,
) -> Lattice:
    """Divide the latitudes and bind each to its neighbours (Yan et al. 2016, §5).

    Parameters
    ----------
    latitudes : Latitudes
    edge_length : float, optional
        Length that the edges along the latitudes come near to, in the model's unit.  By default
        the one that makes equilateral triangles with the spacing.
    pattern : str
        ``"triangular"`` or ``"quad"``.
    progress : callable, optional
        Called with a fraction and a label.

    Returns
    -------
    Lattice
        A manifold with the Euler characteristic and the borders of the surface.

    Raises
    ------
    Unsupported
        When the edge length is not a positive number, or there is no such pattern.
    """
    tell = progress or (lambda _fraction, _label: None)
    design = pattern_named(pattern)
    length = 2.0 / np.sqrt(3.0) * latitudes.spacing if edge_length is None else float(edge_length)
    if not (np.isfinite(length) and length > 0):
        raise Unsupported(f"An edge length of {length:g} is no length", remedy="Give a positive length.")
    tell(0.0, "dividing the latitudes")
    counts = count_nodes(latitudes, length, design)
    feet = find_feet(latitudes, counts)
    nodes = place_nodes(latitudes, counts, feet, design)
    latitude = rows_of(offsets_of(counts))
    station = np.concatenate(nodes)
    places = points_at(latitudes.polylines, latitude, station)
    tell(0.3, "binding the rings")
    zips, others = [], []
    for band, is_plain in enumerate(_plain_bands(latitudes).tolist()):
        zipped = zip_band(latitudes, band, feet, nodes, places) if is_plain else None
        if zipped is None:
            others.append(band)
        else:
            zips.append(zipped)
    tell(0.5, "filling the pockets")
    taken = np.unique(np.concatenate([_ring_edges(counts), *(z.links() for z in zips)]), axis=0)
    filling = _fill(latitudes, nodes, places, np.array(others, np.int64), taken, length)
    return assemble(latitudes, places, latitude, station, zips, filling, design, length)


def _plain_bands(latitudes: Latitudes) -> Bools:
    """Bands between one parent and one child, with no handle."""
    bands = latitudes.bands
    n_parents = np.bincount(rows_of(bands.offsets)[bands.is_parent], minlength=len(bands))
    plain: Bools = (np.diff(bands.offsets) == 2) & (bands.euler == 0) & (n_parents == 1)
    return plain


def _ring_edges(counts: Ints) -> Ints:
    after = next_in_loop(offsets_of(counts))
    edges: Ints = np.sort(np.c_[np.arange(len(after)), after], axis=1)
    return edges


def _fill(
    latitudes: Latitudes, nodes: list[Floats], places: Floats, bands: Ints, taken: Ints, edge_length: float
) -> Filling:
    if len(bands) == 0:
        return Filling(np.zeros((0, 3), np.int64), np.zeros((0, 3)))
    return fill_bands(latitudes, nodes, places, bands, taken, edge_length)
