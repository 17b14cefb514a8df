"""The report is made from the written files alone, and finds what is wrong with them."""

from __future__ import annotations

import csv
import io
import re
from functools import cache
from typing import Callable

import pytest

from fabricated import PATTERNS, SHELL, made, make, table
from open_cloth import woven_cloth
from weavecore import pipeline
from weavecore.fabricating.csv_tables import Source
from weavecore.fabricating.folder_report import check_files
from weavecore.fabricating.workshop import Workshop
from weavecore.fabricating.workshop_folder import Fabrication, fabricate_weave
from weavecore.weaving.sequence import find_sequence
from woven_rods import tube_latitudes
from woven_tube import tube_lattice

WITH_TEMPLATES = Workshop(stock=600.0, templates=("dxf", "svg"))

MODEL = {
    "rod_bending_utilisation",
    "rod_min_radius_overstated",
    "splice_near_another",
    "splice_not_held",
    "rods_that_clash",
}
"""Findings on the weave itself, which the folder cannot help."""

Rows = list[list[str]]


@pytest.mark.parametrize("pattern", PATTERNS)
def test_a_folder_breaks_none_of_its_own_promises(pattern: str) -> None:
    folder = made(SHELL, pattern)
    assert {finding.invariant for finding in folder.failed} <= MODEL
    report = table(folder, "report")
    assert report["invariant"] == [finding.invariant for finding in folder.checks]
    assert report["pass"].count("no") == len(folder.failed)
    for finding in folder.failed:
        assert f"FAIL  {finding.invariant}" in folder.files["report.txt"].decode()


@pytest.mark.parametrize("name", ["side", "hole", "slit"])
@pytest.mark.parametrize("pattern", ["triangular", "plain", "kagome"])
def test_a_folder_of_a_weave_with_selvedges_breaks_none_of_its_own_promises(name: str, pattern: str) -> None:
    assert {finding.invariant for finding in make(woven_cloth(name, pattern)).failed} <= MODEL


def test_a_tube_of_thin_rods_has_nothing_to_look_at() -> None:
    folder = thin()
    assert [(f.invariant, f.value, f.ids) for f in folder.failed] == []
    assert "all" in folder.files["report.txt"].decode()


def edited(files: dict[str, bytes], name: str, edit: Callable[[Rows], object]) -> dict[str, bytes]:
    """The files, with the rows of a table (the first one its header) changed."""
    first, _, rest = files[f"{name}.csv"].decode().partition("\n")
    rows = list(csv.reader(io.StringIO(rest)))
    edit(rows)
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return {**files, f"{name}.csv": f"{first}\n{stream.getvalue()}".encode()}


def put(row: int, column: str, value: str) -> Callable[[Rows], object]:
    return lambda rows: rows[row].__setitem__(rows[0].index(column), value)


def add(row: int, column: str, by: float) -> Callable[[Rows], object]:
    def edit(rows: Rows) -> None:
        k = rows[0].index(column)
        rows[row][k] = f"{float(rows[row][k]) + by:.3f}"

    return edit


def swap(row: int, column: str) -> Callable[[Rows], object]:
    def edit(rows: Rows) -> None:
        k = rows[0].index(column)
        rows[row][k] = " ".join(reversed(rows[row][k].split()))

    return edit


def turn(row: int) -> Callable[[Rows], object]:
    def edit(rows: Rows) -> None:
        k = rows[0].index("over_under")
        rows[row][k] = {"over": "under", "under": "over"}[rows[row][k]]

    return edit


def conflict(rows: Rows) -> None:
    """A joint says of one of its rods that it does not go on as it should."""
    rows[5][rows[0].index("conflicts")] = rows[5][rows[0].index("rods")].split()[0]


def move_joint(rows: Rows) -> None:
    """A joint is tied in the first step, when its rods do not stand yet."""
    k = rows[0].index("joints_to_tie")
    last = max(row for row in range(1, len(rows)) if rows[row][k])
    names = rows[last][k].split()
    rows[last][k], rows[1][k] = " ".join(names[1:]), names[0]


def pile_up(rows: Rows) -> None:
    """All joints are tied in the last step."""
    k = rows[0].index("joints_to_tie")
    joints = [joint for row in rows[1:] for joint in row[k].split()]
    for row in rows[1:]:
        row[k] = ""
    rows[-1][k] = " ".join(joints)


def forget_last_mark(rows: Rows) -> None:
    """The last tick of the last piece has no row."""
    piece, number = rows[0].index("piece_id"), rows[0].index("no")
    last = rows[-1][piece], rows[-1][number]
    while (rows[-1][piece], rows[-1][number]) == last:
        rows.pop()


