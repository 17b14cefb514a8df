"""Texts from outside, such as names of files, objects and materials, as they can be shown and written anywhere.

Control characters move the cursor of a terminal or end a line of a table; surrogates, which stand for bytes of a file
name in another encoding, can be encoded in no file.
"""

from __future__ import annotations

import unicodedata

REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
"""Stands for what cannot be shown."""

_HIDDEN = frozenset({"Cc", "Cs", "Zl", "Zp", "Co", "Cn"})
"""Unicode categories of control characters, surrogates, separators of lines and paragraphs, and unassigned ones."""

_REORDERING = frozenset("\u200e\u200f\u061c\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
"""Format characters that change the order in which a terminal shows the text after them."""

_GREATEST_COUNT = 1e15
"""Beyond this a count is written as a power of ten."""


def is_hidden(character: str) -> bool:
    """Whether a character must not be shown.

    Parameters
    ----------
    character : str
        One.
    """
    return unicodedata.category(character) in _HIDDEN or character in _REORDERING


def printable(text: str) -> str:
    """The text with `REPLACEMENT` for each character that must not be shown.

    Parameters
    ----------
    text : str

    Returns
    -------
    str
    """
    if text.isascii() and text.isprintable():
        return text
    return "".join(REPLACEMENT if is_hidden(one) else one for one in text)


def rough_count(count: float) -> str:
    """A count for a person to read: ``1,200``, or ``3e+40``.

    Parameters
    ----------
    count : float
    """
    return f"{count:,.0f}" if count < _GREATEST_COUNT else f"{count:.3g}"
