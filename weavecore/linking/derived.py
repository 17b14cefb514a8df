"""Patterns whose cells are made from those of another lattice on the same latitudes.

A new one is a new entry in `DERIVED`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Callable, Optional

from weavecore.errors import Unsupported
from weavecore.linking.diagonal import diagonal_lattice
from weavecore.linking.hexagonal import hexagonal_lattice
from weavecore.linking.kagome import kagome_lattice
from weavecore.linking.link import link_latitudes
from weavecore.linking.patterns import PATTERNS
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


def spacing_for_edges(edge_length: float, *, pattern: str = "triangular") -> float:
    """The spacing that goes best with an edge length, where no spacing is asked for.

    Parameters
    ----------
    edge_length : float
        As in `link_pattern`.
    pattern : str

    Returns
    -------
    float
        In the same unit: the height of an equilateral triangle of that edge, or the side of a square.

    Raises
    ------
    Unsupported
        Where there is no such pattern.
    """
    base = DERIVED[pattern].base if known_pattern(pattern) in DERIVED else pattern
    return float(edge_length / PATTERNS[base].edge_per_spacing)


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
