"""What the page draws as rods: sampled curves with names, families and depths.

The *depth* of a sample is its generation, with a fraction between two latitudes; the page cuts the rods by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.splines import CurveSamples
from weavecore.model import Latitudes, Lattice, Strands, SurfaceMesh, Weave
from weavecore.model.lattice import node_generations
from weavecore.palette import LONGITUDES, POCKETS, SELVEDGES, WOVEN
from weavecore.viewing.outlines import outlines_of

_STEPS_PER_EDGE = 16
_TURN = np.radians(5.0)
"""A rod is drawn in straight pieces that turn by no more than about this."""


@dataclass(frozen=True)
class Family:
    """A family of rods: its name and its colour from 0 to 255."""

    name: str
    colour: tuple[int, int, int]


_LETTERS = {
    "L": Family("Latitudes", WOVEN["L"]),
    "A": Family("Longitudes forward", WOVEN["A"]),
    "B": Family("Longitudes back", WOVEN["B"]),
    "P": Family("Pockets", WOVEN["P"]),
}
_OF_LATTICE = (Family("Latitudes", WOVEN["L"]), Family("Longitudes", LONGITUDES), Family("Pockets", POCKETS))


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves end to end; of a closed one the first sample comes again at its end.

    Parameters
    ----------
    names : tuple of str
    families : tuple of Family
    family : (R,) int64
    closed : (R,) bool
    offsets : (R+1,) int64
    points : (N, 3) float64
    stations : (N,) float64
        Arc length from the start of the curve.
    depth : (N,) float64
    radius : float
        Of the rods, in the model's unit.
    """

    names: tuple[str, ...]
    families: tuple[Family, ...]
    family: Ints
    closed: Bools
    offsets: Ints
    points: Floats
    stations: Floats
    depth: Floats
    radius: float

    @property
    def lengths(self) -> Floats:
        """(R,) arc length of each curve."""
        return self.stations[self.offsets[1:] - 1]


def curves_of_borders(surface: SurfaceMesh) -> Curves:
    """The borders and cuts of a surface, or its origins and selvedges where origins were chosen."""
    outlines = outlines_of(surface)
    chosen = (Family("Origins", WOVEN["L"]), Family("Selvedges", SELVEDGES))[: 1 + outlines.is_selvedge.any()]
    return _straight(
        outlines.points,
        outlines.offsets,
        outlines.closed,
        np.zeros(len(outlines.points)),
        names=list(outlines.names),
        families=(Family("Borders", WOVEN["L"]),) if surface.starts is None else chosen,
        family=outlines.is_selvedge.astype(np.int64),
        radius=0.002 * surface.size,
    )


def curves_of_latitudes(latitudes: Latitudes) -> Curves:
    """The polylines, named by their number."""
    lines = latitudes.polylines
    return _straight(
        lines.points,
        lines.offsets,
        lines.closed,
        latitudes.generation[lines.owner].astype(float),
        names=[f"polyline {p}" for p in range(len(latitudes))],
        families=(Family("Latitudes", WOVEN["L"]),),
        family=np.zeros(len(latitudes), np.int64),
        radius=0.03 * latitudes.spacing,
    )


def curves_of_lattice(lattice: Lattice, strands: Strands) -> Curves:
    """The strands from node to node, named by their number."""
    return _straight(
        lattice.nodes[strands.nodes],
        strands.offsets,
        strands.closed,
        node_generations(lattice)[strands.nodes],
        names=[f"strand {s}" for s in range(len(strands))],
        families=_OF_LATTICE,
        family=strands.family,
        radius=0.03 * min(lattice.latitudes.spacing, lattice.edge_length),
    )


def curves_of_weave(weave: Weave) -> Curves:
    """The axes of the rods, with as few samples as look smooth."""
    lattice, axes = weave.lattice, weave.axes
    samples = axes.samples(min(lattice.latitudes.spacing, lattice.edge_length) / _STEPS_PER_EDGE)
    depth = _depth_along(samples, axes.offsets, axes.closed, node_generations(lattice)[weave.strands.nodes])
    kept = _corners(samples)
    letters = [letter for letter in _LETTERS if any(name.startswith(letter) for name in weave.ids)]
    return Curves(
        names=weave.ids,
        families=tuple(_LETTERS[letter] for letter in letters),
        family=np.array([letters.index(name[0]) for name in weave.ids], np.int64),
        closed=axes.closed,
        offsets=np.searchsorted(kept, samples.offsets),
        points=samples.points[kept],
        stations=samples.stations[kept],
        depth=depth[kept],
        radius=weave.rod_diameter / 2.0,
    )


def _straight(
    points: Floats,
    offsets: Ints,
    closed: Bools,
    depth: Floats,
    *,
    names: list[str],
    families: tuple[Family, ...],
    family: Ints,
    radius: float,
) -> Curves:
    """Curves through the given points, closed ones brought back to their start."""
    counts = np.diff(offsets) + closed
    all_offsets = offsets_of(counts)
    row = rows_of(all_offsets)
    place = np.arange(all_offsets[-1]) - all_offsets[row]
    index = offsets[row] + place % np.maximum(np.diff(offsets), 1)[row]
    points = points[index]
    steps = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    steps[all_offsets[:-1]] = 0.0
    total = np.cumsum(steps)
    stations = total - total[all_offsets[:-1]][row] if len(total) else total
    return Curves(tuple(names), families, family, closed, all_offsets, points, stations, depth[index], radius)


def _corners(samples: CurveSamples) -> Ints:
    """The samples that are needed: ends, given points, and where the curve has turned far enough."""
    chord = np.linalg.norm(np.diff(samples.tangents, axis=0, prepend=samples.tangents[:1]), axis=1)
    sector = np.floor(np.cumsum(chord) / _TURN)
    needed = samples.is_given | (np.diff(sector, prepend=-1.0) > 0)
    needed[samples.offsets[1:] - 1] = True
    needed[samples.offsets[:-1]] = True
    return np.flatnonzero(needed)


def _depth_along(samples: CurveSamples, offsets: Ints, closed: Bools, at_visits: Floats) -> Floats:
    """The depth of every sample, linear by arc length between the visits."""
    first, last = samples.offsets[:-1], samples.offsets[1:] - 1
    known = samples.is_given.copy()
    known[last] = True
    depth = np.zeros(len(known))
    depth[samples.is_given] = at_visits
    depth[last[closed]] = at_visits[offsets[:-1][closed]]
    # All curves end to end, each a gap after the one before, make one rising row.
    base = np.concatenate([[0.0], np.cumsum(samples.stations[last] + 1.0)])[:-1]
    along = samples.stations + np.repeat(base, np.diff(samples.offsets))
    result: Floats = np.interp(along, along[known], depth[known]) if len(first) else depth
    return result
