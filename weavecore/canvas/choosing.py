"""A row of an exploration's table for *Weave Choose*: its options, as the other components take them."""

from __future__ import annotations

from typing import NamedTuple, Optional

from weavecore.canvas.solve import Run
from weavecore.errors import BadIndex
from weavecore.exploring import Row, choose_variant, describe_row, read_rows
from weavecore.exploring.variants import ALL, STOCK
from weavecore.units import METRES


class ChosenRow(NamedTuple):
    """Spacing and diameter in the document's unit; None is the default of the component that takes it."""

    spacing: Optional[float] = None
    pattern: Optional[str] = None
    diameter: Optional[float] = None
    material: Optional[str] = None
    borders: Optional[list[int]] = None
    picture: Optional[str] = None
    figures: Optional[list[str]] = None
    reason: Optional[str] = None


def choose_row(run: Run, table: str, number: Optional[int], spacing: Optional[float]) -> ChosenRow:
    """Take a row of a table.

    Parameters
    ----------
    run : Run
    table : str
        Folder of an exploration or its ``data.csv``, absolute or relative to `Run.folder`.
    number : int, optional
        Number of the row, from 1; by default the best one.
    spacing : float, optional
        The spacing that is wished for, in the document's unit.

    Returns
    -------
    ChosenRow
        Empty, with a remark, where there is no such folder or file yet.

    Raises
    ------
    Unreadable, NoSurface
    BadIndex
        Where there is no row of that number.
    """
    path = run.folder / table.strip().strip('"')
    if not path.exists():
        run.remark(f"There is no table at {path} yet: weavecore explore writes one.")
        return ChosenRow()
    rows = read_rows(path)
    if number is None:
        choice = choose_variant(rows, spacing=spacing / _scale(run, rows[0]) if spacing and rows else None)
        row, reason = choice.best, choice.reason
    elif 1 <= number <= len(rows):
        row = rows[number - 1]
        reason = row.error or describe_row(row)
    else:
        raise BadIndex(f"Row {number} does not exist", remedy=f"Take one from 1 to {len(rows)}.")
    if row.error:
        run.warn(row.error)
    folder, scale, inputs = path if path.is_dir() else path.parent, _scale(run, row), row.inputs
    return ChosenRow(
        spacing=row.spacing * scale,
        pattern=inputs["pattern"],
        diameter=None if inputs["rod"] == STOCK else float(inputs["rod"]) * scale,
        material=inputs["material"],
        borders=None if inputs["borders"] == ALL else [int(n) for n in inputs["borders"].split("+")],
        picture=str(folder / row.picture) if row.picture else None,
        figures=[f"{name}: {value:.6g}" for name, value in row.figures.items() if value is not None],
        reason=f"row {row.number}: {reason}",
    )


def _scale(run: Run, row: Row) -> float:
    """Units of the document in one unit of the table; 1 where either is not known."""
    unit = run.document.unit
    return METRES[row.unit] / METRES[unit] if row.unit in METRES and unit in METRES else 1.0
