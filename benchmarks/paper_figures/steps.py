"""Figures 5 to 8: one offset, step for step, by the code of ``method="fronts"``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Polygon, Wedge

from paper_figures.drawing import (
    CHILD,
    GREY,
    INK,
    PARENT,
    RIGHT,
    WRONG,
    draw_loops,
    fill,
    make_panels,
    match_scales,
    save,
)
from paper_figures.pages import count, image, join, table, yes
from paper_figures.plates import Plate, Step, circle, dumbbell
from weavecore.offsetting.propagation.intersections import DOUBT, ends_on_opposite_sides, sum_of_four_angles

_EDGE = 0.2
_PAIRS = 100_000


def pinched_plate() -> Plate:
    """A dumbbell whose second offset pinches itself in the neck."""
    return Plate([dumbbell(8.4, (3.7, 3.2), 1.7, edge=_EDGE)], spacing=1.0, edge=_EDGE)


def draw_handling(folder: Path) -> str:
    """Figure 5: vertices moved, a crossing found, taken apart, and what goes on."""
    plate = pinched_plate()
    step = plate.offset(2)
    judged = plate.judge(step)
    figure, panels = make_panels(
        ["1  move the vertices", "2  find the crossings", "3  reconnect", "4  keep what has room"], width=8, height=2.5
    )
    for panel in panels:
        fill(panel, plate.loops)
        draw_loops(panel, plate.outlines(step.parents), PARENT, 1.4)
        panel.set_xlim(-3.6, 3.6)
        panel.set_ylim(-3.1, 3.1)
    shown = np.abs(step.start[:, 0]) < 4.2
    for a, b in zip(step.start[shown][::2], step.end[shown][::2]):
        panels[0].annotate(
            "", b, a, arrowprops={"arrowstyle": "-|>", "color": GREY, "linewidth": 0.5, "mutation_scale": 4}
        )
    for panel in panels[:2]:
        draw_loops(panel, plate.outlines(step.raw), CHILD, 1.3)
    panels[1].plot(*plate.crossings(step).T, "o", color=WRONG, markersize=5)
    stays = ~(judged.crosses | judged.passes)
    loops = plate.outlines(step.loops)
    for k, loop in enumerate(loops):
        draw_loops(panels[2], [loop], CHILD if stays[k] else WRONG, 1.5)
    draw_loops(panels[3], [loop for k, loop in enumerate(loops) if stays[k]], CHILD, 1.5)
    save(figure, folder / "figure_5.png")
    return join(
        image("figure_5", "An intersection in the neck of a dumbbell, in four steps"),
        f"{len(step.end)} vertices are moved by one spacing: {count(len(step.raw), 'child', 'children')} with\n"
        f"{count(len(step.crossings), 'crossing')} and, after reconnection, {count(len(loops), 'loop')}, of which\n"
        f"{stays.sum()} have room and go on.",
    )


def draw_criterion(folder: Path) -> str:
    """Figure 6: four points of one crossing and of one near miss, with their angles; the reconnection."""
    cases = [
        (np.array([[-2.0, -1.1], [2.1, 0.9], [-1.7, 1.2], [1.5, -1.5]]), "they cross"),
        (np.array([[-2.0, -1.1], [2.1, 0.9], [-1.7, 1.2], [-0.15, 0.25]]), "they do not"),
    ]
    figure, panels = make_panels(["", "", "reconnected"], width=8, height=2.3)
    sums = []
    for panel, (corners, name) in zip(panels, cases):
        total = float(sum_of_four_angles(*(corners[k : k + 1] for k in range(4)))[0])
        sums.append(total)
        _draw_angles(panel, corners)
        panel.set_title(f"{name}: the angles sum up to {total / np.pi:.3f} π", fontsize=8.5)
    _draw_reconnection(panels[2], cases[0][0])
    for panel in panels:
        panel.set_xlim(-2.9, 3.0)
        panel.set_ylim(-2.1, 1.9)
    save(figure, folder / "figure_6.png")
    agreed, near, wrong = compare_criterion()
    return join(
        image("figure_6", "The four angles of two segments that cross, of two that do not, and the reconnection"),
        f"The sums above are {sums[0]:.6f} (2π is {2 * np.pi:.6f}) and {sums[1]:.6f}. Of {_PAIRS:,} random pairs of\n"
        f"segments the sum of angles, with {DOUBT:g} allowed for rounding, decides {agreed:.4%} as exact arithmetic\n"
        f"does. Of {_PAIRS:,} pairs where one segment ends within 10⁻¹⁴ to 10⁻⁴ of the other it decides {near:.1%}\n"
        f"so, and takes {wrong:.1%} for a crossing that are none.",
    )


def compare_criterion() -> tuple[float, float, float]:
    """How often the sum alone is right: at random, and where segments nearly touch; false crossings there."""
    rng = np.random.default_rng(0)

    def decide(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return sum_of_four_angles(a, b, c, d) > 2 * np.pi - DOUBT, ends_on_opposite_sides(a, b, c, d)

    a, b, c, d = rng.uniform(-1, 1, (4, _PAIRS, 2))
    by_sum, exactly = decide(a, b, c, d)
    off = 10.0 ** rng.uniform(-14, -4, (_PAIRS, 1)) * rng.choice([-1, 1], (_PAIRS, 1))
    part = rng.uniform(0.05, 0.95, (_PAIRS, 1))
    touch = a + (b - a) * part
    touching_sum, touching = decide(a, b, c, touch + (touch - c) * off)
    return (
        float((by_sum == exactly).mean()),
        float((touching_sum == touching).mean()),
        float((touching_sum & ~touching).mean()),
    )


_NAMES = ("$A_i$", "$A_{i+1}$", "$A_j$", "$A_{j+1}$")


def _draw_angles(panel: Any, corners: np.ndarray) -> None:
    a, b, c, d = corners
    panel.add_patch(
        Polygon([a, c, b, d], closed=True, fill=False, edgecolor=GREY, linewidth=0.8, linestyle=(0, (3, 2)))
    )
    # Before it and after it around the quadrilateral, and the other end of its segment.
    places = ((d, a, c, b), (c, b, d, a), (a, c, b, d), (b, d, a, c))
    for name, (before, at, after, other) in zip(_NAMES, places):
        u, v = before - at, after - at
        low, high = np.degrees([np.arctan2(u[1], u[0]), np.arctan2(v[1], v[0])])
        if (high - low) % 360 > 180:
            low, high = high, low
        panel.add_patch(Wedge(at, 0.42, low, high, facecolor="#e2b658", alpha=0.75, edgecolor="none"))
        inward = _unit(_unit(u) + _unit(v))
        _write_beside(
            panel, at, 0.7 * _unit(at - other) - inward, f"{name}\n{np.radians((high - low) % 360) / np.pi:.2f} π"
        )
    _draw_segments(panel, corners)


def _draw_segments(panel: Any, corners: np.ndarray) -> None:
    for (start, end), colour in (((0, 1), CHILD), ((2, 3), PARENT)):
        panel.plot(*corners[[start, end]].T, color=colour, linewidth=1.8)
    panel.plot(*corners.T, "o", color=INK, markersize=3.5, zorder=5)


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector / np.linalg.norm(vector))


def _write_beside(panel: Any, at: np.ndarray, way: np.ndarray, text: str) -> None:
    x, y = _unit(way) * 18
    panel.annotate(
        text, at, xytext=(float(x), float(y)), textcoords="offset points", ha="center", va="center", fontsize=8
    )


def _draw_reconnection(panel: Any, corners: np.ndarray) -> None:
    a, b, c, d = corners
    u, v, w = b - a, d - c, c - a
    meet = a + u * (w[0] * v[1] - w[1] * v[0]) / (u[0] * v[1] - u[1] * v[0])
    for start, end in ((a, b), (c, d)):
        panel.plot(*np.stack([start, end]).T, color=GREY, linewidth=0.8, linestyle=(0, (3, 2)))
    for start, end, colour in ((a, d, CHILD), (c, b, PARENT)):
        toward = meet + 0.08 * ((start + end) / 2 - meet)
        panel.plot(*np.stack([start, toward, end]).T, color=colour, linewidth=1.8)
    panel.plot(*corners.T, "o", color=INK, markersize=3.5, zorder=5)
    for corner, name in zip(corners, _NAMES):
        _write_beside(panel, corner, corner - meet, name)


def holed_plate() -> Plate:
    """A dumbbell with three round holes: fronts cross themselves, each other and the border's."""
    holes = [circle(0.9, at, edge=_EDGE)[::-1] for at in ((-2.9, 1.0), (-2.6, -1.35), (3.2, 0.35))]
    return Plate([dumbbell(7.2, (3.7, 3.2), 0.8, edge=_EDGE), *holes], spacing=1.0, edge=_EDGE)


