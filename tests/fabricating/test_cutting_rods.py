"""Pieces, splices and nesting."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabricated import SHELL, made, make, table
from weavecore.errors import Unsupported
from weavecore.fabricating import splices as splicing
from weavecore.fabricating.nesting import least_bars, nest_pieces
from weavecore.fabricating.plan import plan_rods
from weavecore.fabricating.splices import Candidate, Piece, choose_splices, cut_rods
from weavecore.fabricating.workshop import Workshop
from weavecore.weaving.overhangs import with_overhangs
from woven_rods import woven_sample, woven_tube

SHORT = Workshop(stock=1000.0, templates=())
SLEEVES = Workshop(stock=1000.0, splice="sleeve", templates=())


def row(centres: list[float], half: float, penalties: list[float]) -> list[Candidate]:
    return [Candidate(c, c - half, c + half, c - half, c + half, 2, 0.0, penalty=p) for c, p in zip(centres, penalties)]


def centres(found: list[Candidate] | None) -> list[float]:
    assert found is not None
    return [one.centre for one in found]


def test_a_long_rod_takes_the_fewest_pieces_and_of_those_the_best() -> None:
    places = row([200.0, 400.0, 500.0, 600.0, 800.0], 20.0, [0.0, 5.0, 1.0, 3.0, 0.0])
    assert centres(choose_splices(places, 1000.0, closed=False, longest=700.0)) == [500.0]
    assert centres(choose_splices(places, 1000.0, closed=False, longest=2000.0)) == []
    assert centres(choose_splices(places, 1000.0, closed=False, longest=450.0)) == [200.0, 600.0]
    assert choose_splices(places, 1000.0, closed=False, longest=210.0) is None


def test_a_ring_is_spliced_at_the_best_places_around() -> None:
    places = row([100.0, 300.0, 500.0, 700.0, 900.0], 20.0, [9.0, 9.0, 1.0, 9.0, 2.0])
    assert centres(choose_splices(places, 1000.0, closed=True, longest=1100.0)) == [500.0]
    two = choose_splices(places, 1000.0, closed=True, longest=700.0)
    assert sorted(c % 1000.0 for c in centres(two)) == [500.0, 900.0]


@pytest.mark.parametrize("workshop", [SHORT, SLEEVES], ids=["overlap", "sleeve"])
@pytest.mark.parametrize("pattern", ["triangular", "plain"])
def test_pieces_cover_their_rods_and_fit_the_stock(pattern: str, workshop: Workshop) -> None:
    folder = made(SHELL, pattern, workshop)
    pieces, rods = table(folder, "pieces"), table(folder, "rods")
    assert pieces.floats("cut_length").max() <= 1000.0
    for rod, length, closed in zip(rods["rod_id"], rods.floats("length").tolist(), rods["closed"]):
        mine = [k for k, name in enumerate(pieces["rod_id"]) if name == rod]
        low, high = (pieces.floats(name)[mine] for name in ("from", "to"))
        assert [int(pieces["seq"][k]) for k in mine] == list(range(1, len(mine) + 1))
        assert (high[:-1] >= low[1:]).all()
        assert high[-1] - low[0] >= length - 0.002
        if closed == "no":
            assert (low[0], high[-1]) == (0.0, length)
        shared = high[:-1] - low[1:]
        if workshop is SLEEVES:
            assert np.abs(shared).max(initial=0.0) < 0.002


def test_overlaps_are_held_at_two_crossings_and_thirty_diameters_long() -> None:
    weave, folder = woven_sample(SHELL, "triangular"), made(SHELL, "triangular", SHORT)
    splices, marks = table(folder, "splices"), table(folder, "marks")
    assert len(splices) > len(weave) / 10
    assert (splices.floats("length") >= 30 * weave.rod_diameter - 0.002).all()
    pieces = table(folder, "pieces")
    for name in splices["splice_id"]:
        sides = [
            p for p, a, b in zip(*(pieces[c] for c in ("piece_id", "splice_start", "splice_end"))) if name in (a, b)
        ]
        joints = [
            {j for p, j, o in zip(marks["piece_id"], marks["joint_id"], marks["other_rod"]) if p == s and o}
            for s in sides
        ]
        if len(joints) == 2:
            assert len(joints[0] & joints[1]) >= 2
        else:  # A ring of one piece: two joints are marked twice on it.
            marked = [j for p, j, n in {*zip(marks["piece_id"], marks["joint_id"], marks["no"])} if p == sides[0]]
            assert len(marked) - len(set(marked)) >= 2


def test_splices_keep_off_bends_where_a_rod_has_straighter_parts() -> None:
    weave, splices = woven_sample(SHELL, "triangular"), table(made(SHELL), "splices")
    utilisation = dict(zip(splices["rod_id"], splices.floats("utilisation").tolist()))
    bent = {rod: weave.bending.utilisation[weave.ids.index(rod)] for rod in utilisation}
    assert all(utilisation[rod] <= bent[rod] * 1.001 for rod in bent)
    assert sum(utilisation[rod] < 0.5 * bent[rod] for rod in bent) >= len(bent) / 3


def test_splices_of_neighbours_are_staggered(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_rods(woven_sample(SHELL, "triangular"), 1.0)

    def n_near(workshop: Workshop) -> int:
        _, splices = cut_rods(plan, workshop)
        return sum(splice.nearest < splicing.stagger(plan) for splice in splices)

    usual, crowded = Workshop(templates=()), SHORT
    assert n_near(usual) <= 1
    staggered = n_near(crowded)
    monkeypatch.setattr(splicing, "_PENALTY_NEAR", 0.0)
    assert n_near(crowded) > 1.3 * staggered


def test_sleeves_lie_between_crossings() -> None:
    splices = table(made(SHELL, "triangular", SLEEVES), "splices")
    assert set(splices["kind"]) == {"sleeve"}
    assert np.mean(splices.floats("n_crossings") == 0) > 0.9
    assert table(made(SHELL, "triangular", SLEEVES), "bom")["sleeves"] == [str(len(splices))]


def test_free_ends_run_past_their_last_tie_in_every_table() -> None:
    weave = woven_sample(SHELL, "triangular")
    folder = make(with_overhangs(weave, 30.0))
    pieces, marks = table(folder, "pieces"), table(folder, "marks")
    rods, axes = table(folder, "rods"), table(folder, "axes")
    length, closed = (
        dict(zip(rods["rod_id"], rods.floats("length").tolist())),
        dict(zip(rods["rod_id"], rods["closed"])),
    )
    station = marks.floats("station")
    axis_station = axes.floats("station")
    for rod in [rod for rod in rods["rod_id"] if closed[rod] == "no"]:
        ties = station[[k for k, name in enumerate(marks["rod_id"]) if name == rod]]
        assert ties.min() == pytest.approx(30.0, abs=0.002)
        assert length[rod] - ties.max() == pytest.approx(30.0, abs=0.002)
        rows = [k for k, name in enumerate(axes["rod_id"]) if name == rod]
        assert (axis_station[rows].min(), axis_station[rows].max()) == pytest.approx((0.0, length[rod]), abs=0.002)
    ends = dict.fromkeys(length, 0.0)
    for rod, high in zip(pieces["rod_id"], pieces.floats("to").tolist()):
        ends[rod] = max(ends[rod], high)
    assert all(ends[rod] == pytest.approx(length[rod], abs=0.002) for rod in ends if closed[rod] == "no")
    assert {finding.invariant for finding in folder.failed} <= {"rods_that_clash"}


def test_every_open_rod_runs_ten_diameters_past_its_ties_where_there_is_room() -> None:
    folder = made(SHELL)
    rods, marks = table(folder, "rods"), table(folder, "marks")
    first: dict[str, float] = {}
    for rod, station, other in zip(marks["rod_id"], marks.floats("station").tolist(), marks["other_rod"]):
        if other:
            first[rod] = min(first.get(rod, station), station)
    reaches = [
        first[rod] / diameter
        for rod, diameter, closed in zip(rods["rod_id"], rods.floats("diameter").tolist(), rods["closed"])
        if closed == "no"
    ]
    assert min(reaches) >= 5.0
    assert np.mean(np.array(reaches) >= 9.99) > 0.9


def test_stock_that_is_too_short_is_refused_with_the_rod() -> None:
    with pytest.raises(Unsupported, match="too short") as refused:
        make(woven_tube("quad"), Workshop(stock=120.0, templates=()))
    assert refused.value.kind == "rod"
    assert refused.value.ids[0] in woven_tube("quad").ids


@pytest.mark.parametrize(
    "wrong",
    [
        {"stock": 0.0},
        {"stock": float("nan")},
        {"splice": "glue"},
        {"paper": "A7"},
        {"templates": ("dwg",)},
    ],
)
def test_a_workshop_that_cannot_be_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(Unsupported):
        Workshop(**wrong)  # type: ignore[arg-type]


def pieces_of(lengths: list[float]) -> list[Piece]:
    return [Piece(f"A{k}", k, 1, 0.0, length, None, None) for k, length in enumerate(lengths)]


@given(st.lists(st.floats(1.0, 600.0), max_size=60), st.floats(0.0, 5.0))
def test_every_piece_is_cut_once_from_bars_that_are_long_enough(lengths: list[float], kerf: float) -> None:
    bars = nest_pieces(pieces_of(lengths), stock=610.0, kerf=kerf)
    assert sorted(piece.rod for bar in bars for piece in bar.pieces) == list(range(len(lengths)))
    for bar in bars:
        assert bar.used == pytest.approx(sum(piece.cut_length + kerf for piece in bar.pieces))
        assert bar.used <= 610.0 + 1e-5
        assert bar.used + bar.offcut == pytest.approx(610.0, abs=1e-5)
    least = least_bars([length + kerf for length in lengths], 610.0)
    assert math.ceil(sum(length + kerf for length in lengths) / 610.0 - 1e-6) <= least <= len(bars)
    assert 9 * len(bars) <= 11 * least + 6


@given(st.lists(st.integers(1, 12), min_size=1, max_size=8))
def test_the_lower_bound_is_never_above_the_best_nesting(parts: list[int]) -> None:
    """Bars of 12 are cut into parts at random and the parts nested again: no more bars are needed than there were."""
    lengths = []
    for part in parts:
        lengths += [float(part)] + ([float(12 - part)] if part < 12 else [])
    assert least_bars(lengths, 12.0) <= len(parts)
    assert len(nest_pieces(pieces_of(lengths), stock=12.0, kerf=0.0)) == len(parts)


def test_pieces_that_best_fit_spreads_badly_are_packed_full() -> None:
    lengths = [5.0, 5.0, 4.0, 4.0, 3.0, 3.0, 3.0, 3.0]  # Three bars of 10: 5+5, 4+3+3, 4+3+3; best fit takes four.
    assert len(nest_pieces(pieces_of(lengths), stock=10.0, kerf=0.0)) == 3


def test_long_pieces_need_a_bar_each() -> None:
    assert least_bars([6.0, 6.0, 6.0], 10.0) == 3
    assert least_bars([], 10.0) == 0
    assert least_bars([9.0, 9.0, 2.0, 2.0], 10.0) == 3
