"""The bridge with laser scanners: whom it sees, and what a lost sensor means."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bridge_scenes import (
    FRONT,
    INFO,
    PERSON,
    REAR,
    START_S,
    TIMING,
    Listener,
    Robot,
    attentive,
    image,
    odometry,
    scanning,
)
from scan_scenes import scan_message

from nav_adapter import NavError
from nav_adapter.ros2.messages.diagnostic_msgs import DiagnosticStatus


def test_the_robot_stands_until_every_sensor_has_been_heard() -> None:
    nav = Listener(scanners=[FRONT, REAR])
    sent = (
        (lambda: None, "no odometry yet"),
        (lambda: nav.bridge.on_odometry(odometry(START_S)), "no camera_info yet"),
        (lambda: nav.bridge.on_camera_info(INFO), "no camera frame yet"),
        (lambda: nav.bridge.on_image(image(START_S), START_S), "no scan yet from 'scan_front'"),
        (
            lambda: nav.bridge.on_scan(0, scan_message(START_S), START_S),
            "no scan yet from 'scan_rear'",
        ),
    )
    for send, reason in sent:
        send()
        assert nav.bridge.tick(START_S).limited_by == reason
        assert nav.standing()
    assert nav.bridge.on_scan(1, scan_message(START_S), START_S)
    assert nav.bridge.tick(START_S).limited_by == "robot maximum"
    assert not nav.standing()


def test_somebody_whom_only_a_scanner_sees_is_a_person_and_unaware() -> None:
    nav = Robot(FRONT, people=[PERSON])
    constraints = nav.drive(START_S, 1.0)[-1]
    (track,) = nav.bridge.tracks
    assert track.status == "confirmed"
    assert np.linalg.norm(track.position_odom_m - PERSON) < 0.1
    (obstacle,) = constraints.obstacles
    assert obstacle.awareness_lower == 0.0
    assert constraints.speed_limit_mps < 1.4
    assert nav.details()["scans"] == "25"
    assert nav.details()["scans_refused"] == "0"


def test_a_person_before_both_sensors_is_one_and_a_scan_takes_no_awareness() -> None:
    alone = Robot(make_pipeline=attentive)
    both = Robot(FRONT, people=[(3.2, -0.2)], make_pipeline=attentive)
    lower = []
    for nav in (alone, both):
        nav.drive(START_S, 1.0)
        (track,) = nav.bridge.tracks
        lower.append(track.awareness_lower)
    assert min(lower) > 0.5
    assert lower[1] == pytest.approx(lower[0], abs=0.05)


def test_a_lost_scanner_leaves_the_camera_as_it_is_alone_and_says_so() -> None:
    alone = Robot(make_pipeline=attentive)
    both = Robot(FRONT, people=[(3.2, -0.2), (1.0, 2.5)], make_pipeline=attentive)
    before = [nav.drive(START_S, 1.6)[-1] for nav in (alone, both)]
    assert [len(each.obstacles) for each in before] == [1, 2]
    both.silent.add("scan_front")
    after = [nav.drive(START_S + 1.6, 8.0) for nav in (alone, both)]
    for camera, degraded in zip(*after, strict=True):
        assert not degraded.stale
        assert degraded.speed_limit_mps <= camera.speed_limit_mps + 1e-6
        assert len(degraded.obstacles) >= 1
    assert after[1][-1].speed_limit_mps == pytest.approx(after[0][-1].speed_limit_mps, abs=0.02)
    assert both.warnings == ["scan_front has been silent for 0.5 s: camera goes on"]
    assert both.sensors().level == DiagnosticStatus.WARN
    assert both.sensors().message == "lost: scan_front"
    ages = {pair.key: float(pair.value) for pair in both.sensors().values}
    assert ages["camera_age_s"] < 0.1
    assert ages["scan_front_age_s"] == pytest.approx(8.0, abs=0.1)
    both.silent.clear()
    both.drive(START_S + 9.6, 0.2)
    assert both.warnings[1:] == ["scan_front is back"]
    assert both.sensors().level == DiagnosticStatus.OK


def test_a_lost_camera_makes_everybody_unaware_and_a_scanner_goes_on() -> None:
    nav = Robot(FRONT, people=[(3.2, -0.2)], make_pipeline=attentive)
    (obstacle,) = nav.drive(START_S, 1.6)[-1].obstacles
    assert obstacle.awareness_lower > 0.5
    aware_mps = nav.drive(START_S + 1.6, 0.4)[-1].speed_limit_mps
    nav.silent.add("camera")
    for constraints in nav.drive(START_S + 2.0, 3.0):
        assert not constraints.stale
        (obstacle,) = constraints.obstacles
        if constraints.stamp_s - (START_S + 2.0) > TIMING.stale_after_s:
            assert obstacle.awareness_lower == 0.0
            assert constraints.speed_limit_mps < aware_mps
    assert nav.warnings == [
        "camera has been silent for 0.5 s: scan_front goes on, and everybody counts as unaware"
    ]
    assert nav.sensors().message == "lost: camera"
    assert nav.details()["frame_age_s"] == "3.000"


@pytest.mark.parametrize(
    ("scanners", "goes_on"),
    [((FRONT,), True), ((REAR,), False), ((FRONT, REAR), True)],
    ids=["ahead", "behind", "both"],
)
def test_scanners_replace_the_camera_only_where_it_looked(scanners, goes_on: bool) -> None:
    narrow = {"field_of_view_deg": [-80.0, 80.0]}
    scanners = tuple(replace(each, mount=each.mount.model_copy(update=narrow)) for each in scanners)
    nav = Robot(*scanners)
    assert not nav.drive(START_S, 1.0)[-1].stale
    nav.silent.add("camera")
    last = nav.drive(START_S + 1.0, 2.0)[-1]
    assert last.stale is not goes_on
    assert nav.standing() is not goes_on
    assert ("perception is" in last.limited_by) is not goes_on


def test_losing_everything_stops_the_robot_and_says_so() -> None:
    nav = Robot(FRONT)
    nav.drive(START_S, 1.0)
    nav.silent |= {"camera", "scan_front"}
    for constraints in nav.drive(START_S + 1.0, 3.0):
        silent_s = constraints.stamp_s - (START_S + 1.0 - Robot.period_s)
        if silent_s > TIMING.stop_after_s + 0.02:
            assert nav.standing()
            assert "stale data" in constraints.limited_by
    assert nav.standing()
    assert nav.sensors().level == DiagnosticStatus.ERROR
    assert "the robot stops" in "".join(nav.warnings)


def test_scanners_alone_need_no_camera() -> None:
    nav = scanning(people=[PERSON])
    nav.bridge.on_camera_info(INFO)
    constraints = nav.drive(START_S, 1.0)[-1]
    assert nav.bridge.camera is None
    assert not constraints.stale
    assert 0.0 < constraints.speed_limit_mps < 1.5
    assert [each.awareness_lower for each in constraints.obstacles] == [0.0]
    assert nav.sensors().message == "all sensors are at work"
    assert "camera" not in "".join(pair.key for pair in nav.sensors().values)
    nav.silent.add("scan_front")
    nav.drive(START_S + 1.0, 2.0)
    assert nav.standing()


def test_a_scanner_alone_that_looks_back_is_not_enough() -> None:
    narrow = REAR.mount.model_copy(update={"field_of_view_deg": [-90.0, 90.0]})
    nav = scanning(replace(REAR, mount=narrow))
    assert nav.drive(START_S, 0.5)[-1].limited_by == "no sensor sees what is ahead"
    assert nav.standing()


def test_a_bridge_without_sensors_is_refused() -> None:
    with pytest.raises(NavError, match="scanners must name one or two, got none"):
        Listener(with_camera=False)
    with pytest.raises(NavError, match="made without scanners"):
        Listener().bridge.on_scan(0, scan_message(START_S), START_S)
    with pytest.raises(NavError, match="0 to 0, got 1"):
        Listener(scanners=[FRONT]).bridge.on_scan(1, scan_message(START_S), START_S)


def test_the_camera_alone_has_no_status_of_sensors() -> None:
    nav = Robot()
    nav.drive(START_S, 0.2)
    assert len(nav.heard["alerts"][-1].status) == 1
    assert not any("scan" in name or "tracker" in name for name in nav.details())


def test_a_scanner_with_a_wrong_clock_does_not_stop_the_camera() -> None:
    nav = Robot(FRONT)
    nav.drive(START_S, 1.0)
    nav.silent.add("scan_front")
    for tick in range(50):
        now = START_S + 1.0 + Robot.period_s * tick
        constraints = nav.step(now)
        assert not nav.bridge.on_scan(0, scan_message(now - 4.0), now)
    assert not constraints.stale
    assert nav.sensors().message == "lost: scan_front"
