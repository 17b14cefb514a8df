"""The report of a folder: which invariants hold, measured on the written files alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from weavecore.fabricating.csv_tables import Source, Table, listed, yes_no
from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder
from weavecore.fabricating.joint_checks import check_joints
from weavecore.fabricating.rod_checks import check_rods
from weavecore.fabricating.template_checks import check_templates
from weavecore.polling import each

_CHECKS = (check_rods, check_joints, check_templates)

_MOST_IDS = 12
"""Ids shown for a failed check in report.txt; report.csv has all of them."""


def check_files(files: Mapping[str, bytes]) -> list[CheckResult]:
    """Check the files of a folder.

    Parameters
    ----------
    files : mapping of file name to bytes

    Returns
    -------
    list of CheckResult
        One for each invariant, whether it holds or not.
    """
    folder = WrittenFolder(files)
    return [result for check in _CHECKS for result in each(check(folder))]


def encode_report(checks: Sequence[CheckResult], source: Source) -> dict[str, bytes]:
    """Write the report as a table, and as a text.

    Parameters
    ----------
    checks : sequence of CheckResult
    source : Source

    Returns
    -------
    dict of file name to bytes
    """
    rows = [
        (one.invariant, _figure(one.value), _figure(one.limit), yes_no(one.passes), listed(one.ids)) for one in checks
    ]
    table = Table("report", ("invariant", "value", "limit", "pass", "ids"), rows)
    return {"report.csv": table.encode(source), "report.txt": _text(checks, source).encode()}


def summarize_checks(checks: Sequence[CheckResult]) -> str:
    """Count the failed checks in a few words.

    Parameters
    ----------
    checks : sequence of CheckResult

    Returns
    -------
    str
        ``"all 41 checks passed"`` or ``"2 of 41 checks failed"``.
    """
    n_failed = sum(not one.passes for one in checks)
    return f"{n_failed} of {len(checks)} checks failed" if n_failed else f"all {len(checks)} checks passed"


def _text(checks: Sequence[CheckResult], source: Source) -> str:
    width = max(len(one.invariant) for one in checks)
    lines = [source.line("report"), "", f"Measured on the files of this folder: {summarize_checks(checks)}.", ""]
    for one in checks:
        verdict = "ok    " if one.passes else "FAIL  "
        lines.append(f"{verdict}{one.invariant:{width}}  {_figure(one.value):>10}  limit {_figure(one.limit)}")
        if not one.passes and one.ids:
            more = f" and {len(one.ids) - _MOST_IDS} more" if len(one.ids) > _MOST_IDS else ""
            lines.append(f"      {'':{width}}  {', '.join(one.ids[:_MOST_IDS])}{more}")
    return "\n".join([*lines, ""])


def _figure(value: float) -> str:
    """A figure; ``none`` for an infinite limit."""
    return "none" if value == float("inf") else f"{value:.6g}"
