"""Stage 3: from the latitudes to the lattice (Yan et al. 2016, §5).

    leave out  ──▶  count nodes  ──▶  divide, join rings  ──▶  fill pockets  ──▶  assemble  ──▶  smooth  ──▶  derive
    small_rings     node_counts       ring_to_parent           assemble,          assemble       tangential_, kagome, …
                                      free_borders             pocket_filling                    bending_smoothing

Patterns of `PATTERNS` are linked directly.  Those of `DERIVED` have other cells: they are made from the lattice of
another pattern on the same latitudes.  A new one is a new entry in `DERIVED`.

Where faces lie inverted or many rods are short, the polylines are divided again in a few other ways, and the best
division is taken.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Callable, Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import Degenerate, TooMuchWork, Unsupported
from weavecore.geometry.arrays import Bools, offsets_of, rows_of
from weavecore.geometry.matching import ALONE
from weavecore.linking.arc_length import points_at
from weavecore.linking.assemble import BandFilling, assemble, fill_all_bands
from weavecore.linking.bending_smoothing import smooth_bending
from weavecore.linking.diagonal import diagonal_lattice
from weavecore.linking.free_borders import (
    FreeBorderNodes,
    divide_free_borders,
    find_border_caps,
    find_free_borders,
    find_open_strips,
    number_border_nodes,
    refine_boundary,
    split_obstructed_chords,
)
from weavecore.linking.hexagonal import hexagonal_lattice
from weavecore.linking.kagome import kagome_lattice
from weavecore.linking.node_counts import count_nodes
from weavecore.linking.patterns import PATTERNS, Pattern, pattern_named
from weavecore.linking.ring_to_parent import DividedPolylines, join_rings_to_parents
from weavecore.linking.rod_runs import partners_of
from weavecore.linking.small_rings import FEWEST_EDGES, leave_out_small_rings
from weavecore.linking.tangential_smoothing import smooth_tangentially
from weavecore.linking.untangling import untangle
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice
from weavecore.model.lattice_fit import inverted_faces
from weavecore.model.rod_ends import count_short_rods
from weavecore.model.rod_pairing import MOST_TURN, turns_between
from weavecore.texts import rough_count

Progress = Optional[Callable[[float, str], None]]

_MOST_REFINEMENTS = 8
"""Rounds of boundary refinement; each adds at most one node to an edge, so eight divide it into 256 parts."""

MOST_NODES = 150_000
"""Nodes of a lattice: each takes some 25 kB to link, smooth, weave and write, so these take 4 GB."""

_NODE_OF_SQUARE = 0.87
"""Area that a Steiner vertex of a pocket takes, in squares of the edge length: that of two equilateral triangles."""

_OTHER_DIVISIONS = ((1.0, 1.0), (0.93, 1.0), (1.07, 1.0), (0.87, 1.0), (0.8, 1.0), (1.2, 1.0))
"""Parts of the edge length, and factors by which counts may be off, with which polylines are divided again where faces
lie inverted: a few nodes more or less often suffice for a fold."""

_MOST_NODES_TO_DIVIDE_AGAIN = 5_000
"""Larger lattices, which take seconds to divide, are divided once."""

_FEW_SHORT = 0.01
"""Share of the rods that may have fewer than four joints before latitudes are divided in other ways for their sake."""

_AGAINST_SHORT_RODS: tuple[tuple[Optional[bool], Optional[float], Optional[float]], ...] = (
    (True, None, None),
    (True, 1.25, None),
    (False, 1.25, None),
    (False, 1.6, None),
    (None, None, 13.0),
)
"""Other divisions: whether counts are in balance where rings split, the factor by which they may be off, and the edges
of the least ring that is kept.  One after the other is tried with what was best before it, which None keeps."""
_LITTLE_GAIN = 3
"""For so few short rods less the usual division stays, and nodes stay as they are smoothed: where the nodes of a ring
begin, which is free, decides over as many, and the same surface with its vertices in another order should get the same
rings."""
_MANY_INVERTED = 0.01
"""Share of inverted faces above which other divisions are not tried for the sake of short rods: where all those of
`_OTHER_DIVISIONS` leave so many, the surface is too thin or too folded for the spacing, and each takes seconds."""
_MOST_UNEVEN = 3.5
"""Longest edge over the shortest, up to which a division may be chosen for the sake of short rods: smoothing evens it
to less than 3."""

_MOST_REVERTS = 8
"""Rounds in which nodes of faces that smoothing inverts move back, and with them those of their neighbours."""


@dataclass(frozen=True)
class Derived:
    """How a pattern is derived from another.

    Parameters
    ----------
    base : str
        The pattern that is linked first.
    derive : callable
        Makes the lattice from that of the base and the pattern's name.
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
    """Return the name of a pattern if there is one of that name.

    Parameters
    ----------
    name : str

    Raises
    ------
    Unsupported
        When there is none.
    """
    if name not in PATTERN_NAMES:
        raise Unsupported(f"Unknown pattern {name!r}", remedy=f"Choose one of: {', '.join(PATTERN_NAMES)}.")
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
    free_rings: bool = False,
    progress: Progress = None,
) -> Lattice:
    """Link latitudes to a lattice of any pattern, and smooth it so that its rods bend little.

    In patterns that have rings, those too small to be bent are left out (`small_rings`).

    Parameters
    ----------
    latitudes : Latitudes
    edge_length, progress :
        As of `link_latitudes`.
    pattern : str
        One of `PATTERN_NAMES`.
    free_rings : bool
        Whether nodes may leave the latitudes in patterns that have rings; see `smooth_bending`.

    Returns
    -------
    Lattice

    Raises
    ------
    Unsupported
        When the edge length is not a positive number, or there is no such pattern.
    TooMuchWork, Degenerate
        As `link_latitudes`.
    """
    if known_pattern(pattern) in PATTERNS:
        lattice = _linked_with_few_short_rods(latitudes, edge_length, PATTERNS[pattern], progress)
        smoothed = _without_new_inversions(lattice, smooth_bending(lattice, free_rings=free_rings))
        return _without_new_breaks(lattice, smoothed)
    made = DERIVED[pattern]

    def derive(lattice: Lattice) -> Lattice:
        return made.derive(lattice, pattern)

    base = link_latitudes(
        latitudes, edge_length=edge_length, pattern=made.base, even_edges=True, derive=derive, progress=progress
    )
    lattice = derive(base)
    smoothed = smooth_bending(lattice)
    return _without_new_inversions(lattice, untangle(smoothed) if smoothed.off_latitudes else smoothed)


