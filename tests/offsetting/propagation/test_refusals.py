"""What is not offset well is refused, never given."""

from dataclasses import replace

import numpy as np
import pytest

from drawn_curves import draw, square_domain
from flat_fields import flat_surface
from planar_meshes import circle
from weavecore.errors import Degenerate
from weavecore.offsetting.propagation.method import offset_fronts, refuse_broken, refuse_crossings


def test_children_that_cross_each_other_or_a_parent_are_refused_with_the_faces():
    domain = square_domain()
    ring, beside = draw(domain, circle(3.0, (-1, 0))), draw(domain, circle(3.0, (1, 0.1)))
    refuse_crossings(domain, ring, None)
    refuse_crossings(domain, ring, draw(domain, circle(4.5, (-1, 0))))
    for children, parents in ((ring, beside), (draw(domain, circle(3.0, (-1, 0)), circle(3.0, (1, 0.1))), None)):
        with pytest.raises(Degenerate, match="levels") as caught:
            refuse_crossings(domain, children, parents)
        assert 0 < len(caught.value.ids) <= 2
        assert caught.value.kind == "face"


def test_latitudes_with_orphans_or_a_part_without_rings_are_refused():
    latitudes = offset_fronts(flat_surface([circle(5.0, n=120)], 0.4), spacing=0.9)
    refuse_broken(latitudes)
    deep = replace(latitudes.bands, depth=latitudes.bands.depth + np.where(latitudes.bands.euler == 1, 0.9, 0.0))
    split = replace(latitudes.bands, euler=latitudes.bands.euler - 2)
    for broken in (
        replace(latitudes, parents=latitudes.parents[:-1]),
        replace(latitudes, bands=deep),
        replace(latitudes, bands=split),
    ):
        with pytest.raises(Degenerate, match="levels"):
            refuse_broken(broken)
