"""*Weave Fabricate*: the pieces laid out straight with their marks, the cut list, and the folder for the workshop.

::

    P ──┼────┼──────┼───  a piece, with its name before it
        J01  J02    J03   a mark, with its code: longer upwards where the rod lies over, downwards where under

Pieces lie under one another along the x axis, in the unit of the document.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any, NamedTuple, Optional, Union

import numpy as np

from weavecore import pipeline
from weavecore.canvas.inputs import named
from weavecore.canvas.simulating import unit_of
from weavecore.canvas.solve import Run
from weavecore.canvas.trees import Branch
from weavecore.fabricating.marks import Mark, mark_pieces
from weavecore.fabricating.nesting import Bar, nest_pieces
from weavecore.fabricating.plan import RodPlan, plan_rods
from weavecore.fabricating.splices import Piece, cut_rods
from weavecore.fabricating.work import check_work
from weavecore.fabricating.workshop import DXF, PDF, SPLICES, SVG, Workshop
from weavecore.fabricating.workshop_folder import describe_fabrication
from weavecore.model import Equilibrium, Weave
from weavecore.units import millimetres_in

_ROW = 40.0
"""Distance of the rows of pieces in millimetres."""

_TICK, _SHORT_TICK = 8.0, 3.0
"""Length of a mark on the side that it points to, and on the other, in millimetres."""

_LIBRARIES = {PDF: "reportlab"}
"""What templates are drawn with; .dxf and .svg need none."""


class CutResults(NamedTuple):
    """Pieces, their names and lengths; marks, codes and where these stand; the cut list; what was written."""

    pieces: list[Any]
    names: list[str]
    lengths: list[float]
    marks: Any
    codes: Any
    places: Any
    cut_list: Any
    folder: Optional[str]
    report: list[str]


def draw_cut_list(
    run: Run,
    value: Union[Weave, Equilibrium],
    *,
    stock: Optional[float] = None,
    splice: Optional[str] = None,
    folder: Optional[str] = None,
    write: bool = False,
    overwrite: bool = False,
) -> CutResults:
    """Cut the rods of a weave, draw the pieces straight, and write the folder for the workshop where that is wanted.

    Parameters
    ----------
    run : Run
    value : Weave or Equilibrium
    stock : float, optional
        Length of the bars in the document's unit.
    splice : str, optional
        ``"overlap"`` or ``"sleeve"``.
    folder : str, optional
        Absolute, or relative to `Run.folder`.
    write, overwrite : bool

    Returns
    -------
    CutResults

    Raises
    ------
    Unsupported, TooMuchWork, OutputExists, NotWritten
    """
    weave = value.weave if isinstance(value, Equilibrium) else value
    unit = unit_of(run, weave)
    scale = millimetres_in(weave.lattice.latitudes.surface.unit, unit)
    kind = named(splice, SPLICES, "splice")
    options: dict[str, Any] = {"templates": available_templates()}
    options.update({"splice": kind} if kind else {})
    options.update({"stock": float(stock) * scale} if stock is not None else {})
    workshop = Workshop(**options)
    check_work(weave, scale=scale, stock=workshop.stock)
    run.progress(0.0, "cutting the rods")
    plan = plan_rods(weave, scale)
    pieces, splices = cut_rods(plan, workshop)
    bars = nest_pieces(pieces, stock=workshop.stock, kerf=workshop.kerf, diameters=plan.diameters)
    marks = mark_pieces(plan, pieces)
    run.progress(0.5, "drawing the pieces")
    report = _summary(pieces, bars, len(splices), workshop)
    target = str(run.folder / folder.strip().strip('"')) if folder else None
    if write and target is None:
        run.warn("There is no folder to write to. Wire its name to folder.")
    if write and target is not None:
        written = pipeline.fabricate(
            value, target, workshop=workshop, unit=unit, overwrite=overwrite, progress=run.progress
        )
        report = [f"{label}: {text}" for label, text in describe_fabrication(written)]
        _warn_of_libraries(run, workshop)
    lines, codes, places = _drawn_marks(run, plan, pieces, marks, scale)
    rows = np.array([[0.0, -_ROW * k, 0.0] for k in range(len(pieces))]).reshape(-1, 3)
    ends = rows + np.array([[piece.cut_length, 0.0, 0.0] for piece in pieces]).reshape(-1, 3)
    return CutResults(
        pieces=run.drawing.lines(rows / scale, ends / scale),
        names=[piece.id for piece in pieces],
        lengths=[piece.cut_length / scale for piece in pieces],
        marks=run.tree(lines),
        codes=run.tree(codes),
        places=run.tree(places),
        cut_list=run.tree(_cut_list(plan, bars)),
        folder=target if write else None,
        report=report,
    )


def available_templates() -> tuple[str, ...]:
    """The kinds of templates whose libraries are installed: .dxf and .svg need none."""
    return (DXF, SVG, *(kind for kind, library in _LIBRARIES.items() if find_spec(library) is not None))


def _warn_of_libraries(run: Run, workshop: Workshop) -> None:
    """Say what was left out of the folder, and how to have it."""
    missing = [library for kind, library in _LIBRARIES.items() if kind not in workshop.templates]
    missing += [] if find_spec("rhino3dm") else ["rhino3dm"]
    if missing:
        lines = " and ".join(f"# r: {library}" for library in missing)
        run.remark(f"Some files were left out. For these add {lines} on top of the component's script.")


def _summary(pieces: Sequence[Piece], bars: Sequence[Bar], n_splices: int, workshop: Workshop) -> list[str]:
    cut = sum(piece.cut_length for piece in pieces)
    waste = 1.0 - cut / (workshop.stock * max(len(bars), 1))
    return [
        f"pieces: {len(pieces)}, together {cut / 1000.0:.1f} m",
        f"splices: {n_splices}",
        f"bars: {len(bars)} of {workshop.stock:g} mm, {waste:.0%} waste",
    ]


def _cut_list(plan: RodPlan, bars: Sequence[Bar]) -> list[Branch]:
    """A line for each piece, in a branch for each bar."""
    return [
        (
            (b,),
            [
                f"{bar.id} {piece.id} {piece.cut_length:.1f} mm, diameter {plan.diameters[piece.rod]:g} mm"
                for piece in bar.pieces
            ],
        )
        for b, bar in enumerate(bars)
    ]


def _drawn_marks(
    run: Run, plan: RodPlan, pieces: Sequence[Piece], marks: Sequence[Mark], scale: float
) -> tuple[list[Branch], list[Branch], list[Branch]]:
    """Lines, codes and the places of the codes, in a branch for each piece."""
    row = {piece.id: k for k, piece in enumerate(pieces)}
    owner = np.array([row[mark.piece.id] for mark in marks], np.int64)
    at = np.array([mark.at for mark in marks])
    over = np.array([any(one.is_over for one in mark.crossings) for mark in marks], bool)
    under = np.array([not all(one.is_over for one in mark.crossings) for mark in marks], bool)
    y, z = -_ROW * owner, np.zeros(len(marks))
    low = np.stack([at, y - np.where(under, _TICK, _SHORT_TICK), z], axis=1) / scale
    high = np.stack([at, y + np.where(over, _TICK, _SHORT_TICK), z], axis=1) / scale
    lines, places = run.drawing.lines(low, high), run.drawing.points(low)
    codes = [f"{mark.code} {', '.join(_sides(plan, mark))}".strip() for mark in marks]
    split: list[list[Branch]] = []
    for items in (lines, codes, list(places)):
        branches: list[Branch] = [((k,), []) for k in range(len(pieces))]
        for k, item in zip(owner.tolist(), items):
            branches[k][1].append(item)
        split.append(branches)
    return split[0], split[1], split[2]


def _sides(plan: RodPlan, mark: Mark) -> list[str]:
    """The other rods at a mark, each with the side on which the piece lies."""
    return [f"{'over' if other.is_over else 'under'} {plan.ids[other.rod]}" for other in mark.crossings]
