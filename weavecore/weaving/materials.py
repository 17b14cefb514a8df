"""The table of materials, ``materials.csv``: one row each, with where its figures come from.

A material of one's own is a `Material` made with the same figures.
"""

from __future__ import annotations

import csv
from functools import lru_cache
from importlib import resources

from weavecore.errors import Unsupported
from weavecore.model.material import Material


@lru_cache(maxsize=1)
def known_materials() -> dict[str, Material]:
    """All materials of the table by name."""
    text = resources.files("weavecore.weaving").joinpath("materials.csv").read_text("utf-8")
    return {
        row["name"]: Material(
            row["name"],
            modulus=float(row["modulus_gpa"]),
            strength=float(row["strength_mpa"]),
            factor=float(row["factor"]),
            density=float(row["density_kg_m3"]),
            source=row["source"],
        )
        for row in csv.DictReader(text.splitlines())
    }


def material_named(name: str) -> Material:
    """The material of that name.

    Raises
    ------
    Unsupported
        When the table has none.
    """
    known = known_materials()
    if name not in known:
        raise Unsupported(
            f"There is no material {name!r}",
            remedy=f"Take one of: {', '.join(known)}; or give a Material of your own.",
        )
    return known[name]
