"""*Weave Preview*: the rods as pipes in one mesh, coloured, up to a step of the construction, with dots that name them.

A pipe is a ring of `_SIDES` points about each place where an axis has turned by `_TURN`.  The rings are turned by the
normal of the surface, which no rod runs along, so that all are made at once.  Pipes of one colour are one mesh of
one colour, and these are joined: so no colour has to be handed over point by point.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any, NamedTuple, Optional, Union
from weakref import WeakKeyDictionary

import numpy as np

from weavecore.canvas.inputs import named
from weavecore.canvas.solve import Run
from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Floats, Ints, next_in_loop, rows_of, unit_vectors
from weavecore.model import Equilibrium, Weave
from weavecore.palette import WOVEN, latitude_colours, utilisation_colours
from weavecore.viewing.page.page_equilibrium import stations_at_points
from weavecore.weaving.sequence import find_sequence

COLOURS = ("family", "utilisation", "step")
"""What pipes can be coloured by."""

_SIDES = 6
_SAMPLES_PER_EDGE = 2
_TURN = np.radians(10.0)
_SHADES = 24
"""Colours of a scale."""

_CAP = np.array([[0, 1, 2, 3], [0, 3, 4, 5]])
"""Faces over the end of a pipe."""


class PreviewResults(NamedTuple):
    """The mesh, dots with the names of the rods, and the number of steps."""

    mesh: Any
    dots: list[Any]
    places: list[Any]
    names: list[str]
    n_steps: int


@dataclass(frozen=True, eq=False)
class _Pipes:
    """Rings of points about all samples (N, sides, 3), rods as ranges of samples, and the middle of each rod."""

    rings: Floats
    offsets: Ints
    middles: Floats


_made: WeakKeyDictionary[Any, dict[float, _Pipes]] = WeakKeyDictionary()
"""Pipes of weaves by their amplitude: a slider through the steps makes none anew."""

_steps: WeakKeyDictionary[Weave, Ints] = WeakKeyDictionary()
"""The step that sets each rod: found once, where steps are asked for."""


def draw_preview(
    run: Run,
    value: Union[Weave, Equilibrium],
    *,
    colour: Optional[str] = None,
    step: Optional[int] = None,
    amplitude: Optional[float] = None,
) -> PreviewResults:
    """Draw the rods of a weave as pipes.

    Parameters
    ----------
    run : Run
    value : Weave or Equilibrium
        At rest, the rods are drawn there.
    colour : str, optional
        One of `COLOURS`, by default the first.
    step : int, optional
        The last step of the construction that is shown; by default all are.
    amplitude : float, optional
        How many times their distance rods are drawn off the surface, to show over and under; by default 1.

    Returns
    -------
    PreviewResults

    Raises
    ------
    Unsupported
    """
    weave = _weave_of(value)
    by = named(colour, COLOURS, "colour") or COLOURS[0]
    factor = 1.0 if amplitude is None else float(amplitude)
    kept = _made.setdefault(value, {})
    if factor not in kept:
        run.progress(0.0, "shaping the pipes")
        kept[factor] = _pipes_of(weave, value if isinstance(value, Equilibrium) else None, factor)
    pipes = kept[factor]
    n_steps = len(weave)
    last = n_steps if step is None else min(max(step, 0), n_steps)
    shown = np.arange(n_steps) if last == n_steps else np.flatnonzero(_steps_of(weave) < last)
    run.progress(0.5, "drawing")
    colours = _colours(value, by)
    names = [weave.ids[s] for s in shown.tolist()]
    places = run.drawing.points(pipes.middles[shown])
    dot = import_module("Rhino.Geometry").TextDot
    return PreviewResults(
        mesh=_mesh(run, pipes, shown, colours),
        dots=[dot(name, place) for name, place in zip(names, places)],
        places=list(places),
        names=names,
        n_steps=n_steps,
    )


def _weave_of(value: Any) -> Weave:
    if isinstance(value, (Weave, Equilibrium)):
        return value.weave if isinstance(value, Equilibrium) else value
    raise Unsupported(
        f"A {type(value).__name__} came where a weave must be", remedy="Wire the output weave of Weave Strands."
    )


def _pipes_of(weave: Weave, at_rest: Optional[Equilibrium], amplitude: float) -> _Pipes:
    axes, lattice = weave.axes, weave.lattice
    samples = axes.samples(min(lattice.latitudes.spacing, lattice.edge_length) / _SAMPLES_PER_EDGE)
    rod = rows_of(samples.offsets)
    # Stations of all rods one behind the other, so that one interpolation serves them all.
    gap = float(axes.lengths.max(initial=0.0)) + 1.0
    at = samples.stations + gap * rod
    visit_at, visit = _known_visits(weave, gap)
    normals = _along(at, visit_at, weave.normals[weave.strands.nodes][visit])
    offsets = np.interp(at, visit_at, axes.layer_offsets[visit])
    points = samples.points + (amplitude - 1.0) * offsets[:, None] * normals
    if at_rest is not None:
        rest_at = stations_at_points(at_rest) + gap * at_rest.rod
        points = points + _along(at, rest_at, at_rest.points - at_rest.drawn)
    tangents = _tangents(points, samples.offsets)
    middles = points[np.searchsorted(at, gap * np.arange(len(weave)) + axes.lengths / 2)]
    kept = _turns(tangents, samples.offsets)
    points, normals, tangents, rod = points[kept], normals[kept], tangents[kept], rod[kept]
    bounds = np.searchsorted(kept, samples.offsets)
    across = unit_vectors(np.cross(normals, tangents))
    upward = np.cross(tangents, across)
    angle = 2 * np.pi * np.arange(_SIDES) / _SIDES
    rings = np.cos(angle)[:, None] * across[:, None] + np.sin(angle)[:, None] * upward[:, None]
    rings = points[:, None] + weave.diameters[rod, None, None] / 2.0 * rings
    return _Pipes(rings, bounds, middles)


def _steps_of(weave: Weave) -> Ints:
    """(S,) the step of the construction that sets each rod."""
    if weave not in _steps:
        step = np.empty(len(weave), np.int64)
        step[find_sequence(weave).strand] = np.arange(len(weave))
        _steps[weave] = step
    return _steps[weave]


def _tangents(points: Floats, offsets: Ints) -> Floats:
    """Unit directions along rows of points."""
    chords = unit_vectors(np.diff(points, axis=0, append=points[-1:]))
    chords[offsets[1:] - 1] = chords[offsets[1:] - 2]
    before = np.roll(chords, 1, axis=0)
    before[offsets[:-1]] = chords[offsets[:-1]]
    return unit_vectors(chords + before)


def _turns(tangents: Floats, offsets: Ints) -> Ints:
    """Indices of the ends of all rows, and of where a row has turned once more by `_TURN`."""
    turned = np.linalg.norm(np.diff(tangents, axis=0, prepend=tangents[:1]), axis=1)
    needed = np.diff(np.floor(np.cumsum(turned) / _TURN), prepend=-1.0) > 0
    needed[offsets[:-1]] = needed[offsets[1:] - 1] = True
    return np.flatnonzero(needed)


def _known_visits(weave: Weave, gap: float) -> tuple[Floats, Ints]:
    """Stations of the visits along all rods, with the first visit of each ring once more at its end."""
    axes = weave.axes
    rings = np.flatnonzero(axes.closed)
    at = np.concatenate([axes.stations + gap * axes.strand, axes.lengths[rings] + gap * rings])
    visit = np.concatenate([np.arange(len(axes.stations)), axes.offsets[:-1][rings]])
    order = np.argsort(at, kind="stable")
    return at[order], visit[order]


def _along(at: Floats, known_at: Floats, known: Floats) -> Floats:
    return np.stack([np.interp(at, known_at, column) for column in known.T], axis=1)


def _colours(value: Union[Weave, Equilibrium], by: str) -> Ints:
    """(S, 3) colour of each rod, of few different ones."""
    weave = _weave_of(value)
    if by == "family":
        return np.array([WOVEN[name[0]] for name in weave.ids], np.int64).reshape(-1, 3)
    if by == "step":
        return np.asarray(latitude_colours(_steps_of(weave) * _SHADES // max(len(weave), 1), _SHADES))
    at_rest = value.greatest_of_rods(value.utilisation) if isinstance(value, Equilibrium) else None
    used = weave.bending.utilisation if at_rest is None else at_rest
    return np.asarray(utilisation_colours(np.round(np.clip(used, 0.0, 1.0) * _SHADES) / _SHADES))


def _mesh(run: Run, pipes: _Pipes, rods: Ints, colours: Ints) -> Any:
    """One mesh of some of the rods."""
    parts = []
    kinds, kind = np.unique(colours[rods], axis=0, return_inverse=True)
    for k, colour in enumerate(kinds.tolist()):
        points, quads = _skin(pipes, rods[np.ravel(kind) == k])
        parts.append(run.drawing.mesh(points, quads, colour=colour))
    return run.drawing.joined(parts)


def _skin(pipes: _Pipes, rods: Ints) -> tuple[Floats, Ints]:
    """Points and quads of the pipes of some rods, caps included."""
    first, last = pipes.offsets[:-1][rods], pipes.offsets[1:][rods] - 1
    counts = last - first + 1
    starts = np.concatenate([[0], np.cumsum(counts)])
    row = rows_of(starts)
    sample = first[row] + np.arange(starts[-1]) - starts[row]
    here = np.delete(np.arange(starts[-1]), starts[1:] - 1)
    corner = np.arange(_SIDES)
    around = next_in_loop(np.array([0, _SIDES]))[corner]
    sides = np.stack(
        np.broadcast_arrays(
            here[:, None] * _SIDES + corner,
            here[:, None] * _SIDES + around,
            (here[:, None] + 1) * _SIDES + around,
            (here[:, None] + 1) * _SIDES + corner,
        ),
        axis=2,
    ).reshape(-1, 4)
    caps = [starts[:-1, None, None] * _SIDES + _CAP[:, ::-1], (starts[1:, None, None] - 1) * _SIDES + _CAP]
    quads = np.concatenate([sides, *(cap.reshape(-1, 4) for cap in caps)])
    return pipes.rings[sample].reshape(-1, 3), quads
