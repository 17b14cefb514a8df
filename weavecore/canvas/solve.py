"""`solve`: one run of a component, from its inputs to its outputs, balloons and caption.

    inputs → hash → kept outcome, or `compute` → outcome: outputs, caption, balloons → shown

The hash covers the values of all inputs, the files that they name, the unit of the document and the code of `compute`;
an input that cannot be hashed is computed each time.  Grasshopper runs a component several times in one solution where
lists or branches come to inputs that take one item or one list: the branches of its trees, and its messages, begin with
the number of the run.  What is kept of a component grows with its runs, and goes with it (`caching`).
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import CodeType
from typing import Any, Callable, Optional
from weakref import WeakKeyDictionary

import numpy as np

from weavecore.canvas.caching import ComponentCache, cache_of, pressed, runs_of
from weavecore.canvas.placing import offer_lists
from weavecore.canvas.trees import data_tree
from weavecore.errors import UnitUnknown, Unsupported, WeaveError
from weavecore.polling import listening
from weavecore.rhino_geometry import DocumentUnit, Drawing, document_unit, is_rhino_mesh, rhino_faces, rhino_vertices

REMARK, WARNING, ERROR = "Remark", "Warning", "Error"
"""Grasshopper's levels of a balloon."""

_MAKERS = {
    "SurfaceMesh": "Put a Weave Surface in between and wire its output surface.",
    "Latitudes": "Put a Weave Offset in between and wire its output latitudes.",
    "Weave": "Put a Weave Strands in between and wire its output weave.",
    "Lattice": "Put a Weave Link in between and wire its output lattice.",
}
"""Remedy for an input of the wrong kind: the component whose output has the right one."""

_COMPARED_BY = (
    ("X", "Y", "Z"),
    ("Origin", "XAxis", "YAxis"),
    ("From", "To"),
    ("StartPoint", "MidPoint", "EndPoint"),
    ("Plane", "Radius"),
    ("Plane", "Radius1", "Radius2"),
    ("Plane", "X", "Y"),
    ("T0", "T1"),
)
"""Attributes that define Rhino's structures: points, planes, lines, arcs, circles, ellipses, rectangles, intervals."""

_known: WeakKeyDictionary[Any, str] = WeakKeyDictionary()
"""Hashes of weavecore's values, which never change."""

Outputs = tuple[Any, ...]
Compute = Callable[..., Any]


class Cancelled(Exception):
    """The user pressed Escape."""


@dataclass(frozen=True)
class Outcome:
    """What a run gave: outputs, a caption and balloons (level, text)."""

    outputs: Outputs
    caption: str = ""
    balloons: tuple[tuple[str, str], ...] = ()
    is_kept: bool = True
    is_cancelled: bool = False


@dataclass
class Run:
    """What a component's own function sees of its run.

    Parameters
    ----------
    is_cancelled : callable
        Whether the user has cancelled.
    show_text : callable
        Shows a text under the component meanwhile.
    folder : Path
        Where files without a folder of their own belong: beside the definition, or in the user's home where that
        has not been saved yet.
    number : int
        Which run of the solution it is, from 0.
    count : int
        How many runs the solution has.
    cache : ComponentCache, optional
        Of the component.
    """

    is_cancelled: Callable[[], bool]
    show_text: Callable[[str], None]
    folder: Path = field(default_factory=Path.home)
    number: int = 0
    count: int = 1
    cache: Optional[ComponentCache] = None
    caption: str = ""
    balloons: list[tuple[str, str]] = field(default_factory=list)

    @cached_property
    def document(self) -> DocumentUnit:
        """Unit and tolerance of Rhino's document."""
        return document_unit()

    @cached_property
    def drawing(self) -> Drawing:
        """What makes geometry for the outputs."""
        return Drawing()

    def progress(self, fraction: float, label: str) -> None:
        """Show how far it is, and stop where the user wants that: for ``progress=`` of a stage.

        Raises
        ------
        Cancelled
        """
        self.check()
        self.show_text(f"{label} {fraction:.0%}")

    def check(self, _fraction: float = 0.0, _label: str = "") -> None:
        """Stop where the user wants that.

        Raises
        ------
        Cancelled
        """
        if self.is_cancelled():
            raise Cancelled

    def part(self, make: Callable[..., Any], *arguments: Any) -> Any:
        """What ``make`` gives for some arguments, kept between solutions: for what other inputs do not change.

        Parameters
        ----------
        make : callable
        *arguments
            Values of weavecore, numbers and texts.
        """
        if self.cache is None:
            return make(*arguments)
        key = digest([make.__module__, make.__qualname__, *arguments])
        return self.cache.part(key, lambda: make(*arguments), self.count)

    def tree(self, branches: Iterable[tuple[tuple[int, ...], list[Any]]]) -> Any:
        """A ``DataTree`` of branches, whose paths begin with the number of the run.

        Parameters
        ----------
        branches : iterable of (path, items)
            A path is a tuple of whole numbers.
        """
        return data_tree(((self.number, *path), items) for path, items in branches)

    def warn(self, text: str) -> None:
        """Put up an orange balloon."""
        self.balloons.append((WARNING, text))

    def remark(self, text: str) -> None:
        """Put up a white balloon."""
        self.balloons.append((REMARK, text))


