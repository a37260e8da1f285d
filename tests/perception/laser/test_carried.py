"""Carried things are the robot's own; whoever stands, walks or drives beside it is not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laser_scenes import laser_scan, pose, ranges_of

from perception.laser import CarriedThings, LaserScan, RobotMotion, Scanner, scan_points

PERIOD_S = 0.1
CART = [(x, y, 0.02) for x in (-0.55, 0.55) for y in (-0.4, 0.4)]
TROLLEY = [(0.9, -0.3, 0.025), (0.9, 0.3, 0.025)]
SCANNER = Scanner.mounted(0.2, 0.0, 0.2)
HALL = (-4.0, -3.0, 60.0, 3.5)


def drive(circles_of, seconds=3.0, *, yaw_rate=0.0, slips=False, stood_s=0.5, fastest=1.2):
    """Return, by scan, the robot's way and the base places of what is taken for its own.

    ``circles_of`` gives circles in odom for the time and the pose (x, y, yaw). Wheels that slip
    move the odometry and not the robot.
    """
    things, x, y, yaw, v, out = CarriedThings(), 0.0, 0.0, 0.0, 0.0, []
    for k in range(round(seconds / PERIOD_S)):
        t = k * PERIOD_S
        moves = t >= stood_s
        v = min(v + 1.0 * PERIOD_S, fastest) if moves else 0.0
        yaw_rate_now = yaw_rate if moves else 0.0
        truth = (0.0, 0.0, 0.0) if slips else (x, y, yaw)
        place = pose(*truth) @ SCANNER.T_base_scanner
        angles = np.linspace(-math.pi, math.pi, 1080, endpoint=False)
        world = angles + truth[2]
        ranges = ranges_of(circles_of(t, truth), world, tuple(place[:2, 3]), HALL)
        ranges = ranges + 0.008 * np.random.default_rng(k).normal(size=len(angles))
        ranges[ranges > 20.0] = np.inf
        scan = LaserScan(t, -math.pi, 2.0 * math.pi / 1080, ranges, 0.05, 20.0)
        motion = RobotMotion(t, pose(x, y, yaw), [v, 0.0], yaw_rate_now)
        points = scan_points(scan, SCANNER, motion)
        own = things.note(scan, points, motion)
        out.append((math.hypot(x, y), things.places_base_m(points, own)))
        yaw += yaw_rate_now * PERIOD_S
        x, y = x + v * PERIOD_S * math.cos(yaw), y + v * PERIOD_S * math.sin(yaw)
    return out


def riding(circles):
    def at(_, truth):
        T = pose(*truth)
        return [(*(T[:2, :2] @ (x, y) + T[:2, 3]), radius) for x, y, radius in circles]

    return at


def beside(T, x, y):
    return T[:2, :2] @ (x, y) + T[:2, 3]


@pytest.mark.parametrize("circles", [CART, TROLLEY], ids=["cart", "trolley"])
@pytest.mark.parametrize("yaw_rate", [0.0, 0.4, -0.6])
def test_what_rides_along_is_the_robot_s_own(circles, yaw_rate) -> None:
    rows = drive(riding(circles), yaw_rate=yaw_rate)
    assert not any(len(places) for _, places in rows[:7])
    for way, places in rows:
        if way > 0.5:
            off = np.linalg.norm(places[:, None] - np.array(circles)[:, :2], axis=2)
            assert len(places) == len(circles)
            assert off.min(axis=1).max() < 0.05


@settings(deadline=None, max_examples=15)
@given(
    st.floats(-1.0, 1.2), st.floats(0.35, 1.2), st.floats(0.6, 1.2), st.floats(0.0, 1.0),
    st.sampled_from([-1, 1]),
)  # fmt: skip
def test_whoever_walks_along_from_the_start_is_not(ahead, aside, step_m, phase, side) -> None:
    """Each foot stands while the other goes past it; the middle of both keeps its place."""

    def legs(_, truth):
        x, y, _ = truth
        gait = x / step_m + phase
        stance, swing = (gait + 0.5) % 2.0, (gait + 1.5) % 2.0
        at = [step_m * (0.5 * abs(2.0 - 2.0 * s) - 0.5) for s in (stance, swing)]
        return [
            (x + ahead + at[0], y + side * aside, 0.06),
            (x + ahead + at[1], y + side * (aside + 0.2), 0.06),
        ]

    assert not any(len(places) for _, places in drive(legs))


def test_nor_are_those_who_stand_or_join_at_the_robot_s_speed() -> None:
    stands = [(0.9, 0.5, 0.06), (1.1, 0.5, 0.06)]
    assert not any(len(places) for _, places in drive(lambda _t, _p: stands))

    def joins(t, truth):
        late = 0.0 if t >= 1.5 else 6.0
        return [(x + truth[0] + late, y, r) for x, y, r in TROLLEY]

    assert not any(len(places) for _, places in drive(joins, 4.0))


def test_wheels_that_slip_make_nobody_the_robot_s_own() -> None:
    around = [(0.9, 0.5, 0.06), (1.1, 0.5, 0.06), *CART]
    rows = drive(lambda _t, _p: around, slips=True)
    assert rows[-1][0] > 1.0
    assert not any(len(places) for _, places in rows)


def test_a_cart_that_is_left_behind_is_own_no_more_and_hides_nobody() -> None:
    def at(t, truth):
        T = pose(*truth)
        if t < 2.0:
            return [(*beside(T, x, y), r) for x, y, r in TROLLEY]
        # Taken away; half a second later somebody walks backwards before the robot there.
        return [] if t < 2.5 else [(*beside(T, 0.9, y), 0.06) for y in (-0.3, 0.3)]

    rows = drive(at, 4.0)
    assert len(rows[19][1]) == 2
    assert not any(len(places) for _, places in rows[20:])


def test_scans_of_another_size_begin_anew() -> None:
    things, motion = CarriedThings(), RobotMotion(0.0, np.eye(4))
    for rays in (721, 361):
        scan = laser_scan(CART, rays=rays)
        own = things.note(scan, scan_points(scan, SCANNER, motion), motion)
        assert own.shape == (rays,)
        assert not own.any()
