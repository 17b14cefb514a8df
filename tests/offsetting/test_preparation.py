"""Surfaces that are refined for a spacing, or noted, are what their arrays make, and share what is known."""

from __future__ import annotations

import numpy as np
import pytest

from open_cloth import from_ring_inside, from_side_with_hole, from_slit
from weavecore.geometry.halfedges import check_manifold_vertices, find_twins
from weavecore.model import Note
from weavecore.offsetting.preparation import refine_for_spacing

CLOTHS = {"free borders": from_side_with_hole, "a slit": from_slit, "a ring": from_ring_inside}


@pytest.mark.parametrize("name", CLOTHS)
def test_a_refined_surface_has_the_twins_and_the_origins_of_its_faces(name: str) -> None:
    surface = CLOTHS[name]()
    fine = refine_for_spacing(surface, 0.7 * float(np.median(surface.edge_lengths)))
    assert fine.n_faces > 2 * surface.n_faces
    assert np.array_equal(fine.twins, find_twins(fine.faces, fine.n_vertices))
    check_manifold_vertices(fine.faces, fine.twins, fine.n_vertices)
    assert np.isclose(fine.area, surface.area)
    assert [path.tolist() for path in fine.origins.paths] == [path.tolist() for path in surface.origins.paths]
    assert fine.is_origin.sum() == surface.is_origin.sum()
    for array in (fine.vertices, fine.faces, fine.twins):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_a_surface_with_other_notes_shares_its_arrays_and_leaves_the_first_alone() -> None:
    surface = from_side_with_hole()
    lengths, note = surface.edge_lengths, Note("PHASE", "Out of phase.")
    noted = surface.with_notes([*surface.notes, note])
    assert noted.notes == (*surface.notes, note)
    assert note not in surface.notes
    assert noted.vertices is surface.vertices
    assert noted.twins is surface.twins
    assert noted.edge_lengths is lengths
    assert noted.starts is surface.starts