def solve(
    component: Any,
    sticky: MutableMapping[str, Any],
    compute: Compute,
    inputs: Mapping[str, Any],
    *,
    needs: Mapping[str, type],
    n_outputs: int,
    is_kept: bool = True,
    buttons: Iterable[str] = (),
    lists: Optional[Mapping[str, Sequence[str]]] = None,
) -> Outputs:
    """Run a component.

    Parameters
    ----------
    component : IGH_Component
        ``ghenv.Component``.
    sticky : mapping
        ``scriptcontext.sticky``, where results are kept by the component's id and a hash of its inputs.
    compute : callable
        ``compute(run, **inputs)`` gives the outputs as a tuple.
    inputs : mapping
        Values by the names of the parameters; None where nothing came.
    needs : mapping of str to type
        Inputs without which the component keeps silent, and what they must be.
    n_outputs : int
    is_kept : bool
        Whether the same inputs give the same outputs, so that they need not be computed again.
    buttons : iterable of str
        Inputs that act once when they turn true: `compute` gets them as true in that solution alone.
    lists : mapping of str to sequence of str, optional
        Names that inputs take, offered as lists when the component is placed.

    Returns
    -------
    tuple
        The outputs, None each where there are none.
    """
    nothing = (None,) * n_outputs
    number, count = runs_of(component)
    buttons = tuple(buttons)
    inputs = {**inputs, **pressed(component, sticky, {name: inputs[name] for name in buttons}, number)}
    missing = [name for name in needs if inputs[name] is None]
    if missing:
        offer_lists(component, cache_of(component, sticky), lists or {})
        wired = [name for name in missing if _is_wired(component, name)]
        balloons = tuple((WARNING, f"{name}: nothing comes through the wire.") for name in wired)
        _show(component, _numbered(Outcome(nothing, "", balloons), number, count))
        return nothing
    cache, folder = cache_of(component, sticky), _folder_of(component)
    is_pressed = any(inputs[name] for name in buttons)
    asked = {**inputs, **dict.fromkeys(buttons)}
    key = _key_of(compute, asked, folder, number) if is_kept or buttons else None
    # What a button gave is shown after it is released, until another input changes.
    outcome = None if is_pressed else cache.get(key)
    if outcome is None:
        run = Run(
            _escape_pressed, lambda text: setattr(component, "Message", text), folder, number, count=count, cache=cache
        )
        outcome = _numbered(_run(run, compute, inputs, needs, nothing), number, count)
        if outcome.is_cancelled:
            cache.down.clear()
        elif is_pressed:
            # A file that was written, and that an input names, makes another input.
            cache.put(_key_of(compute, asked, folder, number), outcome, count)
        elif is_kept and outcome.is_kept:
            cache.put(key, outcome, count)
    _show(component, outcome)
    outputs: Outputs = outcome.outputs
    return outputs


def _numbered(outcome: Outcome, number: int, count: int) -> Outcome:
    """An outcome whose messages say which of several runs they are about."""
    if count < 2:
        return outcome
    told = f"Item {number + 1} of {count}: "
    return replace(outcome, balloons=tuple((level, told + text) for level, text in outcome.balloons))


def _run(run: Run, compute: Compute, inputs: Mapping[str, Any], needs: Mapping[str, type], nothing: Outputs) -> Outcome:
    failed = Outcome(nothing, is_kept=False)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", UnitUnknown)
            _check_kinds(inputs, needs)
            # Between the stages, where results are drawn and written, Escape is polled as well.
            with listening(run.check):
                outputs = tuple(compute(run, **inputs))
    except Cancelled:
        return replace(
            failed, is_cancelled=True, caption="cancelled", balloons=((REMARK, "Cancelled. Recompute to go on."),)
        )
    except WeaveError as error:
        return replace(failed, balloons=(*run.balloons, (ERROR, str(error))))
    except MemoryError:
        text = "TOO_MUCH_WORK: the memory did not suffice. Choose a larger spacing or a coarser mesh."
        return replace(failed, balloons=((ERROR, text),))
    except ModuleNotFoundError as error:
        text = f"UNSUPPORTED: This needs {error.name}, which is not installed."
        text += f" Add # r: {error.name} on top of the component's script."
        return replace(failed, balloons=((ERROR, text),))
    except Exception as error:  # noqa: BLE001 - a fault of the program must not end in a traceback either.
        text = f"INTERNAL: {type(error).__name__}: {error}. This is a fault of weavecore: please report it."
        return replace(failed, balloons=((ERROR, text),))
    said = tuple((WARNING, f"{UnitUnknown.code}: {warning.message}") for warning in caught)
    return Outcome(outputs, run.caption, (*said, *run.balloons))


