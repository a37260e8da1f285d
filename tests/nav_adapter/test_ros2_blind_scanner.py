"""The bridge with scanners that publish and see nothing: they count as silent.

Hazard H23 and claim C30 of docs/safety.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from bridge_scenes import FRONT, START_S, TIMING, Robot, attentive, odometry
from scan_scenes import RAYS, STEP_RAD

from nav_adapter.ros2.messages.diagnostic_msgs import DiagnosticStatus

PERIOD_S = Robot.period_s
NEAR = (1.5, 0.0)
ANGLES_DEG = np.degrees(STEP_RAD) * np.arange(RAYS) - 135.0
COVERS_M = (0.06, 0.2)
NO_ANSWERS = (math.nan, 65.535, COVERS_M[0])

Change = Callable[[np.ndarray], np.ndarray]


class Blinded(Robot):
    """A robot whose front scanner has its ranges changed."""

    change: Change = staticmethod(lambda ranges: ranges)

    x_m = 0.0

    def odometry(self, now_s: float):
        self.x_m += PERIOD_S * self.speed_mps
        return odometry(now_s, x=self.x_m, speed=self.speed_mps)

    def scan(self, number: int, now_s: float):
        scan = super().scan(number, now_s)
        if number > 0:
            return scan
        return replace(scan, ranges=tuple(self.change(np.array(scan.ranges)).tolist()))


def alone(*scanners, **settings) -> Blinded:
    nav = Blinded(*(scanners or (FRONT,)), with_camera=False, **settings)
    nav.silent.add("camera")
    return nav


def every_ray(value: float) -> Change:
    if value in COVERS_M:  # rays that end under a cover have noise
        return lambda ranges: value + 1e-3 * np.sin(1e3 * np.minimum(ranges, 20.0))
    return lambda ranges: np.full(len(ranges), value)


def sector(low_deg: float, high_deg: float, value: float) -> Change:
    inside = np.clip(ANGLES_DEG, low_deg, high_deg) == ANGLES_DEG
    return lambda ranges: np.where(inside, value, ranges)


@pytest.mark.parametrize("moves", [False, True])
def test_a_scanner_that_repeats_itself_while_the_robot_moves_counts_as_silent(moves) -> None:
    nav = alone(people=[])
    assert nav.drive(START_S, 2.0)[-1].speed_limit_mps > 1.0
    repeated: list[np.ndarray] = []
    nav.change = lambda ranges: repeated[0] if repeated else (repeated.append(ranges), ranges)[1]
    nav.people.append(NEAR)  # whom the frozen scan does not show
    nav.speed_mps = 0.4 if moves else 0.0
    after = nav.drive(START_S + 2.0, 3.0)
    # By 0.05 m, which take 0.125 s, it is known.
    stopped = [each for each in after if each.stamp_s - START_S > 2.2 + TIMING.stop_after_s]
    assert all((each.speed_limit_mps == 0.0) == moves for each in stopped)
    assert any("scanner is frozen" in each for each in nav.warnings) == moves


@pytest.mark.parametrize("value", NO_ANSWERS)
def test_a_blind_scanner_keeps_the_robot_before_somebody_whom_it_saw(value: float) -> None:
    nav = alone(people=[NEAR])
    before_mps = nav.drive(START_S, 2.0)[-1].speed_limit_mps
    nav.change = every_ray(value)
    after = nav.drive(START_S + 2.0, 3.0)
    assert max(each.speed_limit_mps for each in after) <= before_mps + 1e-9
    for each in after:
        if each.stamp_s - (START_S + 2.0) > TIMING.stop_after_s + PERIOD_S:
            assert each.speed_limit_mps == 0.0
            assert "scan_front: blind (" in each.limited_by
    assert nav.standing()
    (told,) = nav.warnings
    assert told.startswith("scan_front: blind (")
    assert told.endswith("): the robot stops")
    assert nav.sensors().level == DiagnosticStatus.ERROR


def test_scans_go_on_only_while_they_see_when_the_camera_falls_silent() -> None:
    """C21: of a scanner that has gone blind before, nothing goes on."""
    nav = Blinded(FRONT, people=[NEAR], make_pipeline=attentive)
    nav.drive(START_S, 1.6)
    nav.change = every_ray(math.nan)
    goes_on = nav.drive(START_S + 1.6, 2.0)[-1]
    assert not goes_on.stale
    assert nav.warnings == ["scan_front: blind (most of its rays have no answer): camera goes on"]
    nav.silent.add("camera")
    last = nav.drive(START_S + 3.6, 3.0)[-1]
    assert last.stale
    assert nav.standing()
    assert nav.sensors().message == "lost: camera, scan_front"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (sector(-45.0, 45.0, math.nan), "blind from -45° to 45°"),
        (sector(-75.0, -50.0, 0.0), "blind from -75° to -50°"),
    ],
)
def test_a_sector_ahead_that_is_blind_stops_the_robot_and_is_named(change, words) -> None:
    nav = alone()
    assert nav.drive(START_S, 1.0)[-1].speed_limit_mps == 1.5
    nav.change = change
    last = nav.drive(START_S + 1.0, 4.0)[-1]
    assert nav.standing()
    assert last.limited_by.endswith(f"; scan_front: {words}")
    assert nav.warnings == [f"scan_front: {words}: the robot stops"]
    nav.change = lambda ranges: ranges
    assert nav.drive(START_S + 5.0, 3.0)[-1].speed_limit_mps > 1.0
    assert nav.warnings[1:] == ["scan_front is back"]


RACK, CHANCE = sector(30.0, 42.0, 0.0), np.random.default_rng(0)


@pytest.mark.parametrize(
    "change",
    [
        # Rays that meet nothing within the range are +inf; others show that the scanner lives.
        sector(-135.0, 27.0, math.inf),
        lambda ranges: np.where(CHANCE.random(RAYS) < 0.01, math.nan, RACK(ranges)),
    ],
    ids=["open hall", "single rays and a black rack"],
)
def test_a_scanner_that_misses_some_rays_is_not_blind(change: Change) -> None:
    nav = alone()
    nav.change = change
    assert nav.drive(START_S, 2.0)[-1].speed_limit_mps == 1.5
    assert nav.warnings == []


def test_somebody_behind_a_blind_sector_stays_a_person() -> None:
    nav = Blinded(FRONT, people=[(2.5, 1.2)])
    nav.drive(START_S, 2.0)
    assert len(nav.bridge.tracks) == 1
    nav.change = sector(10.0, 60.0, math.nan)
    nav.drive(START_S + 2.0, 2.5)
    (track,) = nav.bridge.tracks
    assert track.status == "coasting"
    assert not track.place_empty
