"""Figures 9 to 11: the test models, the patterns, the built models."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

import weavecore as wc
from comparing import compare
from paper_figures.drawing import INK, draw_loops, generation_colour, make_panels, save, save_picture
from paper_figures.pages import join, row_of_images, table, yes
from weavecore.fabricating.csv_tables import Source
from weavecore.fabricating.folder_reader import WrittenFolder
from weavecore.fabricating.workshop import Workshop
from weavecore.fabricating.workshop_folder import fabricate_weave
from weavecore.model import LATITUDINAL, POCKET, Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.palette import LONGITUDES, POCKETS
from weavecore.weaving.sequence import find_sequence

SAMPLES = Path(__file__).resolve().parents[2] / "sample_files"
MODELS = {"narrow_neck": 25.0, "six_way_joint": 20.0, "minimal_surface": 9.0}
VIEWS: dict[str, Any] = {"narrow_neck": (-0.25, -0.8, 0.9), "shell_2400x1600": (0.3, -0.9, 1.0)}
GRIDS = {"narrow_neck": 25.0, "shell_2400x1600": 70.0}
PATTERNS = {
    "triangular": "rings and two families that lean forward and back",
    "quad": "rings of even counts and one longitudinal family",
    "plain": "the same lattice, by the name of its weave",
    "twill": "the same with counts in fours, over two and under two",
    "hexagonal": "the dual: rings zigzag, and short rods tie them; three edges at a joint",
    "kagome": "rods through the middles of the edges: triangles and hexagons",
    "diagonal": "the two longitudinal families without the rings",
}
PATTERN_SAMPLE, PATTERN_SPACING, PATTERN_ROD = "hemisphere", 45.0, 6.0
BUILT = {"hemisphere": (40.0, 2.0), "shell_2400x1600": (70.0, 5.0)}
"""Spacing and rod diameter in millimetres."""

_CORNER_EDGES = 3.5
"""Edges from the middle of the picture of a corner to its upper side."""

_SIZE, _SMALL = (900, 675), (640, 480)


def draw_models(folder: Path) -> str:
    """Figure 9: the narrow neck, the six-way joint and the minimal surface, by both methods."""
    rows, images = [], {}
    for name, spacing in MODELS.items():
        surface = wc.read_surface(SAMPLES / f"{name}.3dm")
        (levels, seconds), (fronts, longer) = (_offset(surface, spacing, method) for method in ("levels", "fronts"))
        save_picture(levels, folder / f"figure_9_{name}.png", size=_SIZE, view=VIEWS.get(name))
        images[f"figure_9_{name}"] = f"{name}, latitudes"
        both = compare(levels, fronts)
        row = [f"`{name}.3dm`", f"{spacing:g}", len(surface.borders), surface.euler_characteristic]
        row += [len(levels), len(fronts), levels.n_generations, yes(both.same_counts and both.same_parents)]
        rows.append([*row, f"{100 * both.mean:.2f}", f"{longer / seconds:.1f}"])
    columns = ["", "spacing, mm", "borders", "χ", "polylines: levels", "fronts", "generations"]
    columns += ["<same counts and parents", "mean distance between both, % of spacing", "time of fronts, levels = 1"]
    return join(row_of_images(images, 32), table(columns, rows))


def _offset(surface: SurfaceMesh, spacing: float, method: str) -> tuple[Latitudes, float]:
    """The latitudes, and the processor seconds that they took."""
    begin = time.process_time()
    latitudes = wc.offset(surface, spacing=spacing, method=method)
    return latitudes, time.process_time() - begin


def draw_lattices(folder: Path) -> str:
    """Figure 10: the triangular grid, and the special places that its second step fills."""
    rows, images = [], {}
    for name, spacing in GRIDS.items():
        lattice = wc.link(wc.offset(wc.read_surface(SAMPLES / f"{name}.3dm"), spacing=spacing))
        save_picture(lattice, folder / f"figure_10_{name}.png", size=_SIZE, view=VIEWS.get(name))
        images[f"figure_10_{name}"] = f"{name}, triangular lattice"
        rows.append([f"`{name}.3dm`", f"{spacing:g}", *_of_lattice(lattice)])
        _draw_corner(lattice, folder / f"figure_10_{name}_corner.png")
        images[f"figure_10_{name}_corner"] = f"{name}, where children meet themselves"
    columns = ["", "spacing, mm", "nodes", "edges", "of these in pockets, %", "mean edge, mm", "variation of edges, %"]
    columns += ["longest edge, medians", "inner nodes with 6 edges, %"]
    words = (
        "Latitudes in blue to green, longitudes in amber, the second step in crimson. Beside each lattice,\n"
        "from above, the place with most of the second step; pale lines are the undivided latitudes."
    )
    return join(row_of_images(images, 48), words, table(columns, rows))


def _draw_corner(lattice: Lattice, path: Path) -> None:
    """The edges about the place with most edges of the second step, from above."""
    a, b = lattice.edges.T
    middle = (lattice.nodes[a] + lattice.nodes[b])[:, :2] / 2
    pockets = middle[lattice.edge_family == POCKET]
    half = _CORNER_EDGES * lattice.edge_length
    near = [np.linalg.norm(pockets - at, axis=1) < half / 2 for at in pockets]
    centre = pockets[near[int(np.argmax([rows.sum() for rows in near]))]].mean(0)
    figure, (panel,) = make_panels([""], width=6, height=4.5)
    lines, latitudes = lattice.latitudes.polylines, lattice.latitudes
    draw_loops(panel, [lines.polyline(p)[:, :2] for p in range(len(lines))], "#c3ccd6", 1.2)
    generation = latitudes.generation[np.maximum(lattice.node_latitude[a], 0)]
    for i in np.flatnonzero(np.abs(middle - centre).max(1) < 2 * half):
        colour: Any = generation_colour(int(generation[i]), latitudes.n_generations)
        if lattice.edge_family[i] != LATITUDINAL:
            colour = np.array(POCKETS if lattice.edge_family[i] == POCKET else LONGITUDES) / 255
        panel.plot(*lattice.nodes[lattice.edges[i]][:, :2].T, color=colour, linewidth=2)
    panel.plot(*lattice.nodes[:, :2].T, "o", color=INK, markersize=3.5, zorder=5)
    panel.set_xlim(centre[0] - half * 4 / 3, centre[0] + half * 4 / 3)
    panel.set_ylim(centre[1] - half, centre[1] + half)
    save(figure, path)


def _of_lattice(lattice: Lattice) -> list[str]:
    length = lattice.edge_lengths
    return [
        f"{lattice.n_nodes:,}",
        f"{lattice.n_edges:,}",
        f"{100 * (lattice.edge_family == POCKET).mean():.1f}",
        f"{length.mean():.1f}",
        f"{100 * length.std() / length.mean():.1f}",
        f"{length.max() / np.median(length):.2f}",
        f"{100 * _regular(lattice):.1f}",
    ]


def _regular(lattice: Lattice) -> float:
    """Part of the nodes off the borders with six edges."""
    valence = np.bincount(lattice.edges.ravel(), minlength=lattice.n_nodes)
    n_borders = len(lattice.latitudes.surface.borders)
    inner = (lattice.node_latitude < 0) | (lattice.node_latitude >= n_borders)
    return float((valence[inner] == 6).mean())


def draw_patterns(folder: Path) -> str:
    """One picture of each pattern, woven."""
    latitudes = wc.offset(wc.read_surface(SAMPLES / f"{PATTERN_SAMPLE}.3dm"), spacing=PATTERN_SPACING)
    rows, images = [], {}
    for pattern, words in PATTERNS.items():
        weave = wc.weave(wc.link(latitudes, pattern=pattern), rod_diameter=PATTERN_ROD)
        save_picture(weave, folder / f"pattern_{pattern}.png", size=_SMALL)
        images[f"pattern_{pattern}"] = pattern
        row = [f"`{pattern}`", words, weave.over_under, len(weave), f"{weave.median_length:.0f}", weave.n_ends_inside]
        sharpest = f"{weave.bending.min_radius.min():.0f}"
        rows.append([*row, f"{len(weave.crossings):,}", len(weave.conflicts), sharpest])
    words = (
        f"In the order of the table: `{PATTERN_SAMPLE}.3dm` with rings {PATTERN_SPACING:g} mm apart and rods of "
        f"{PATTERN_ROD:g} mm."
    )
    columns = ["<pattern", "<what it is", "<over and under", "rods", "median length, mm", "ends inside", "crossings"]
    return join(row_of_images(images, 32), words, table([*columns, "conflicts", "least radius, mm"], rows))


def draw_built(folder: Path) -> str:
    """Figure 11: the size of the two models that were built, woven and prepared for a workshop."""
    rows, images = [], {}
    for name, (spacing, diameter) in BUILT.items():
        surface = wc.read_surface(SAMPLES / f"{name}.3dm")
        weave = wc.weave(wc.link(wc.offset(surface, spacing=spacing)), rod_diameter=diameter)
        save_picture(weave, folder / f"figure_11_{name}.png", size=_SIZE, view=VIEWS.get(name))
        images[f"figure_11_{name}"] = f"{name}, woven"
        size = " × ".join(f"{x:.0f}" for x in np.ptp(surface.vertices, axis=0))
        row = [f"`{name}.3dm`", size, f"{spacing:g}", f"{diameter:g}", len(weave)]
        row += [f"{weave.axes.lengths.sum() / 1000:.0f}", _count_pieces(weave), f"{weave.lattice.n_nodes:,}"]
        radius = weave.bending.min_radius
        radii = [weave.material.least_bend * diameter, np.median(radius), radius.min()]
        rows.append([*row, *(f"{r:.0f}" for r in radii), len(weave.bending.violations)])
    columns = ["", "<size, mm", "spacing, mm", "rod, mm", "rods", "length of all, m", "pieces of stock", "joints"]
    columns += ["a rod bears, mm", "least radius of the median rod", "of all", "rods bent too sharply"]
    return join(row_of_images(images, 48), table(columns, rows))


def _count_pieces(weave: Weave) -> int:
    """How many pieces are cut from stock."""
    source = Source("", "", weave.over_under, weave.lattice.pattern)
    shop = Workshop(templates=())
    made = fabricate_weave(weave, find_sequence(weave), scale=1.0, workshop=shop, source=source)
    return len(WrittenFolder(made.files).table("pieces"))
