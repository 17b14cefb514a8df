"""The folder of an exploration: one result for each variant, and the table of all.

::

    data.csv            a row for each variant, in the columns that Design Explorer reads: in:…, out:…, img
    index.html          the page
    times.csv           seconds that each variant took: all other files are the same from run to run
    results/KEY.json    figures and error of a variant
    pictures/KEY.png    pages/KEY.html

A result is there once its .json is, which is written last: a run that is stopped leaves every result whole or absent.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional

from weavecore.errors import NotWritten, Unreadable
from weavecore.exploring.evaluate import Figure, Result
from weavecore.exploring.variants import Variant
from weavecore.files import PathLike, write_together, write_whole

TABLE, PAGE, TIMES = "data.csv", "index.html", "times.csv"
RESULTS, PICTURES, PAGES = "results", "pictures", "pages"
_OWN = (TABLE, PAGE, TIMES, RESULTS, PICTURES, PAGES)
_DRAFT = ".weavecore-"
"""Start of the names of drafts, which a run that was ended by force may leave."""

INPUTS = ("surface", "borders", "spacing", "pattern", "rod", "material")
_IN, _OUT, _IMAGE, _PAGE, _UNIT, _ERROR, _KEY = "in:", "out:", "img", "page", "unit", "error", "key"
_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
"""A cell of text that starts so is evaluated by spreadsheets, unless an apostrophe stands before it."""


@dataclass(frozen=True)
class Row:
    """A variant in the table.

    Parameters
    ----------
    number : int
        From 1, in the order of the table.
    inputs : mapping of str to str
        By the names of `INPUTS`, as they are typed; lengths in ``unit``.
    figures : mapping of str to number or None
        Empty where nothing was woven.
    error : str
        Empty where all went well.
    key, picture, page, unit : str
        Name of the variant's files, paths of its picture and page in the folder (empty where there are none), and
        Rhino's name of the unit of lengths.
    """

    number: int
    inputs: Mapping[str, str]
    figures: Mapping[str, Figure]
    error: str
    key: str
    picture: str
    page: str
    unit: str

    @property
    def spacing(self) -> float:
        """In ``unit``."""
        return float(self.inputs["spacing"])


def prepare_folder(path: Path) -> None:
    """Make the folder, or check that an existing one is that of an exploration.

    Parameters
    ----------
    path : Path

    Raises
    ------
    NotWritten
    """
    try:
        if path.exists():
            strangers = sorted(
                one.name for one in path.iterdir() if one.name not in _OWN and not one.name.startswith(_DRAFT)
            )
            if strangers:
                remedy = "Name a new folder, or that of an exploration."
                raise NotWritten(f"The folder {path} holds other files", remedy=remedy, ids=strangers, kind="file")
        for name in (RESULTS, PICTURES, PAGES):
            (path / name).mkdir(parents=name == RESULTS, exist_ok=True)
    except OSError as error:
        if isinstance(error, NotWritten):
            raise
        remedy = "Check the path and the folder permissions, or name another folder."
        raise NotWritten(f"{path} could not be made: {error.strerror or error}", remedy=remedy) from error


def keep_result(folder: Path, result: Result) -> None:
    """Write the files of a result, the .json last.

    Parameters
    ----------
    folder : Path
    result : Result

    Raises
    ------
    NotWritten
    """
    contents: dict[PathLike, bytes] = {}
    if result.picture is not None:
        contents[folder / PICTURES / f"{result.key}.png"] = result.picture
    if result.page is not None:
        contents[folder / PAGES / f"{result.key}.html"] = result.page
    if result.is_final:
        text = json.dumps({"figures": dict(result.figures), "error": result.error}, indent=1)
        contents[folder / RESULTS / f"{result.key}.json"] = f"{text}\n".encode()
    write_together(contents, overwrite=True)


def find_result(folder: Path, variant: Variant, *, with_page: bool) -> Optional[Result]:
    """The result of an earlier run, without its picture and page; None where it is not there, or not whole.

    Parameters
    ----------
    folder : Path
    variant : Variant
    with_page : bool
        Whether a result without a page does not count, if something was woven.
    """
    key = variant.key
    try:
        found = json.loads((folder / RESULTS / f"{key}.json").read_text("utf-8"))
        result = Result(key, dict(found["figures"]), str(found["error"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None
    needed = [folder / PICTURES / f"{key}.png", *([folder / PAGES / f"{key}.html"] if with_page else [])]
    return result if not result.figures or all(file.is_file() for file in needed) else None


def rows_of(folder: Path, variants: Sequence[Variant], results: Mapping[str, Result]) -> tuple[Row, ...]:
    """The rows of the table.

    Parameters
    ----------
    folder : Path
    variants : sequence of Variant
        In the order of the table.
    results : mapping of str to Result
        By key, one for each variant.
    """
    rows = []
    for number, variant in enumerate(variants, start=1):
        result = results[variant.key]
        texts = (variant.surface, variant.borders_text, f"{variant.spacing:.12g}", variant.pattern, variant.rod_text)
        inputs = dict(zip(INPUTS, (*texts, variant.material)))
        files = [f"{PICTURES}/{result.key}.png", f"{PAGES}/{result.key}.html"]
        picture, page = (name if result.figures and (folder / name).is_file() else "" for name in files)
        rows.append(Row(number, inputs, result.figures, result.error, result.key, picture, page, variant.unit))
    return tuple(rows)


def encode_table(rows: Sequence[Row], figures: Sequence[str]) -> bytes:
    """The table as CSV.

    Parameters
    ----------
    rows : sequence of Row
    figures : sequence of str
        Names of the columns of figures.

    Returns
    -------
    bytes
        UTF-8, with rows that end in a line feed.
    """
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    columns = [*(_IN + name for name in INPUTS), *(_OUT + name for name in figures)]
    writer.writerow([*columns, _IMAGE, _PAGE, _UNIT, _ERROR, _KEY])
    for row in rows:
        cells: list[Any] = [_text(row.inputs[name]) for name in INPUTS]
        cells += [row.figures.get(name) for name in figures]  # None becomes an empty cell.
        writer.writerow([*cells, row.picture, row.page, row.unit, _text(row.error), row.key])
    return stream.getvalue().encode("utf-8", "replace")


def read_rows(folder: Path) -> tuple[Row, ...]:
    """Read the table of an exploration.

    Parameters
    ----------
    folder : Path
        The folder, or its ``data.csv``.

    Returns
    -------
    tuple of Row

    Raises
    ------
    Unreadable
        Where the table is not there, or is not that of an exploration.
    """
    path = folder / TABLE if folder.is_dir() else folder
    remedy = "Name the folder that weavecore explore has written."
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            return tuple(_row(number, cells) for number, cells in enumerate(csv.DictReader(stream), start=1))
    except (KeyError, ValueError, AttributeError, csv.Error) as error:
        raise Unreadable(f"{path} is not the table of an exploration: {error}", remedy=remedy) from error
    except OSError as error:
        raise Unreadable(f"{path} could not be read: {error.strerror or error}", remedy=remedy) from error


def write_times(folder: Path, seconds: Mapping[str, float]) -> None:
    """Add to the times of earlier runs.

    Parameters
    ----------
    folder : Path
    seconds : mapping of str to float
        By key.
    """
    known: dict[str, str] = {}
    with contextlib.suppress(OSError, csv.Error, KeyError, ValueError):
        text = (folder / TIMES).read_text("utf-8")
        known = {cells["key"]: cells["seconds"] for cells in csv.DictReader(text.splitlines())}
    known.update({key: f"{value:.3f}" for key, value in seconds.items()})
    lines = ["key,seconds", *(f"{key},{value}" for key, value in sorted(known.items()))]
    write_whole(folder / TIMES, ("\n".join(lines) + "\n").encode(), overwrite=True)


def _row(number: int, cells: Mapping[str, str]) -> Row:
    inputs = {name: _plain(cells[_IN + name]) for name in INPUTS}
    float(inputs["spacing"])
    figures = {name[len(_OUT) :]: _number(cell) for name, cell in cells.items() if name.startswith(_OUT)}
    figures = figures if any(value is not None for value in figures.values()) else {}
    error, unit = _plain(cells[_ERROR]), cells[_UNIT]
    return Row(number, inputs, figures, error, cells[_KEY], cells[_IMAGE], cells[_PAGE], unit)


def _number(cell: str) -> Figure:
    if not cell:
        return None
    return float(cell) if any(sign in cell for sign in ".en") else int(cell)


def _text(cell: str) -> str:
    return f"'{cell}" if cell.startswith((*_FORMULA_STARTS, "'")) else cell


def _plain(cell: str) -> str:
    return cell.removeprefix("'")


def names_of(surfaces: Iterable[str]) -> list[str]:
    """Names of surfaces, with a number behind those that come again.

    Parameters
    ----------
    surfaces : iterable of str
    """
    names: list[str] = []
    for name in surfaces:
        tried, count = name, 1
        while tried in names:
            count += 1
            tried = f"{name} {count}"
        names.append(tried)
    return names
