"""The materials of ``materials.csv`` by name, each with the source of its figures."""

from __future__ import annotations

import csv
from functools import lru_cache
from importlib import resources

from weavecore.errors import Unsupported
from weavecore.model.bending import Material


@lru_cache(maxsize=1)
def known_materials() -> dict[str, Material]:
    """All materials of the table ``materials.csv`` by name, each with the source of its figures."""
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

    Parameters
    ----------
    name : str
        As in ``materials.csv``, such as ``"gfrp"``.

    Returns
    -------
    Material

    Raises
    ------
    Unsupported
        When the table has none of that name.
    """
    known = known_materials()
    if name not in known:
        raise Unsupported(
            f"Unknown material {name!r}",
            remedy=f"Take one of: {', '.join(known)}; or give a Material of your own.",
        )
    return known[name]
