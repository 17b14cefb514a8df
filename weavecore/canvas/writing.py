"""Texts about a result that components show, and the file that ``Weave_Export`` writes."""

from __future__ import annotations

import tempfile
import webbrowser
from pathlib import Path
from typing import Any, Optional

from weavecore import pipeline
from weavecore.canvas.solve import Run
from weavecore.errors import Unsupported
from weavecore.model import Equilibrium, Latitudes, Lattice, SurfaceMesh, Weave
from weavecore.reading.raw import counted

_PAGE = ".html"
_MOST_NAMED = 5
"""Rods that a warning names; it counts the others."""


def report_lines(value: Any) -> list[str]:
    """Describe a stage's result and those before it.

    Parameters
    ----------
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium

    Returns
    -------
    list of str
        One line each.

    Raises
    ------
    Unsupported
        Where it is none of them.
    """
    if not isinstance(value, (SurfaceMesh, Latitudes, Lattice, Weave, Equilibrium)):
        raise Unsupported(
            f"A {type(value).__name__} is not a result of a stage",
            remedy="Wire a surface, latitudes, a lattice, a weave or an equilibrium.",
        )
    return [f"{label}: {text}" for label, text in pipeline.describe(value)]


def counts(**numbers: int) -> str:
    """What there is of each noun, for a caption: ``326 nodes, 1 edge``."""
    return ", ".join(counted(n, noun) for noun, n in numbers.items())


def write_value(run: Run, value: Any, path: str, *, overwrite: bool) -> str:
    """Write a stage's result to a file.

    Parameters
    ----------
    run : Run
    value : SurfaceMesh, Latitudes, Lattice or Weave
    path : str
        Absolute, or relative to `Run.folder`; quotes about it are removed.
    overwrite : bool

    Returns
    -------
    str
        The full path.

    Raises
    ------
    Unsupported, OutputExists, NotWritten
    """
    target = str(run.folder / path.strip().strip('"'))
    pipeline.export_together(value, [target], overwrite=overwrite, progress=run.progress)
    return target


def open_page(run: Run, value: Any, path: Optional[str]) -> str:
    """Write a result as a page and open it in the browser.

    Parameters
    ----------
    run : Run
    value : SurfaceMesh, Latitudes, Lattice, Weave or Equilibrium
    path : str, optional
        Absolute, or relative to `Run.folder`; by default a file among the temporary ones.

    Returns
    -------
    str
        The full path.

    Raises
    ------
    Unsupported, NotWritten
    """
    if path is None or not path.strip():
        folder = Path(tempfile.gettempdir()) / "weavecore"
        folder.mkdir(exist_ok=True)
        path = str(folder / "weave.html")
    if Path(path.strip().strip('"')).suffix.lower() != _PAGE:
        raise Unsupported(f"A page ends in {_PAGE}, not as {path} does", remedy=f"Let the path end in {_PAGE}.")
    target = write_value(run, value, path, overwrite=True)
    webbrowser.open(Path(target).as_uri())
    return target


def concerns(weave: Weave) -> list[str]:
    """List what has to be mended before the rods are cut.

    Parameters
    ----------
    weave : Weave

    Returns
    -------
    list of str
        One sentence each; empty where nothing is wrong.
    """
    said = []
    worst = weave.bending.violations
    if len(worst):
        names = ", ".join(weave.ids[s] for s in worst[:_MOST_NAMED].tolist())
        more = f" and {len(worst) - _MOST_NAMED} more" if len(worst) > _MOST_NAMED else ""
        said.append(f"Bent too sharply: {names}{more}. Take thinner rods, another material or a larger spacing.")
    if len(weave.conflicts):
        places = counted(len(weave.conflicts), "place")
        said.append(f"Rods cannot go over and under as the style wants at {places}. Another pattern may help.")
    return said


def check(run: Run, value: Any) -> list[str]:
    """Validate a result; what is broken is put up as a warning too.

    Parameters
    ----------
    run : Run
    value : SurfaceMesh, Latitudes, Lattice or Weave

    Returns
    -------
    list of str
        The findings of `weavecore.validate`, one line each.
    """
    lattice = value.lattice if isinstance(value, Weave) else None
    report = pipeline.validate(value.strands, lattice=lattice) if lattice is not None else pipeline.validate(value)
    for finding in report.broken:
        run.warn(f"{finding}. Please report it with the input.")
    return str(report).splitlines()
