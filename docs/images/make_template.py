"""Draw the template in docs/fabrication.md: python docs/images/make_template.py."""

from __future__ import annotations

from pathlib import Path

from weavecore import pipeline
from weavecore.fabricating.drawing_files import encode_svg
from weavecore.fabricating.marks import mark_pieces
from weavecore.fabricating.plan import plan_rods
from weavecore.fabricating.splices import cut_rods
from weavecore.fabricating.templates import draw_roll, strips_of
from weavecore.fabricating.workshop import Workshop

HERE = Path(__file__).resolve().parent
SHOWN = ("L16", "L15", "A33", "B30")


def main() -> None:
    """Write template.svg."""
    surface = pipeline.read_surface(HERE.parents[1] / "sample_files" / "hemisphere.3dm")
    weave = pipeline.weave(pipeline.link(pipeline.offset(surface)))
    plan = plan_rods(weave, 1.0)
    pieces, _ = cut_rods(plan, Workshop())
    strips = [strip for strip in strips_of(pieces, mark_pieces(plan, pieces)) if strip.piece.id in SHOWN]
    content = encode_svg(draw_roll(plan, strips, "weavecore; 1:1 templates; unit mm"), "A template")
    (HERE / "template.svg").write_bytes(content)


if __name__ == "__main__":
    main()
