"""Faults of the laser scanners do what they describe, and change nothing else of an episode."""

import itertools
import math

import numpy as np
import pytest

from perception import Camera
from perception.laser import LaserScan, RobotMotion
from sim_tests import Scenario, run_crossing
from sim_tests.crossing.faults import EpisodeFaults, Fault, shipped_faults
from sim_tests.crossing.faults._scans import (
    Legs,
    Mirror,
    new_legs,
    new_mirror,
    with_legs,
    with_mirror,
)
from sim_tests.crossing.sensors import Delivery, MountedScan
from sim_tests.world.scanner import DIAGONAL_SCANNERS, ScannerSpec

# One ray per degree all around, on the middle of the robot.
ROUND = ScannerSpec(x_m=0.0, field_of_view_deg=(-180.0, 180.0), resolution_deg=1.0)
PERIOD_S = 0.04
CAMERA = Camera.from_fov(640, 480, math.radians(90.0))
BODY = np.array([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2]])
SCANNER_FAULTS = tuple(name for name in shipped_faults() if name.startswith("scanner_"))
#: In every run of the tests; the others with --full.
ALWAYS = ("scanner_late", "scanner_ghosts")


def scan_at(t_s, range_m=5.0, count=360):
    """A sweep that ends at ``t_s``; every ray measures the same."""
    ranges = np.full(count, range_m)
    return LaserScan(t_s, -math.pi, math.radians(1.0), ranges, 0.05, 20.0)


def motion_at(t_s, x_m=0.0, heading_rad=0.0):
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    T = np.eye(4)
    T[:2, :2], T[0, 3] = [[cos, -sin], [sin, cos]], x_m
    return RobotMotion(t_s, T)


def scan_change(fault, seed=0, spec=ROUND, number=0):
    """Return the change of the scans of a scanner by the settings below ``scanner``."""
    return EpisodeFaults(Fault(scanner=fault), seed, CAMERA).scans(number, spec, BODY)


def delivered(fault, seconds=30.0, seed=0, spec=ROUND, number=0):
    """Return time, scan and delivery of each sweep; all rays of sweep n measure 5 m + n mm."""
    change = scan_change(fault, seed, spec, number)
    found = []
    for n in range(round(seconds / PERIOD_S)):
        t_s = n * PERIOD_S
        T_odom_scanner = motion_at(t_s).T_odom_base @ spec.scanner().T_base_scanner
        message = MountedScan(scan_at(t_s, 5.0 + 0.001 * n), spec.scanner())
        taken = Delivery(message, t_s, t_s, T_odom_scanner)
        sent = taken if change is None else change(taken)
        found.append(
            (t_s, *((None, None) if sent is None else (sent.message.scan, sent.arrives_s)))
        )
    return found


def points(scan):
    angles = scan.angles_rad
    return scan.ranges_m[:, None] * np.column_stack((np.cos(angles), np.sin(angles)))


def test_the_issue_faults_are_shipped():
    assert {
        "scanner_frozen", "scanner_frozen_old_stamps", "scanner_late", "scanner_blind_sector",
        "scanner_yawed", "scanner_ghosts", "scanner_dead", "scanner_one_dead",
        "scanner_clock_ahead", "scanner_clock_behind", "scanner_blind",
    } == set(SCANNER_FAULTS)  # fmt: skip
    for name in SCANNER_FAULTS:
        # Camera and odometry stay as they are.
        assert set(Fault.shipped(name).model_dump()) == {"name", "description", "scanner"}


def test_no_fault_changes_no_scan_bit_for_bit():
    none = EpisodeFaults(None, 3, CAMERA)
    assert none.pictures() is none.images() is none.odometry() is None
    assert none.scans(0, ROUND, BODY) is None
    assert EpisodeFaults(Fault(miss_rate=0.5), 3, CAMERA).scans(0, ROUND, BODY) is None
    zero = {
        "frozen": {"for_s": 0.0, "every_s": 0.1},
        "blind": {"width_deg": 0.0, "at_deg": 0.0},
        "reflections": {"rate_hz": 0.0, "for_s": 9.0},
        "ghosts": {"rate_hz": 0.0, "for_s": 9.0},
        "drop_rate": 0.0,
        "clock_error_s": 0.0,
    }
    for n, (t_s, scan, delivery_s) in enumerate(delivered(zero, 5.0)):
        assert (scan.stamp_s, delivery_s) == (t_s, t_s)
        np.testing.assert_array_equal(scan.ranges_m, 5.0 + 0.001 * n)


