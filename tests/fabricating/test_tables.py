"""What each table says, held against the weave that it was made from."""

from __future__ import annotations

import csv
import io
from collections import Counter

import numpy as np
import pytest
from scipy.interpolate import BSpline

from fabricated import PATTERNS, SHELL, made, make, table
from open_cloth import woven_cloth
from weavecore import pipeline
from weavecore.fabricating.csv_tables import Source, Table, number, read_table
from weavecore.fabricating.plan import plan_rods
from weavecore.fabricating.ties import find_ties, size_of_tie
from weavecore.fabricating.workshop import Workshop
from weavecore.fabricating.workshop_folder import TABLES, fabricate_weave
from weavecore.model import Material
from weavecore.weaving.sequence import find_sequence
from woven_rods import woven_sample, woven_tube

COLUMNS = {
    "rods": (
        "rod_id family generation closed length n_crossings min_radius station_at_min utilisation material diameter "
        "allowed_radius"
    ),
    "pieces": "piece_id rod_id seq from to cut_length splice_start splice_end stock_id",
    "nesting": "stock_id pieces used offcut",
    "marks": "piece_id no station other_rod other_station joint_id over_under side",
    "joints": "joint_id x y z nx ny nz rods order angle ties tie_length",
    "axes": "rod_id station x y z layer_offset",
    "sequence": "step action rod joints_to_tie after",
    "bom": "material diameter stock_count ties mass",
    "report": "invariant value limit pass ids",
}


def test_every_table_has_its_columns_first_and_states_unit_version_and_hash() -> None:
    folder = made(SHELL)
    assert {f"{name}.csv" for name in TABLES} == {name for name in folder.files if name.endswith(".csv")}
    for name, columns in COLUMNS.items():
        first, header, *rest = folder.files[f"{name}.csv"].decode().splitlines()
        assert header.split(",")[: len(columns.split())] == columns.split(), name
        assert first.startswith("# weavecore 1.2.3; ")
        assert "unit mm" in first
        assert f"input sha256 {'0' * 64}" in first
        assert all(len(row) == header.count(",") + 1 for row in csv.reader(rest)), name


def test_lengths_are_those_of_the_splines() -> None:
    weave, rods = woven_sample(SHELL, "kagome"), table(made(SHELL, "kagome"), "rods")
    assert tuple(rods["rod_id"]) == weave.ids
    for s, length in enumerate(rods.floats("length").tolist()):
        spline = BSpline(*weave.axes.bspline(s), 3)
        at = np.linspace(0, weave.axes.ends[s], 4000)
        steps = np.linalg.norm(np.diff(spline(at), axis=0), axis=1)
        assert abs(steps.sum() - length) < 0.1


def test_lengths_are_millimetres_whatever_the_unit_of_the_model() -> None:
    weave = woven_tube("kagome")
    source = Source("1", "", "plain", "kagome")
    args = (weave, find_sequence(weave))
    long = Workshop(stock=2e4, templates=())
    one = fabricate_weave(*args, scale=1.0, workshop=long, source=source)
    inches = fabricate_weave(*args, scale=2.54, workshop=long, source=source)
    for name, columns in (("rods", ("length", "min_radius", "diameter")), ("joints", ("x", "y", "z"))):
        for column in columns:
            assert np.allclose(table(inches, name).floats(column), 2.54 * table(one, name).floats(column), atol=0.02)
    assert np.array_equal(table(inches, "rods").floats("utilisation"), table(one, "rods").floats("utilisation"))


@pytest.mark.parametrize("pattern", PATTERNS)
def test_marks_tell_the_order_of_every_pair_of_rods_once_from_each_side(pattern: str) -> None:
    weave, marks = woven_sample("narrow_neck", pattern), table(made("narrow_neck", pattern), "marks")
    told = {
        (int(joint[1:]), rod, other, side)
        for joint, rod, other, side in zip(*(marks[c] for c in ("joint_id", "rod_id", "other_rod", "over_under")))
        if other
    }
    expected = set()
    for node, over, under in weave.crossings.tolist():
        expected |= {
            (node, weave.ids[over], weave.ids[under], "over"),
            (node, weave.ids[under], weave.ids[over], "under"),
        }
    assert told == expected


