"""The curves that the page draws as rods, sampled, with names, families and depths.

The *depth* of a sample is its generation, with a fraction between two latitudes; the page cuts the rods by it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.geometry.splines import CurveSamples
from weavecore.model import Latitudes, Lattice, Strands, SurfaceMesh, Weave
from weavecore.model.lattice import node_generations
from weavecore.palette import FREE_BORDERS, LONGITUDES, POCKETS, WOVEN
from weavecore.viewing.surface_paths import paths_of_surface

STEPS_PER_EDGE = 16
"""Samples of an axis in one edge, of which those are kept where it turns."""

_TURN = np.radians(5.0)
"""A rod is drawn in straight segments that turn by about this angle, so that it looks smooth."""

_BORDER_RADIUS, _LINE_RADIUS = 0.002, 0.03
"""Radius of borders in sizes of the surface, and of polylines and strands in spacings."""


@dataclass(frozen=True)
class Family:
    """A family of rods: its name, and its colour (red, green, blue from 0 to 255)."""

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
class PageCurves:
    """Curves end to end; of a closed one the first sample comes again at its end.

    Parameters
    ----------
    names : tuple of str
    families : tuple of Family
    family : (R,) int64
        Index in ``families``.
    closed : (R,) bool
    offsets : (R+1,) int64
    points : (N, 3) float64
    stations : (N,) float64
        Arc length from the start of the curve.
    depth : (N,) float64
    radius : float
        Of the thickest rods, in the model's unit.
    thickness : (R,) float64
        Of each, as a part of that radius.
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
    thickness: Floats

    @property
    def lengths(self) -> Floats:
        """(R,) arc length of each curve."""
        return self.stations[self.offsets[1:] - 1]


def curves_of_borders(surface: SurfaceMesh) -> PageCurves:
    """The borders and cuts of a surface, or its origins and free borders where origins were chosen.

    Parameters
    ----------
    surface : SurfaceMesh
    """
    paths = paths_of_surface(surface)
    chosen = (Family("Origins", WOVEN["L"]), Family("Free borders", FREE_BORDERS))[: 1 + paths.is_free_border.any()]
    return _straight(
        paths.points,
        paths.offsets,
        paths.closed,
        np.zeros(len(paths.points)),
        names=list(paths.names),
        families=(Family("Borders", WOVEN["L"]),) if surface.starts is None else chosen,
        family=paths.is_free_border.astype(np.int64),
        radius=_BORDER_RADIUS * surface.size,
    )


def curves_of_latitudes(latitudes: Latitudes) -> PageCurves:
    """The polylines, named by their index.

    Parameters
    ----------
    latitudes : Latitudes
    """
    lines = latitudes.polylines
    return _straight(
        lines.points,
        lines.offsets,
        lines.closed,
        latitudes.generation[lines.owner].astype(float),
        names=[f"polyline {p}" for p in range(len(latitudes))],
        families=(Family("Latitudes", WOVEN["L"]),),
        family=np.zeros(len(latitudes), np.int64),
        radius=_LINE_RADIUS * latitudes.spacing,
    )


def curves_of_lattice(lattice: Lattice, strands: Strands) -> PageCurves:
    """The strands from node to node, named by their index.

    Parameters
    ----------
    lattice : Lattice
    strands : Strands
    """
    return _straight(
        lattice.nodes[strands.nodes],
        strands.offsets,
        strands.closed,
        node_generations(lattice)[strands.nodes],
        names=[f"strand {s}" for s in range(len(strands))],
        families=_OF_LATTICE,
        family=strands.family,
        radius=_LINE_RADIUS * min(lattice.latitudes.spacing, lattice.edge_length),
    )


def curves_of_weave(weave: Weave) -> PageCurves:
    """The axes of the rods, with as few samples as look smooth.

    Parameters
    ----------
    weave : Weave
    """
    lattice, axes = weave.lattice, weave.axes
    samples = axes.samples(min(lattice.latitudes.spacing, lattice.edge_length) / STEPS_PER_EDGE)
    depth = _depth_along(samples, axes.offsets, axes.closed, node_generations(lattice)[weave.strands.nodes])
    kept = _corners(samples)
    letters = [letter for letter in _LETTERS if any(name.startswith(letter) for name in weave.ids)]
    return PageCurves(
        names=weave.ids,
        families=tuple(_LETTERS[letter] for letter in letters),
        family=np.array([letters.index(name[0]) for name in weave.ids], np.int64),
        closed=axes.closed,
        offsets=np.searchsorted(kept, samples.offsets),
        points=samples.points[kept],
        stations=samples.stations[kept],
        depth=depth[kept],
        radius=weave.rod_diameter / 2.0,
        thickness=weave.diameters / weave.rod_diameter,
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
) -> PageCurves:
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
    return PageCurves(
        tuple(names),
        families,
        family,
        closed,
        all_offsets,
        points,
        stations,
        depth[index],
        radius,
        np.ones(len(closed)),
    )


def _corners(samples: CurveSamples) -> Ints:
    """Indices of the samples that are needed: ends, given points, and where the curve has turned by `_TURN`."""
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
    # With a gap between curves, the stations of all of them are one rising sequence to interpolate in.
    base = np.concatenate([[0.0], np.cumsum(samples.stations[last] + 1.0)])[:-1]
    along = samples.stations + np.repeat(base, np.diff(samples.offsets))
    result: Floats = np.interp(along, along[known], depth[known]) if len(first) else depth
    return result