def world(fault):
    """Return what robot, people and camera do in each frame, and the scans, as bytes."""
    scenario = Scenario.shipped("paper_encounter").model_copy(update={"duration_s": 1.5})
    result = run_crossing(
        scenario, policy="balanced", perception="keypoints+scanner", seed=2, fault=fault
    )
    return [
        (
            frame.robot_state.position_odom_m.tobytes(),
            [view.position_odom_m.tobytes() for view in frame.truth],
            [each.position_camera_m.tobytes() for each in frame.observations],
        )
        for frame in result.frames
    ], [frame.scan_points_odom_m.tobytes() for frame in result.frames]


@pytest.fixture(scope="module")
def world_without_fault():
    return world(None)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in ALWAYS else pytest.mark.full)
        for name in SCANNER_FAULTS
    ],
)
def test_a_scan_fault_changes_neither_people_nor_what_the_camera_sees(name, world_without_fault):
    """The robot of the paper drives straight on, so the world may not differ by a bit."""
    (plain, plain_scans), (faulty, scans) = world_without_fault, world(Fault.shipped(name))
    assert faulty == plain
    if name in ("scanner_yawed", "scanner_late", "scanner_clock_ahead", "scanner_clock_behind"):
        assert scans != plain_scans


@pytest.mark.parametrize("fresh", [True, False])
def test_a_frozen_scanner_repeats_its_last_scan(fresh):
    frozen = 0
    last = 0
    fault = {"frozen": {"for_s": 1.0, "every_s": 10.0, "fresh_stamps": fresh}}
    for n, (t_s, scan, _) in enumerate(delivered(fault, 40.0)):
        taken = round((scan.ranges_m[0] - 5.0) / 0.001)
        if taken == n:
            last = n
            assert scan.stamp_s == t_s
        else:
            frozen += 1
            assert taken == last
            assert scan.stamp_s == pytest.approx(t_s if fresh else last * PERIOD_S)
    assert frozen == pytest.approx(4 * 25, abs=4)


def test_a_dead_scanner_stays_silent_from_a_time_that_the_seed_draws():
    deaths = []
    for seed in range(60):
        silent = [scan is None for _, scan, _ in delivered({"dies_within_s": 5.0}, 6.0, seed)]
        first = silent.index(True)
        assert all(silent[first:])
        assert not any(silent[:first])
        deaths.append(first * PERIOD_S)
    assert max(deaths) <= 5.0 + PERIOD_S
    # The mean of 60 uniform times has a standard deviation of 5 / √12 / √60 = 0.19 s.
    assert np.mean(deaths) == pytest.approx(2.5, abs=4.0 * 0.19)
    assert all(scan is None for _, scan, _ in delivered({"dies_within_s": 0.0}, 1.0))


def test_only_one_scanner_has_the_fault():
    for number, dead in ((0, False), (1, True)):
        scans = delivered({"only": 2, "dies_within_s": 0.0}, 1.0, number=number)
        assert all((scan is None) == dead for _, scan, _ in scans)


def test_late_and_lost_scans():
    for t_s, scan, delivery_s in delivered({"latency_s": 0.2}, 5.0):
        assert scan.stamp_s == t_s
        assert delivery_s == pytest.approx(t_s + 0.2)
    scans = delivered({"drop_rate": 0.3}, 160.0)
    assert np.mean([scan is None for _, scan, _ in scans]) == pytest.approx(
        0.3, abs=4.0 * math.sqrt(0.21 / 4000)
    )


