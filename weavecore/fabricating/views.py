"""Drawings of the whole: plan, elevations, and the rods of every step.

::

    sheet 1    plan: x to the right, y up
    sheet 2    front: x to the right, z up; side: y to the right, z up
    sheets 3…  the steps of the sequence, 4 by 3 a sheet: borders in grey, what is set in red, in isometric view

Isometric view: a point (x, y, z) is drawn at ((x - y) cos 30°, (x + y) sin 30° + z).  Plan and elevations have one
scale of those that drawings usually have.  Linear in the points that are drawn: a step shows its own rod and the
borders, not all the rods before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from weavecore.fabricating.drawing import BOLD, LINE_STEP, RIGHT, TEXT_HEIGHT, Drawing
from weavecore.fabricating.plan import RodPlan
from weavecore.fabricating.steps import Step
from weavecore.fabricating.ties import Ties
from weavecore.fabricating.workshop import PAPERS
from weavecore.geometry.arrays import Floats
from weavecore.geometry.splines import CurveSamples, points_at_stations
from weavecore.model import FAMILIES
from weavecore.polling import each

SET, BORDERS, TEXTS = "SET", "BORDERS", "TEXTS"
_FAMILY_COLOURS = ((40, 96, 200), (0, 0, 0), (0, 120, 60))
LAYERS = {
    **{f"RODS-{name.upper()}": colour for name, colour in zip(FAMILIES, _FAMILY_COLOURS)},
    BORDERS: (160, 160, 160),
    SET: (200, 56, 40),
    TEXTS: (0, 0, 0),
}
"""Layers and their colours: the rods of each family in plan and elevations; borders, what is set, and texts."""

_SCALES = (1, 2, 5, 10, 20, 25, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 100_000)
"""Millimetres of the model on one of the paper (ISO 5455)."""

_MARGIN, _TITLE = 12.0, 10.0
"""Of a sheet, and the height of the line of its title, in millimetres."""

_ACROSS, _DOWN = 4, 3
"""Steps on a sheet."""

_STEPS_OF_SPACING = 0.5
"""Rods are drawn as polylines with points so many spacings apart."""

_POINTS_OF_BORDER = 48
"""Points that a border is drawn with in a step, which is a few centimetres wide."""

_NAME_HEIGHT = 1.4
"""Height of the names of rods in the plan, in millimetres: they are many, and they are looked up one by one."""

_NAME_AT = 5.0
"""Names of rods stand so many millimetres of the paper from their starts."""

_GAP = 20.0
"""Between the sheets of an SVG or DXF, in millimetres of the paper."""

_LAPS = (-1, 0, 1, 2)
"""A piece of a ring begins up to a lap before its start, and ends up to two laps after."""

_TITLE_LINES = 2
"""Lines of text above a step."""


@dataclass(frozen=True)
class Views:
    """What the sheets are drawn from.

    Parameters
    ----------
    plan : RodPlan
    samples : CurveSamples
        Points along all rods.
    scale : int
        Of plan and elevations.
    paper : str
    """

    plan: RodPlan
    samples: CurveSamples
    scale: int
    paper: str

    @classmethod
    def of(cls, plan: RodPlan, paper: str) -> Views:
        """Choose the scale so that plan and elevations fit on a sheet."""
        samples = plan.axes.samples(_STEPS_OF_SPACING * plan.spacing)
        size = np.ptp(samples.points, axis=0) if len(samples.points) else np.zeros(3)
        width, height = PAPERS[paper]
        room = (width - 2 * _MARGIN, height - 2 * _MARGIN - _TITLE)
        need = max(size[0] / room[0], size[1] / room[1], size[:2].max() / room[0], size[2] / (room[1] / 2 - _TITLE))
        return cls(plan, samples, next((one for one in _SCALES if one >= need), _SCALES[-1]), paper)

    def rod(self, k: int) -> Floats:
        """(n, 3) the points along a rod."""
        points: Floats = self.samples.points[self.samples.offsets[k] : self.samples.offsets[k + 1]]
        return points


def draw_sheets(views: Views, steps: Sequence[Step], ties: Ties, statement: str) -> Iterator[Drawing]:
    """Draw plan, elevations and steps.

    Parameters
    ----------
    views : Views
    steps : sequence of Step
    ties : Ties
    statement : str
        Origin of the file.

    Yields
    ------
    Drawing
        One sheet after the other.
    """
    yield _draw_views(views, [("plan", (0, 1))], statement, named=True)
    yield _draw_views(views, [("front", (0, 2)), ("side", (1, 2))], statement, named=False)
    per_sheet = _ACROSS * _DOWN
    # Of all rods once: a sheet shows a few of them.
    whole, borders = _isometric(views.samples.points), [_isometric(border) for border in _borders(views)]
    low, size = whole.min(0), np.ptp(whole, axis=0)
    for first in each(range(0, len(steps), per_sheet)):
        yield _draw_steps(views, (low, size), borders, steps[first : first + per_sheet], ties, statement)


def _sheet(views: Views, title: str, statement: str) -> Drawing:
    width, height = PAPERS[views.paper]
    sheet = Drawing(LAYERS, width, height)
    sheet.text(_MARGIN, height - _MARGIN, title, TEXT_HEIGHT, TEXTS, bold=True)
    sheet.text(width - _MARGIN, _MARGIN / 2, statement, TEXT_HEIGHT / 2, TEXTS, anchor=RIGHT)
    return sheet


def _draw_views(
    views: Views, projections: Sequence[tuple[str, tuple[int, int]]], statement: str, *, named: bool
) -> Drawing:
    """Draw the rods along some of the axes, one view above the other."""
    names = ", ".join(name for name, _ in projections)
    sheet = _sheet(views, f"{names}, 1:{views.scale}", statement)
    points, plan = views.samples.points, views.plan
    room = (sheet.height - 2 * _MARGIN - _TITLE) / len(projections)
    for k, (name, axes) in enumerate(projections):
        corner = np.array([_MARGIN, sheet.height - _MARGIN - _TITLE - room * (k + 1)])
        low, size = points[:, axes].min(0), np.ptp(points[:, axes], axis=0) / views.scale
        corner += (np.array([sheet.width - 2 * _MARGIN, room]) - size) / 2
        drawn = (points[:, axes] - low) / views.scale + corner
        if len(projections) > 1:
            sheet.text(_MARGIN, float(corner[1] + size[1]), name, TEXT_HEIGHT, TEXTS)
        for rod, (a, b) in each(enumerate(zip(views.samples.offsets.tolist(), views.samples.offsets[1:].tolist()))):
            family = FAMILIES[plan.weave.strands.family[rod]]
            sheet.path(drawn[a:b], f"RODS-{family.upper()}")
        if named:
            # Rods that begin at one joint have room for their names where they have parted.
            at = np.minimum(_NAME_AT * views.scale, plan.axes.lengths / 2)
            places = points_at_stations(views.samples, np.arange(len(at)), at)[:, axes]
            for rod, (x, y) in enumerate(((places - low) / views.scale + corner).tolist()):
                sheet.text(x, y, plan.ids[rod], _NAME_HEIGHT, TEXTS)
    return sheet


def _isometric(points: Floats) -> Floats:
    """Points (n, 2) of the isometric view of points (n, 3)."""
    x, y, z = points.T
    return np.stack([(x - y) * np.cos(np.pi / 6), (x + y) * np.sin(np.pi / 6) + z], axis=1)


def _borders(views: Views) -> list[Floats]:
    """The borders of the surface (n, 3), or the cuts of a closed one, with few points."""
    latitudes = views.plan.weave.lattice.latitudes
    lines = latitudes.polylines
    found = []
    for k in np.flatnonzero(latitudes.generation == 0).tolist():
        points = lines.points[lines.offsets[k] : lines.offsets[k + 1]]
        keep = np.unique(np.linspace(0, len(points) - 1, min(len(points), _POINTS_OF_BORDER)).astype(np.int64))
        if lines.closed[k]:
            keep = np.append(keep, 0)
        found.append(points[keep] * views.plan.scale)
    return found


def _draw_steps(
    views: Views,
    extent: tuple[Floats, Floats],
    borders: Sequence[Floats],
    steps: Sequence[Step],
    ties: Ties,
    statement: str,
) -> Drawing:
    """Draw some steps, each in a cell of its own; the isometric view of all has this lower left corner and size."""
    title = f"steps {steps[0].number} to {steps[-1].number}: borders in grey, what is set in red"
    sheet = _sheet(views, title, statement)
    low, size = extent
    width = (sheet.width - 2 * _MARGIN) / _ACROSS
    height = (sheet.height - 2 * _MARGIN - _TITLE) / _DOWN
    above = (_TITLE_LINES + 1) * LINE_STEP
    scale = max(size[0] / (0.92 * width), size[1] / (height - above - LINE_STEP), np.finfo(float).tiny)
    for k, step in each(enumerate(steps)):
        row, column = divmod(k, _ACROSS)
        x, top = _MARGIN + column * width, sheet.height - _MARGIN - _TITLE - row * height
        corner = np.array([x, top - height + LINE_STEP])
        for border in borders:
            sheet.path((border - low) / scale + corner, BORDERS)
        sheet.path((_isometric(_stretch(views, step)) - low) / scale + corner, SET, width=BOLD)
        n_ties = int(sum(ties.count[joint] for joint in step.joints))
        sheet.text(x, top - LINE_STEP, f"{step.number}  {step.action} {step.piece.id}", TEXT_HEIGHT, TEXTS, bold=True)
        after = " ".join(map(str, step.after)) or "none"
        note = f"{step.low:.0f} to {step.high:.0f} mm, {n_ties} ties; after {after}"
        sheet.text(x, top - 2 * LINE_STEP, note, TEXT_HEIGHT * 0.7, TEXTS)
    return sheet


def _stretch(views: Views, step: Step) -> Floats:
    """(n, 3) points along the stretch of a step, its ends among them."""
    rod, plan = step.piece.rod, views.plan
    low, high = step.piece.start + step.low, step.piece.start + step.high
    part = slice(views.samples.offsets[rod], views.samples.offsets[rod + 1])
    own, points = views.samples.stations[part], views.samples.points[part]
    if plan.axes.closed[rod]:
        length = float(plan.axes.lengths[rod])
        own = np.concatenate([own[:-1] + lap * length for lap in _LAPS])
        points = np.concatenate([points[:-1]] * len(_LAPS))
    stations = np.concatenate([[low], own[(own > low) & (own < high)], [high]])
    return np.stack([np.interp(stations, own, points[:, k]) for k in range(3)], axis=1)


def stack_sheets(sheets: Iterable[Drawing], scale: float = 1.0) -> Drawing:
    """Place sheets one below the other in one drawing, for formats without pages.

    Parameters
    ----------
    sheets : iterable of Drawing
    scale : float
        That all is enlarged by: the scale of plan and elevations makes these 1:1.

    Returns
    -------
    Drawing
        With its lower left corner at 0.
    """
    pages = list(each(sheets))
    total = sum(page.height + _GAP for page in pages) - _GAP
    found = Drawing(LAYERS, max(page.width for page in pages) * scale, total * scale)
    top = total
    for page in each(pages):
        shift = np.array([0.0, top - page.height])
        for path in page.paths:
            found.paths.append(path._replace(points=(path.points + shift) * scale))
        for text in page.texts:
            x, y, height = text.x * scale, (text.y + shift[1]) * scale, text.height * scale
            found.texts.append(text._replace(x=x, y=float(y), height=height))
        top -= page.height + _GAP
    return found
