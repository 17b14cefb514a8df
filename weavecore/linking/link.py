"""Stage 3: from the latitudes to the lattice (Yan et al. 2016, §5)."""

from __future__ import annotations

from typing import Callable, Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import offsets_of, rows_of
from weavecore.linking.assembling import assemble
from weavecore.linking.binding import Bound, bind
from weavecore.linking.division import count_nodes, points_at
from weavecore.linking.fairing import fair
from weavecore.linking.loosening import loosen
from weavecore.linking.patterns import Pattern, pattern_named
from weavecore.linking.rings import Rings, link_rings
from weavecore.linking.selvedges import (
    Hem,
    divide_selvedges,
    find_selvedges,
    find_tongues,
    give_way,
    number_hem,
    plain_strips,
)
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice

_MOST_LOOSENINGS = 8

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
        the one that makes equilateral triangles, or squares, with the spacing.
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
    length = design.edge_per_spacing * latitudes.spacing if edge_length is None else float(edge_length)
    if not (np.isfinite(length) and length > 0):
        raise Unsupported(f"An edge length of {length:g} is no length", remedy="Give a positive length.")
    tell(0.0, "dividing the latitudes")
    rings, hem = _divide(latitudes, length, design)
    tell(0.4, "filling the pockets")
    bound = _bind_loosely(latitudes, rings, hem, design, length)
    tell(0.8, "fairing the lattice")
    return fair(assemble(latitudes, bound, design, length), rings.spikes)


def _divide(latitudes: Latitudes, length: float, design: Pattern) -> tuple[Rings, Hem]:
    """The polylines divided and zipped, and the selvedges divided."""
    selvedges = find_selvedges(latitudes)
    turns = divide_selvedges(selvedges, length)
    counts = count_nodes(latitudes, length, design, find_tongues(latitudes, selvedges))
    rings = link_rings(latitudes, counts, design, plain_strips(latitudes, selvedges, turns))
    if selvedges:
        tree = cKDTree(points_at(latitudes.polylines, rows_of(offsets_of(rings.counts)), np.concatenate(rings.nodes)))
        turns = [give_way(selvedge, stations, tree) for selvedge, stations in zip(selvedges, turns)]
    return rings, number_hem(selvedges, turns, rings.counts)


def _bind_loosely(latitudes: Latitudes, rings: Rings, hem: Hem, design: Pattern, length: float) -> Bound:
    """Bound with as many more nodes at selvedges as leave the fewest faces fallen."""
    best = bound = bind(latitudes, rings, hem, design, length)
    for _ in range(_MOST_LOOSENINGS):
        if len(bound.fallen) == 0:
            break
        rings, hem = loosen(latitudes.polylines, bound.rings, bound.hem, bound.fallen)
        if len(hem.places) + rings.counts.sum() == len(bound.latitude):
            break
        bound = bind(latitudes, rings, hem, design, length)
        if len(bound.fallen) < len(best.fallen):
            best = bound
    return best
