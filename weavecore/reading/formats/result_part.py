"""`ResultPart`: a JSON object of a result, every value of which is checked when it is taken.

Indices are checked against what they refer to, numbers for being finite, texts for characters that no terminal, table
or drawing can hold; the error names the field, such as ``strands[3].id``.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import BadIndex, NonFinite, Unreadable
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.texts import is_hidden

_REMEDY = "The file is damaged, or another version wrote it: weave again with this version of weavecore."

_BEYOND = 1e100
"""Numbers of this size and more are refused: squares and products of lesser ones are finite."""

_WORDS = {"fiu": "a number", "iu": "a whole number", "b": "true or false"}
"""What the kinds of NumPy types are called in errors."""

_LONG = 64
"""Items of a list from which on it is kept as an array."""

MOST_CHARACTERS = 10_000
"""Of a text: the longest that weavecore writes is a note of some hundred."""

_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")

_MOST_SHOWN = 40
"""Characters of a text that an error shows."""


def damaged_result(what: str) -> Unreadable:
    """The error of a result that breaks off or contradicts itself.

    Parameters
    ----------
    what : str
        Without a full stop.
    """
    return Unreadable(what, remedy=_REMEDY)


def with_arrays(values: dict[str, Any]) -> dict[str, Any]:
    """A JSON object whose long lists of numbers are arrays: Python's numbers take ten times their memory.

    Parameters
    ----------
    values : dict
        Changed in place.
    """
    for key, value in values.items():
        if isinstance(value, list) and len(value) >= _LONG and not isinstance(value[0], (str, dict)):
            with contextlib.suppress(ValueError, OverflowError):  # of no one shape: checked when it is taken
                array = np.asarray(value)
                if array.dtype.kind in "fiub":
                    values[key] = array
    return values


class ResultPart:
    """One object of the file and where it is, such as ``lattice`` or ``strands[3]``."""

    def __init__(self, value: Any, where: str = "") -> None:
        if not isinstance(value, dict):
            raise damaged_result(f"{where or 'The file'} is not a JSON object")
        self._values: dict[str, Any] = value
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def names_of_values(self) -> list[str]:
        """The keys, which are identifiers."""
        wrong = next((key for key in self._values if not _KEY.fullmatch(key)), None)
        if wrong is not None:
            raise damaged_result(f"{self.where} has the key {wrong[:_MOST_SHOWN]!r}, which is not a name")
        return list(self._values)

    def path(self, key: str) -> str:
        """Where a value is, as a person finds it."""
        return f"{self.where}.{key}" if self.where else key

    def part(self, key: str) -> ResultPart:
        """The object under a key."""
        return ResultPart(self._take(key), self.path(key))

    def parts(self, key: str) -> Iterator[ResultPart]:
        """The objects in a list."""
        for k, value in enumerate(self.items(key)):
            yield ResultPart(value, f"{self.path(key)}[{k}]")

    def items(self, key: str) -> list[Any]:
        """A list, whatever it holds."""
        value = self._take(key)
        if isinstance(value, np.ndarray):
            value = value.tolist()
        if not isinstance(value, list):
            raise damaged_result(f"{self.path(key)} is not a list")
        return value

    def text(self, key: str) -> str:
        """A text that can be shown."""
        value = self._take(key)
        if not isinstance(value, str):
            raise damaged_result(f"{self.path(key)} is not a text")
        if len(value) > MOST_CHARACTERS:
            raise damaged_result(f"{self.path(key)} has more than {MOST_CHARACTERS:,} characters")
        hidden = next((one for one in value if is_hidden(one)), None)
        if hidden is not None:
            raise damaged_result(f"{self.path(key)} has the character U+{ord(hidden):04X}, which cannot be shown")
        return value

    def word(self, key: str, form: re.Pattern[str], what: str) -> str:
        """A text of a form; ``what`` says in an error what it must be."""
        value = self.text(key)
        if not form.fullmatch(value):
            raise damaged_result(f"{self.path(key)} is {value[:_MOST_SHOWN]!r}, and must be {what}")
        return value

    def texts(self, key: str) -> list[str]:
        """A list of texts."""
        values = self.items(key)
        if not all(isinstance(value, str) for value in values):
            raise damaged_result(f"{self.path(key)} holds something that is not a text")
        return values

    def number(self, key: str, *, least: float = -np.inf) -> float:
        """A finite number, ``least`` or more."""
        value = float(self.floats(key, ())[()])
        if value < least:
            raise damaged_result(f"{self.path(key)} is {value:g}, and must not be below {least:g}")
        return value

    def number_or_none(self, key: str) -> Optional[float]:
        """A finite number, or nothing where the file has null."""
        return None if self._take(key) is None else self.number(key)

    def floats(self, key: str, shape: tuple[int, ...]) -> Floats:
        """An array of finite numbers with the given shape (-1 = any)."""
        array: Floats = self._array(key, shape, "fiu").astype(np.float64)
        bad = np.flatnonzero(~(np.abs(array) < _BEYOND))
        if len(bad):
            raise NonFinite(
                f"{self.path(key)} has numbers that are too large or not finite",
                remedy=_REMEDY,
                ids=bad.tolist(),
                kind="entry",
            )
        return array

    def indices(self, key: str, shape: tuple[int, ...], count: int, *, least: int = 0) -> Ints:
        """An array of whole numbers from ``least`` up to ``count - 1``."""
        array: Ints = self._array(key, shape, "iu").astype(np.int64)
        bad = np.flatnonzero((array < least) | (array >= count))
        if len(bad):
            raise BadIndex(
                f"{self.path(key)} has indices beyond the {count} entries",
                remedy=_REMEDY,
                ids=bad.tolist(),
                kind="entry",
            )
        return array

    def index(self, key: str, count: int) -> int:
        """One whole number from 0 up to ``count - 1``."""
        return int(self.indices(key, (), count)[()])

    def offsets(self, key: str, count: int) -> Ints:
        """Offsets of a ragged array of ``count`` values: they rise from 0 to it."""
        offsets = self.indices(key, (-1,), count + 1)
        if not len(offsets) or offsets[0] != 0 or offsets[-1] != count or (np.diff(offsets) < 0).any():
            raise damaged_result(f"{self.path(key)} does not rise from 0 to {count}")
        return offsets

    def rows(self, key: str, count: int) -> tuple[Ints, Ints]:
        """A list of lists of indices below ``count`` as offsets and values."""
        whole = self._take(key)
        if isinstance(whole, np.ndarray) and whole.ndim == 2 and whole.shape[1]:
            n_rows, n_values = whole.shape
            return n_values * np.arange(n_rows + 1), self.indices(key, whole.shape, count).ravel()
        lists = self.items(key)
        if not all(isinstance(row, list) for row in lists):
            raise damaged_result(f"{self.path(key)} has an entry that is not a list")
        flat = ResultPart({key: [value for row in lists for value in row]}, self.where)
        return offsets_of([len(row) for row in lists]), flat.indices(key, (-1,), count)

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self._take(key)
        if not isinstance(value, bool):
            raise damaged_result(f"{self.path(key)} is neither true nor false")
        return value

    def flag_or_none(self, key: str) -> Optional[bool]:
        """True or false, or nothing where the file has null."""
        return None if self._take(key) is None else self.flag(key)

    def flags(self, key: str, count: int) -> Bools:
        """An array (count,) of true and false."""
        array: Bools = self._array(key, (count,), "b").astype(np.bool_)
        return array

    def names(self, key: str, known: Sequence[str]) -> Ints:
        """Which of the known names each text in a list is."""
        places = {name: k for k, name in enumerate(known)}
        return np.array([self.name_of(name, key, places) for name in self.texts(key)], np.int64)

    def name(self, key: str, places: dict[str, int]) -> int:
        """The number of the name that a text is."""
        return self.name_of(self.text(key), key, places)

    def name_of(self, name: str, key: str, places: dict[str, int]) -> int:
        """The number of a name that stands under a key."""
        if name not in places:
            raise BadIndex(
                f"{self.path(key)} refers to {name[:_MOST_SHOWN]!r}, which is not in the file", remedy=_REMEDY
            )
        return places[name]

    def _take(self, key: str) -> Any:
        if key not in self._values:
            raise damaged_result(f"{self.path(key)} is missing")
        return self._values[key]

    def _array(self, key: str, shape: tuple[int, ...], kinds: str) -> NDArray[Any]:
        try:
            array = np.asarray(self._take(key))
        except (ValueError, OverflowError):
            raise damaged_result(f"{self.path(key)} has rows of different lengths") from None
        if array.shape == (0,) and 0 in [max(n, 0) for n in shape]:
            # An empty list says nothing of its shape, nor of what it would hold.
            array = np.zeros([max(n, 0) for n in shape], "?" if kinds == "b" else "i8")
        if array.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, array.shape)):
            wanted = " × ".join("any" if n == -1 else str(n) for n in shape) or "one number"
            raise damaged_result(f"{self.path(key)} has the shape {array.shape}, not {wanted}")
        if array.dtype.kind not in kinds:
            raise damaged_result(f"{self.path(key)} has an entry that is not {_WORDS[kinds]}")
        return array
