"""The report of a folder: which invariants hold, measured on the written files alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import wrap

from weavecore.fabricating.axis_checks import check_axes
from weavecore.fabricating.csv_tables import Source, Table, listed, yes_no
from weavecore.fabricating.folder_reader import CheckResult, WrittenFolder
from weavecore.fabricating.joint_checks import check_joints
from weavecore.fabricating.rod_checks import check_rods
from weavecore.fabricating.splice_checks import check_splices
from weavecore.fabricating.step_checks import check_steps
from weavecore.fabricating.template_checks import check_templates
from weavecore.polling import each

_CHECKS = (check_rods, check_splices, check_joints, check_axes, check_steps, check_templates)

_REASON_WIDTH = 70
"""Characters of a line of a reason in report.txt."""

_MOST_IDS = 12
"""Ids shown for a failed check or a note in report.txt; report.csv has all of them."""


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
        (one.invariant, _figure(one.value), _figure(one.limit), yes_no(one.passes), listed(one.ids), one.reason)
        for one in checks
    ]
    table = Table("report", ("invariant", "value", "limit", "pass", "ids", "reason"), rows)
    return {"report.csv": table.encode(source), "report.txt": _text(checks, source).encode()}


def summarize_checks(checks: Sequence[CheckResult]) -> str:
    """Count the failed checks in a few words.

    Parameters
    ----------
    checks : sequence of CheckResult

    Returns
    -------
    str
        ``"all 41 checks passed"`` or ``"2 of 41 checks failed"``, and how many notes there are.
    """
    n_failed, n_notes = sum(not one.passes for one in checks), sum(one.is_note for one in checks)
    text = f"{n_failed} of {len(checks)} checks failed" if n_failed else f"all {len(checks)} checks passed"
    return f"{text}, {n_notes} note{'s' * (n_notes > 1)}" if n_notes else text


def _text(checks: Sequence[CheckResult], source: Source) -> str:
    width = max(len(one.invariant) for one in checks)
    lines = [source.line("report"), *([source.compensation] if source.compensation else []), ""]
    lines += [f"Measured on the files of this folder: {summarize_checks(checks)}.", ""]
    for one in checks:
        verdict = "note" if one.is_note else "ok" if one.passes else "FAIL"
        lines.append(f"{verdict:6}{one.invariant:{width}}  {_figure(one.value):>10}  limit {_figure(one.limit)}")
        if one.ids and (one.is_note or not one.passes):
            more = f" and {len(one.ids) - _MOST_IDS} more" if len(one.ids) > _MOST_IDS else ""
            lines.append(f"      {'':{width}}  {', '.join(one.ids[:_MOST_IDS])}{more}")
        if one.reason and (one.is_note or not one.passes):
            lines += [f"      {'':{width}}  {line}" for line in wrap(one.reason, _REASON_WIDTH)]
    return "\n".join([*lines, ""])


def _figure(value: float) -> str:
    """A figure; ``none`` for an infinite limit."""
    return "none" if value == float("inf") else f"{value:.6g}"
