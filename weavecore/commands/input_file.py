"""The surface that a command works on, and what it says of the files it has written."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Callable, Optional, Union

import typer

from weavecore.commands.arguments import Plane
from weavecore.errors import UnitUnknown

if TYPE_CHECKING:
    from weavecore.geometry.arrays import Floats
    from weavecore.model import SurfaceMesh
    from weavecore.units import Length

Lines = list[tuple[str, str]]


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
) -> SurfaceMesh:
    """Read the surface, and tell its warnings in one line each."""
    from weavecore import pipeline

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
        )
    for warning in caught:
        typer.echo(f"weavecore: warning: {UnitUnknown.code}: {warning.message}", err=True)
    return surface


def curves_of(path: Path, names: Sequence[str], *, unit: str, time_limit: Optional[float]) -> list[Floats]:
    """The curves that are meant: first those of the input file, then those of files of their own."""
    from weavecore import pipeline
    from weavecore.reading import CURVE_ENDINGS

    inside = [name for name in names if Path(name).suffix.lower() not in CURVE_ENDINGS]
    files = [name for name in names if name not in inside]
    curves = pipeline.read_curves(path, names=inside, guarded=True, time_limit=time_limit) if inside else []
    for file in files:
        curves += pipeline.read_curves(file, unit=unit, guarded=True, time_limit=time_limit)
    return curves


def told_names(names: Optional[Sequence[str]]) -> Union[str, list[str], None]:
    """Names as they are told in the files that are written: a single one as a text."""
    return names[0] if names and len(names) == 1 else list(names or ()) or None


def told_input(
    path: Path,
    surface: SurfaceMesh,
    *,
    layers: Optional[Sequence[str]],
    objects: Optional[Sequence[str]],
    edge_target: Optional[Length],
) -> dict[str, object]:
    """What was read, as it is told in the files that are written."""
    options = {
        "input": path.name,
        "layer": told_names(layers),
        "object": told_names(objects),
        "edge_target": edge_target.in_unit(surface.unit) if edge_target else None,
    }
    return {key: option for key, option in options.items() if option is not None}


def written(targets: list[Path]) -> Lines:
    """The line that lists the files written."""
    if not targets:
        return [("written", "nothing; ask for files with -o, --json or --picture")]
    return [("written", ", ".join(str(path) for path in targets))]