BREAKS = [
    ("rods", lambda rows: rows.append(["X99", *rows[-1][1:]]), "rods_without_axis"),
    ("rods", add(1, "length", 0.3), "rod_length_off_its_axis_mm"),
    ("rods", put(1, "allowed_radius", "99999"), "rod_bending_utilisation"),
    ("rods", put(1, "min_radius", "99999"), "rod_min_radius_overstated"),
    ("pieces", add(1, "cut_length", 1.0), "piece_cut_length_off_mm"),
    ("pieces", put(1, "cut_length", "600.1"), "piece_longest_mm"),
    ("pieces", lambda rows: rows.pop(), "rod_not_covered_by_pieces_mm"),
    ("nesting", swap(1, "pieces"), None),
    ("nesting", lambda rows: rows.append(rows[-1]), "piece_not_cut_once"),
    ("nesting", put(1, "stock_id", "S999"), "piece_on_another_bar"),
    ("nesting", add(1, "used", 5.0), "bar_sums_off_mm"),
    ("pieces", add(1, "cut_length", 590.0), "bar_used_mm"),
    (
        "nesting",
        lambda rows: rows.extend([[f"T{k}", "", "0", "600"] for k in range(60)]),
        "bars_beyond_the_lower_bound",
    ),
    ("splices", put(1, "n_crossings", "1"), "splice_not_held"),
    ("splices", put(1, "length", "10"), "splice_overlap_too_short"),
    ("splices", put(1, "utilisation", "0.9"), "splice_bent_avoidably"),
    ("splices", put(1, "utilisation", "0.001"), "splice_utilisation_understated"),
    ("splices", add(1, "from", 20.0), "splice_nearest_off_mm"),
    ("splices", put(1, "nearest_splice", "3"), "splice_near_another"),
    ("marks", add(3, "station", 0.2), "mark_sides_differ_mm"),
    ("marks", add(3, "from_start", 0.2), "mark_off_its_station_mm"),
    ("axes", add(1, "x", 4.0), "node_rebuilt_off_mm"),
    ("joints", add(4, "x", 0.3), "node_rebuilt_off_mm"),
    ("marks", turn(3), "joint_without_one_over"),
    ("joints", swap(4, "order"), "joint_order_contradicts_marks"),
    ("joints", conflict, "order_conflict_listed_wrongly"),
    ("marks", turn(3), "order_conflict_not_listed"),
    ("rods", put(1, "diameter", "0.100"), "joint_gap_diameters"),
    ("rods", put(1, "diameter", "8.000"), "rods_that_clash"),
    ("rods", put(1, "diameter", "8.000"), "clash_not_listed"),
    ("clashes", lambda rows: rows.append(["L01", "A01", "0.3", "0", "0", "0"]), "clash_distance_off_diameters"),
    ("sequence", put(2, "piece", "A01"), "piece_not_set_once"),
    ("sequence", add(2, "to", -5.0), "piece_not_set_once"),
    ("sequence", put(2, "after", "50"), "piece_set_before_what_it_needs"),
    ("rods", put(-3, "diameter", "1.500"), "bar_of_two_diameters"),
    ("rods", put(1, "generation", "7"), "ring_set_before_its_parents"),
    ("sequence", put(3, "joints_to_tie", "J0001 J0001"), "joint_not_tied_once"),
    ("sequence", move_joint, "joint_tied_before_its_rods_are_set"),
    ("sequence", put(2, "ties", "99"), "step_ties_off"),
    ("sequence", pile_up, "step_ties"),
    ("machine", add(3, "millimetres", 0.01), "machine_row_off_its_mark"),
    ("machine", put(3, "code", "J9999"), "machine_row_off_its_mark"),
    ("machine", lambda rows: rows.pop(), "machine_row_off_its_mark"),
    ("marks", forget_last_mark, "dxf_tick_off_its_mark_mm"),
    ("marks", add(4, "from_start", 0.02), "svg_tick_off_its_mark_mm"),
    ("bom", add(1, "stock_count", 1), "bom_bars_off"),
    ("bom", add(1, "ties", -1), "bom_ties_off"),
    ("bom", add(1, "labels", 1), "bom_labels_off"),
    ("bom", add(1, "cut_length", 9.0), "bom_cut_length_off_mm"),
    ("bom", add(1, "mass", 0.1), "bom_mass_off_kg"),
    ("bom", put(1, "tie_size", "20"), "tie_longer_than_bought_mm"),
]


