"""Weave many variants of surfaces, and write what became of each: a table, pictures and a page.

::

    surfaces, lists of options → groups → those without results → workers → results → data.csv, index.html
                                 variants.py  table.py            schedule.py, executors.py, evaluate.py

A result is written as soon as it is known, and found again by its key: a run that was stopped goes on where it was, and
a larger grid weaves only what is new.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Callable, Optional, Union

from weavecore import pipeline
from weavecore.exploring.choose import Choice, choose_variant
from weavecore.exploring.evaluate import FIGURES, SIMULATED, Result
from weavecore.exploring.executors import open_crew
from weavecore.exploring.explore_page import encode_explore_page
from weavecore.exploring.schedule import run_groups
from weavecore.exploring.table import (
    PAGE,
    TABLE,
    Row,
    encode_table,
    find_result,
    keep_result,
    names_of,
    prepare_folder,
    rows_of,
    write_times,
)
from weavecore.exploring.variants import Group, digest_surface, make_grid
from weavecore.files import PathLike, write_together
from weavecore.model import SurfaceMesh
from weavecore.units import METRES, Length

Progress = Callable[[float, str], None]
Input = Union[SurfaceMesh, PathLike]


@dataclass(frozen=True)
class Exploration:
    """Many variants and what became of them.

    Parameters
    ----------
    folder : Path
    rows : tuple of Row
        The table.
    n_woven : int
        Variants that this run has woven; the others were there.
    """

    folder: Path
    rows: tuple[Row, ...]
    n_woven: int

    @property
    def failed(self) -> tuple[Row, ...]:
        """The variants that ended with an error."""
        return tuple(row for row in self.rows if row.error)

    def choose(self, *, spacing: Optional[float] = None) -> Choice:
        """The best variant; see `choose_variant`."""
        return choose_variant(self.rows, spacing=spacing)


def explore(
    inputs: Union[Input, Sequence[Input]],
    folder: PathLike,
    *,
    spacings: Optional[Sequence[Union[float, Length]]] = None,
    patterns: Sequence[str] = ("triangular",),
    rods: Sequence[Union[float, Length, str]] = ("stock",),
    materials: Sequence[str] = ("gfrp",),
    borders: Sequence[Union[Sequence[int], str]] = ("all",),
    simulate: bool = False,
    pages: bool = True,
    time_limit: Optional[float] = None,
    workers: int = 1,
    executor: Optional[Executor] = None,
    scheduler: Optional[str] = None,
    progress: Optional[Progress] = None,
) -> Exploration:
    """Weave every combination of the options, and write a table, pictures and a page of all; see docs/exploring.md.

    Parameters
    ----------
    inputs : SurfaceMesh, path, or sequence of these
    folder : path
        Made where it is not there; in that of an earlier run only what is new is woven.
    spacings : sequence of float or Length, optional
        Numbers are in the unit of each surface; by default the one that `suggest_spacing` gives.
    patterns, materials : sequence of str
    rods : sequence of float, Length or ``"stock"``
        Diameters; ``"stock"`` is the thickest in which nearly all rods can be bent.
    borders : sequence of sequences of int, or ``"all"``
        Numbers of the borders at which distances start.
    simulate : bool
        Whether the rods come to rest, with the borders held, which takes a few times as long.
    pages : bool
        Whether each variant gets a page of its own, of about 1 MB.
    time_limit : float, optional
        Seconds that a variant may take; one that takes longer gets an error, and is tried again in the next run.
    workers : int
        Processes; more than one need ``if __name__ == "__main__":`` in a script.
    executor : concurrent.futures.Executor, optional
        Weaves instead of own processes; stays open.
    scheduler : str, optional
        Address of a Dask scheduler, whose workers weave instead.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels, and what is woven stays.

    Returns
    -------
    Exploration

    Raises
    ------
    Unsupported, NotWritten, and what `read_surface` raises
        What goes wrong with a variant is in its row instead.
    """
    update = progress or (lambda _fraction, _label: None)
    surfaces = _read_surfaces(inputs, spacings)
    grids: list[Group] = []
    for name, surface in surfaces.items():
        wanted = [pipeline.suggest_spacing(surface)] if spacings is None else spacings
        grids += make_grid(
            surface,
            name,
            spacings=wanted,
            patterns=patterns,
            rods=rods,
            materials=materials,
            borders=borders,
            is_simulated=simulate,
        )
    target = Path(folder)
    prepare_folder(target)
    results = {}
    for variant in (variant for group in grids for variant in group.variants):
        found = find_result(target, variant, with_page=pages)
        if found is not None:
            results[variant.key] = found
    missing = [left for left in (_without(group, results) for group in grids) if left.variants]
    by_digest = {digest_surface(surface): surface for surface in surfaces.values()}
    n_found = len(results)
    with open_crew(
        by_digest, with_pages=pages, time_limit=time_limit, workers=workers, executor=executor, scheduler=scheduler
    ) as crew:
        n_all = n_found + sum(len(group.variants) for group in missing)
        update(n_found / max(n_all, 1), f"{n_found} of {n_all} variants")
        seconds = {}
        for result in run_groups(missing, crew):
            keep_result(target, result)
            seconds[result.key] = result.seconds
            results[result.key] = replace(result, picture=None, page=None)
            update(len(results) / n_all, f"{len(results)} of {n_all} variants")
    rows = rows_of(target, [variant for group in grids for variant in group.variants], results)
    write_times(target, seconds)
    _write_table(target, rows, simulate)
    return Exploration(target, rows, len(seconds))


def _write_table(folder: Path, rows: tuple[Row, ...], is_simulated: bool) -> None:
    figures = [*FIGURES, *(SIMULATED if is_simulated else ())]
    page = encode_explore_page(rows, figures)
    write_together({folder / TABLE: encode_table(rows, figures), folder / PAGE: page}, overwrite=True)


def _without(group: Group, known: Mapping[str, Result]) -> Group:
    return Group(tuple(variant for variant in group.variants if variant.key not in known))


def _read_surfaces(
    inputs: Union[Input, Sequence[Input]], spacings: Optional[Sequence[Union[float, Length]]]
) -> dict[str, SurfaceMesh]:
    """Surfaces by the names that they get in the table; a file is meshed finely enough for the least spacing."""
    several = [inputs] if isinstance(inputs, (SurfaceMesh, str, os.PathLike)) else inputs
    least = min(spacings, key=_metres) if spacings else None
    surfaces, names = [], []
    for number, one in enumerate(several, start=1):
        if isinstance(one, SurfaceMesh):
            surfaces.append(one)
            names.append(one.name or f"surface {number}")
        else:
            surfaces.append(pipeline.read_surface(one, spacing=least))
            names.append(Path(one).stem)
    return dict(zip(names_of(names), surfaces))


def _metres(length: Union[float, Length]) -> float:
    return length.value * METRES.get(length.unit, 1.0) if isinstance(length, Length) else length
