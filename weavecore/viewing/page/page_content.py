"""What the page holds of a stage's result: one object of texts, numbers and packed arrays.

Arrays are base64 of little-endian values, with the name of JavaScript's typed array.  Coordinates are relative to the
centre of the surface, so that 32-bit floats hold them.
"""

from __future__ import annotations

import base64
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.polygon_mesh import fan_triangles
from weavecore.model import BuildSequence, Equilibrium, Latitudes, Lattice, Strands, SurfaceMesh, Weave
from weavecore.palette import latitude_colours, utilisation_colours
from weavecore.polling import poll
from weavecore.units import with_unit
from weavecore.viewing.camera import choose_view
from weavecore.viewing.page.page_curves import (
    PageCurves,
    curves_of_borders,
    curves_of_latitudes,
    curves_of_lattice,
    curves_of_weave,
)
from weavecore.viewing.page.page_equilibrium import equilibrium_figures, moves_of_samples
from weavecore.viewing.scene import Drawable, Pictured
from weavecore.viewing.summary import diameters_text, spacing_text
from weavecore.viewing.surface_paths import describe_chosen_borders, paths_of_surface

_MOST_FACES = 120_000
"""Of a finer surface the page shows the faces of the lattice instead: a bound on the size of the page."""

Figure = dict[str, Any]
"""A row of the table beside the picture: label, text, the rod it is about, and whether it is an alarm."""

_TYPES = {"Float32Array": "<f4", "Uint32Array": "<u4", "Uint8Array": "u1"}
_SHADES = 24
"""Count of colours between which the page interpolates utilisation."""


def page_content(
    value: Pictured, *, strands: Optional[Strands] = None, sequence: Optional[BuildSequence] = None
) -> dict[str, Any]:
    """Gather everything that the page shows.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    strands : Strands, optional
        The rods of a lattice, which it needs.
    sequence : BuildSequence, optional
        The construction of a weave.

    Returns
    -------
    dict
        JSON values.

    Raises
    ------
    ValueError
        For a lattice without strands.
    """
    at_rest = value if isinstance(value, Equilibrium) else None
    value = value.weave if isinstance(value, Equilibrium) else value
    surface, n_generations = _surface_and_generations(value)
    stage, curves, figures = _curves_and_figures(value, strands)
    vertices, triangles = _drawn_surface(value, surface)
    low, high = vertices.min(0), vertices.max(0)
    centre = (low + high) / 2
    return {
        "title": surface.name or "Unnamed surface",
        "stage": stage if at_rest is None else f"{stage}, at rest",
        "unit": with_unit(1.0, surface.unit).partition(" ")[2],
        "figures": figures if at_rest is None else _equilibrium_figures(at_rest) + figures,
        "families": [{"name": family.name, "colour": list(family.colour)} for family in curves.families],
        "generationColours": latitude_colours(np.arange(n_generations), n_generations).tolist(),
        "utilisationColours": utilisation_colours(np.linspace(0, 1, _SHADES)).tolist(),
        "view": choose_view(surface.vertices, surface.faces, paths_of_surface(surface).points).tolist(),
        "size": float(np.linalg.norm(high - low)),
        "surface": {
            "vertices": _pack(vertices - centre, "Float32Array"),
            "triangles": _pack(triangles, "Uint32Array"),
        },
        "rods": _rods(curves, centre),
        "weave": _weave(value, centre) if isinstance(value, Weave) else None,
        "equilibrium": None if at_rest is None else _equilibrium(at_rest, curves, centre),
        "sequence": _sequence(sequence, curves) if sequence is not None else None,
    }


def _pack(values: ArrayLike, kind: str) -> dict[str, str]:
    """An array as the page reads it; infinite values become the greatest finite one."""
    poll()
    array = np.asarray(values)
    if kind == "Float32Array":
        array = np.nan_to_num(array, posinf=float(np.finfo(np.float32).max))
    return {"type": kind, "data": base64.b64encode(array.astype(_TYPES[kind]).tobytes()).decode("ascii")}


def _surface_and_generations(value: Drawable) -> tuple[SurfaceMesh, int]:
    if isinstance(value, SurfaceMesh):
        return value, 1
    lattice = value.lattice if isinstance(value, Weave) else value
    latitudes = lattice.latitudes if isinstance(lattice, Lattice) else lattice
    return latitudes.surface, latitudes.n_generations


def _curves_and_figures(value: Drawable, strands: Optional[Strands]) -> tuple[str, PageCurves, list[Figure]]:
    if isinstance(value, SurfaceMesh):
        return "Surface", curves_of_borders(value), _surface_figures(value)
    if isinstance(value, Latitudes):
        return "Latitudes", curves_of_latitudes(value), _latitudes_figures(value)
    if isinstance(value, Weave):
        stage = f"{value.lattice.pattern.capitalize()} pattern, {value.over_under}"
        return stage, curves_of_weave(value), _weave_figures(value)
    if strands is None:
        raise ValueError("a lattice needs its strands")
    curves = curves_of_lattice(value, strands)
    return f"{value.pattern.capitalize()} pattern", curves, _lattice_figures(value, curves)


