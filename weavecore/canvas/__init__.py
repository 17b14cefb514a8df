"""Support for the Grasshopper components: read inputs, run a stage, keep and show its result.

A *solution* is one run of a component.  Its inputs that are not wired are None; `solve` does nothing until those that
are needed are there, keeps results of the same inputs, and turns every error into a balloon.
Nothing here imports Grasshopper before it is needed, so that it can be tested without.
"""

from weavecore.canvas.baking import bake_rods
from weavecore.canvas.choosing import ChosenRow, choose_row
from weavecore.canvas.cutting import CutResults, draw_cut_list
from weavecore.canvas.deconstructing import LatticeParts, WeaveParts, draw_lattice_parts, draw_weave_parts
from weavecore.canvas.inputs import (
    USUAL_STYLE,
    chosen,
    diameters,
    named,
    numbers,
    plain,
    read_curves,
    read_factors,
    read_geometry,
    style_or_none,
)
from weavecore.canvas.measuring import Measures, measure, measures_caption
from weavecore.canvas.previewing import COLOURS, PreviewResults, draw_preview
from weavecore.canvas.results import (
    LatitudeResults,
    LatticeResults,
    RodResults,
    draw_doubts,
    draw_latitudes,
    draw_lattice,
    draw_rods,
    draw_surface,
    remark_of_grading,
    warn_of_doubts,
)
from weavecore.canvas.simulating import (
    EquilibriumResults,
    draw_equilibrium,
    equilibrium_caption,
    equilibrium_concerns,
    read_loads,
    read_places,
    unit_of,
)
from weavecore.canvas.solve import Cancelled, Run, solve
from weavecore.canvas.writing import check, concerns, counts, open_page, report_lines, write_value
from weavecore.fabricating.workshop import SPLICES
from weavecore.linking.link import PATTERN_NAMES
from weavecore.pipeline import METHODS
from weavecore.weaving.layers import PLAIN, STACKED
from weavecore.weaving.layout import lay_out_rods
from weavecore.weaving.materials import known_materials

STYLES = (USUAL_STYLE, STACKED, PLAIN, "twill 2/2", "twill 3/1")
"""Styles of over and under on the list; others are typed."""

LISTS = {
    "method": METHODS,
    "pattern": PATTERN_NAMES,
    "material": known_materials(),
    "style": STYLES,
    "supports": ("borders", "none"),
    "colour": COLOURS,
    "splice": SPLICES,
}
"""Names that inputs take, the default first."""


def lists_of(*inputs: str) -> dict[str, tuple[str, ...]]:
    """The lists that are offered for some inputs.

    Parameters
    ----------
    inputs : str
        Keys of `LISTS`.
    """
    return {name: tuple(LISTS[name]) for name in inputs}


__all__ = [
    "LISTS",
    "Cancelled",
    "ChosenRow",
    "CutResults",
    "EquilibriumResults",
    "LatitudeResults",
    "LatticeParts",
    "LatticeResults",
    "Measures",
    "PreviewResults",
    "RodResults",
    "Run",
    "WeaveParts",
    "bake_rods",
    "check",
    "choose_row",
    "chosen",
    "concerns",
    "counts",
    "diameters",
    "draw_cut_list",
    "draw_doubts",
    "draw_equilibrium",
    "draw_latitudes",
    "draw_lattice",
    "draw_lattice_parts",
    "draw_preview",
    "draw_rods",
    "draw_surface",
    "draw_weave_parts",
    "equilibrium_caption",
    "equilibrium_concerns",
    "lay_out_rods",
    "lists_of",
    "measure",
    "measures_caption",
    "named",
    "numbers",
    "open_page",
    "plain",
    "read_curves",
    "read_factors",
    "read_geometry",
    "read_loads",
    "read_places",
    "remark_of_grading",
    "report_lines",
    "solve",
    "style_or_none",
    "unit_of",
    "warn_of_doubts",
    "write_value",
]
