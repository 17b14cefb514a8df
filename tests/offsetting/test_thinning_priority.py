"""Which rays go first where they crowd does not hang on the numbering."""

from __future__ import annotations

import numpy as np

from weavecore.offsetting.distance.ray_seeds import places_along, thinning_priority


def two_loops() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """An oval of seven points and one of five, with the ray counts of their edges."""
    points, before = [], []
    for n, first, middle in ((7, 0, 0.0), (5, 7, 9.0)):
        angle = 2 * np.pi * (np.arange(n) + 0.3) / n
        points.append(np.stack([middle + 2 * np.cos(angle), np.sin(angle), 0 * angle], axis=1))
        before.append(first + (np.arange(n) - 1) % n)
    return np.concatenate(points), np.concatenate(before), np.array([2, 1, 3, 1, 1, 2, 4, 1, 2, 3, 1, 1])


def test_rays_are_numbered_around_each_loop_from_its_furthest_point() -> None:
    points, before, count = two_loops()
    place = places_along(points, before, count)
    start = np.array([np.argmax(np.abs(points[:7, 0])), 7 + np.argmax(np.abs(points[7:, 0] - 9.0))])
    assert np.array_equal(np.flatnonzero(place == 0), start)
    elsewhere = place > 0
    assert np.array_equal(place[elsewhere], (place + count)[before[elsewhere]])


def test_the_numbers_stay_with_the_points_when_these_are_renumbered() -> None:
    points, before, count = two_loops()
    place = places_along(points, before, count)
    for seed in range(8):
        new = np.random.default_rng(seed).permutation(len(points))
        old = np.argsort(new)
        again = places_along(points[old], new[before[old]], count[old])
        assert np.array_equal(again[new], place)


def test_every_other_place_has_the_least_grade() -> None:
    assert thinning_priority(np.arange(1, 9)).tolist() == [0, 1, 0, 2, 0, 1, 0, 3]
    assert thinning_priority(np.array([0]))[0] > thinning_priority(np.array([1 << 39]))[0]