def _linked_with_few_short_rods(
    latitudes: Latitudes, edge_length: Optional[float], design: Pattern, progress: Progress
) -> Lattice:
    """The lattice without small rings, divided in other ways too where many rods are short: the best of these."""
    length = _edge_length(latitudes, edge_length, design)

    def link(design: Pattern, fewest: float) -> tuple[Lattice, tuple[int, int], float]:
        kept = leave_out_small_rings(latitudes, length, fewest=fewest)
        lattice = kept.restore(_link_design(kept.latitudes, length, design, None, progress))
        short, n_rods = count_short_rods(partners_of(lattice))
        return lattice, (len(inverted_faces(lattice)), short), short / max(n_rods, 1)

    fewest = FEWEST_EDGES
    lattice, count, share = link(design, fewest)
    usual, usual_count = lattice, count
    widest = max(_MOST_UNEVEN, _unevenness(lattice))
    for balances, tolerance, other_fewest in _AGAINST_SHORT_RODS:
        if share <= _FEW_SHORT or lattice.n_nodes > _MOST_NODES_TO_DIVIDE_AGAIN:
            break
        if count[0] > _MANY_INVERTED * lattice.n_faces:
            break
        other_design = replace(
            design,
            balances_splits=design.balances_splits if balances is None else balances,
            count_tolerance=tolerance or design.count_tolerance,
        )
        try:
            other, other_count, other_share = link(other_design, other_fewest or fewest)
        except (Degenerate, TooMuchWork):
            continue
        if other_count < count and _unevenness(other) <= widest:
            lattice, count, share = other, other_count, other_share
            design, fewest = other_design, other_fewest or fewest
    is_better = count[0] < usual_count[0] or usual_count[1] - count[1] > _LITTLE_GAIN
    return lattice if is_better else usual


def _unevenness(lattice: Lattice) -> float:
    """The longest edge over the shortest."""
    length = lattice.edge_lengths
    return float(length.max() / length.min()) if len(length) else 1.0


