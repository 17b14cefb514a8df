"""Make the paper's figures anew from runs of weavecore, with what was measured in the same runs.

    pip install -e ".[bench]"
    python benchmarks/figures.py                 # all figures, into docs/
    python benchmarks/figures.py --only 3 9      # some of them
    python benchmarks/figures.py --docs FOLDER   # into copies of the pages elsewhere

Each picture goes to images/paper/ beside the pages.  In the pages paper.md, patterns.md and structure.md what stands
between two comments, ``<!-- figure 3 -->`` and ``<!-- end of figure 3 -->``, is replaced; the words around it
are written by hand.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Callable

from paper_figures import at_rest, offsets, steps, woven

DOCS = Path(__file__).resolve().parents[1] / "docs"
FIGURES: dict[str, tuple[str, Callable[[Path], str]]] = {
    "2": ("paper.md", offsets.draw_comparison),
    "3": ("paper.md", offsets.draw_three_kinds),
    "5": ("paper.md", steps.draw_handling),
    "6": ("paper.md", steps.draw_criterion),
    "7": ("paper.md", steps.draw_reduction),
    "8": ("paper.md", steps.draw_grandchildren),
    "9": ("paper.md", woven.draw_models),
    "10": ("paper.md", woven.draw_lattices),
    "11": ("paper.md", woven.draw_built),
    "page": ("structure.md", at_rest.draw_page),
    "patterns": ("patterns.md", woven.draw_patterns),
}


def main() -> None:
    """Make the figures as the command line says."""
    parser = argparse.ArgumentParser(description="The paper's figures, reproduced.")
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=list(FIGURES), metavar="FIGURE")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of paper.md, patterns.md and structure.md")
    options = parser.parse_args()
    for name in options.only:
        make_figure(name, options.docs)
        print(f"figure {name}")


def make_figure(name: str, docs: Path) -> None:
    """Draw one figure, and write what was measured into its page."""
    page, draw = FIGURES[name]
    pictures = docs / "images" / "paper"
    pictures.mkdir(parents=True, exist_ok=True)
    text = draw(pictures)
    path = docs / page
    path.write_text(replace_block(path.read_text("utf-8"), name, text), encoding="utf-8")


def replace_block(page: str, name: str, text: str) -> str:
    """The page with other text between the two comments of a figure."""
    begin, end = f"<!-- figure {name} -->", f"<!-- end of figure {name} -->"
    before, rest = page.split(begin)
    return f"{before}{begin}\n\n{text}\n\n{end}{rest.split(end)[1]}"


if __name__ == "__main__":
    main()