def _drawn_surface(value: Drawable, surface: SurfaceMesh) -> tuple[Floats, Ints]:
    """Vertices and triangles of the surface, or of the lattice where the surface is too fine for a page."""
    lattice = value.lattice if isinstance(value, Weave) else value
    if surface.n_faces > _MOST_FACES and isinstance(lattice, Lattice):
        return lattice.nodes, fan_triangles(lattice.face_offsets, lattice.face_nodes)[0]
    return surface.vertices, surface.faces


def _rods(curves: PageCurves, centre: Floats) -> dict[str, Any]:
    starts = curves.offsets[:-1]
    empty = np.zeros(0)
    least, most = (f.reduceat(curves.depth, starts) if len(starts) else empty for f in (np.minimum, np.maximum))
    return {
        "names": list(curves.names),
        "family": _pack(curves.family, "Uint8Array"),
        "closed": _pack(curves.closed, "Uint8Array"),
        "length": _pack(curves.lengths, "Float32Array"),
        "shallowest": _pack(least, "Float32Array"),
        "deepest": _pack(most, "Float32Array"),
        "offsets": _pack(curves.offsets, "Uint32Array"),
        "points": _pack(curves.points - centre, "Float32Array"),
        "stations": _pack(curves.stations, "Float32Array"),
        "depth": _pack(curves.depth, "Float32Array"),
        "radius": curves.radius,
        "thickness": _pack(curves.thickness, "Float32Array"),
    }


def _weave(weave: Weave, centre: Floats) -> dict[str, Any]:
    """Bending of each rod, and the joints with their rods from the innermost outwards."""
    bending, joints = weave.bending, weave.joints
    return {
        "material": weave.material.name,
        "source": weave.material.source,
        "leastRadius": _pack(weave.material.least_bend * weave.diameters, "Float32Array"),
        "minRadius": _pack(bending.min_radius, "Float32Array"),
        "stationAtMin": _pack(bending.station_at_min, "Float32Array"),
        "pointAtMin": _pack(bending.point_at_min - centre, "Float32Array"),
        "utilisation": _pack(bending.utilisation, "Float32Array"),
        "largestDiameter": _pack(bending.largest_diameter, "Float32Array"),
        "jointPoints": _pack(weave.lattice.nodes[joints.node] - centre, "Float32Array"),
        "jointOffsets": _pack(joints.offsets, "Uint32Array"),
        "jointRods": _pack(joints.strand, "Uint32Array"),
        "jointStations": _pack(weave.axes.stations[joints.visit], "Float32Array"),
    }


def _equilibrium(equilibrium: Equilibrium, curves: PageCurves, centre: Floats) -> dict[str, Any]:
    """Moves and stress of the samples, extremes of each rod, and the supports."""
    weave = equilibrium.weave
    moves, utilisation = moves_of_samples(equilibrium, curves)
    figures = equilibrium_figures(equilibrium)
    return {
        "moves": _pack(moves, "Float32Array"),
        "utilisation": _pack(utilisation, "Float32Array"),
        "jointMoves": _pack(equilibrium.node_move[weave.joints.node], "Float32Array"),
        "supports": _pack(weave.lattice.nodes[equilibrium.is_supported] - centre, "Float32Array"),
        **{key: one if isinstance(one, float) else _pack(one, "Float32Array") for key, one in figures.items()},
    }


def _sequence(sequence: BuildSequence, curves: PageCurves) -> dict[str, Any]:
    return {
        "rods": _pack(sequence.strand, "Uint32Array"),
        "isRing": _pack(sequence.is_ring & curves.closed[sequence.strand], "Uint8Array"),
        "generation": _pack(sequence.generation, "Uint32Array"),
        "tiedOffsets": _pack(sequence.tied_offsets, "Uint32Array"),
        "tied": _pack(sequence.tied, "Uint32Array"),
    }


def _figure(label: str, text: str, *, rod: Optional[int] = None, is_alarm: bool = False) -> Figure:
    """A row of the table about the result, or about one rod."""
    return {"label": label, "text": text, "rod": rod, "alarm": is_alarm}


def _surface_figures(surface: SurfaceMesh) -> list[Figure]:
    """Faces, borders and size."""
    chosen, n_inside = describe_chosen_borders(surface)
    rows = [_figure("Faces", f"{surface.n_faces:,}"), _figure("Borders", f"{len(surface.borders)}{chosen}")]
    if surface.cuts:
        rows.append(_figure("Cuts", str(len(surface.cuts))))
    if n_inside:
        rows.append(_figure("Curves inside", str(n_inside)))
    return [
        *rows,
        _figure("Euler characteristic", str(surface.euler_characteristic)),
        _figure("Diagonal", with_unit(surface.size, surface.unit)),
    ]


