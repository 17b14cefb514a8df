"""The gallery, every sample in every pattern: ``python docs/generate/gallery.py`` writes its page and its pictures.

The weaves are those of `weavecore explore`, so a run that was stopped goes on where it was (``--folder``).  Pictures
are made small, with few colours, so that the repository stays light.  Needs Pillow (extra ``bench``).
"""

from __future__ import annotations

import argparse
import io
import tempfile
from pathlib import Path

import weavecore as wc
from weavecore.exploring.table import Row

ROOT = Path(__file__).resolve().parents[2]
PAGE, PICTURES = ROOT / "docs" / "gallery.md", ROOT / "docs" / "images" / "gallery"
SAMPLES = (
    "hemisphere",
    "hourglass",
    "narrow_neck",
    "shell_2400x1600",
    "six_way_joint",
    "handle",
    "closed_body",
    "minimal_surface",
)
PATTERNS = ("triangular", "quad", "plain", "twill", "hexagonal", "kagome", "diagonal")
MATERIAL = "rattan"
WIDER = 2.0
"""Times the spacing that is chosen by default: in pictures of this size one sees over and under."""

SIZE, COLOURS = (300, 225), 32

HEAD = f"""# Gallery

Every sample in every pattern, at twice the spacing that weavecore chooses by itself, in the thickest rattan sold in
which nearly all rods can be bent. The pictures show rods at their true thickness. Made by
`python docs/generate/gallery.py`.

Each in files, with a page to choose from ([exploring](exploring.md)):

<!-- not run: takes minutes -->

```sh
weavecore explore sample_files/hourglass.3dm -o explored --spacing 40:80:10 --pattern {",".join(PATTERNS)}
```

`quad` and `plain` are one lattice and one weave; pictures are of `plain`. *Rods that bend* is the share whose stress is
within the allowable one; *clashes* are pairs of rods nearer to each other than their diameter.
"""

COLUMNS = {
    "rods": "rods",
    "length (m)": "length, m",
    "diameter": "diameter, mm",
    "rods that bend (%)": "rods that bend, %",
    "ends inside": "ends inside",
    "conflicts": "conflicts",
    "clashes": "clashes",
}


def main() -> None:
    """Weave what is missing, and write the page and the pictures."""
    parser = argparse.ArgumentParser(description="Write the gallery.")
    parser.add_argument("--folder", type=Path, help="an exploration to go on in; by default a temporary one")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        write(options.folder or Path(scratch) / "explored")


def write(folder: Path) -> None:
    """Weave into a folder, and write the page and the pictures."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    parts = [HEAD]
    for name in SAMPLES:
        surface = wc.read_surface(ROOT / "sample_files" / f"{name}.3dm")
        spacing = float(f"{WIDER * wc.suggest_spacing(surface):.2g}")
        explored = wc.explore(surface, folder, spacings=[spacing], patterns=PATTERNS, materials=[MATERIAL], pages=False)
        parts.append(_section(name, list(explored.rows), folder))
    PAGE.write_text("\n".join(parts), "utf-8")


def _section(name: str, rows: list[Row], folder: Path) -> str:
    pictures = []
    for row in rows:
        pattern = row.inputs["pattern"]
        if pattern == "quad" or not row.picture:
            continue
        target = PICTURES / f"{name}_{pattern}.png"
        target.write_bytes(_small((folder / row.picture).read_bytes()))
        pictures.append(f'<img src="images/gallery/{target.name}" width="32%" alt="{name}, {pattern}">')
    heads = ["pattern", *COLUMNS.values()]
    table = [f"| {' | '.join(heads)} |", "|---|" + "---:|" * len(COLUMNS)]
    for row in rows:
        cells = [_cell(row.figures.get(column)) for column in COLUMNS]
        table.append(f"| {' | '.join([row.inputs['pattern'], *cells])} |")
    spacing = rows[0].spacing
    return "\n".join([f"## {name}", "", f"Spacing {spacing:g} mm.", "", " ".join(pictures), "", *table, ""])


def _cell(value: float | None) -> str:
    return "" if value is None else f"{value:,.4g}"


def _small(picture: bytes) -> bytes:
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
    packed = io.BytesIO()
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(packed, "PNG", optimize=True)
    return packed.getvalue()


if __name__ == "__main__":
    main()
