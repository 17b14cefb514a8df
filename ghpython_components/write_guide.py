"""Write the tables and the pictures of ``docs/grasshopper.md``: ``python ghpython_components/write_guide.py``.

The tables and a picture of each component come from the components' ``metadata.json``, the picture of the canvas from
the definition that `build` makes.
"""

from __future__ import annotations

from pathlib import Path

import build
import draw_canvas
from grasshopper_files.archive import decode_archive
from grasshopper_files.components import ACCESS, Component, read_components
from grasshopper_files.definition import NAME

DOCS = Path(__file__).resolve().parents[1] / "docs"
GUIDE, PICTURE = DOCS / "grasshopper.md", DOCS / "images" / "grasshopper_canvas.svg"
COMPONENT_PICTURES = DOCS / "images" / "components"
BEGIN, END = "<!-- parameters -->\n", "<!-- end of parameters -->\n"

ORDER = (
    *(f"Weave_{name}" for name in ("Surface", "Offset", "Link", "Strands", "Simulate", "Preview", "Fabricate")),
    *(f"Weave_{name}" for name in ("Export", "View", "Bake", "Measure", "Choose")),
    "Deconstruct_Lattice",
    "Deconstruct_Weave",
)
"""The components in the order of the guide."""

_KINDS = {
    "none": "any",
    "float": "number",
    "int": "whole number",
    "bool": "true or false",
    "str": "text",
    "plane": "plane",
}


def tables() -> str:
    """What each parameter of each component is, in Markdown."""
    components = {one.folder: one for one in read_components(build.HERE)}
    return "\n".join(_table(components[name]) for name in ORDER)


def _table(one: Component) -> str:
    rows = [f"| in | `{p['name']}` | {_kind(p)} | {p['description']} |" for p in one.inputs]
    rows += [f"| out | `{p['name']}` | | {p['description']} |" for p in one.outputs]
    icon = f"![](../ghpython_components/{one.folder}/icon.png)"
    drawn = f"![{one.name} on the canvas](images/{COMPONENT_PICTURES.name}/{one.folder}.svg)"
    head = [f"### {icon} {one.name}", "", one.metadata["description"], "", drawn, ""]
    head.append("| | parameter | takes | what it is |")
    return "\n".join([*head, "|---|---|---|---|", *rows, ""])


def _kind(parameter: dict[str, str]) -> str:
    access = parameter["scriptParamAccess"]
    return _KINDS[parameter["typeHintID"]] + ("" if ACCESS[access] == 0 else f", {access}")


def picture() -> str:
    """The canvas of the definition as SVG."""
    return draw_canvas.draw(decode_archive(build.build()[f"{NAME}.gh"]))


def component_pictures() -> dict[str, str]:
    """Each component by itself as SVG, by the name of its file."""
    return {f"{one.folder}.svg": draw_canvas.draw_component(one) for one in read_components(build.HERE)}


def with_tables(guide: str) -> str:
    """The guide with its tables as they are now."""
    before, _, rest = guide.partition(BEGIN)
    _, _, after = rest.partition(END)
    return f"{before}{BEGIN}\n{tables()}\n{END}{after}"


def main() -> None:
    """Write the guide and its pictures."""
    GUIDE.write_text(with_tables(GUIDE.read_text("utf-8")), "utf-8")
    PICTURE.write_text(picture(), "utf-8")
    COMPONENT_PICTURES.mkdir(exist_ok=True)
    for name, drawn in component_pictures().items():
        (COMPONENT_PICTURES / name).write_text(drawn, "utf-8")


if __name__ == "__main__":
    main()
