"""`Table`: rows of texts under names of columns, as CSV files hold them.

The first line of every file begins with ``#`` and states weavecore's version, the unit, the weave and a hash of the
input; the second has the names of the columns.  Fields are parted by commas, numbers have a decimal point,
several names in one field are parted by blanks.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256

from weavecore.model import Weave
from weavecore.version import installed_version


@dataclass(frozen=True)
class Source:
    """What every file of the folder states.

    Parameters
    ----------
    version : str
        Of weavecore.
    sha256 : str
        Of the JSON result that the folder was made from.
    weave : str
        How rods go over and under.
    pattern : str
    """

    version: str
    sha256: str
    weave: str
    pattern: str

    @classmethod
    def of(cls, weave: Weave, content: bytes) -> Source:
        """The statement on a weave that was read from, or would be written as, a file with this content."""
        return cls(installed_version(), sha256(content).hexdigest(), weave.over_under, weave.lattice.pattern)

    def line(self, name: str) -> str:
        """The statement of one file."""
        return (
            f"weavecore {self.version}; table {name}; unit mm; weave {self.weave}; pattern {self.pattern}; "
            f"input sha256 {self.sha256}"
        )


@dataclass(frozen=True)
class Table:
    """A table.

    Parameters
    ----------
    name : str
        Of the file, without ending.
    columns : sequence of str
    rows : sequence of sequences
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
        writer.writerows(self.rows)
        return stream.getvalue().encode()


def mm(length: float) -> str:
    """A length to a micrometre."""
    return number(length, 3)


def number(value: float, digits: int) -> str:
    """A number with so many digits after the point; nothing where it is not finite; 0 has no sign."""
    if not abs(value) < float("inf"):
        return ""
    text = f"{value:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


def listed(names: Iterable[object]) -> str:
    """Several names in one field."""
    return " ".join(map(str, names))


def yes_no(value: bool) -> str:
    """A truth in a field."""
    return "yes" if value else "no"
