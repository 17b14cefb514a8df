"""Libraries that only the drawings need, and what is said where they are missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from weavecore.errors import Unsupported


def need(library: str, what: str) -> Any:
    """The library.

    Raises
    ------
    Unsupported
        Where it is not installed, or not for this version of Python.
    """
    try:
        return import_module(library)
    except ImportError as error:
        raise Unsupported(
            f"Templates as {what} need {library}, which could not be imported: {str(error).splitlines()[0]}",
            remedy='Install it, pip install "weavecore[fabricate]", or ask for others: --templates svg, or none.',
        ) from None