@pytest.mark.parametrize("error_s", [0.1, -0.1])
def test_a_wrong_clock_moves_the_stamp_and_not_the_arrival(error_s):
    for t_s, scan, delivery_s in delivered({"clock_error_s": error_s}, 2.0):
        assert scan.stamp_s == pytest.approx(t_s + error_s)
        assert delivery_s == t_s


def test_the_assumed_scanner_is_turned_to_the_left():
    for number, spec in enumerate(DIAGONAL_SCANNERS):
        true = spec.scanner(BODY).T_base_scanner
        change = scan_change({"yaw_error_deg": 3.0}, spec=spec, number=number)
        taken = Delivery(MountedScan(scan_at(0.0), spec.scanner(BODY)), 0.0, 0.0, true)
        assumed = change(taken).message.mounting.T_base_scanner
        turn = true[:3, :3].T @ assumed[:3, :3]
        assert math.degrees(math.atan2(turn[1, 0], turn[0, 0])) == pytest.approx(3.0)
        np.testing.assert_allclose(assumed[:3, 3], true[:3, 3])


@pytest.mark.parametrize(
    ("returns", "value"), [("inf", math.inf), ("max", 20.0), ("nan", math.nan)]
)
def test_a_blind_sector_lies_where_it_is_said_to_for_every_mounting(returns, value):
    blind = {"width_deg": 60.0, "at_deg": 90.0, "returns": returns}
    for spec in (ROUND, ROUND.model_copy(update={"yaw_deg": 70.0, "upside_down": True})):
        ((_, scan, _), *_) = delivered({"blind": blind}, 0.1, spec=spec)
        T = spec.scanner().T_base_scanner
        base = np.column_stack((np.cos(scan.angles_rad), np.sin(scan.angles_rad))) @ T[:2, :2].T
        off = np.abs(np.degrees(np.arctan2(base[:, 1], base[:, 0])) - 90.0)
        changed = scan.ranges_m != 5.0
        assert changed[off < 29.9].all()
        assert not changed[off > 30.1].any()
        np.testing.assert_array_equal(scan.ranges_m[changed], value)


def test_a_drawn_blind_sector_is_the_same_for_all_scanners_and_even_over_seeds():
    def middle(seed, number):
        ((_, scan, _), *_) = delivered({"blind": {"width_deg": 40.0}}, 0.1, seed, number=number)
        blind = scan.angles_rad[np.isposinf(scan.ranges_m)]
        return math.atan2(np.sin(blind).mean(), np.cos(blind).mean())

    middles = np.array([middle(seed, 0) for seed in range(100)])
    assert middle(5, 1) == pytest.approx(middles[5])
    assert abs(np.exp(1j * middles).mean()) < 0.25  # Rayleigh: 0.25 has probability 0.002


def test_ghosts_follow_littles_law_and_a_scanner_without_them_is_left_alone():
    fault = {"ghosts": {"rate_hz": 1.0, "for_s": 1.0}}
    shown = [(scan.ranges_m < 5.0).any() for _, scan, _ in delivered(fault, 200.0)]
    # One ghost on average; some walk off or stand farther than the wall at 5 m to 21 m.
    assert 0.35 < np.mean(shown) < 1.0 - math.exp(-1.0) + 0.1
    assert not any((scan.ranges_m < 5.0).any() for _, scan, _ in delivered({}, 2.0))


def test_legs_stand_in_odom_while_the_robot_moves_and_hide_what_is_behind_them():
    legs = Legs(np.array([3.0, 0.0]), np.zeros(2), np.array([0.0, 0.15]), 0.0)
    fine = LaserScan(0.0, -math.pi / 2, math.radians(0.25), np.full(721, 10.0), 0.05, 20.0)
    for x_m, heading in itertools.product((0.0, 1.0), (0.0, 0.4)):
        T = motion_at(0.0, x_m, heading).T_odom_base
        scan = with_legs(fine, legs, 0.0, T, np.zeros(721))
        hit = scan.ranges_m < 9.0
        odom = points(scan)[hit] @ T[:2, :2].T + T[:2, 3]
        for side in (0.15, -0.15):
            near = odom[np.sign(odom[:, 1]) == np.sign(side)]
            assert len(near) >= 4
            np.testing.assert_allclose(np.hypot(*(near - [3.0, side]).T), 0.06, atol=1e-9)
    empty = LaserScan(0.0, -math.pi / 2, math.radians(0.25), np.full(721, np.inf), 0.05, 20.0)
    assert np.isfinite(with_legs(empty, legs, 0.0, np.eye(4), np.zeros(721)).ranges_m).any()
    wall = LaserScan(0.0, -math.pi / 2, math.radians(0.25), np.full(721, 2.0), 0.05, 20.0)
    hidden = with_legs(wall, legs, 0.0, np.eye(4), np.zeros(721))
    np.testing.assert_array_equal(hidden.ranges_m, wall.ranges_m)


