"""The surface and curves that a command reads, and the line about the files that it has written."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Optional, Union

import typer

from weavecore.commands.arguments import Plane
from weavecore.errors import UnitUnknown
from weavecore.texts import printable

if TYPE_CHECKING:
    from weavecore.geometry.arrays import Floats
    from weavecore.model import SurfaceMesh
    from weavecore.units import Length

Lines = list[tuple[str, str]]


@dataclass(frozen=True)
class Repairs:
    """What is repaired or left out beyond the usual, as `weavecore.read_surface` takes it."""

    weld: Optional[Length] = None
    fill_holes: Optional[Length] = None
    largest: bool = False
    side: Optional[str] = None
    strict: bool = False

    def parameters(self, unit: str) -> dict[str, object]:
        """What differs from the usual, as it is recorded in the output."""
        lengths = {"weld": self.weld, "fill_holes": self.fill_holes}
        found: dict[str, object] = {key: length.in_unit(unit) for key, length in lengths.items() if length is not None}
        if self.largest:
            found["largest"] = True
        if self.side is not None:
            found["side"] = self.side
        return found


def read_input(
    path: Path,
    *,
    layers: Optional[Sequence[str]] = None,
    objects: Optional[Sequence[str]] = None,
    plane: Optional[Plane] = None,
    edge_target: Optional[Length] = None,
    spacing: Optional[Length] = None,
    time_limit: Optional[float] = None,
    progress: Optional[Callable[[float, str], None]] = None,
    repairs: Optional[Repairs] = None,
    borders: Optional[Sequence[int]] = None,
    curves: Optional[Sequence[str]] = None,
) -> SurfaceMesh:
    """Read the surface of a file in a child process, and print its warnings in one line each.

    Parameters
    ----------
    path : Path
    layers, objects : sequence of str, optional
        Which objects of the file are meant.
    plane : Plane, optional
        Cuts a closed surface in two.
    edge_target : Length, optional
        Longest edge of the mesh that is made of a surface.
    spacing : Length, optional
        Least spacing of the rings, from which the edge is chosen otherwise.
    time_limit : float, optional
        In seconds.
    progress : callable, optional
        Called with a fraction and a label.
    repairs : Repairs, optional
        What is repaired or left out beyond the usual.
    borders : sequence of int, optional
        Numbers of the borders at which the weave starts.
    curves : sequence of str, optional
        Names or files of the curves at which it starts; see `curves_of`.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    WeaveError
        As `weavecore.read_surface`; `Doubtful` where doubts are to be refused.
    """
    from weavecore import pipeline

    repairs = repairs or Repairs()

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", UnitUnknown)
        surface = pipeline.read_surface(
            path,
            layer=layers,
            object=objects,
            cut_plane=plane.point_and_normal if plane else None,
            edge_target=edge_target,
            spacing=spacing,
            guarded=True,
            time_limit=time_limit,
            progress=progress,
            weld=repairs.weld,
            fill_holes=repairs.fill_holes,
            largest=repairs.largest,
            side=repairs.side,
        )
    if repairs.strict:
        pipeline.refuse_doubts(surface)
    for warning in caught:
        typer.echo(f"weavecore: warning: {UnitUnknown.code}: {printable(str(warning.message))}", err=True)
    found = curves_of(path, curves, unit=surface.unit, time_limit=time_limit) if curves else None
    return pipeline.start_at(surface, borders=borders, curves=found)


def curves_of(path: Path, names: Sequence[str], *, unit: str, time_limit: Optional[float]) -> list[Floats]:
    """Read curves: first those of the input file, then those of files of their own.

    Parameters
    ----------
    path : Path
        The input file.
    names : sequence of str
        Names, ids or layers of curves in the input file, or paths of other files.
    unit : str
        Unit of the surface, to which curves of other files are converted.
    time_limit : float or None
        In seconds, for each file.

    Returns
    -------
    list of (n, 3) float64

    Raises
    ------
    WeaveError
        As `weavecore.read_curves`.
    """
    from weavecore import pipeline
    from weavecore.reading import CURVE_ENDINGS

    inside = [name for name in names if Path(name).suffix.lower() not in CURVE_ENDINGS]
    files = [name for name in names if name not in inside]
    curves = pipeline.read_curves(path, names=inside, guarded=True, time_limit=time_limit) if inside else []
    for file in files:
        curves += pipeline.read_curves(file, unit=unit, guarded=True, time_limit=time_limit)
    return curves


def describe_input(
    path: Path,
    surface: SurfaceMesh,
    *,
    layers: Optional[Sequence[str]],
    objects: Optional[Sequence[str]],
    edge_target: Optional[Length],
    repairs: Repairs,
    **more: object,
) -> dict[str, object]:
    """List what was read and how, as it is recorded in the output.

    Parameters
    ----------
    path : Path
    surface : SurfaceMesh
    layers, objects : sequence of str or None
    edge_target : Length or None
    repairs : Repairs
    **more : object
        Further options by the names under which they are recorded.

    Returns
    -------
    dict of str to object
        Without the options that were not given.
    """
    options = {
        "input": printable(path.name),
        "layer": _names_as_json(layers),
        "object": _names_as_json(objects),
        "edge_target": edge_target.in_unit(surface.unit) if edge_target else None,
        **repairs.parameters(surface.unit),
        **more,
    }
    return {key: option for key, option in options.items() if option is not None}


def _names_as_json(names: Optional[Sequence[str]]) -> Union[str, list[str], None]:
    """Names as they are recorded in the output: a single one as a text."""
    texts = [printable(name) for name in names or ()]
    return texts[0] if len(texts) == 1 else texts or None


def written_line(targets: list[Path]) -> Lines:
    """The line that lists the files written.

    Parameters
    ----------
    targets : list of Path

    Returns
    -------
    list of one (label, text)
    """
    if not targets:
        return [("written", "nothing; ask for files with -o, --json or --picture")]
    return [("written", ", ".join(str(path) for path in targets))]