def _without_new_inversions(before: Lattice, after: Lattice) -> Lattice:
    """The smoothed lattice with nodes moved back where smoothing inverts faces."""
    known = inverted_faces(before)
    back = np.zeros(before.n_nodes, bool)
    for _ in range(_MOST_REVERTS):
        inverted = np.setdiff1d(inverted_faces(after), known)
        if len(inverted) == 0:
            return after
        face = rows_of(after.face_offsets)
        back[after.face_nodes[np.isin(face, inverted)]] = True
        around = np.unique(face[back[after.face_nodes]])
        back[after.face_nodes[np.isin(face, around)]] = True
        after = _moved_back(before, after, back)
    return before


def _without_new_breaks(before: Lattice, after: Lattice) -> Lattice:
    """The smoothed lattice, or that with nodes moved back where rods that went on turn too much now.

    The latter where clearly fewer rods are short then.
    """
    partner, tail, head = partners_of(before), before.edges.ravel(), before.edges[:, ::-1].ravel()
    known = np.flatnonzero(partner != ALONE)
    back, found = np.zeros(before.n_nodes, bool), after
    smoothed = onward = partners_of(after)
    for _ in range(_MOST_REVERTS):
        ended = known[(onward[known] == ALONE) & (turns_between(found, known, partner[known]) > MOST_TURN)]
        if len(ended) == 0:
            break
        back[tail[ended]] = back[head[ended]] = back[head[partner[ended]]] = True
        found = _moved_back(before, found, back)
        onward = partners_of(found)
    fewer = count_short_rods(smoothed)[0] - count_short_rods(onward)[0]
    return found if fewer > _LITTLE_GAIN and len(inverted_faces(found)) <= len(inverted_faces(after)) else after


def _moved_back(before: Lattice, after: Lattice, back: Bools) -> Lattice:
    """The lattice after with some nodes (N,) where they were before."""
    return replace(
        after,
        nodes=np.where(back[:, None], before.nodes, after.nodes),
        node_station=np.where(back, before.node_station, after.node_station),
    )


def link_latitudes(
    latitudes: Latitudes,
    *,
    edge_length: Optional[float] = None,
    pattern: str = "triangular",
    even_edges: bool = False,
    derive: Optional[Callable[[Lattice], Lattice]] = None,
    progress: Progress = None,
) -> Lattice:
    """Divide the latitudes and join each to its neighbours (Yan et al. 2016, §5).

    Parameters
    ----------
    latitudes : Latitudes
    edge_length : float, optional
        Wanted length of the edges along the latitudes, in the unit of the surface.  The default
        makes triangles equilateral and quads square: the spacing times `Pattern.edge_per_spacing`.
    pattern : str
        One of `PATTERNS`.
    even_edges : bool
        Whether the nodes of each ring are counted for its length alone: for patterns of which no rod ends where the
        count changes.
    derive : callable, optional
        Makes the lattice that is wanted from the one that is linked; its inverted faces then count in choosing a
        division.
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
    TooMuchWork
        When there would be more than `MOST_NODES` nodes.
    Degenerate
        When a band is too small for its topology at this edge length.
    """
    design = pattern_named(pattern)
    if even_edges:
        design = replace(design, count_tolerance=1.0)
    return _link_design(latitudes, _edge_length(latitudes, edge_length, design), design, derive, progress)


def _edge_length(latitudes: Latitudes, wanted: Optional[float], design: Pattern) -> float:
    """The edge length that is asked for, or that goes best with the spacing."""
    length = design.edge_per_spacing * latitudes.spacing if wanted is None else float(wanted)
    if not (np.isfinite(length) and length > 0):
        raise Unsupported(f"Edge length must be positive (got {length:g})", remedy="Use a positive edge length.")
    return length