def _check_kinds(inputs: Mapping[str, Any], needs: Mapping[str, type]) -> None:
    for name, kind in needs.items():
        if not isinstance(inputs[name], kind):
            raise Unsupported(
                f"A {type(inputs[name]).__name__} came where {name} must be a {kind.__name__}",
                remedy=_MAKERS.get(kind.__name__, "Wire what the input's description says."),
            )


def _show(component: Any, outcome: Outcome) -> None:
    component.Message = outcome.caption
    if outcome.balloons:
        levels: Any = import_module("Grasshopper.Kernel").GH_RuntimeMessageLevel
        for level, text in outcome.balloons:
            component.AddRuntimeMessage(getattr(levels, level), text)


def _is_wired(component: Any, name: str) -> bool:
    return any(name in (p.Name, p.NickName) and p.SourceCount > 0 for p in component.Params.Input)


def _folder_of(component: Any) -> Path:
    """The folder of the definition that the component is in."""
    definition = component.OnPingDocument()
    path = definition.FilePath if definition is not None else None
    return Path(path).parent if path else Path.home()


def _key_of(compute: Compute, inputs: Mapping[str, Any], folder: Path, number: int) -> Optional[str]:
    """Hash of the inputs, the run, the document's unit and the script; None where an input cannot be hashed."""
    # A text may name a file beside the definition, which is another input once it has changed.
    files = [str(folder / value) for value in inputs.values() if isinstance(value, str)]
    try:
        return digest([document_unit()._asdict(), dict(inputs), files, number, _text_of(compute.__code__)])
    except Indistinct:
        return None


def _text_of(code: CodeType) -> str:
    """What a function does: who edits a script on the canvas wants to see what it gives now."""
    inner = [_text_of(part) if isinstance(part, CodeType) else repr(part) for part in code.co_consts]
    return repr((code.co_code, code.co_names, inner))


def _escape_pressed() -> bool:
    try:
        kernel: Any = import_module("Grasshopper.Kernel")
    except ImportError:
        return False
    return bool(kernel.GH_Document.IsEscapeKeyDown())


class Indistinct(TypeError):
    """A value has nothing by which it differs from others of its kind."""


def digest(value: Any) -> str:
    """Hash a value.

    Parameters
    ----------
    value : object
        A number, text, array, value of weavecore, geometry of Rhino, or a list or dict of these.

    Returns
    -------
    str
        The same for equal values.

    Raises
    ------
    Indistinct
        Where its kind gives nothing to compare.
    """
    if is_dataclass(value) and not isinstance(value, type):
        if value not in _known:
            _known[value] = _hash(type(value).__name__, *(digest(getattr(value, f.name)) for f in fields(value)))
        return _known[value]
    if value is None or isinstance(value, (bool, int, float, str, bytes)):
        return _hash(type(value).__name__, repr(value), _file_state(value))
    if isinstance(value, np.ndarray):
        return _hash(value.dtype.str, str(value.shape), np.ascontiguousarray(value).tobytes())
    if isinstance(value, dict):
        return _hash("dict", *(digest(part) for pair in value.items() for part in pair))
    if is_rhino_mesh(value):
        return _hash("mesh", digest(rhino_vertices(value)), digest(rhino_faces(value)))
    return _of_rhino(value)


def _of_rhino(value: Any) -> str:
    """Hash of other geometry of Rhino: curves, surfaces, lines, arcs, circles, planes and points; and of lists."""
    kind = type(value).__name__
    if hasattr(value, "DataCRC"):
        box = value.GetBoundingBox(False)
        return _hash(kind, str(value.DataCRC(0)), digest(box.Min), digest(box.Max))
    if hasattr(value, "Encode"):
        return _hash(kind, json.dumps(value.Encode(), sort_keys=True))
    for names in _COMPARED_BY:
        if all(hasattr(value, name) for name in names):
            return _hash(kind, *(digest(getattr(value, name)) for name in names))
    if isinstance(value, Iterable):
        return _hash("list", *(digest(part) for part in value))
    raise Indistinct(f"A {kind} cannot be distinguished from another")


def _file_state(value: Any) -> str:
    """Size and time of the file that a text names, so that a file that has changed is read again."""
    if not isinstance(value, str):
        return ""
    try:
        state = os.stat(value)  # noqa: PTH116 - a text that is no path must not become one.
    except (OSError, ValueError):
        return ""
    return f"{state.st_size} {state.st_mtime_ns}"


def _hash(*parts: str | bytes) -> str:
    content = hashlib.sha256()
    for part in parts:
        encoded = part if isinstance(part, bytes) else part.encode("utf-8", "surrogatepass")
        content.update(b"%d:" % len(encoded))
        content.update(encoded)
    return content.hexdigest()