def test_marks_count_from_the_start_of_the_piece() -> None:
    folder = made(SHELL)
    marks, pieces = table(folder, "marks"), table(folder, "pieces")
    length = dict(zip(pieces["piece_id"], pieces.floats("cut_length").tolist()))
    last: dict[str, tuple[int, float]] = {}
    for piece, no, at in zip(marks["piece_id"], map(int, marks["no"]), marks.floats("from_start").tolist()):
        before = last.get(piece, (0, 0.0))
        assert no in (before[0], before[0] + 1)
        assert before[1] <= at <= length[piece] + 0.001
        last[piece] = (no, at)
    assert last.keys() == length.keys()


def test_the_side_is_where_the_other_rod_goes_on_seen_from_outside() -> None:
    """On an upright tube seen from outside, a rod that rises crosses a ring that runs to the right to its left."""
    weave = woven_tube("quad")
    folder = make(weave)
    marks = table(folder, "marks")
    tangents = weave.axes.derivatives
    for piece, other, joint, side in zip(*(marks[c] for c in ("rod_id", "other_rod", "joint_id", "side"))):
        if not other:
            continue
        node = int(joint[1:])
        rod, crossing = weave.ids.index(piece), weave.ids.index(other)
        at, there = (int(np.flatnonzero(weave.strands.strand(s) == node)[0]) for s in (rod, crossing))
        along = tangents[weave.strands.offsets[rod] + at]
        across = tangents[weave.strands.offsets[crossing] + there]
        outward = np.append(weave.lattice.nodes[node][:2], 0.0)
        assert side == ("left" if np.cross(along, across) @ outward > 0 else "right")


def test_joints_have_the_angle_and_ties_that_reach_around() -> None:
    weave = woven_tube("quad")
    ties = find_ties(plan_rods(weave, 1.0))
    assert np.allclose(ties.angle, 90.0, atol=3.0)
    assert set(ties.count) == {1}
    # At right angles the tie runs along the diagonal: ellipses √2 d wide, and twice the gap of the axes, d.
    assert np.allclose(ties.length - 25.0, 3.8202 * 5.0 + 10.0, rtol=0.03)
    assert (size_of_tie(99.0), size_of_tie(100.5), size_of_tie(801.0)) == (100.0, 140.0, 900.0)


def test_three_rods_at_a_joint_take_two_ties_that_go_around_all() -> None:
    joints = table(make(woven_tube("triangular")), "joints")
    assert Counter(len(row) for row in joints.lists("rods")).most_common(1)[0][0] == 3
    for row, ties in zip(joints.lists("order"), joints["ties"]):
        assert int(ties) == len(row) - 1


def test_conflicts_of_the_weave_stand_at_their_joints() -> None:
    weave = woven_sample("narrow_neck", "plain")
    joints = table(make(weave), "joints")
    assert len(weave.conflicts)
    told = Counter(
        (rod, int(joint[1:])) for joint, row in zip(joints["joint_id"], joints.lists("conflicts")) for rod in row
    )
    assert told == Counter((weave.ids[s], node) for s, node, _ in weave.conflicts.tolist())


def test_axes_are_so_dense_that_straight_lines_keep_to_them() -> None:
    weave, axes = woven_sample(SHELL, "triangular"), table(made(SHELL), "axes")
    points = np.stack([axes.floats(name) for name in ("x", "y", "z")], axis=1)
    rods = np.array(axes["rod_id"])
    for s in range(0, len(weave), 7):
        mine = points[rods == weave.ids[s]]
        spline = BSpline(*weave.axes.bspline(s), 3)
        at = spline(np.linspace(0, weave.axes.ends[s], 1500))
        a, b = mine[:-1], mine[1:]
        t = np.clip(((at[:, None] - a) * (b - a)).sum(2) / ((b - a) ** 2).sum(1), 0, 1)
        off = np.linalg.norm(a + t[..., None] * (b - a) - at[:, None], axis=2).min(1)
        assert off.max() < 0.03


