"""Numbers in text files, converted all at once; errors name the line and what stands there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weavecore.errors import Unreadable
from weavecore.geometry.arrays import Floats, Ints

_MOST_SHOWN = 60
"""Characters of a line that an error shows."""


def to_floats(words: Sequence[bytes], what: str, lines: Sequence[int] = ()) -> Floats:
    """Convert words to float64.

    Parameters
    ----------
    words : sequence of bytes
    what : str
        What the words belong to, for the error: "vertex", "face".
    lines : sequence of int, optional
        Number of the line of each word, from 1, for the error.

    Returns
    -------
    (n,) float64

    Raises
    ------
    Unreadable
        Where a word is not a number.
    """
    return _to(words, np.float64, what, lines)


def to_ints(words: Sequence[bytes], what: str, lines: Sequence[int] = ()) -> Ints:
    """Convert words to int64.

    Parameters
    ----------
    words : sequence of bytes
    what : str
        What the words belong to, for the error: "vertex", "face".
    lines : sequence of int, optional
        Number of the line of each word, from 1, for the error.

    Returns
    -------
    (n,) int64

    Raises
    ------
    Unreadable
        Where a word is not a whole number.
    """
    return _to(words, np.int64, what, lines)


def to_points(lines: list[bytes], what: str, numbers: Sequence[int] = ()) -> Floats:
    """The first three numbers of each line.

    Parameters
    ----------
    lines : list of bytes
    what : str
        What a line is, for the error.
    numbers : sequence of int, optional
        Number of each line, from 1, for the error.

    Returns
    -------
    (N, 3) float64

    Raises
    ------
    Unreadable
    """
    rows = [line.split(None, 3)[:3] for line in lines]
    short = next((k for k, row in enumerate(rows) if len(row) < 3), None)
    if short is not None:
        raise damaged(f"A {what} has fewer than three coordinates{in_line(numbers, short)}: {shown(lines[short])}")
    words = [word for row in rows for word in row]
    return to_floats(words, what, np.repeat(numbers, 3).tolist()).reshape(-1, 3)


def in_line(numbers: Sequence[int], k: int) -> str:
    """`` in line 12`` where the numbers of lines are known, else nothing.

    Parameters
    ----------
    numbers : sequence of int
    k : int
        Which of them.
    """
    return f" in line {numbers[k]}" if k < len(numbers) else ""


def shown(text: bytes) -> str:
    """What stands in a line, as an error shows it.

    Parameters
    ----------
    text : bytes
    """
    return repr(text[:_MOST_SHOWN].decode("utf-8", "replace").strip())


def damaged(what: str) -> Unreadable:
    """The error of a file that is truncated or contradicts itself.

    Parameters
    ----------
    what : str
        What is wrong, without a full stop.

    Returns
    -------
    Unreadable
    """
    return Unreadable(what, remedy="The file is damaged: export it again.")


def _to(words: Sequence[bytes], dtype: Any, what: str, lines: Sequence[int]) -> NDArray[Any]:
    try:
        return np.array(words, dtype=dtype)
    except (ValueError, OverflowError):
        k = next((k for k, word in enumerate(words) if not _is_number(word, dtype)), 0)
        kind = "a whole number" if dtype is np.int64 else "a number"
        raise damaged(f"A {what} has the entry {shown(words[k])}{in_line(lines, k)}, which is not {kind}") from None


def _is_number(word: bytes, dtype: Any) -> bool:
    try:
        np.array([word], dtype=dtype)
    except (ValueError, OverflowError):
        return False
    return True
