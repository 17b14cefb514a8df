"""The values that the stages exchange: frozen, with read-only arrays."""

from weavecore.model.bending import Bending, Material
from weavecore.model.compensation import Compensation
from weavecore.model.equilibrium import Equilibrium
from weavecore.model.joints import Clashes, Joints
from weavecore.model.latitudes import Bands, Latitudes
from weavecore.model.lattice import FAMILIES, LATITUDINAL, LONGITUDINAL, POCKET, Lattice
from weavecore.model.notes import InspectionMark, Note
from weavecore.model.polylines import Polylines
from weavecore.model.replay import Replay
from weavecore.model.rod_axes import RodAxes
from weavecore.model.sequence import BuildSequence
from weavecore.model.strands import Strands, first_generations
from weavecore.model.surface import Origins, SurfaceMesh
from weavecore.model.weave import Weave

__all__ = [
    "FAMILIES",
    "LATITUDINAL",
    "LONGITUDINAL",
    "POCKET",
    "Bands",
    "Bending",
    "BuildSequence",
    "Clashes",
    "Compensation",
    "Equilibrium",
    "InspectionMark",
    "Joints",
    "Latitudes",
    "Lattice",
    "Material",
    "Note",
    "Origins",
    "Polylines",
    "Replay",
    "RodAxes",
    "Strands",
    "SurfaceMesh",
    "Weave",
    "first_generations",
]
