from __future__ import annotations

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.geometry.splines import as_b_splines, fit_splines, sample_curves
from weavecore.model import Material, RodAxes
from weavecore.weaving.bending import bending_window, known_materials, material_named, measure_bending
from woven_rods import tube_latitudes, woven_tube


def axes_through(*rows: np.ndarray, closed: tuple[bool, ...]) -> RodAxes:
    points, flags = np.concatenate(rows), np.array(closed)
    offsets = np.r_[0, np.cumsum([len(row) for row in rows])]
    fit, drawn = fit_splines(points, offsets, flags), as_b_splines(points, offsets, flags)
    samples = sample_curves(points, fit.derivatives, fit.parameters, offsets, flags, fit.ends, step=5.0)
    return RodAxes(
        offsets,
        flags,
        points,
        fit.derivatives,
        fit.parameters,
        fit.ends,
        drawn.knot_offsets,
        drawn.knots,
        drawn.control_offsets,
        drawn.controls,
        samples.stations[samples.is_given],
        samples.stations[samples.offsets[1:] - 1],
        np.zeros(len(points)),
    )


def arc(radius: float, degrees: float, n: int, *, closed: bool = False) -> np.ndarray:
    turn = np.radians(np.linspace(0, degrees, n, endpoint=not closed))
    return radius * np.c_[np.cos(turn), np.sin(turn), 0 * turn]


def measured(axes: RodAxes, diameter: float = 5.0, unit: str = "Millimeters"):
    return measure_bending(axes, rod_diameter=diameter, material=material_named("gfrp"), unit=unit)


@pytest.mark.parametrize("radius", [80.0, 300.0, 1500.0])
def test_the_least_radius_of_a_circle_is_its_own_within_a_hundredth(radius: float) -> None:
    bending = measured(axes_through(arc(radius, 360, 24, closed=True), closed=(True,)))
    assert abs(bending.min_radius[0] / radius - 1) < 0.01


def test_a_straight_rod_has_no_radius_and_bears_all() -> None:
    bending = measured(axes_through(np.c_[np.arange(6) * 90.0, np.zeros((6, 2))], closed=(False,)))
    assert np.isinf(bending.min_radius[0])
    assert bending.utilisation[0] == 0
    assert len(bending.violations) == 0


def test_the_place_of_the_sharpest_bend_is_told() -> None:
    x = np.arange(-500.0, 501.0, 50.0)
    axes = axes_through(np.c_[x, 120 * np.exp(-(((x - 200) / 120) ** 2)), 0 * x], closed=(False,))
    bending = measured(axes)
    assert np.linalg.norm(bending.point_at_min[0] - (200, 120, 0)) < 15
    nearest = np.abs(axes.points - bending.point_at_min[0]).sum(1).argmin()
    assert abs(axes.stations[nearest] - bending.station_at_min[0]) < 20


def test_noise_of_a_twentieth_of_a_millimetre_does_not_halve_the_radius() -> None:
    rng = np.random.default_rng(3)
    points = arc(500.0, 180, 80)
    bending = measured(axes_through(points + rng.normal(0, 0.05, points.shape), closed=(False,)))
    assert bending.min_radius[0] > 350


def test_the_radius_does_not_hang_on_the_unit() -> None:
    in_mm = measured(axes_through(arc(300, 200, 30), closed=(False,)))
    points = arc(300, 200, 30) / 1000
    in_metres = measured(axes_through(points, closed=(False,)), 0.005, "Meters")
    assert np.isclose(in_metres.min_radius[0] * 1000, in_mm.min_radius[0])
    assert np.isclose(in_metres.utilisation[0], in_mm.utilisation[0])


@pytest.mark.parametrize(
    ("diameter", "unit", "window"), [(3, "Millimeters", 50), (20, "Millimeters", 100), (3, "Meters", 15)]
)
def test_the_window_is_five_diameters_and_fifty_millimetres_at_least(diameter: float, unit: str, window: float) -> None:
    assert bending_window(diameter, unit) == pytest.approx(window)


@pytest.mark.parametrize(("diameter", "radius"), [(3, 282), (5, 470), (8, 752), (10, 940)])
def test_glass_fibre_that_stays_bent_bears_94_diameters(diameter: float, radius: float) -> None:
    assert material_named("gfrp").least_bend * diameter == pytest.approx(radius, rel=0.004)
    assert material_named("gfrp-short").least_bend == 62.5


def test_every_material_of_the_table_names_its_source() -> None:
    assert {"gfrp", "bamboo", "rattan", "steel-strip"} <= set(known_materials())
    assert all(len(material.source) > 30 and material.density > 0 for material in known_materials().values())


def test_a_material_of_ones_own_is_as_good() -> None:
    mine = Material("mine", modulus=10.0, strength=200.0, factor=2.0)
    lattice = pipeline.link(tube_latitudes())
    weave = pipeline.weave(lattice, rod_diameter=5.0, material=mine)
    assert mine.least_bend == 50
    assert np.allclose(weave.bending.utilisation, 250.0 / weave.bending.min_radius)


def test_violations_tell_the_thickest_rod_that_would_pass() -> None:
    weave = woven_tube("triangular", 5.0)
    bending = weave.bending
    assert len(bending.violations)
    worst = bending.violations[0]
    assert bending.utilisation[worst] == bending.utilisation.max()
    limit = weave.material.least_bend
    assert np.allclose(bending.largest_diameter[bending.violations] * limit, bending.min_radius[bending.violations])
    assert (bending.largest_diameter[bending.violations] < 5.0).all()


def test_the_rings_of_a_tube_have_its_radius() -> None:
    weave = woven_tube("triangular")
    rings = [s for s, name in enumerate(weave.ids) if name[0] == "L"]
    assert np.allclose(weave.bending.min_radius[rings], 300.0, rtol=0.02)


def test_what_is_no_material_and_no_rod_is_refused() -> None:
    with pytest.raises(Unsupported, match="gfrp"):
        material_named("wood")
    with pytest.raises(Unsupported, match="strength"):
        Material("soft", modulus=10.0, strength=0.0)
    with pytest.raises(Unsupported, match="diameter"):
        pipeline.weave(pipeline.link(tube_latitudes()), rod_diameter=-1.0)
