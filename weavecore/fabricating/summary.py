"""What `fabricate` tells when it is done, read off the files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from weavecore.fabricating.report_files import Finding, Folder


@dataclass(frozen=True)
class Fabrication:
    """The files of a folder, and what was found when they were checked.

    Parameters
    ----------
    files : mapping of file name to bytes
    findings : tuple of Finding
        The lines of the report.
    """

    files: Mapping[str, bytes]
    findings: tuple[Finding, ...]

    @property
    def failing(self) -> tuple[Finding, ...]:
        """The findings that do not hold."""
        return tuple(finding for finding in self.findings if not finding.passes)

    def __getitem__(self, invariant: str) -> Finding:
        """The finding of that name."""
        return next(finding for finding in self.findings if finding.invariant == invariant)


def describe_fabrication(made: Fabrication) -> list[tuple[str, str]]:
    """The folder in a few lines: pairs of a label and a text."""
    folder = Folder(made.files)
    bom = folder.table("bom")
    bars, stock = int(bom["stock_count"][0]), float(bom["stock_length"][0])
    mass = f", {float(bom['mass'][0]):.2f} kg" if bom["mass"][0] else ""
    n_pieces, n_splices = len(folder.table("pieces")), len(folder.table("splices"))
    lines = [
        (
            "rods",
            f"{len(folder.table('rods'))}, {float(bom['cut_length'][0]) / 1000:,.1f} m of {bom['material'][0]}{mass}",
        ),
        ("pieces", f"{n_pieces}, {n_splices} splices"),
        ("stock", f"{bars} bars of {stock / 1000:g} m, {made['waste_pct'].value:.1f}% waste"),
        ("joints", f"{len(folder.table('joints'))}, {bom['ties'][0]} ties"),
    ]
    failing = made.failing
    if not failing:
        return [*lines, ("checked", f"all {len(made.findings)} invariants hold")]
    names = ", ".join(finding.invariant for finding in failing)
    return [
        *lines,
        ("checked", f"{len(failing)} of {len(made.findings)} invariants do not hold: {names}; see report.txt"),
    ]
