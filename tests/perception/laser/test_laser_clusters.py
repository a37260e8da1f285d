"""Clusters and hypotheses: where a scan is divided, and what stays the same when it is moved."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laser_scenes import laser_scan, points_of, two_legs

from perception.laser import (
    CUTOUT,
    Clusters,
    Hypotheses,
    LaserScan,
    Scanner,
    clusters_of,
    hypotheses_of,
)

PLACES = st.tuples(st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1))


def divided(points, known=None) -> Clusters:
    return clusters_of(
        points.points_odom_m[:, :2],
        points.ranges_m,
        points.usable,
        points.origins_odom_m[0, :2],
        points.angle_increment_rad,
        0.0,
        known,
    )


def judged(points) -> Hypotheses:
    clusters = divided(points)
    xy = points.points_odom_m[:, :2]
    return hypotheses_of(clusters, xy, points.ranges_m, points.angle_increment_rad)


def legs_of(clusters: Clusters) -> np.ndarray:
    return np.flatnonzero(clusters.widths_m < 0.2)


def test_two_legs_before_a_wall_are_two_clusters_of_their_width() -> None:
    clusters = divided(points_of(laser_scan(two_legs(2.0, 0.5, 0.25))))
    legs = legs_of(clusters)
    assert len(legs) == 2
    np.testing.assert_allclose(clusters.widths_m[legs], 0.12, atol=0.02)
    # The near side of a leg is measured: its mean lies before the middle.
    centres = clusters.centres_m[legs].mean(axis=0)
    assert np.linalg.norm(centres) == pytest.approx(math.hypot(2.0, 0.5) - 0.045, abs=0.02)


def test_a_leg_across_the_seam_of_a_full_turn_is_one_cluster() -> None:
    circles = [(-2.0, 0.0, 0.06)]
    scan = laser_scan(circles, low=-180.0, rays=960)
    legs = legs_of(divided(points_of(scan)))
    assert len(legs) == 1
    assert len(legs_of(divided(points_of(laser_scan(circles, low=-179.9, rays=900))))) == 1


def test_somebody_who_came_to_a_wall_is_apart_from_it() -> None:
    points = points_of(laser_scan([(5.95, 0.0, 0.06)]))
    person = np.abs(points.points_odom_m[:, 1]) < 0.055
    person &= points.points_odom_m[:, 0] > 5.0
    known = np.where(person, 1, np.where(points.points_odom_m[:, 0] > 5.5, -1, 0))
    whole, apart = divided(points), divided(points, known)
    assert len(apart.starts) == len(whole.starts) + 2
    assert np.count_nonzero(legs_of(apart)) >= 1
    # Without the knowledge of where the floor was free nothing is divided.
    assert len(divided(points, np.minimum(known, 0)).starts) == len(whole.starts)


@settings(max_examples=30)
@given(PLACES, st.floats(0.8, 4.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_features_do_not_depend_on_where_the_robot_is(place, distance, bearing, heading) -> None:
    legs = two_legs(distance * math.cos(bearing), distance * math.sin(bearing), heading)
    scan = laser_scan(legs, noise=0.01)
    home, moved = judged(points_of(scan)), judged(points_of(scan, place))
    np.testing.assert_allclose(moved.features, home.features, atol=2e-3)


@settings(max_examples=15)
@given(st.floats(0.8, 4.0), st.floats(-1.5, 1.5), st.floats(-3.0, 3.0))
def test_upside_down_the_same_scene_gives_the_same_features(distance, bearing, heading) -> None:
    legs = two_legs(distance * math.cos(bearing), distance * math.sin(bearing), heading)
    scan = laser_scan(legs, noise=0.01)
    turned = LaserScan(
        0.0, scan.angle_min_rad, scan.angle_increment_rad, scan.ranges_m[::-1], 0.05, 20.0
    )
    scanner = Scanner.mounted(0.0, 0.0, 0.2, upside_down=True)
    home, hung = judged(points_of(scan)), judged(points_of(turned, scanner=scanner))
    np.testing.assert_allclose(hung.features[:, :-CUTOUT], home.features[:, :-CUTOUT], atol=1e-3)
    # A sample midway between two rays may fall on either.
    assert (np.abs(hung.features - home.features) < 1e-3).mean() > 0.97


def test_a_cutout_shows_legs_from_right_to_left() -> None:
    points = points_of(laser_scan([(2.0, 0.3, 0.06), (2.0, -0.3, 0.06), (2.3, 0.0, 0.06)]))
    found = judged(points)
    pair = (found.second >= 0) & (np.abs(found.features[:, -(CUTOUT + 5)]) > 5.0)
    cutout = found.features[np.flatnonzero(pair)[0], -CUTOUT:]
    low = np.flatnonzero(cutout < 0.2)
    offsets = np.linspace(-0.7, 0.7, CUTOUT)[low]
    assert offsets.min() == pytest.approx(-0.34, abs=0.06)
    assert offsets.max() == pytest.approx(0.34, abs=0.06)
    assert cutout[CUTOUT // 2] == pytest.approx(0.3 / 0.7, abs=0.1)
