"""Processor seconds and memory of whole commands, of this checkout and, taking turns with it, of another one.

    python benchmarks/processes.py                                                # prints the table
    python benchmarks/processes.py --beside ../before --write docs/benchmarks.md  # and keeps it there

A command is a process of its own; its children, such as the one that reads a file, count too.  Modules are compiled
before.  Of several turns the least counts: load of the machine lengthens all of them.
"""

from __future__ import annotations

import argparse
import datetime as dt
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "sample_files"
BEGIN, END = "<!-- processes -->", "<!-- end of processes -->"
SHELL, SPACING = "shell_2400x1600.3dm", 60.0
"""The shell that is fabricated, and the spacing that is chosen for it, in millimetres."""

ONCE_FROM = 10.0
"""Commands that take more seconds take one turn."""


@dataclass
class Row:
    """A command, and the least seconds and the most megabytes that it took of each checkout."""

    name: str
    arguments: list[str]
    seconds: dict[Path, float] = field(default_factory=dict)
    megabytes: dict[Path, float] = field(default_factory=dict)


def main() -> None:
    """Print the table as Markdown, and keep it."""
    parser = argparse.ArgumentParser(description="Processor seconds and memory of whole commands.")
    parser.add_argument("--beside", type=Path, help="another checkout, the version before")
    parser.add_argument("--turns", type=int, default=3, help="how often each command runs")
    parser.add_argument("--parts", type=int, nargs="*", default=[1, 2, 4], help="parts of the spacing to fabricate at")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    options = parser.parse_args()
    checkouts = [one.resolve() for one in (options.beside, ROOT) if one]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [*commands(), *(fabrication(folder, part) for part in options.parts)]
        for checkout in checkouts:
            subprocess.run([sys.executable, "-m", "compileall", "-q", str(checkout / "weavecore")], check=True)
        for row in rows:
            measure(row, checkouts, folder, options.turns)
    text = report(rows, checkouts)
    print(text)
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def commands() -> list[Row]:
    """Those that need nothing made before."""
    hemisphere = str(SAMPLES / "hemisphere.3dm")
    return [
        Row("`weavecore --help`", ["--help"]),
        Row("`weavecore info hemisphere.3dm`", ["info", hemisphere]),
        Row("`weavecore weave hemisphere.3dm --json h.json`", ["weave", hemisphere, "--json", "h.json"]),
        Row(
            "`weavecore weave hemisphere.3dm -o h.3dm --picture h.png`",
            ["weave", hemisphere, "-o", "h.3dm", "--picture", "h.png"],
        ),
    ]


def fabrication(folder: Path, part: int) -> Row:
    """The workshop folder of the shell at a part of its spacing, from a result that is woven here."""
    made, length = f"shell_{part}.json", f"{SPACING / part:g}"
    weave = ["weave", str(SAMPLES / SHELL), "--json", made, "--spacing", length]
    run(ROOT, folder, [*weave, "--time-limit", "900", "-q"])
    name = f"`weavecore fabricate` of `{SHELL}` at a spacing of {length} mm"
    return Row(name, ["fabricate", made, "-o", f"folder_{part}", "--time-limit", "900"])


def measure(row: Row, checkouts: list[Path], folder: Path, turns: int) -> None:
    """Run the command of a row, of one checkout after the other, and keep the best."""
    for turn in range(turns):
        for checkout in checkouts:
            if turn and row.seconds[checkout] > ONCE_FROM:
                continue
            overwrite = [] if row.arguments[0] in ("--help", "info") else ["-q", "--overwrite"]
            seconds, megabytes = run(checkout, folder, [*row.arguments, *overwrite])
            row.seconds[checkout] = min(row.seconds.get(checkout, seconds), seconds)
            row.megabytes[checkout] = max(row.megabytes.get(checkout, 0.0), megabytes)


def run(checkout: Path, folder: Path, arguments: list[str]) -> tuple[float, float]:
    """Processor seconds and megabytes of a command and of its children."""
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    command = [sys.executable, "-m", "weavecore", *arguments]
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with {process.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def version(checkout: Path) -> str:
    """The commit that is checked out, as far as git knows it."""
    done = subprocess.run(["git", "describe", "--always"], cwd=checkout, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def report(rows: list[Row], checkouts: list[Path]) -> str:
    """The table, as Markdown."""
    names = ("before", "now") if len(checkouts) > 1 else ("now",)
    headings = " | ".join(f"{name}, commit {version(one)}" for name, one in zip(names, checkouts))
    lines = [
        f"{dt.date.today().isoformat()}, `python benchmarks/processes.py`: processor seconds, and memory in MB.",
        "",
        f"| command | {headings} |",
        "|---" * (len(checkouts) + 1) + "|",
    ]
    for row in rows:
        cells = [f"{row.seconds[one]:.2f} ({row.megabytes[one]:,.0f})" for one in checkouts]
        lines.append(f"| {row.name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
