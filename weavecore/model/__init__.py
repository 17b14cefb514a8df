"""The nouns that travel between the stages: frozen values with read-only arrays."""

from weavecore.model.latitudes import Bands, Latitudes
from weavecore.model.lattice import FAMILIES, LATITUDINAL, LONGITUDINAL, POCKET, Lattice
from weavecore.model.polylines import Polylines
from weavecore.model.strands import Strands
from weavecore.model.surface import SurfaceMesh

__all__ = [
    "FAMILIES",
    "LATITUDINAL",
    "LONGITUDINAL",
    "POCKET",
    "Bands",
    "Lattice",
    "Latitudes",
    "Polylines",
    "Strands",
    "SurfaceMesh",
]