@pytest.mark.parametrize(("name", "edit", "invariant"), BREAKS, ids=[f"{name}-{found}" for name, _, found in BREAKS])
def test_what_is_wrong_in_a_file_is_found(name: str, edit: Callable[[Rows], object], invariant: str | None) -> None:
    files = dict(thin().files)
    failing = {finding.invariant for finding in check_files(edited(files, name, edit)) if not finding.passes}
    assert failing == set() if invariant is None else invariant in failing


@cache
def thin() -> Fabrication:
    """A small tube of thin rods, plainly woven: two rods at every joint, and nothing to look at."""
    lattice = pipeline.link(tube_latitudes(150.0, 240.0, 60.0), pattern="plain")
    return make(pipeline.weave(lattice, rod_diameter=0.8, material="gfrp-short"), WITH_TEMPLATES)


def test_every_finding_can_be_broken() -> None:
    tested = {invariant for _, _, invariant in BREAKS}
    told = {finding.invariant for finding in thin().checks}
    without_limit = {"waste_pct", "order_conflicts_listed", "splices_bent_throughout"}
    assert told - without_limit - tested == {"dxf_scale_bar_off_mm", "svg_scale_bar_off_mm"}


@pytest.mark.parametrize("name", ["dxf", "svg"])
def test_a_template_that_is_not_1_to_1_is_found(name: str) -> None:
    files = dict(thin().files)
    content = files[f"templates.{name}"].decode()
    number = (
        r"(?<=\n11\n)100\.0000(?=\n)" if name == "dxf" else r'(?<=x2=")(\d+\.\d+)(?=" y2="[\d.]+" stroke-width="0.35")'
    )
    content, count = re.subn(number, "1.0", content)
    assert count
    files[f"templates.{name}"] = content.encode()
    failing = {finding.invariant for finding in check_files(files) if not finding.passes}
    assert f"{name}_scale_bar_off_mm" in failing


def test_rods_from_selvedge_to_selvedge_are_set_after_their_parents_too() -> None:
    folder = make(woven_cloth("side", "plain"))
    rows = table(folder, "sequence")
    second = [k for k, action in enumerate(rows["action"]) if action == "set rod"][1]
    at = table(folder, "rods")["rod_id"].index(rows["rod"][second])
    files = edited(dict(folder.files), "rods", put(at + 1, "generation", "99"))
    failing = {finding.invariant for finding in check_files(files) if not finding.passes}
    assert "ring_set_before_its_parents" in failing
    assert "ring_set_before_its_parents" not in {finding.invariant for finding in folder.failed}


def test_offenders_are_named() -> None:
    files = edited(dict(thin().files), "joints", add(4, "x", 0.3))
    joint = table(thin(), "joints")["joint_id"][3]
    found = next(finding for finding in check_files(files) if finding.invariant == "node_rebuilt_off_mm")
    assert found.ids == (joint,)
    assert found.value == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize(
    ("name", "pattern"), [("handle", "twill"), ("closed_body", "kagome"), ("hourglass", "triangular")]
)
def test_rods_that_cross_themselves_and_closed_surfaces_break_no_promise(name: str, pattern: str) -> None:
    workshop = Workshop(stock=700.0, splice="sleeve", kerf=1.5, templates=("svg",))
    assert {finding.invariant for finding in made(name, pattern, workshop).failed} <= MODEL


def test_a_model_in_metres_breaks_no_promise_but_those_of_its_thick_rods() -> None:
    weave = pipeline.weave(tube_lattice())
    source = Source("", "", weave.over_under, weave.lattice.pattern)
    folder = fabricate_weave(weave, find_sequence(weave), scale=1000.0, workshop=Workshop(), source=source)
    assert {finding.invariant for finding in folder.failed} <= MODEL


def test_a_twill_that_is_not_one_is_found() -> None:
    lattice = pipeline.link(tube_latitudes(150.0, 240.0, 60.0), pattern="twill")
    files = dict(make(pipeline.weave(lattice, rod_diameter=0.8, over_under="twill 2/2")).files)

    def n_not_listed(contents: dict[str, bytes]) -> float:
        return next(f.value for f in check_files(contents) if f.invariant == "order_conflict_not_listed")

    assert n_not_listed(files) == 0
    told_otherwise = {name: content.replace(b"weave twill 2/2", b"weave twill 3/1") for name, content in files.items()}
    assert n_not_listed(told_otherwise) > 10
