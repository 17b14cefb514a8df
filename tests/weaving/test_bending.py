from __future__ import annotations

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.errors import Unsupported
from weavecore.geometry.splines import SplineRows, arc_stations, as_b_splines, fit_splines, sample_curves
from weavecore.model import Material, RodAxes
from weavecore.model.bending import Bending
from weavecore.weaving.bending import find_sharpest, measure_bending
from weavecore.weaving.bent_rods import BentRods
from weavecore.weaving.largest_diameters import largest_at, largest_of_rods, least_largest
from weavecore.weaving.materials import known_materials, material_named
from woven_rods import tube_latitudes, woven_tube


def axes_through(*rows: np.ndarray, closed: tuple[bool, ...]) -> RodAxes:
    points, flags = np.concatenate(rows), np.array(closed)
    offsets = np.r_[0, np.cumsum([len(row) for row in rows])]
    fit = fit_splines(points, offsets, flags)
    drawn = as_b_splines(fit, points, offsets, flags)
    samples = sample_curves(points, fit.derivatives, fit.parameters, offsets, flags, fit.ends, step=5.0)
    return RodAxes(
        offsets,
        flags,
        points,
        fit.derivatives,
        fit.parameters,
        fit.ends,
        np.zeros((len(flags), 2)),
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


def measured(axes: RodAxes, diameter: float = 5.0) -> Bending:
    rows, shift = SplineRows(axes.derivatives, axes.parameters, axes.ends), np.zeros_like(axes.points)
    diameters = np.full(len(axes), diameter)
    rods = BentRods(axes.points, rows, shift, axes.offsets, axes.closed, diameters, material_named("gfrp"))
    return measure_bending(axes, rods, find_sharpest(rods))


def test_stations_without_samples_are_those_of_the_samples() -> None:
    rows = arc(80.0, 200, 7), arc(30.0, 360, 9, closed=True), arc(50.0, 40, 2)
    points, closed = np.concatenate(rows), np.array([False, True, False])
    offsets = np.r_[0, np.cumsum([len(row) for row in rows])]
    fit = fit_splines(points, offsets, closed)
    curves = points, fit.derivatives, fit.parameters, offsets, closed, fit.ends
    stations, lengths = arc_stations(*curves, step=5.0)
    samples = sample_curves(*curves, step=5.0)
    np.testing.assert_allclose(stations, samples.stations[samples.is_given], rtol=1e-12)
    np.testing.assert_allclose(lengths, samples.stations[samples.offsets[1:] - 1], rtol=1e-12)


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


def test_a_hairpin_between_straight_legs_is_not_averaged_away() -> None:
    legs = [(-300.0, 10.0), (-150.0, 10.0), (0.0, 10.0), (10.0, 0.0), (0.0, -10.0), (-150.0, -10.0), (-300.0, -10.0)]
    bending = measured(axes_through(np.c_[np.array(legs), np.zeros(len(legs))], closed=(False,)))
    assert bending.min_radius[0] < 12
    assert np.linalg.norm(bending.point_at_min[0] - (10, 0, 0)) < 5


@pytest.mark.parametrize("scale", [0.001, 10.0])
def test_the_verdict_is_the_same_in_every_unit_and_at_every_scale(scale: float) -> None:
    points = arc(300, 200, 30)
    one = measured(axes_through(points, closed=(False,)), 4.0)
    other = measured(axes_through(points * scale, closed=(False,)), 4.0 * scale)
    assert np.isclose(other.min_radius[0], one.min_radius[0] * scale)
    assert np.isclose(other.utilisation[0], one.utilisation[0])
    assert np.isclose(other.largest_diameter[0], one.largest_diameter[0] * scale)


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


@pytest.mark.parametrize("pattern", ["plain", "kagome"])
def test_rods_of_the_largest_diameter_just_pass_though_they_undulate_more(pattern: str) -> None:
    thin = woven_tube(pattern, 1.0)
    d = float(np.median(thin.bending.largest_diameter))
    thick = woven_tube(pattern, d)
    at = np.argmin(np.abs(thin.bending.largest_diameter - d))
    assert thick.bending.utilisation[at] == pytest.approx(1.0, abs=0.05)
    scaled = thin.bending.min_radius[at] / thin.material.least_bend
    assert scaled > 1.1 * d


def test_the_least_of_the_largest_diameters_are_those_of_all_visits() -> None:
    weave = woven_tube("kagome", 4.0)
    axes = weave.axes
    rows, shift = SplineRows(axes.derivatives, axes.parameters, axes.ends), axes.layer_offsets[:, None]
    shift = shift * weave.normals[weave.strands.nodes]
    rods = BentRods(axes.points, rows, shift, axes.offsets, axes.closed, weave.diameters, weave.material)
    every = largest_at(rods, np.ones(len(axes.points), bool))
    assert np.isfinite(every).mean() > 0.9
    np.testing.assert_allclose(np.minimum.reduceat(every, axes.offsets[:-1]), largest_of_rods(rods), rtol=1e-12)
    n = len(every) // 10
    np.testing.assert_allclose(np.sort(least_largest(rods, 0.1))[:n], np.sort(every)[:n], rtol=1e-12)
    too_sharp = find_sharpest(rods).at_visits > 1.0
    # Where the shifts straighten a rod, one that is too thick passes if it grows even more.
    assert too_sharp[every < 4.0].all()
    assert 0 < (every < 4.0).sum() < too_sharp.sum() <= len(every)


def test_violations_are_the_rods_beyond_the_allowable_stress_the_worst_first() -> None:
    bending = woven_tube("plain", 5.0).bending
    assert len(bending.violations)
    assert bending.utilisation[bending.violations[0]] == bending.utilisation.max()
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