def test_a_mirror_shows_a_post_where_its_image_is_and_nowhere_else():
    """A wall at x = 4 m with a mirror in it; a post beside the robot appears behind the wall."""
    angles = np.radians(np.arange(-180.0, 180.0, 0.25))
    with np.errstate(divide="ignore"):
        ranges = np.where(np.cos(angles) > 0.1, 4.0 / np.cos(angles), np.inf)
    post = np.array([1.0, 2.0])
    toward = math.atan2(post[1], post[0])
    on_post = np.abs(angles - toward) < 0.03
    ranges[on_post] = np.hypot(*post)
    ranges[ranges > 20.0] = np.inf
    scan = LaserScan(0.0, -math.pi, math.radians(0.25), ranges, 0.05, 20.0)
    image = np.array([7.0, 2.0])
    # The line from the origin to the image meets the wall at y = 8 / 7 m.
    mirror = Mirror(np.array([4.0, 8.0 / 7.0]), np.array([-1.0, 0.0]))
    seen = with_mirror(scan, mirror, np.eye(4))
    changed = seen.ranges_m != scan.ranges_m
    near = np.hypot(*(points(seen)[changed] - image).T)
    assert changed.any()
    assert near.max() < 0.12
    # Another mirror does not show it, nor does one seen from behind.
    for other in (
        Mirror(np.array([4.0, -1.0]), np.array([-1.0, 0.0])),
        Mirror(np.array([4.0, 8.0 / 7.0]), np.array([1.0, 0.0])),
    ):
        np.testing.assert_array_equal(with_mirror(scan, other, np.eye(4)).ranges_m, ranges)


def test_walking_ghosts_keep_their_velocity():
    rng = np.random.default_rng(4)
    ghosts = [new_legs(rng, 1.0, np.array([2.0, 3.0])) for _ in range(400)]
    speeds = np.array([np.hypot(*each.velocity_odom_mps) for each in ghosts])
    assert np.mean(speeds == 0.0) == pytest.approx(0.5, abs=4.0 * 0.5 / 20.0)
    assert speeds.max() <= 1.5
    ranges = [np.hypot(*(each.middle_odom_m - [2.0, 3.0])) for each in ghosts]
    assert 0.8 <= min(ranges) <= max(ranges) <= 6.0
    moving = Legs(np.array([3.0, 0.0]), np.array([0.0, 1.0]), np.array([0.05, 0.0]), 1.0)
    scan = with_legs(scan_at(3.0, 9.0), moving, 3.0, np.eye(4), np.zeros(360))
    hit = points(scan)[scan.ranges_m < 8.0].mean(axis=0)
    np.testing.assert_allclose(hit, [3.0, 2.0], atol=0.1)


def test_mirrors_lie_on_surfaces_and_face_the_scanner():
    rng = np.random.default_rng(1)
    T = motion_at(0.0, 3.0, 1.0).T_odom_base
    for _ in range(100):
        mirror = new_mirror(rng, scan_at(0.0), T)
        offset = mirror.middle_odom_m - T[:2, 3]
        assert np.hypot(*offset) == pytest.approx(5.0)
        cosine = -mirror.normal_odom @ offset / 5.0
        assert cosine >= math.cos(math.radians(45.0)) - 1e-9
    assert new_mirror(rng, scan_at(0.0, np.inf), T) is None
