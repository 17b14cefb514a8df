"""The unit and the tolerance of the document that Rhino has open."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple

from weavecore.units import METRES, NO_UNIT


class DocumentUnit(NamedTuple):
    """Rhino's name of a unit, "None" where there is none, and the absolute tolerance in it, 0 where it is not known."""

    unit: str = NO_UNIT
    tolerance: float = 0.0


def document_unit() -> DocumentUnit:
    """Unit and tolerance of the active document; none of both without Rhino or a document."""
    try:
        rhino: Any = import_module("Rhino")
        document = rhino.RhinoDoc.ActiveDoc
    except (ImportError, AttributeError):
        return DocumentUnit()
    if document is None:
        return DocumentUnit()
    unit = str(document.ModelUnitSystem).rpartition(".")[2]
    return DocumentUnit(unit if unit in METRES else NO_UNIT, float(document.ModelAbsoluteTolerance))
