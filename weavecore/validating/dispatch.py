"""`validate`: the one door to all the checks."""

from __future__ import annotations

from typing import Union

from weavecore.errors import Unsupported
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.latitudes import check_latitudes
from weavecore.validating.lattices import check_lattice
from weavecore.validating.report import Report
from weavecore.validating.surfaces import check_surface

Checkable = Union[SurfaceMesh, Latitudes, Lattice]


def validate(value: Checkable) -> Report:
    """Check a stage's result against what must always hold of it.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes or Lattice
        Only the value itself is checked, not the ones that it was made from.

    Returns
    -------
    Report
        One finding for each invariant; ``report.raise_if_broken()`` raises `Broken`.

    Raises
    ------
    Unsupported
        Of a value that no stage gives.
    """
    if isinstance(value, SurfaceMesh):
        return Report.of(check_surface(value))
    if isinstance(value, Latitudes):
        return Report.of(check_latitudes(value))
    if isinstance(value, Lattice):
        return Report.of(check_lattice(value))
    raise Unsupported(
        f"There is no check for a {type(value).__name__}",
        remedy="Give a surface, latitudes, a lattice or strands.",
    )
