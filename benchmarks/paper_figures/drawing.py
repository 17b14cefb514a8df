"""Drawing with one hand: colours, axes in true proportion, small files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from PIL import Image

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Polygon

import weavecore as wc
from weavecore.palette import latitude_colours

SURFACE, PAPER, INK, GREY = "#eee9df", "#ffffff", "#26262a", "#8a8a90"
PARENT, CHILD, WRONG, RIGHT = "#26265f", "#1a71ad", "#c4264a", "#2f9e78"
DOTS_PER_INCH = 150
_LARGER = 2
_COLOURS = 128
"""Colours of a picture: its file becomes a third as large, and no eye sees it."""

STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titlepad": 6,
    "text.color": INK,
    "lines.solid_capstyle": "round",
    "lines.solid_joinstyle": "round",
}
plt.rcParams.update(STYLE)


def make_panels(titles: list[str], *, width: float, height: float, n_rows: int = 1) -> Any:
    """A figure (inches) with panels row by row, without frames and in true proportion; figure and axes."""
    figure, axes = plt.subplots(
        n_rows, len(titles) // n_rows, figsize=(width, height), squeeze=False, layout="constrained"
    )
    for panel, title in zip(axes.ravel(), titles):
        panel.set_title(title)
        panel.set_aspect("equal")
        panel.axis("off")
    return figure, axes.ravel()


def match_scales(panels: Any, margin: float = 0.03) -> None:
    """Give the panels of one row the same scale and height, so that titles stand in a line."""
    limits = [(panel.dataLim.intervalx, panel.dataLim.intervaly) for panel in panels]
    high = max(np.ptp(y) for _, y in limits)
    for panel, (x, y) in zip(panels, limits):
        panel.set_ylim(y.mean() - (0.5 + margin) * high, y.mean() + (0.5 + margin) * high)
        panel.set_xlim(x.mean() - np.ptp(x) / 2 - margin * high, x.mean() + np.ptp(x) / 2 + margin * high)
    panels[0].get_gridspec().set_width_ratios([np.ptp(x) + 2 * margin * high for x, _ in limits])


def fill(panel: Any, loops: list[np.ndarray], colour: str = SURFACE) -> None:
    """The inside of an outline, without its holes, which run the other way."""
    codes, corners = [], []
    for loop in loops:
        corners.append(np.concatenate([loop, loop[:1]]))
        codes += [mpl.path.Path.MOVETO] + [mpl.path.Path.LINETO] * (len(loop) - 1) + [mpl.path.Path.CLOSEPOLY]
    path = mpl.path.Path(np.concatenate(corners), codes)
    panel.add_patch(mpl.patches.PathPatch(path, facecolor=colour, edgecolor="none", zorder=0))
    panel.autoscale_view()


def draw_loops(panel: Any, loops: list[np.ndarray], colour: Any, width: float = 1.2, **more: Any) -> None:
    """Closed polylines (n, 2)."""
    for loop in loops:
        panel.add_patch(Polygon(loop, closed=True, fill=False, edgecolor=colour, linewidth=width, **more))
    panel.autoscale_view()


def generation_colour(generation: int, n_generations: int) -> tuple[float, ...]:
    """The colour that pictures and files have for a generation."""
    return tuple(latitude_colours([generation], n_generations)[0] / 255)


def save(figure: Any, path: Path) -> None:
    """Write a drawing as a small .png."""
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=DOTS_PER_INCH, facecolor=PAPER)
    plt.close(figure)
    _write_small(Image.open(buffer), path)


def save_picture(value: Any, path: Path, *, size: tuple[int, int], view: Any = None) -> None:
    """Write weavecore's own picture of a stage's result, drawn large and made small, so that thin rods are smooth."""
    width, height = size
    wc.draw_picture(value, path, size=(_LARGER * width, _LARGER * height), view=view, overwrite=True)
    with Image.open(path) as picture:
        smooth = picture.resize(size, Image.Resampling.LANCZOS)
    _write_small(smooth, path)


def _write_small(picture: Any, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    few = picture.convert("RGB").quantize(_COLOURS, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
