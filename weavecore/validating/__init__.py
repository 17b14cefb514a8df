"""Checks of the invariants of each stage's result.

A *finding* is a figure with a limit, a *report* all findings about a value.  The checks share no code with the
stages that make the values.
"""

from weavecore.validating.report import Finding, Report
from weavecore.validating.validate import validate

__all__ = ["Finding", "Report", "validate"]