def draw_reduction(folder: Path) -> str:
    """Figure 7: crossings taken apart one by one."""
    plate = holed_plate()
    step = plate.offset(1)
    total = len(step.crossings)
    shown = [0, 1, total // 2, total]
    figure, panels = make_panels([""] * len(shown), width=8, height=4.9, n_rows=2)
    rows = []
    for done in range(total + 1):
        curves, left = plate.reduce(step, done)
        rows.append((done, left, len(curves)))
        if done in shown:
            panel = panels[shown.index(done)]
            _draw_reduced(panel, plate, plate.outlines(curves))
            panel.set_title(f"{done} taken apart, {left} left: {count(len(curves), 'loop')}")
    save(figure, folder / "figure_7.png")
    falls = all(left == total - done for done, left, _ in rows)
    return join(
        image("figure_7", "Crossings of the children of four borders, taken apart one by one"),
        f"{count(len(step.raw), 'child', 'children')} with {count(total, 'crossing')}. After each reconnection all\n"
        f"crossings are searched for again: left are {', '.join(str(left) for _, left, _ in rows)},\n"
        f"{'one less each time' if falls else 'not one less each time'}; loops: {', '.join(str(n) for *_, n in rows)}.",
    )


def _draw_reduced(panel: Any, plate: Plate, loops: list[np.ndarray]) -> None:
    fill(panel, plate.loops)
    draw_loops(panel, plate.loops, PARENT, 0.9)
    colours = (CHILD, WRONG, RIGHT, "#c97a2b", "#7a4fa0", "#5d6b78", "#b3a125", "#111111")
    for k, loop in enumerate(sorted(loops, key=len, reverse=True)):
        draw_loops(panel, [loop], colours[k % len(colours)], 1.3)


def draw_grandchildren(folder: Path) -> str:
    """Figure 8: grandchildren that cross a parent, and some that pass one without crossing."""
    ring = Plate([circle(4.7, edge=_EDGE), circle(1.3, edge=_EDGE)[::-1]], spacing=1.0, edge=_EDGE)
    cases = {"neck": (pinched_plate(), 2), "ring": (ring, 2)}
    titles = ["neck: children", "grandchildren, one across its parents", "ring: they pass uncrossed"]
    figure, panels = make_panels(titles, width=8, height=1.95)
    rows = []
    for name, (plate, generation) in cases.items():
        step = plate.offset(generation)
        judged = plate.judge(step)
        gone = judged.crosses | judged.passes
        for panel in panels[:2] if name == "neck" else panels[2:]:
            fill(panel, plate.loops)
            draw_loops(panel, plate.outlines(step.parents), PARENT, 1.4)
        _draw_family(panels[:2] if name == "neck" else panels[[2, 2]], plate, step, judged.grandchildren, gone)
        for k in range(len(gone)):
            verdict = "removed" if gone[k] else "goes on"
            rows.append([f"{name} {k + 1}", yes(judged.crosses[k]), yes(judged.passes[k]), verdict])
    match_scales(panels)
    save(figure, folder / "figure_8.png")
    return join(
        image("figure_8", "Grandchildren tell which children go on"),
        "Blue children go on, red ones are removed; dashed lines are grandchildren, dark ones parents.",
        table(["<child", "<its grandchild crosses a parent", "<most steps lead past a parent", ""], rows),
    )


def _draw_family(panels: Any, plate: Plate, step: Step, grandchildren: Any, gone: np.ndarray) -> None:
    children, theirs = plate.outlines(step.loops), plate.outlines(grandchildren)
    for k, is_gone in enumerate(gone):
        colour = WRONG if is_gone else CHILD
        for panel in panels:
            draw_loops(panel, [children[k]], colour, 1.6)
        draw_loops(panels[1], [theirs[k]], colour, 0.8, linestyle=(0, (4, 2)))
