"""Draw the pictures of the documents: ``python docs/images/make.py``."""

from __future__ import annotations

from pathlib import Path

import weavecore as wc

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parents[1] / "sample_files"
PICTURES = {"six_way_joint": 30.0}


def main() -> None:
    """Weave each sample at its spacing and draw it."""
    for name, spacing in PICTURES.items():
        lattice = wc.link(wc.offset(wc.read_surface(SAMPLES / f"{name}.3dm"), spacing=spacing))
        wc.draw_picture(lattice, HERE / f"{name}.png", size=(1000, 750), overwrite=True)


if __name__ == "__main__":
    main()
