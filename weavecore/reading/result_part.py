"""`ResultPart`: an object of the JSON result whose values are checked as they are taken."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import BadIndex, NonFinite, Unreadable
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of

REMEDY = "The file is damaged, or another version wrote it: weave again with this version of weavecore."


def damaged_result(what: str) -> Unreadable:
    """The error of a result that breaks off or contradicts itself."""
    return Unreadable(what, remedy=REMEDY)


class ResultPart:
    """One object of the file and where it is, such as ``lattice`` or ``strands[3]``."""

    def __init__(self, value: Any, where: str = "") -> None:
        if not isinstance(value, dict):
            raise damaged_result(f"{where or 'The file'} is no JSON object")
        self._values: dict[str, Any] = value
        self.where = where

    def __contains__(self, key: str) -> bool:
        return key in self._values

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
        if not isinstance(value, list):
            raise damaged_result(f"{self.path(key)} is no list")
        return value

    def text(self, key: str) -> str:
        """A text."""
        value = self._take(key)
        if not isinstance(value, str):
            raise damaged_result(f"{self.path(key)} is no text")
        return value

    def texts(self, key: str) -> list[str]:
        """A list of texts."""
        values = self.items(key)
        if not all(isinstance(value, str) for value in values):
            raise damaged_result(f"{self.path(key)} holds something that is no text")
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
                f"{self.path(key)} holds numbers beyond all measure", remedy=REMEDY, ids=bad.tolist(), kind="entry"
            )
        return array

    def indices(self, key: str, shape: tuple[int, ...], count: int, *, least: int = 0) -> Ints:
        """An array of whole numbers from ``least`` up to ``count - 1``."""
        array: Ints = self._array(key, shape, "iu").astype(np.int64)
        bad = np.flatnonzero((array < least) | (array >= count))
        if len(bad):
            raise BadIndex(
                f"{self.path(key)} names what is beyond the {count} there are",
                remedy=REMEDY,
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
        lists = self.items(key)
        if not all(isinstance(row, list) for row in lists):
            raise damaged_result(f"{self.path(key)} holds something that is no list")
        flat = ResultPart({key: [value for row in lists for value in row]}, self.where)
        return offsets_of([len(row) for row in lists]), flat.indices(key, (-1,), count)

    def flag(self, key: str) -> bool:
        """True or false."""
        value = self._take(key)
        if not isinstance(value, bool):
            raise damaged_result(f"{self.path(key)} is neither true nor false")
        return value

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
            raise BadIndex(f"{self.path(key)} names {name!r}, which is not there", remedy=REMEDY)
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
            raise damaged_result(f"{self.path(key)} holds something that is no {_WORDS[kinds]}")
        return array


_BEYOND = 1e100
"""Squares and products of lesser numbers are finite too."""

_WORDS = {"fiu": "number", "iu": "whole number", "b": "true or false"}
