"""*Weave Bake*: rods as curves of the document, with the layers, names, colours and user text of a .3dm file."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Optional, Union

from weavecore.canvas.simulating import curve_at_rest
from weavecore.canvas.solve import Run
from weavecore.errors import Unsupported
from weavecore.exporting.equilibrium_layers import ROD_LAYERS
from weavecore.exporting.rhino_file import rod_texts
from weavecore.model import Equilibrium, Weave
from weavecore.palette import utilisation_colours

_SEPARATOR = "::"
_UNDO = "Weave Bake"


def bake_rods(run: Run, value: Union[Weave, Equilibrium], layer: Optional[str] = None) -> list[Any]:
    """Add the rods of a weave to the document, as one step that can be undone.

    Parameters
    ----------
    run : Run
    value : Weave or Equilibrium
        At rest, the rods are baked there.
    layer : str, optional
        The layer above those of the families; by default ``weave``.

    Returns
    -------
    list of Guid

    Raises
    ------
    Unsupported
        Where no document is open, or the value is no weave.
    """
    rhino: Any = import_module("Rhino")
    document = rhino.RhinoDoc.ActiveDoc
    if document is None:
        raise Unsupported("No document is open in Rhino", remedy="Open one.")
    if not isinstance(value, (Weave, Equilibrium)):
        raise Unsupported(f"A {type(value).__name__} has no rods", remedy="Wire the output weave of Weave Strands.")
    weave = value.weave if isinstance(value, Equilibrium) else value
    root = (layer or "").strip() or "weave"
    colours = utilisation_colours(weave.bending.utilisation).tolist()
    undo, ids = document.BeginUndoRecord(_UNDO), []
    try:
        for s, name in enumerate(weave.ids):
            run.progress(s / len(weave), "baking")
            attributes = rhino.DocObjects.ObjectAttributes()
            path = _SEPARATOR.join([root, "rods", ROD_LAYERS[name[0]]])
            attributes.Name, attributes.LayerIndex = name, _layer(rhino, document, path)
            attributes.ObjectColor = import_module("System.Drawing").Color.FromArgb(*colours[s])
            attributes.ColorSource = rhino.DocObjects.ObjectColorSource.ColorFromObject
            for key, text in rod_texts(weave, s).items():
                attributes.SetUserString(key, text if isinstance(text, str) else repr(text))
            spline = curve_at_rest(value, s) if isinstance(value, Equilibrium) else weave.axes.bspline(s)
            ids.append(document.Objects.AddCurve(run.drawing.spline(*spline), attributes))
    finally:
        document.EndUndoRecord(undo)
        document.Views.Redraw()
    return ids


def _layer(rhino: Any, document: Any, path: str) -> int:
    """Index of the layer with this full path, which is added with those above it where it is not there."""
    found = int(document.Layers.FindByFullPath(path, -1))
    if found >= 0:
        return found
    above, _, name = path.rpartition(_SEPARATOR)
    layer = rhino.DocObjects.Layer()
    layer.Name = name
    if above:
        layer.ParentLayerId = document.Layers[_layer(rhino, document, above)].Id
    return int(document.Layers.Add(layer))
