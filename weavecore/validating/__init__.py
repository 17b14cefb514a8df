"""Checks what each stage gives against what must always hold.

A *finding* is a figure with a limit, a *report* all the findings about a value.  Nothing
here is shared with the stages that make the values.
"""

from weavecore.validating.report import Finding, Report
from weavecore.validating.validate import validate

__all__ = ["Finding", "Report", "validate"]
