"""The report: what must hold of the folder, measured on the written files alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from weavecore.fabricating import joint_checks, rod_checks
from weavecore.fabricating.joint_checks import check_conflicts
from weavecore.fabricating.tables import Source, Table, listed, yes_no
from weavecore.fabricating.template_checks import check_templates
from weavecore.fabricating.written_folder import Finding, Folder

CHECKS = (
    rod_checks.check_rods,
    rod_checks.check_pieces,
    rod_checks.check_nesting,
    rod_checks.check_splices,
    joint_checks.check_marks,
    joint_checks.check_nodes,
    joint_checks.check_over_under,
    check_conflicts,
    joint_checks.check_axes,
    joint_checks.check_sequence,
    check_templates,
    rod_checks.check_bom,
)

_MOST_IDS = 12


def check_files(files: Mapping[str, bytes]) -> list[Finding]:
    """All findings on the files of a folder: their names and contents."""
    folder = Folder(files)
    return [finding for check in CHECKS for finding in check(folder)]


def encode_report(findings: Sequence[Finding], source: Source) -> dict[str, bytes]:
    """The report as a table, and as a text to read."""
    rows = [(f.invariant, _figure(f.value), _figure(f.limit), yes_no(f.passes), listed(f.ids)) for f in findings]
    table = Table("report", ("invariant", "value", "limit", "pass", "ids"), rows)
    return {"report.csv": table.encode(source), "report.txt": _text(findings, source).encode()}


def _text(findings: Sequence[Finding], source: Source) -> str:
    failing = [finding for finding in findings if not finding.passes]
    width = max(len(finding.invariant) for finding in findings)
    verdict = f"{len(failing)} of {len(findings)} do not hold" if failing else f"all {len(findings)} hold"
    lines = [source.line("report"), "", f"What was measured on the files of this folder: {verdict}.", ""]
    for finding in findings:
        sign = "ok    " if finding.passes else "LOOK  "
        lines.append(
            f"{sign}{finding.invariant:{width}}  {_figure(finding.value):>10}  at most {_figure(finding.limit)}"
        )
        if not finding.passes and finding.ids:
            more = f" and {len(finding.ids) - _MOST_IDS} more" if len(finding.ids) > _MOST_IDS else ""
            lines.append(f"      {'':{width}}  {', '.join(finding.ids[:_MOST_IDS])}{more}")
    return "\n".join([*lines, ""])


def _figure(value: float) -> str:
    """A figure; ``any`` where there is no limit."""
    return "any" if value == float("inf") else f"{value:.6g}"