def _link_design(
    latitudes: Latitudes,
    length: float,
    design: Pattern,
    derive: Optional[Callable[[Lattice], Lattice]],
    progress: Progress,
) -> Lattice:
    """The lattice of the division that leaves the fewest inverted faces."""
    report = progress or (lambda _fraction, _label: None)
    _check_work(latitudes, length)
    report(0.0, "dividing the latitudes")

    def n_inverted(one: Lattice) -> int:
        return len(inverted_faces(one)) + (len(inverted_faces(derive(one))) if derive else 0)

    lattice = _linked(latitudes, length, length, design)
    least = n_inverted(lattice)
    for tried, (factor, tolerance) in enumerate(_OTHER_DIVISIONS):
        if least == 0 or lattice.n_nodes > _MOST_NODES_TO_DIVIDE_AGAIN:
            break
        report(0.3 + 0.6 * tried / len(_OTHER_DIVISIONS), "dividing the latitudes again")
        other_design = replace(design, count_tolerance=min(tolerance, design.count_tolerance))
        try:
            other = _linked(latitudes, factor * length, length, other_design)
        except (Degenerate, TooMuchWork):
            continue
        count = n_inverted(other)
        lattice, least = (other, count) if count < least else (lattice, least)
    return lattice


def _linked(latitudes: Latitudes, length: float, wanted: float, pattern: Pattern) -> Lattice:
    """The lattice with edges of a length, where one of ``wanted`` was asked for."""
    filling = _divide_and_fill(latitudes, length, pattern)
    lattice = assemble(latitudes, filling, pattern, wanted)
    return _without_new_inversions(lattice, smooth_tangentially(lattice, filling.divided.cusps))


def _check_work(latitudes: Latitudes, length: float) -> None:
    """Refuse more nodes on polylines, and in the pockets that these leave, than can be linked and woven in minutes."""
    lengths = latitudes.polylines.lengths
    total = float(lengths.sum())
    # Each child has a strip of about a spacing behind it; what is left over are pockets.
    pockets = max(latitudes.surface.area - latitudes.spacing * float(lengths[latitudes.generation > 0].sum()), 0.0)
    expected = total / length + pockets / (_NODE_OF_SQUARE * length**2)
    if expected > MOST_NODES:
        # The edge at which these would be just as many: a quadratic equation in its inverse.
        least = (total + math.sqrt(total**2 + 4 * MOST_NODES * pockets / _NODE_OF_SQUARE)) / (2 * MOST_NODES)
        raise TooMuchWork(
            f"Edges of {length:.4g} on polylines of {total:.4g} in all, and in pockets of {pockets:.4g} square units "
            f"between them, would make about {rough_count(expected)} nodes, more than {MOST_NODES:,}",
            remedy=f"Use edges of at least {least:.3g}, or another spacing than {latitudes.spacing:.4g}.",
        )


def _divide_and_fill(latitudes: Latitudes, length: float, pattern: Pattern) -> BandFilling:
    """The faces of all bands between divided polylines."""
    divided, border_nodes = _divide(latitudes, length, pattern)
    return _fill_with_refinement(latitudes, divided, border_nodes, pattern, length)


def _divide(latitudes: Latitudes, length: float, pattern: Pattern) -> tuple[DividedPolylines, FreeBorderNodes]:
    """The polylines divided and joined to their parents, and the free borders divided."""
    borders = find_free_borders(latitudes)
    stations = divide_free_borders(borders, length)
    counts = count_nodes(latitudes, length, pattern, find_border_caps(latitudes, borders))
    divided = join_rings_to_parents(latitudes, counts, pattern, find_open_strips(latitudes, borders, stations))
    if borders:
        polyline = rows_of(offsets_of(divided.counts))
        tree = cKDTree(points_at(latitudes.polylines, polyline, np.concatenate(divided.stations)))
        stations = [split_obstructed_chords(border, at, tree) for border, at in zip(borders, stations)]
    return divided, number_border_nodes(borders, stations, divided.counts)


def _fill_with_refinement(
    latitudes: Latitudes, divided: DividedPolylines, border_nodes: FreeBorderNodes, pattern: Pattern, length: float
) -> BandFilling:
    """The faces of all bands, with the boundary refinement that leaves the fewest inverted faces."""
    best = filling = fill_all_bands(latitudes, divided, border_nodes, pattern, length)
    for _ in range(_MOST_REFINEMENTS):
        if len(filling.inverted) == 0:
            break
        divided, border_nodes = refine_boundary(
            latitudes.polylines, filling.divided, filling.border_nodes, filling.inverted
        )
        if len(border_nodes.points) + divided.counts.sum() == len(filling.latitude):
            break
        filling = fill_all_bands(latitudes, divided, border_nodes, pattern, length)
        if len(filling.inverted) < len(best.inverted):
            best = filling
    return best
