"""`Workshop`: what the workshop has and how it works; its own choice, not the model's."""

from __future__ import annotations

from dataclasses import dataclass

from weavecore.errors import Unsupported

OVERLAP, SLEEVE = "overlap", "sleeve"
SPLICES = (OVERLAP, SLEEVE)
DXF, SVG, PDF = "dxf", "svg", "pdf"
TEMPLATES = (DXF, SVG, PDF)
PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}
"""Width and height in millimetres, on the long side."""

OVERLAP_DIAMETERS = 30.0
SLEEVE_DIAMETERS = 20.0
TAIL_DIAMETERS = 5.0
"""An overlap reaches so many diameters beyond the two crossings that hold it."""

MOST_UTILISED = 0.8
"""No splice where a rod is bent beyond this part of what it bears."""


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
    overhang : float
        How far the free ends of rods stand out beyond their last joint.
    kerf : float
        What the saw takes for each cut.
    templates : tuple of str
        Which of ``"dxf"``, ``"svg"`` and ``"pdf"`` are drawn.
    paper : str
        Of the PDF: ``"A4"`` to ``"A0"``.

    Raises
    ------
    Unsupported
    """

    stock: float = 6000.0
    splice: str = OVERLAP
    overhang: float = 0.0
    kerf: float = 0.0
    templates: tuple[str, ...] = TEMPLATES
    paper: str = "A3"

    def __post_init__(self) -> None:
        object.__setattr__(self, "templates", tuple(self.templates))
        for label, least in (("stock", 1.0), ("overhang", 0.0), ("kerf", 0.0)):
            value = getattr(self, label)
            if not least <= value < 1e6:
                raise Unsupported(f"The {label} of {value:g} mm", remedy=f"Give {least:g} mm or more, below 1 km.")
        known = (("splice", (self.splice,), SPLICES), ("template", self.templates, TEMPLATES))
        for label, names, all_known in (*known, ("paper", (self.paper,), tuple(PAPERS))):
            for name in names:
                if name not in all_known:
                    raise Unsupported(f"There is no {label} {name!r}", remedy=f"Take one of: {', '.join(all_known)}.")

    def sleeve_length(self, diameter: float) -> float:
        """Length of the tube over a sleeved splice."""
        return SLEEVE_DIAMETERS * diameter
