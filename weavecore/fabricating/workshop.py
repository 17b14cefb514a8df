"""`Workshop`: the options of a workshop, with the measures of splices; without NumPy, for the command's help."""

from __future__ import annotations

from dataclasses import dataclass

from weavecore.errors import Unsupported

OVERLAP, SLEEVE = "overlap", "sleeve"
SPLICES = (OVERLAP, SLEEVE)
DXF, SVG, PDF = "dxf", "svg", "pdf"
TEMPLATES = (DXF, SVG, PDF)
PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}
"""Width and height in millimetres, landscape (ISO 216)."""

OVERLAP_DIAMETERS = 30.0
"""Least length of an overlap, in diameters of the rod, as is usual for rods that are tied."""

SLEEVE_DIAMETERS = 20.0
"""Length of a sleeve, in diameters: each piece reaches ten diameters into it."""

TAIL_DIAMETERS = 5.0
"""How far an overlap reaches beyond the two crossings that hold it, in diameters: a tie on the very end slips off."""

SPLICE_UTILISATION = 0.8
"""Greatest bending utilisation where a rod is spliced: a fifth of the allowable stress is kept for the splice, which
is stiffer than the rod and adds stress at its ends."""

LABELS_PER_PIECE = 2
"""One at each end."""

KG_PER_MM3 = 1e-9
"""One kg/m³ in kg/mm³."""

_MOST_MM = 1e6
"""Lengths of a workshop are below this (1 km): above it the unit was mistaken."""


@dataclass(frozen=True)
class Workshop:
    """Options of `fabricate`, in millimetres.

    Parameters
    ----------
    stock : float
        Length of the bars.
    splice : str
        ``"overlap"``: two pieces side by side past two crossings and 30 diameters; ``"sleeve"``: end to end in
        a tube of 20 diameters between two crossings.
    kerf : float
        Length that the saw removes at each cut.
    templates : tuple of str
        In which of ``"dxf"``, ``"svg"`` and ``"pdf"`` templates and drawings are written; labels are a PDF.
    paper : str
        Paper of templates and drawings: ``"A4"`` to ``"A0"``.

    Raises
    ------
    Unsupported
    """

    stock: float = 6000.0
    splice: str = OVERLAP
    kerf: float = 0.0
    templates: tuple[str, ...] = TEMPLATES
    paper: str = "A3"

    def __post_init__(self) -> None:
        object.__setattr__(self, "templates", tuple(self.templates))
        for label, least in (("stock", 1.0), ("kerf", 0.0)):
            value = getattr(self, label)
            if not least <= value < _MOST_MM:
                raise Unsupported(
                    f"The {label} must be at least {least:g} mm and below 1 km (got {value:g} mm)",
                    remedy=f"Change the {label}.",
                )
        known = (("splice", (self.splice,), SPLICES), ("template", self.templates, TEMPLATES))
        for label, names, all_known in (*known, ("paper", (self.paper,), tuple(PAPERS))):
            for name in names:
                if name not in all_known:
                    raise Unsupported(f"Unknown {label} {name!r}", remedy=f"Use one of: {', '.join(all_known)}.")

    def sleeve_length(self, diameter: float) -> float:
        """Length of the tube over a sleeved splice of rods of this diameter."""
        return SLEEVE_DIAMETERS * diameter
