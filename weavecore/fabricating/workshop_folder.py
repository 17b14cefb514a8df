"""From a weave to the files of the workshop folder.

::

    Weave → RodPlan → pieces, splices → bars, marks, ties → tables, templates → checks → report
            plan.py   splices.py        nesting.py …        tables.py …        *_checks.py
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Callable, Optional

from weavecore.fabricating.csv_tables import Source, Table
from weavecore.fabricating.drawing_files import encode_dxf, encode_pdf, encode_svg, import_optional
from weavecore.fabricating.equilibrium_checks import check_equilibrium
from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder
from weavecore.fabricating.folder_report import check_files, encode_report, summarize_checks
from weavecore.fabricating.labels import draw_labels
from weavecore.fabricating.marks import mark_pieces
from weavecore.fabricating.nesting import nest_pieces
from weavecore.fabricating.plan import RodPlan, plan_rods
from weavecore.fabricating.splices import cut_rods
from weavecore.fabricating.steps import split_steps
from weavecore.fabricating.tables import CutList, build_tables
from weavecore.fabricating.templates import draw_pages, draw_roll, strips_of
from weavecore.fabricating.ties import find_ties
from weavecore.fabricating.views import Views, draw_sheets, stack_sheets
from weavecore.fabricating.workshop import DXF, PDF, SVG, TEMPLATES, Workshop
from weavecore.model import BuildSequence, Weave

Progress = Callable[[float, str], None]
"""Called with the fraction that is done, from 0 to 1, and a label."""

TABLES = (
    "rods",
    "pieces",
    "splices",
    "nesting",
    "marks",
    "joints",
    "axes",
    "clashes",
    "sequence",
    "machine",
    "bom",
    "report",
)
DRAWINGS = (*(f"{name}.{ending}" for name in ("templates", "drawings") for ending in TEMPLATES), "labels.pdf")
NAMES = (*(f"{table}.csv" for table in TABLES), *DRAWINGS, "report.txt")
"""All files that are written here."""

_LIBRARIES = {PDF: "reportlab"}
_MM_PER_M = 1000.0


@dataclass(frozen=True)
class Fabrication:
    """The files of a folder, and the results of its checks.

    Parameters
    ----------
    files : mapping of file name to bytes
    checks : tuple of CheckResult
        The lines of the report.
    """

    files: Mapping[str, bytes]
    checks: tuple[CheckResult, ...]

    @property
    def failed(self) -> tuple[CheckResult, ...]:
        """The checks that failed."""
        return tuple(one for one in self.checks if not one.passes)

    def __getitem__(self, invariant: str) -> CheckResult:
        """The check of that name."""
        return next(one for one in self.checks if one.invariant == invariant)


def check_libraries(workshop: Workshop) -> None:
    """Import what the templates need before any work is done.

    Parameters
    ----------
    workshop : Workshop

    Raises
    ------
    Unsupported
        Where a library is not installed.
    """
    for template in workshop.templates:
        if template in _LIBRARIES:
            import_optional(_LIBRARIES[template], template.upper())


def fabricate_weave(
    weave: Weave,
    sequence: BuildSequence,
    *,
    scale: float,
    workshop: Workshop,
    source: Source,
    equilibrium_tables: Sequence[Table] = (),
    progress: Optional[Progress] = None,
) -> Fabrication:
    """Make all files of the folder but the .3dm.

    Parameters
    ----------
    weave : Weave
    sequence : BuildSequence
        The order of construction.
    scale : float
        Millimetres in one unit of the model.
    workshop : Workshop
    source : Source
        What every file states.
    equilibrium_tables : sequence of Table
        Those of the weave at rest, where it was simulated.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    Fabrication

    Raises
    ------
    Unsupported
        Where the stock is too short for a rod, or a library for the templates is missing.
    """
    update = progress or (lambda _fraction, _label: None)
    check_libraries(workshop)
    plan = plan_rods(weave, scale)
    update(0.0, "cutting the rods")
    pieces, splices = cut_rods(plan, workshop)
    bars = nest_pieces(pieces, stock=workshop.stock, kerf=workshop.kerf, diameters=plan.diameters)
    marks, ties = mark_pieces(plan, pieces), find_ties(plan)
    cut_list = CutList(pieces, splices, bars, marks, ties, split_steps(plan, pieces, marks, ties, sequence))
    update(0.2, "writing the tables")
    tables = [*build_tables(plan, workshop, cut_list), *equilibrium_tables]
    files = {f"{table.name}.csv": table.encode(source) for table in tables}
    update(0.4, "drawing the templates")
    files.update(_templates(plan, cut_list, workshop, source))
    update(0.8, "checking the files")
    checks = [*check_files(files), *check_equilibrium(WrittenFolder(files))]
    update(1.0, "checked")
    return Fabrication({**files, **encode_report(checks, source)}, tuple(checks))


def _templates(plan: RodPlan, cut_list: CutList, workshop: Workshop, source: Source) -> dict[str, bytes]:
    """Templates, drawings and labels, in the formats that the workshop asks for, by file name."""
    files = {}
    strips = strips_of(cut_list.pieces, cut_list.marks)
    statement = source.line("templates").replace("table ", "1:1 ")
    drawn = source.line("drawings").replace("table ", "")
    kinds = workshop.templates
    views = Views.of(plan, workshop.paper) if kinds else None
    sheets = list(draw_sheets(views, cut_list.steps, cut_list.ties, drawn)) if views else []
    roll = draw_roll(plan, strips, statement) if DXF in kinds or SVG in kinds else None
    if roll and DXF in kinds:
        files["templates.dxf"] = encode_dxf(roll, statement)
        files["drawings.dxf"] = encode_dxf(stack_sheets(sheets, in_full_size=True), drawn)
    if roll and SVG in kinds:
        files["templates.svg"] = encode_svg(roll, statement)
        files["drawings.svg"] = encode_svg(stack_sheets(sheets), drawn)
    if PDF in kinds:
        pages = draw_pages(plan, strips, statement, workshop.paper)
        files["templates.pdf"] = encode_pdf(pages, "templates", statement)
        files["drawings.pdf"] = encode_pdf(sheets, "drawings", drawn)
        labels = draw_labels(plan, strips, cut_list.bars, cut_list.steps)
        files["labels.pdf"] = encode_pdf(labels, "labels", source.line("labels").replace("table ", ""))
    return files


def describe_fabrication(made: Fabrication) -> list[tuple[str, str]]:
    """Summarize a folder in a few lines, read from its files.

    Parameters
    ----------
    made : Fabrication

    Returns
    -------
    list of (label, text)
    """
    folder = WrittenFolder(made.files)
    bom = folder.table("bom")
    n_bars, stock = int(bom["stock_count"][0]), float(bom["stock_length"][0]) / _MM_PER_M
    mass = f", {float(bom['mass'][0]):.2f} kg" if bom["mass"][0] else ""
    cut = float(bom["cut_length"][0]) / _MM_PER_M
    failed = ", ".join(one.invariant for one in made.failed)
    n_splices = len(folder.table("splices"))
    return [
        ("rods", f"{len(folder.table('rods'))}, {cut:,.1f} m of {bom['material'][0]}{mass}"),
        ("pieces", f"{len(folder.table('pieces'))}, {n_splices} splice{'s' * (n_splices != 1)}"),
        ("stock", f"{n_bars} bars of {stock:g} m, {made['waste_pct'].value:.1f}% waste"),
        ("joints", f"{len(folder.table('joints'))}, {bom['ties'][0]} ties"),
        ("checked", summarize_checks(made.checks) + (f": {failed}; see report.txt" if failed else "")),
    ]
