"""Patterns whose cells are made from those of another lattice on the same latitudes.

A new one is a new entry in `DERIVED`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import offsets_of, rows_of
from weavecore.linking.assemble import Bound, assemble, bind
from weavecore.linking.diagonal import diagonal_lattice
from weavecore.linking.free_borders import (
    Hem,
    divide_selvedges,
    find_selvedges,
    find_tongues,
    give_way,
    loosen,
    number_hem,
    plain_strips,
)
from weavecore.linking.hexagonal import hexagonal_lattice
from weavecore.linking.kagome import kagome_lattice
from weavecore.linking.patterns import PATTERNS, Pattern, pattern_named
from weavecore.linking.resample import count_nodes, points_at
from weavecore.linking.smoothing import fair
from weavecore.linking.strips import Rings, link_rings
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice

Progress = Optional[Callable[[float, str], None]]


@dataclass(frozen=True)
class Derived:
    """How a pattern is made.

    Parameters
    ----------
    base : str
        The pattern that is linked first.
    derive : callable
        What makes the lattice of that into the one that is wanted; it is given the pattern's name as well.
    """

    base: str
    derive: Callable[[Lattice, str], Lattice]


DERIVED = {
    "hexagonal": Derived("triangular", hexagonal_lattice),
    "kagome": Derived("triangular", kagome_lattice),
    "diagonal": Derived("triangular", diagonal_lattice),
}

PATTERN_NAMES = (*PATTERNS, *DERIVED)


def known_pattern(name: str) -> str:
    """The name, where there is a pattern of that name.

    Raises
    ------
    Unsupported
        Where there is none.
    """
    if name not in PATTERN_NAMES:
        raise Unsupported(f"There is no pattern {name!r}", remedy=f"Take one of: {', '.join(PATTERN_NAMES)}.")
    return name


def link_pattern(
    latitudes: Latitudes,
    *,
    edge_length: Optional[float] = None,
    pattern: str = "triangular",
    progress: Progress = None,
) -> Lattice:
    """Link latitudes to a lattice of any pattern; see `link_latitudes` for the options.

    Raises
    ------
    Unsupported
        When the edge length is not a positive number, or there is no such pattern.
    """
    if known_pattern(pattern) in PATTERNS:
        return link_latitudes(latitudes, edge_length=edge_length, pattern=pattern, progress=progress)
    made = DERIVED[pattern]
    lattice = link_latitudes(latitudes, edge_length=edge_length, pattern=made.base, progress=progress)
    return made.derive(lattice, pattern)


# ----------------------------------------------------------------------
# Stage 3: from the latitudes to the lattice (Yan et al. 2016, §5).

_MOST_LOOSENINGS = 8


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
