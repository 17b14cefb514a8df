"""`validate`: the one door to all the checks."""

from __future__ import annotations

from typing import Optional, Union

from weavecore.errors import Unsupported
from weavecore.model.latitudes import Latitudes
from weavecore.model.lattice import Lattice
from weavecore.model.strands import Strands
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.latitudes import check_latitudes
from weavecore.validating.lattices import check_lattice
from weavecore.validating.report import Report
from weavecore.validating.strands import check_strands
from weavecore.validating.surfaces import check_surface

Checkable = Union[SurfaceMesh, Latitudes, Lattice, Strands]


def validate(value: Checkable, *, lattice: Optional[Lattice] = None) -> Report:
    """Check a stage's result against what must always hold of it.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice or Strands
        Only the value itself is checked, not the ones that it was made from.
    lattice : Lattice, optional
        The lattice whose edges the strands part among them; needed with strands only.

    Returns
    -------
    Report
        One finding for each invariant; ``report.raise_if_broken()`` raises `Broken`.

    Raises
    ------
    Unsupported
        Of a value that no stage gives, and of strands without their lattice.
    """
    if isinstance(value, SurfaceMesh):
        return Report.of(check_surface(value))
    if isinstance(value, Latitudes):
        return Report.of(check_latitudes(value))
    if isinstance(value, Lattice):
        return Report.of(check_lattice(value))
    if isinstance(value, Strands) and lattice is not None:
        return Report.of(check_strands(value, lattice))
    raise Unsupported(
        f"There is no check for a {type(value).__name__} alone",
        remedy="Give a surface, latitudes, a lattice, or strands together with their lattice.",
    )
