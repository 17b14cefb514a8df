"""Drawings of the whole: plan, elevations, and the rods of every step.

::

    sheet 1    plan: x to the right, y up
    sheet 2    front: x to the right, z up; side: y to the right, z up; below or beside it, where they are larger
    sheets 3…  the steps of the sequence, 4 by 3 a sheet: borders in grey, what is set in red, in isometric view

Isometric view: a point (x, y, z) is drawn at ((x - y) cos 30°, (x + y) sin 30° + z).  Plan and elevations each have the
largest scale that fits, of those that drawings usually have.  Linear in the points that are drawn: a step shows its own
rod and the borders, not all the rods before it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

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

_SCALES = (1, 2, 2.5, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10_000, 100_000)
"""Millimetres of the model on one of the paper (ISO 5455)."""

_MARGIN, _TITLE = 12.0, 10.0
"""Of a sheet, and the height of the line of its title, in millimetres."""

_GUTTER = 10.0
"""What stays free of a cell, in millimetres."""

_ACROSS, _DOWN = 4, 3
"""Steps on a sheet."""

_STEPS_OF_SPACING = 0.5
"""Rods are drawn as polylines with points so many spacings apart."""

_POINTS_OF_BORDER = 48
"""Points that a border is drawn with in a step, which is a few centimetres wide."""

_NAME_HEIGHT = 1.4
"""Height of the names of rods in the plan, in millimetres: they are many, and they are looked up one by one."""

_NAME_AT, _NAME_PLACES = 5.0, 8
"""Names of rods stand so many millimetres of the paper from their starts, or a multiple up to so many times as much
where others stand there."""

_NAME_WIDTH = 0.85
"""Of a capital, with the space beside it, over its height."""

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
    paper : str
    """

    plan: RodPlan
    samples: CurveSamples
    paper: str

    @classmethod
    def of(cls, plan: RodPlan, paper: str) -> Views:
        """Find the points along the rods."""
        return cls(plan, plan.axes.samples(_STEPS_OF_SPACING * plan.spacing), paper)

    @property
    def room(self) -> Floats:
        """(2,) width and height of a sheet within its margins and below its title."""
        width, height = PAPERS[self.paper]
        return np.array([width - 2 * _MARGIN, height - 2 * _MARGIN - _TITLE])

    @cached_property
    def extent(self) -> tuple[Floats, Floats]:
        """Lower left corner (2,) and size (2,) of all rods in the isometric view."""
        whole = _isometric(self.samples.points)
        return whole.min(0), np.ptp(whole, axis=0)

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
    plan = _draw_views(views, {"plan": (0, 1)}, statement, named=True)
    yield plan
    yield _draw_views(views, {"front": (0, 2), "side": (1, 2)}, statement, named=False)
    per_sheet = _ACROSS * _DOWN
    borders = [_isometric(border) for border in _borders(views)]
    for first in each(range(0, len(steps), per_sheet)):
        yield _draw_steps(views, borders, steps[first : first + per_sheet], ties, statement, plan.scale)


def _sheet(views: Views, title: str, statement: str, scale: float) -> Drawing:
    width, height = PAPERS[views.paper]
    sheet = Drawing(LAYERS, width, height, scale=scale)
    sheet.text(_MARGIN, height - _MARGIN, title, TEXT_HEIGHT, TEXTS, bold=True)
    sheet.text(width - _MARGIN, _MARGIN / 2, statement, TEXT_HEIGHT / 2, TEXTS, anchor=RIGHT)
    return sheet


def _draw_views(views: Views, projections: Mapping[str, tuple[int, int]], statement: str, *, named: bool) -> Drawing:
    """Draw the rods along some of the axes."""
    points, plan = views.samples.points, views.plan
    lows = [points[:, axes].min(0) for axes in projections.values()]
    sizes = np.array([np.ptp(points[:, axes], axis=0) for axes in projections.values()])
    cells, scale = _cells(views.room, sizes)
    sheet = _sheet(views, f"{', '.join(projections)}, 1:{scale:g}", statement, scale)
    for (name, axes), low, size, cell in zip(projections.items(), lows, sizes, cells):
        corner = cell[:2] + (cell[2:] - size / scale) / 2 + _MARGIN
        drawn = (points[:, axes] - low) / scale + corner
        if len(projections) > 1:
            sheet.text(float(cell[0]) + _MARGIN, float(corner[1] + size[1] / scale) + 1, name, TEXT_HEIGHT, TEXTS)
        stretches = zip(views.samples.offsets.tolist(), views.samples.offsets[1:].tolist())
        for code, (a, b) in each(zip(plan.weave.strands.family.tolist(), stretches)):
            family = FAMILIES[code]
            sheet.path(drawn[a:b], f"RODS-{family.upper()}")
        if named:
            places = (_name_places(views, axes, scale) - low / scale + corner).tolist()
            for rod, (x, y) in zip(plan.ids, places):
                sheet.text(x, y, rod, _NAME_HEIGHT, TEXTS)
    return sheet


