"""Steps that are made in parts, where whole ones leave something out behind sharp saddles."""

import numpy as np
import pytest

from flat_fields import distance_at, flat_surface
from planar_meshes import circle, rectangle
from tough_origins import started
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.errors import Degenerate
from weavecore.offsetting.propagation import method
from weavecore.offsetting.propagation.domain import Domain
from weavecore.offsetting.propagation.method import propagate_fronts
from weavecore.validating import validate


def cover_plate(surface, spacing, parts):
    domain = Domain(surface)
    middle = surface.vertices.mean(axis=0)
    generations = propagate_fronts(domain, spacing=np.asarray(spacing) / domain.scale, parts=parts)
    return [(len(fronts), fronts.points * domain.scale + middle) for fronts in generations]


TWO_HOLES = [rectangle(12, 12), circle(1.5, (-2, 0.2), n=60), circle(1.5, (2.1, 0), n=60)]
DISC = [circle(5.0, n=120)]


@pytest.mark.parametrize("parts", [2, 3, 4])
@pytest.mark.parametrize(
    ("loops", "spacing"),
    [
        (TWO_HOLES, [0.7]),
        (TWO_HOLES, [0.5, 0.9, 0.7]),
        (DISC, [0.96]),  # The last ring goes around what is a fifth of the spacing deep.
    ],
)
def test_steps_in_parts_lead_to_the_same_fronts_as_whole_ones(loops, spacing, parts):
    surface = flat_surface(loops, 0.2)
    whole, in_parts = cover_plate(surface, spacing, 1), cover_plate(surface, spacing, parts)
    assert [n for n, _ in in_parts] == [n for n, _ in whole]
    steps = np.append(spacing, np.full(len(whole), spacing[-1]))
    for generation, (_, points) in enumerate(in_parts, start=1):
        off = np.abs(distance_at(surface, points)[0] - steps[:generation].sum()) / min(spacing)
        assert off.mean() < 0.005
        assert off.max() < 0.03


@pytest.mark.slow
def test_what_is_left_bare_by_whole_steps_is_covered_by_steps_in_parts(monkeypatch):
    surface = pipeline.surface_from(TOUGH["crumpled"](22002))
    surface = started(surface, np.random.default_rng([22002, *b"crumpled"]))
    latitudes = pipeline.offset(surface, method="fronts")
    assert validate(latitudes).holds
    monkeypatch.setattr(method, "_MOST_PARTS", 1)
    with pytest.raises(Degenerate, match="levels") as caught:
        pipeline.offset(surface, method="fronts")
    assert len(caught.value.ids) > 0


def test_the_refusal_of_whole_steps_is_the_one_raised(monkeypatch):
    surface = flat_surface([circle(5.0, n=60)], 0.5)
    refused = []

    def refuse(domain, *, spacing, parts, progress):
        refused.append(parts)
        raise Degenerate(f"in {parts}", remedy="", ids=[0], kind="face")

    monkeypatch.setattr(method, "propagate_fronts", refuse)
    with pytest.raises(Degenerate, match="in 1"):
        pipeline.offset(surface, spacing=0.9, method="fronts")
    assert refused == [1, 2, 3, 4]
