"""The version of weavecore that is installed."""

from __future__ import annotations


def installed_version() -> str:
    """The version; ``0+unknown`` where weavecore is used from its source and was never installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("weavecore")
    except PackageNotFoundError:
        return "0+unknown"