def _cells(room: Floats, sizes: Floats) -> tuple[Floats, float]:
    """Cells (k, 4), each as x, y, width and height, of views of some sizes (k, 2), and the scale that fits into them.

    They lie one below the other, or beside it where the scale is larger.
    """
    n, k = len(sizes), np.arange(len(sizes))
    below = np.stack([0 * k, n - 1 - k], axis=1) * room / [1, n], room / [1, n]
    beside = np.stack([k, 0 * k], axis=1) * room / [n, 1], room / [n, 1]
    found = []
    for corners, cell in (below, beside):
        need = float((sizes / (cell - _GUTTER)).max())
        scale = next((float(one) for one in _SCALES if one >= need), float(_SCALES[-1]))
        found.append((np.column_stack([corners, np.tile(cell, (n, 1))]), scale))
    return min(found, key=lambda one: one[1])


def _name_places(views: Views, axes: tuple[int, int], scale: float) -> Floats:
    """Where (n, 2) the names of all rods begin: near the start of the rod, where it has parted from others there.

    Each takes the first place along its rod where it covers no name before it, or else the first of all.
    """
    plan = views.plan
    n = len(plan.ids)
    at = np.minimum(_NAME_AT * scale * np.arange(1, _NAME_PLACES + 1)[:, None], plan.axes.lengths / 2)
    points = points_at_stations(views.samples, np.tile(np.arange(n), _NAME_PLACES), at.ravel())[:, axes] / scale
    points = points.reshape(_NAME_PLACES, n, 2)
    width = _NAME_WIDTH * _NAME_HEIGHT * np.array([len(name) for name in plan.ids])
    found = np.empty((n, 2))
    for rod in each(range(n)):
        apart = points[:, None, rod] - found[:rod]
        covers = (apart[..., 0] < width[:rod]) & (-apart[..., 0] < width[rod]) & (abs(apart[..., 1]) < _NAME_HEIGHT)
        found[rod] = points[covers.any(axis=1).argmin(), rod]
    return found


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
    views: Views, borders: Sequence[Floats], steps: Sequence[Step], ties: Ties, statement: str, sheet_scale: float
) -> Drawing:
    """Draw some steps, each in a cell of its own."""
    title = f"steps {steps[0].number} to {steps[-1].number}: borders in grey, what is set in red"
    sheet = _sheet(views, title, statement, sheet_scale)
    low, size = views.extent
    width, height = (views.room / [_ACROSS, _DOWN]).tolist()
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


def stack_sheets(sheets: Iterable[Drawing], *, in_full_size: bool = False) -> Drawing:
    """Place sheets one below the other in one drawing, for formats without pages.

    Parameters
    ----------
    sheets : iterable of Drawing
    in_full_size : bool
        Whether each is enlarged by its scale, which makes plan and elevations 1:1.

    Returns
    -------
    Drawing
        With its lower left corner at 0.
    """
    pages = list(each(sheets))
    scales = [page.scale if in_full_size else 1.0 for page in pages]
    heights = [page.height * scale for page, scale in zip(pages, scales)]
    gap = _GAP * max(scales)
    top = sum(heights) + gap * (len(pages) - 1)
    found = Drawing(LAYERS, max(page.width * scale for page, scale in zip(pages, scales)), top)
    for page, scale, height in each(zip(pages, scales, heights)):
        shift = np.array([0.0, top - height])
        for path in page.paths:
            found.paths.append(path._replace(points=path.points * scale + shift))
        for text in page.texts:
            x, y, capitals = text.x * scale, text.y * scale + shift[1], text.height * scale
            found.texts.append(text._replace(x=x, y=float(y), height=capitals))
        top -= height + gap
    return found
