"""What a weave needs is what the workshop folder says."""

from __future__ import annotations

import pytest

from fabricated import SHELL, TABLES_ONLY, made, table
from weavecore.errors import Unsupported
from weavecore.fabricating.needs import estimate_needs
from weavecore.fabricating.workshop import Workshop
from woven_rods import woven_sample


def test_metres_mass_bars_and_waste_are_those_of_the_folder() -> None:
    needs = estimate_needs(woven_sample(SHELL, "plain"), scale=1.0, workshop=TABLES_ONLY)
    folder = made(SHELL, "plain")
    bom = table(folder, "bom")
    assert needs.metres == pytest.approx(float(bom["cut_length"][0]) / 1000, rel=1e-6)
    assert needs.kilograms == pytest.approx(float(bom["mass"][0]), abs=1e-4)
    assert needs.n_bars == int(bom["stock_count"][0])
    assert 100 * needs.waste == pytest.approx(folder["waste_pct"].value, abs=1e-4)


def test_a_stock_that_is_too_short_is_refused() -> None:
    with pytest.raises(Unsupported):
        estimate_needs(woven_sample(SHELL, "plain"), scale=1.0, workshop=Workshop(stock=10.0, templates=()))
