"""The surface that a command works on, and what it says of the files it has written."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Optional

import typer

from weavecore.commands.arguments import Plane
from weavecore.errors import UnitUnknown

if TYPE_CHECKING:
    from weavecore.model import SurfaceMesh

Lines = list[tuple[str, str]]


def read_input(path: Path, layer: Optional[str], name: Optional[str], plane: Optional[Plane]) -> SurfaceMesh:
    """Read the surface, and tell its warnings in one line each."""
    from weavecore import pipeline

    cut_plane = plane.point_and_normal if plane else None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", UnitUnknown)
        surface = pipeline.read_surface(path, layer=layer, object=name, cut_plane=cut_plane, guarded=True)
    for warning in caught:
        typer.echo(f"weavecore: warning: {UnitUnknown.code}: {warning.message}", err=True)
    return surface


def written(targets: list[Path]) -> Lines:
    """The line that tells what was written."""
    if not targets:
        return [("written", "nothing; ask for files with -o, --json or --picture")]
    return [("written", ", ".join(str(path) for path in targets))]
