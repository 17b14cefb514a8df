"""One of each messy export is mended, or noted; ``tests/sweep_exports.py`` weaves them by the hundred."""

import pytest

from messy_exports import MESSES
from sweep_exports import run_case


@pytest.mark.parametrize("name", sorted(MESSES))
def test_a_messy_export_is_mended_or_its_fault_noted(name: str) -> None:
    mess = MESSES[name]
    outcome, said = run_case("hole_near_the_rim", name, 2)
    if mess.refusals:
        assert outcome in ("told", "refused as it should"), said
    else:
        assert outcome == ("told" if mess.doubts else "mended"), said
