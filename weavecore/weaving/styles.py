"""Styles of going over and under, by name."""

from __future__ import annotations

import re
from dataclasses import dataclass

from weavecore.errors import Unsupported

STACKED, PLAIN, TWILL = "stacked", "plain", "twill"
_TWILL = re.compile(r"twill(?: (\d)/(\d))?")

USUAL = {"triangular": STACKED, "twill": "twill 2/2"}
"""What a pattern is woven in where it is not plain."""


@dataclass(frozen=True)
class Style:
    """How rods go over and under.

    Parameters
    ----------
    name : str
    over, under : int
        How many rods at a time; 0 in a stack, where rods keep to their layers.
    """

    name: str
    over: int
    under: int


def usual_style(pattern: str) -> str:
    """The style in which a pattern is woven."""
    return USUAL.get(pattern, PLAIN)


def style_named(name: str) -> Style:
    """The style of that name: ``"stacked"``, ``"plain"``, ``"twill"``, ``"twill 3/1"``…

    Raises
    ------
    Unsupported
    """
    if name == STACKED:
        return Style(STACKED, 0, 0)
    if name == PLAIN:
        return Style(PLAIN, 1, 1)
    match = _TWILL.fullmatch(name)
    over, under = (int(match[k] or 2) for k in (1, 2)) if match else (0, 0)
    if not (over and under):
        raise Unsupported(f"There is no weave {name!r}", remedy="Take stacked, plain, or twill with counts: twill 2/2.")
    return Style(f"{TWILL} {over}/{under}", over, under)
