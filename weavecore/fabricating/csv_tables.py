"""The CSV format of the workshop folder: writing a table and reading it back.

::

    # weavecore 1.2; table bom; unit mm; weave plain; pattern quad; input sha256 …     the statement
    material,diameter,stock_count,…                                                  names of the columns
    gfrp,3.000,24,…                                                                  rows

Fields are separated by commas, names within a field by blanks; numbers have a decimal point.  A field is empty where
a value is missing or infinite.

A spreadsheet evaluates a cell that starts with ``=``, ``+``, ``-`` or ``@`` as a formula, and names come from
files of others, so such a text is written with an apostrophe before it, and so is a text that starts with an
apostrophe; the reader removes it (OWASP, "CSV Injection").  Numbers stay as they are.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256

import numpy as np

from weavecore.geometry.arrays import Floats
from weavecore.model import Weave
from weavecore.polling import each, each_of_many
from weavecore.version import installed_version

LENGTH_DIGITS = 3
"""Lengths are written to a micrometre, so that sums and places can be checked."""

_APOSTROPHE = "'"
_SUSPECT = frozenset("=+-@\t\n'")
_NUMBER = re.compile(r"-?\d+(\.\d+)?")
_MAYBE_FORMULA = re.compile(r"""\r|[,\n](?:[=+@\t']|-(?!\d+(?:\.\d+)?[,\n])|"[=+@\t\n'-])""")
"""Where a written row may have a cell to be guarded: none is overlooked, and few tables have any such place."""


_COMPENSATION = ("COMPENSATED", "SPRINGS_BACK")
"""Codes of the notes that say whether marks allow for spring-back."""


@dataclass(frozen=True)
class Source:
    """What every file of the folder states about its origin.

    Parameters
    ----------
    version : str
        Version of weavecore.
    sha256 : str
        Hash of the JSON result that the folder was made from.
    weave : str
        How rods go over and under: ``"stacked"``, ``"plain"``, ``"twill 2/2"``…
    pattern : str
    compensation : str
        What the compensation of the marks reached; empty where they are those of the drawing.
    """

    version: str
    sha256: str
    weave: str
    pattern: str
    compensation: str = ""

    @classmethod
    def of(cls, weave: Weave, content: bytes) -> Source:
        """The statement on a weave whose JSON result has this content."""
        notes = weave.lattice.latitudes.surface.notes
        compensation = [f"{note.code}: {note.text}" for note in notes if note.code in _COMPENSATION]
        digest = sha256(content).hexdigest()
        return cls(installed_version(), digest, weave.over_under, weave.lattice.pattern, " ".join(compensation))

    def line(self, name: str) -> str:
        """The statement of the file of one table."""
        return (
            f"weavecore {self.version}; table {name}; unit mm; weave {self.weave}; pattern {self.pattern}; "
            f"input sha256 {self.sha256}"
        )


@dataclass(frozen=True)
class Table:
    """A table to be written.

    Parameters
    ----------
    name : str
        Name of the file, without ending.
    columns : sequence of str
    rows : sequence of sequences
        Texts and integers; other numbers as texts from `number` or `mm`.
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]

    def encode(self, source: Source) -> bytes:
        """The bytes of the CSV file."""
        stream = io.StringIO()
        stream.write(f"# {source.line(self.name)}\n")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(self.columns)
        begin = stream.tell()
        writer.writerows(each_of_many(self.rows))
        if _MAYBE_FORMULA.search(stream.getvalue(), begin - 1):
            stream.seek(begin)
            stream.truncate()
            writer.writerows([_without_formula(cell) for cell in row] for row in each_of_many(self.rows))
        return stream.getvalue().encode()


def _without_formula(cell: object) -> object:
    """The cell, as a text that no spreadsheet evaluates."""
    if not isinstance(cell, str) or not (cell[:1] in _SUSPECT or "\r" in cell) or _NUMBER.fullmatch(cell):
        return cell
    # Readers of CSV take a bare carriage return for the end of a row, and Python quotes it from 3.13 on only.
    text = cell.replace("\r", "\n")
    return f"{_APOSTROPHE}{text}" if text[:1] in _SUSPECT else text


@dataclass(frozen=True)
class ReadTable:
    """A table that was read back.

    Parameters
    ----------
    columns : mapping of column name to list of str
    """

    columns: Mapping[str, list[str]]
    _numbers: dict[str, Floats] = field(default_factory=dict, compare=False)

    def __getitem__(self, column: str) -> list[str]:
        return self.columns[column]

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), []))

    def floats(self, column: str) -> Floats:
        """(n,) the numbers of a column; NaN where a field is empty."""
        if column not in self._numbers:
            texts = self.columns[column]
            numbers = np.array(list(map(float, (text or "nan" for text in texts) if "" in texts else texts)))
            numbers.flags.writeable = False
            self._numbers[column] = numbers
        return self._numbers[column]

    def lists(self, column: str) -> list[list[str]]:
        """The names in every field of a column."""
        return [text.split() for text in self.columns[column]]


def read_table(content: bytes) -> ReadTable:
    """Read a CSV file of the folder.

    Parameters
    ----------
    content : bytes
        The whole file, statement included.

    Returns
    -------
    ReadTable
    """
    text = content.decode()
    body = text.split("\n", 1)[1] if text.startswith("#") else text
    names, *rows = each_of_many(csv.reader(io.StringIO(body, newline="")))
    columns = dict(zip(names, map(list, zip(*rows)))) if rows else {name: [] for name in names}
    if _APOSTROPHE in body:
        columns = {name: [cell.removeprefix(_APOSTROPHE) for cell in column] for name, column in each(columns.items())}
    return ReadTable(columns)


def read_statement(content: bytes) -> dict[str, str]:
    """Read the first line of a CSV file: ``unit``, ``weave``, ``pattern``, ``input``…

    Parameters
    ----------
    content : bytes

    Returns
    -------
    dict of str to str
    """
    line = content.split(b"\n", 1)[0].decode().lstrip("# ")
    return {part.split(" ", 1)[0]: part.split(" ", 1)[1] for part in line.split("; ") if " " in part}


def mm(length: float) -> str:
    """Write a length to a micrometre.

    Parameters
    ----------
    length : float
        In millimetres.
    """
    return number(length, LENGTH_DIGITS)


def number(value: float, digits: int) -> str:
    """Write a number with a fixed count of decimals.

    Parameters
    ----------
    value : float
    digits : int
        Count of digits after the decimal point.

    Returns
    -------
    str
        Empty for an infinite value or NaN; zero has no sign.
    """
    if not abs(value) < float("inf"):
        return ""
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def listed(names: Iterable[object]) -> str:
    """Write several names into one field.

    Parameters
    ----------
    names : iterable
        Without blanks in them.
    """
    return " ".join(map(str, names))


def yes_no(value: bool) -> str:
    """Write a truth value as ``yes`` or ``no``.

    Parameters
    ----------
    value : bool
    """
    return "yes" if value else "no"