def test_the_sequence_sets_borders_first_and_ties_each_joint_once() -> None:
    weave, folder = woven_sample(SHELL, "triangular"), made(SHELL)
    sequence, rods = table(folder, "sequence"), table(folder, "rods")
    borders = [
        rod
        for rod, generation, closed in zip(rods["rod_id"], rods["generation"], rods["closed"])
        if generation == "0" and closed == "yes"
    ]
    assert sorted(sequence["rod"][: len(borders)]) == sorted(borders)
    assert set(sequence["action"][: len(borders)]) == {"set ring"}
    tied = [joint for row in sequence.lists("joints_to_tie") for joint in row]
    assert sorted(tied) == sorted(table(folder, "joints")["joint_id"])
    step = dict(zip(sequence["rod"], sequence["step"]))
    assert all(int(before) < int(own) for own, row in zip(sequence["step"], sequence.lists("after")) for before in row)
    assert len(step) == len(weave)


def test_what_selvedges_cut_open_is_set_as_rods_and_what_stays_closed_as_rings() -> None:
    weave = woven_cloth("slit", "plain")
    rows, closed = table(make(weave), "sequence"), dict(zip(weave.ids, weave.strands.closed.tolist()))
    for rod, action in zip(rows["rod"], rows["action"]):
        wanted = "weave in" if rod[0] != "L" else "set ring" if closed[rod] else "set rod"
        assert action == wanted
    assert {"set ring", "set rod", "weave in"} == set(rows["action"])


def test_the_mass_is_that_of_the_cut_rods() -> None:
    weave, bom = woven_sample(SHELL, "triangular"), table(made(SHELL), "bom")
    volume = np.pi / 4 * weave.rod_diameter**2 * table(made(SHELL), "pieces").floats("cut_length").sum()
    assert float(bom["mass"][0]) == pytest.approx(volume * 1e-9 * 1850, rel=1e-3)
    assert bom["material"] == ["gfrp"]


def test_a_material_without_density_has_no_mass() -> None:
    own = Material("own", modulus=20.0, strength=300.0)
    folder = make(pipeline.weave(woven_tube("quad").lattice, rod_diameter=5.0, material=own))
    assert table(folder, "bom")["mass"] == [""]
    assert not [f for f in folder.failed if f.invariant.startswith("bom")]


def test_the_same_weave_gives_the_same_bytes() -> None:
    weave = woven_tube("kagome")
    assert make(weave).files == make(weave).files


def test_numbers_are_plain() -> None:
    assert [number(x, 3) for x in (-0.0001, 1e-9, 12345678.9, float("inf"), float("nan"), -1.5)] == [
        "0.000",
        "0.000",
        "12345678.900",
        "",
        "",
        "-1.500",
    ]


FORMULAS = ["=cmd|' /C calc'!A0", "+1+1", "-2+3", "@SUM(1)", "\t=1", "\r=1", "a\r=1", "'quoted", "=a,b", '="x"\n#y']


def test_no_text_is_a_formula_in_a_spreadsheet_and_all_are_read_back() -> None:
    table = Table("any", ("text", "number"), [(text, number(-1.5, 3)) for text in FORMULAS])
    content = table.encode(Source("1", "", "plain", "quad"))
    rows = list(csv.reader(io.StringIO(content.decode().split("\n", 1)[1], newline="")))[1:]
    assert all(text.startswith(("'", "a")) for text, _ in rows)
    assert [value for _, value in rows] == ["-1.500"] * len(FORMULAS)
    assert read_table(content)["text"] == [text.replace("\r", "\n") for text in FORMULAS]


def test_a_material_named_as_a_formula_is_a_text_in_the_bill() -> None:
    own = Material(FORMULAS[0], modulus=20.0, strength=300.0, density=1800.0)
    folder = make(pipeline.weave(woven_tube("quad").lattice, rod_diameter=5.0, material=own))
    assert f"\n'{FORMULAS[0]},5.000," in folder.files["bom.csv"].decode()
    assert table(folder, "bom")["material"] == [FORMULAS[0]]
    assert not [one for one in folder.failed if one.invariant.startswith("bom")]