def _latitudes_figures(latitudes: Latitudes) -> list[Figure]:
    """Generations, polylines and spacing."""
    unit, n_open = latitudes.surface.unit, int((~latitudes.polylines.closed).sum())
    return [
        _figure("Spacing", spacing_text(latitudes)),
        _figure("Generations", str(latitudes.n_generations)),
        _figure("Polylines", f"{len(latitudes):,}" + (f", {n_open:,} open" if n_open else "")),
        _figure("Length in all", _total(latitudes.polylines.lengths, unit)),
    ]


def _lattice_figures(lattice: Lattice, curves: PageCurves) -> list[Figure]:
    """Strands, edges and spacing."""
    unit = lattice.latitudes.surface.unit
    return [
        _figure("Spacing", spacing_text(lattice.latitudes)),
        _figure("Generations", str(lattice.latitudes.n_generations)),
        _figure("Strands", f"{len(curves.names):,}"),
        _figure("Nodes", f"{lattice.n_nodes:,}"),
        _figure("Edges", f"{lattice.n_edges:,}"),
        _figure("Mean edge", with_unit(float(lattice.edge_lengths.mean()), unit)),
    ]


def _weave_figures(weave: Weave) -> list[Figure]:
    """Rods, joints, bending, conflicts and clashes."""
    lattice, bending = weave.lattice, weave.bending
    unit = lattice.latitudes.surface.unit
    lengths = weave.axes.lengths
    longest, sharpest, worst = (
        int(one) for one in (np.argmax(lengths), np.argmin(bending.min_radius), np.argmax(bending.utilisation))
    )
    return [
        _figure("Rods", f"{len(weave):,}"),
        _figure("Joints", f"{len(weave.joints):,}"),
        _figure("Spacing", spacing_text(lattice.latitudes)),
        _figure("Rod", f"{diameters_text(weave)}, {weave.material.name}"),
        _figure("Length in all", _total(lengths, unit)),
        _figure("Median length", with_unit(weave.median_length, unit)),
        _figure("Longest", with_unit(float(lengths[longest]), unit), rod=longest),
        _figure("Least radius", with_unit(float(bending.min_radius[sharpest]), unit), rod=sharpest),
        _figure(
            "Highest utilisation",
            f"{float(bending.utilisation[worst]):,.0%}",
            rod=worst,
            is_alarm=bool(bending.utilisation[worst] > 1),
        ),
        _figure("Bent too sharply", _count_rods(len(bending.violations)), is_alarm=len(bending.violations) > 0),
        _figure("Ends inside", str(weave.n_ends_inside)),
        _figure("Conflicts", str(len(weave.conflicts)), is_alarm=len(weave.conflicts) > 0),
        _figure("Clashes", str(len(weave.clashes)), is_alarm=len(weave.clashes) > 0),
    ]


def _equilibrium_figures(equilibrium: Equilibrium) -> list[Figure]:
    """Supports and loads, how far the nodes depart, and the largest stress and forces."""
    unit, used = equilibrium.weave.lattice.latitudes.surface.unit, equilibrium.utilisation_max
    worst = int(equilibrium.rod[np.argmax(equilibrium.stress)])
    stands = "stable" if equilibrium.is_stable else "not stable"
    moves = (equilibrium.departure_mean, equilibrium.departure_p95, equilibrium.departure_max)
    mean, p95, largest = (with_unit(move, unit, digits=3) for move in moves)
    rows = [
        _figure("At rest", stands, is_alarm=not equilibrium.is_stable),
        _figure("Supports", equilibrium.supports),
        _figure("Loads", equilibrium.loads),
        _figure("Mean departure", mean),
        _figure("95% depart within", p95),
        _figure("Largest departure", largest),
        _figure("Stress at rest", f"{equilibrium.stress_max:.0f} MPa", rod=worst),
        _figure("Utilisation at rest", f"{used:,.0%}", rod=worst, is_alarm=used > 1),
        _figure("Largest tie force", f"{equilibrium.tie_force_size.max(initial=0.0):.3g} N"),
    ]
    reaction = float(np.linalg.norm(equilibrium.reaction, axis=1).max(initial=0.0))
    return rows + ([_figure("Largest reaction", f"{reaction:.3g} N")] if equilibrium.is_supported.any() else [])


def _total(lengths: Floats, unit: str) -> str:
    """A sum of lengths, to five digits or to whole units."""
    total = float(lengths.sum())
    return with_unit(total, unit, digits=max(5, len(f"{total:.0f}")))


def _count_rods(n: int) -> str:
    return "none" if n == 0 else "1 rod" if n == 1 else f"{n:,} rods"
