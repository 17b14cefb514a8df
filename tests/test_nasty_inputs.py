"""Nasty meshes are refused with the right code and a remedy, or mended and then woven like any other."""

from __future__ import annotations

import numpy as np
import pytest

from nasty_inputs import NASTY
from stages import hold, weave
from weavecore import pipeline
from weavecore.errors import WeaveError

REFUSED = sorted(name for name, (_, _, code) in NASTY.items() if code is not None)
MENDED = sorted(name for name, (_, _, code) in NASTY.items() if code is None)


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_mended_is_refused_with_its_code_and_a_remedy(name: str) -> None:
    vertices, faces, code = NASTY[name]
    with pytest.raises(WeaveError) as refused:
        pipeline.surface_from((vertices, faces))
    assert refused.value.code == code
    assert refused.value.remedy.endswith(".")
    assert str(refused.value).startswith(f"{code}: ")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", MENDED)
def test_what_can_be_mended_is_one_surface_and_is_woven(name: str) -> None:
    vertices, faces, _ = NASTY[name]
    before = np.array(vertices), np.array(faces)
    surface = pipeline.surface_from((vertices, faces))
    assert (len(surface.borders), surface.euler_characteristic) == (1, 1)
    assert np.array_equal(before[0], np.array(vertices))
    assert np.array_equal(before[1], np.array(faces))
    hold(weave(surface, spacing=surface.size / 12))
