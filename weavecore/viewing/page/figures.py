"""The figures beside the picture: what a result comes to, in words and numbers."""

from __future__ import annotations

from typing import Any, Optional

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.model import Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.units import with_unit
from weavecore.viewing.outlines import chosen_borders
from weavecore.viewing.page.curves import Curves
from weavecore.viewing.summary import spacing_text

Figure = dict[str, Any]


def figure(label: str, text: str, *, rod: Optional[int] = None, is_alarm: bool = False) -> Figure:
    """A row of the table; ``rod`` is the one that it tells of."""
    return {"label": label, "text": text, "rod": rod, "alarm": is_alarm}


def surface_figures(surface: SurfaceMesh) -> list[Figure]:
    """Faces, borders and size."""
    chosen, n_inside = chosen_borders(surface)
    rows = [figure("Faces", f"{surface.n_faces:,}"), figure("Borders", f"{len(surface.borders)}{chosen}")]
    if surface.cuts:
        rows.append(figure("Cuts", str(len(surface.cuts))))
    if n_inside:
        rows.append(figure("Curves inside", str(n_inside)))
    return [
        *rows,
        figure("Euler characteristic", str(surface.euler_characteristic)),
        figure("Diagonal", with_unit(surface.size, surface.unit)),
    ]


def latitudes_figures(latitudes: Latitudes) -> list[Figure]:
    """Generations, polylines and spacing."""
    unit, n_open = latitudes.surface.unit, int((~latitudes.polylines.closed).sum())
    return [
        figure("Spacing", spacing_text(latitudes)),
        figure("Generations", str(latitudes.n_generations)),
        figure("Polylines", f"{len(latitudes):,}" + (f", {n_open:,} open" if n_open else "")),
        figure("Length in all", _total(latitudes.polylines.lengths, unit)),
    ]


def lattice_figures(lattice: Lattice, curves: Curves) -> list[Figure]:
    """Strands, edges and spacing."""
    unit = lattice.latitudes.surface.unit
    return [
        figure("Spacing", spacing_text(lattice.latitudes)),
        figure("Generations", str(lattice.latitudes.n_generations)),
        figure("Strands", f"{len(curves.names):,}"),
        figure("Nodes", f"{lattice.n_nodes:,}"),
        figure("Edges", f"{lattice.n_edges:,}"),
        figure("Mean edge", with_unit(float(lattice.edge_lengths.mean()), unit)),
    ]


def weave_figures(weave: Weave) -> list[Figure]:
    """Rods, joints, bending, and what could not be helped."""
    lattice, bending = weave.lattice, weave.bending
    unit = lattice.latitudes.surface.unit
    lengths = weave.axes.lengths
    longest, sharpest, worst = (
        int(one) for one in (np.argmax(lengths), np.argmin(bending.min_radius), np.argmax(bending.utilisation))
    )
    return [
        figure("Rods", f"{len(weave):,}"),
        figure("Joints", f"{len(weave.joints):,}"),
        figure("Spacing", spacing_text(lattice.latitudes)),
        figure("Rod", f"Ø {with_unit(weave.rod_diameter, unit)}, {weave.material.name}"),
        figure("Length in all", _total(lengths, unit)),
        figure("Median length", with_unit(weave.median_length, unit)),
        figure("Longest", with_unit(float(lengths[longest]), unit), rod=longest),
        figure("Least radius", with_unit(float(bending.min_radius[sharpest]), unit), rod=sharpest),
        figure(
            "Highest utilisation",
            f"{float(bending.utilisation[worst]):,.0%}",
            rod=worst,
            is_alarm=bool(bending.utilisation[worst] > 1),
        ),
        figure("Bent too sharply", _rods(len(bending.violations)), is_alarm=len(bending.violations) > 0),
        figure("Ends inside", str(weave.n_ends_inside)),
        figure("Conflicts", str(len(weave.conflicts)), is_alarm=len(weave.conflicts) > 0),
        figure("Clashes", str(len(weave.clashes)), is_alarm=len(weave.clashes) > 0),
    ]


def _total(lengths: Floats, unit: str) -> str:
    """A sum of lengths, to five digits or to the unit."""
    total = float(lengths.sum())
    return with_unit(total, unit, digits=max(5, len(f"{total:.0f}")))


def _rods(n: int) -> str:
    return "none" if n == 0 else "1 rod" if n == 1 else f"{n:,} rods"
