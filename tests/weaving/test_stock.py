from __future__ import annotations

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.weaving.stock import choose_diameter, stock_diameters
from woven_rods import tube_latitudes


def test_the_thickest_of_the_stock_with_which_all_pass_is_chosen() -> None:
    assert choose_diameter(np.linspace(1.9, 9.0, 1000), (1.0, 1.5, 2.0, 3.0)) == 1.5


def test_a_few_joints_that_ask_for_much_thinner_rods_do_not_decide() -> None:
    largest = np.linspace(1.9, 9.0, 1000)
    assert choose_diameter(np.append(largest, [0.1] * 5), (0.1, 1.0, 1.5, 2.0, 3.0)) == 1.5
    assert choose_diameter(np.append(largest, [1.2] * 5), (0.1, 1.0, 1.5, 2.0, 3.0)) == 1.0
    assert choose_diameter(np.append(largest, [0.1] * 50), (0.1, 1.0, 1.5, 2.0, 3.0)) == 0.1


def test_the_thinnest_of_the_stock_is_chosen_where_none_passes() -> None:
    assert choose_diameter(np.full(10, 0.2), (1.0, 1.5)) == 1.0


def test_without_a_stock_the_largest_diameter_is_rounded_down() -> None:
    assert choose_diameter(np.full(10, 0.0237), ()) == pytest.approx(0.023)


def test_rods_are_sold_by_the_millimetre_or_by_the_inch() -> None:
    assert 1.5 in stock_diameters("gfrp", "Millimeters")
    assert 1 / 16 in stock_diameters("gfrp", "Inches")
    assert np.allclose(stock_diameters("rattan", "Meters"), np.array(stock_diameters("rattan", "Millimeters")) / 1000)
    assert stock_diameters("gfrp", "None") == ()
    for unit in ("Millimeters", "Inches"):
        for material in ("gfrp", "gfrp-short", "bamboo", "rattan", "steel-strip"):
            sizes = stock_diameters(material, unit)
            assert len(sizes) > 5
            assert list(sizes) == sorted(set(sizes))


@pytest.mark.parametrize("pattern", ["triangular", "plain", "kagome"])
def test_a_tube_is_woven_from_stock_with_all_rods_passing(pattern: str) -> None:
    weave = pipeline.weave(pipeline.link(tube_latitudes(), pattern=pattern))
    assert weave.rod_diameter in stock_diameters("gfrp", "Millimeters")
    assert len(weave.bending.violations) == 0


def test_rods_too_thick_for_most_joints_stay_whole_and_exceed_the_stress() -> None:
    lattice = pipeline.link(tube_latitudes(), pattern="plain")
    weave = pipeline.weave(lattice, stock=[9.0])
    thin = pipeline.weave(lattice, stock=[0.1])
    assert len(weave) == len(thin)
    assert len(weave.bending.violations) > 0.9 * len(weave)
    assert "exceed the allowable stress" in dict(pipeline.describe(weave))["bending"]


def test_rods_of_an_own_stock_are_taken() -> None:
    lattice = pipeline.link(tube_latitudes(), pattern="kagome")
    usual = pipeline.weave(lattice)
    assert pipeline.weave(lattice, stock=[9.0, 0.31, 0.07]).rod_diameter == 0.31 < usual.rod_diameter


@pytest.mark.parametrize(("stock", "rod"), [([], None), ([0.0, 1.0], None), ([np.nan], None), ([1.0], 1.0)])
def test_a_stock_without_a_diameter_to_choose_is_refused(stock: list[float], rod: float) -> None:
    with pytest.raises(Unsupported):
        pipeline.weave(pipeline.link(tube_latitudes()), stock=stock, rod_diameter=rod)
