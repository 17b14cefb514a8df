"""How large the page of a result becomes, estimated before it is made.

The axes of rods of length L in all are sampled in steps of 1 / `STEPS_PER_EDGE` of an edge; of these the page keeps
those that are needed to look smooth.
"""

from __future__ import annotations

from weavecore.errors import TooMuchWork
from weavecore.model import Equilibrium, Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.texts import rough_count
from weavecore.viewing.page.page_curves import STEPS_PER_EDGE
from weavecore.viewing.scene import Pictured

MOST_SAMPLES = 8_000_000
"""Points along rods that are looked at: each takes 250 bytes."""

MOST_FACES = 5_000_000
"""Triangles of the surface on a page: each takes 24 bytes of it, and a browser as much again."""


def check_work(value: Pictured) -> None:
    """Refuse a result whose page would take gigabytes.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium

    Raises
    ------
    TooMuchWork
    """
    if isinstance(value, Equilibrium):
        value = value.weave
    if isinstance(value, Weave):
        length = float(value.axes.lengths.sum())
        edge = min(value.lattice.latitudes.spacing, value.lattice.edge_length)
        samples = STEPS_PER_EDGE * length / edge
        if samples > MOST_SAMPLES:
            raise TooMuchWork(
                f"Rods {length:.4g} long in all would be drawn through about {rough_count(samples)} points, more than "
                f"{MOST_SAMPLES:,}",
                remedy=f"Weave with edges of at least {STEPS_PER_EDGE * length / MOST_SAMPLES:.3g}.",
            )
    n_faces = _surface_of(value).n_faces
    if n_faces > MOST_FACES:
        raise TooMuchWork(
            f"The page would hold a surface of {rough_count(n_faces)} faces, more than {MOST_FACES:,}",
            remedy="Mesh the surface more coarsely.",
        )


def _surface_of(value: Pictured) -> SurfaceMesh:
    if isinstance(value, (Weave, Equilibrium)):
        return _surface_of(value.lattice if isinstance(value, Weave) else value.weave)
    if isinstance(value, Lattice):
        return value.latitudes.surface
    return value.surface if isinstance(value, Latitudes) else value
