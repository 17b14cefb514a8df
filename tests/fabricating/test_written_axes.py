"""What the checks measure on the points of axes.csv is what the curves are."""

from __future__ import annotations

import numpy as np
import pytest

from fabricated import SHELL, made, table
from weavecore.fabricating import splices as splicing
from weavecore.fabricating.csv_tables import read_table
from weavecore.fabricating.folder_report import check_files
from weavecore.fabricating.splices import Candidate, choose_splices
from weavecore.fabricating.written_axes import WrittenAxes
from weavecore.geometry.arrays import range_maxima
from woven_rods import woven_sample


def axes_of(*rods: np.ndarray, closed: tuple[int, ...] = ()) -> WrittenAxes:
    """Rods through points (n, 3), written as the file has them; a closed one ends at its first point."""
    names, stations, points = [], [], []
    for k, rod in enumerate(rods):
        written = np.round(rod, 6)
        steps = np.linalg.norm(np.diff(written, axis=0), axis=1)
        names += [f"R{k}"] * len(rod)
        stations.append(np.concatenate([[0.0], np.cumsum(steps)]))
        points.append(written)
    place = np.concatenate(points)
    return WrittenAxes.of(names, np.concatenate(stations), place, np.zeros(len(place)), {f"R{k}" for k in closed})


def circle(radius: float, n: int = 200, height: float = 0.0) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, n + 1)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n + 1, height)], axis=1)


def line(a: tuple[float, ...], b: tuple[float, ...], n: int = 11) -> np.ndarray:
    return np.linspace(a, b, n)


def test_rounded_points_of_a_straight_rod_have_no_curvature() -> None:
    axes = axes_of(line((0, 0, 0), (31.4159, 17.1, 3.3), 20))
    assert axes.least_radii.tolist() == [np.inf]


def test_radius_and_length_of_a_ring_are_those_of_the_circle() -> None:
    axes = axes_of(circle(50.0), closed=(0,))
    assert axes.least_radii[0] == pytest.approx(50.0, rel=1e-3)
    assert axes.lengths[0] == pytest.approx(2 * np.pi * 50.0, rel=1e-3)
    # Around its start too.
    assert axes.greatest_curvatures(0, np.array([-10.0]), np.array([10.0]))[0] == pytest.approx(1 / 50.0, rel=1e-3)


@pytest.mark.parametrize("degrees", [90.0, 20.0, 3.0, 0.2])
def test_the_gap_of_two_rods_is_found_at_any_angle(degrees: float) -> None:
    turn = np.radians(degrees)
    other = line((-50 * np.cos(turn), -50 * np.sin(turn), 0.7), (50 * np.cos(turn), 50 * np.sin(turn), 0.7))
    axes = axes_of(line((-50, 0, 0), (50, 0, 0)), other)
    start = np.array([[53.0, 46.5]])
    assert axes.gaps(np.array([[0, 1]]), start, np.array([[10.0, 10.0]]))[0] == pytest.approx(0.7, abs=1e-5)


def test_the_search_for_a_gap_ends_at_its_reach() -> None:
    axes = axes_of(line((-50, 0, 0), (50, 0, 0)), line((0, -50, 0), (0, 50, 0)))
    assert axes.gaps(np.array([[0, 1]]), np.array([[30.0, 50.0]]), np.array([[5.0, 5.0]]))[0] == pytest.approx(15.0)


def test_greatest_values_of_ranges() -> None:
    values = np.random.default_rng(1).random(100)
    first, last = np.random.default_rng(2).integers(0, 101, (2, 300))
    wanted = [values[a:b].max(initial=0.0) for a, b in zip(first, last)]
    assert range_maxima(values, first, last).tolist() == wanted


@pytest.mark.parametrize(("sample", "pattern"), [(SHELL, "triangular"), ("handle", "twill"), ("narrow_neck", "plain")])
def test_weave_tables_and_report_agree_on_clashes_conflicts_and_bending(sample: str, pattern: str) -> None:
    weave, folder = woven_sample(sample, pattern), made(sample, pattern)
    pairs = {frozenset((weave.ids[a], weave.ids[b])) for a, b in weave.clashes.strands.tolist()}
    rows = table(folder, "clashes")
    assert {frozenset(pair) for pair in zip(rows["rod_id"], rows["other_rod"])} == pairs
    assert {frozenset(name.split("+")) for name in folder["rods_that_clash"].ids} == pairs
    assert not {"clash_not_listed", "clash_distance_off_diameters"} & {one.invariant for one in folder.failed}
    assert folder["order_conflicts_listed"].value == len(weave.conflicts)
    bent = {weave.ids[rod] for rod in weave.bending.violations.tolist()}
    assert set(folder["rod_bending_utilisation"].ids) == bent
    rods = table(folder, "rods")
    assert {rod for rod, used in zip(rods["rod_id"], rods.floats("utilisation").tolist()) if used > 1.0} == bent


def test_a_clash_is_measured_in_diameters() -> None:
    folder = made(SHELL)
    thicker = folder.files["rods.csv"].decode().splitlines()
    k = thicker[1].split(",").index("diameter")
    rows = [row.split(",") for row in thicker[2:]]
    for row in rows:
        row[k] = f"{1.05 * float(row[k]):.3f}"
    files = {**folder.files, "rods.csv": "\n".join([*thicker[:2], *map(",".join, rows), ""]).encode()}
    found = {one.invariant: one for one in check_files(files)}
    # Rods 5 % thicker than their gaps clash at nearly every joint.
    assert found["rods_that_clash"].value > 0.9 * len(read_table(files["joints.csv"]))


def place(centre: float, penalty: float) -> Candidate:
    return Candidate(centre, centre - 10, centre + 10, centre - 10, centre + 10, 2, 0.5, penalty=penalty)


def test_a_rod_is_rather_cut_once_more_than_spliced_in_a_bend() -> None:
    bent, good = splicing._PENALTY_BENT, 0.5
    row = [place(200.0, good), place(500.0, bent), place(800.0, good)]
    chosen = choose_splices(row, 1000.0, closed=False, longest=700.0)
    assert chosen is not None
    assert [one.centre for one in chosen] == [200.0, 800.0]
    row = [place(200.0, bent), place(500.0, bent), place(800.0, bent)]
    chosen = choose_splices(row, 1000.0, closed=False, longest=700.0)
    assert chosen is not None
    assert [one.centre for one in chosen] == [500.0]


def test_a_ring_that_is_bent_all_around_is_noted_with_the_reason_and_fails_nothing() -> None:
    folder = made("hemisphere")
    note = folder["splices_bent_throughout"]
    assert note.passes
    for name in note.ids:
        assert name in table(folder, "splices")["splice_id"]
    text = folder.files["report.txt"].decode()
    assert ("note  splices_bent_throughout" in text) == bool(note.ids)
    assert (note.reason.split(".")[0] in " ".join(text.split())) == bool(note.ids)
