"""From a weave to the files of the folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Callable, Optional

from weavecore.fabricating import tables
from weavecore.fabricating.cut import Piece, cut_rods
from weavecore.fabricating.marks import Mark, find_ties, mark_pieces
from weavecore.fabricating.nesting import nest_pieces
from weavecore.fabricating.optional_libraries import need
from weavecore.fabricating.plan import DXF, PDF, SVG, TEMPLATES, RodPlan, Workshop, plan_rods
from weavecore.fabricating.report import check_files, encode_report
from weavecore.fabricating.tables import Source, bom_table
from weavecore.fabricating.template_files import encode_dxf, encode_pdf, encode_svg
from weavecore.fabricating.templates import draw_pages, draw_roll, strips_of, to_corner
from weavecore.fabricating.written_folder import Finding, Folder
from weavecore.model import BuildSequence, Weave

Progress = Callable[[float, str], None]

TABLES = ("rods", "pieces", "splices", "nesting", "marks", "joints", "axes", "sequence", "bom", "report")
NAMES = (*(f"{table}.csv" for table in TABLES), *(f"templates.{ending}" for ending in TEMPLATES), "report.txt")
"""All files that are made here."""

_LIBRARIES = {DXF: "ezdxf", PDF: "reportlab"}


def check_libraries(workshop: Workshop) -> None:
    """See that what the templates need is installed, before any work is done.

    Raises
    ------
    Unsupported
    """
    for template in workshop.templates:
        if template in _LIBRARIES:
            need(_LIBRARIES[template], template.upper())


def fabricate_weave(
    weave: Weave,
    sequence: BuildSequence,
    *,
    scale: float,
    workshop: Workshop,
    source: Source,
    progress: Optional[Progress] = None,
) -> Fabrication:
    """Make all files of the folder but the .3dm.

    Parameters
    ----------
    weave : Weave
    sequence : BuildSequence
        The order of construction.
    scale : float
        Millimetres in one of the model's units.
    workshop : Workshop
    source : Source
        What every file states.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Raises
    ------
    Unsupported
        Where the stock is too short for a rod, or a library for the templates is missing.
    """
    tell = progress or (lambda _fraction, _label: None)
    check_libraries(workshop)
    plan = plan_rods(weave, scale)
    tell(0.0, "cutting the rods")
    pieces, splices = cut_rods(plan, workshop)
    bars = nest_pieces(pieces, stock=workshop.stock, kerf=workshop.kerf)
    marks = mark_pieces(plan, pieces)
    ties = find_ties(plan)
    tell(0.2, "writing the tables")
    made = (
        tables.rods_table(plan),
        tables.pieces_table(plan, pieces, bars),
        tables.splices_table(plan, splices),
        tables.nesting_table(bars),
        tables.marks_table(plan, marks),
        tables.joints_table(plan, ties),
        tables.axes_table(plan),
        tables.sequence_table(plan, sequence),
        bom_table(plan, workshop, pieces, splices, bars, ties),
    )
    files = {f"{table.name}.csv": table.encode(source) for table in made}
    tell(0.4, "drawing the templates")
    files.update(_templates(plan, pieces, marks, workshop, source))
    tell(0.8, "checking what was written")
    findings = check_files(files)
    tell(1.0, "checked")
    return Fabrication({**files, **encode_report(findings, source)}, tuple(findings))


def _templates(
    plan: RodPlan, pieces: Sequence[Piece], marks: Sequence[Mark], workshop: Workshop, source: Source
) -> dict[str, bytes]:
    files = {}
    strips = strips_of(pieces, marks)
    statement = source.line("templates").replace("table ", "1:1 ")
    if DXF in workshop.templates or SVG in workshop.templates:
        roll = draw_roll(plan, strips, statement)
        if DXF in workshop.templates:
            files["templates.dxf"] = encode_dxf(roll.drawing, statement)
        if SVG in workshop.templates:
            corner = to_corner(roll)
            files["templates.svg"] = encode_svg(corner.drawing, corner.width, corner.height, statement)
    if PDF in workshop.templates:
        pages = draw_pages(plan, strips, statement, workshop.paper)
        width, height = pages[0].width, pages[0].height
        files["templates.pdf"] = encode_pdf([page.drawing for page in pages], width, height, statement)
    return files


# ----------------------------------------------------------------------
# What `fabricate` tells when it is done, read off the files.


@dataclass(frozen=True)
class Fabrication:
    """The files of a folder, and what was found when they were checked.

    Parameters
    ----------
    files : mapping of file name to bytes
    findings : tuple of Finding
        The lines of the report.
    """

    files: Mapping[str, bytes]
    findings: tuple[Finding, ...]

    @property
    def failing(self) -> tuple[Finding, ...]:
        """The findings that do not hold."""
        return tuple(finding for finding in self.findings if not finding.passes)

    def __getitem__(self, invariant: str) -> Finding:
        """The finding of that name."""
        return next(finding for finding in self.findings if finding.invariant == invariant)


def describe_fabrication(made: Fabrication) -> list[tuple[str, str]]:
    """The folder in a few lines: pairs of a label and a text."""
    folder = Folder(made.files)
    bom = folder.table("bom")
    bars, stock = int(bom["stock_count"][0]), float(bom["stock_length"][0])
    mass = f", {float(bom['mass'][0]):.2f} kg" if bom["mass"][0] else ""
    n_pieces, n_splices = len(folder.table("pieces")), len(folder.table("splices"))
    lines = [
        (
            "rods",
            f"{len(folder.table('rods'))}, {float(bom['cut_length'][0]) / 1000:,.1f} m of {bom['material'][0]}{mass}",
        ),
        ("pieces", f"{n_pieces}, {n_splices} splices"),
        ("stock", f"{bars} bars of {stock / 1000:g} m, {made['waste_pct'].value:.1f}% waste"),
        ("joints", f"{len(folder.table('joints'))}, {bom['ties'][0]} ties"),
    ]
    failing = made.failing
    if not failing:
        return [*lines, ("checked", f"all {len(made.findings)} invariants hold")]
    names = ", ".join(finding.invariant for finding in failing)
    return [
        *lines,
        ("checked", f"{len(failing)} of {len(made.findings)} invariants do not hold: {names}; see report.txt"),
    ]
