"""The bridge: input that is missing, late, refused or damaged, and its published messages."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from bridge_scenes import (
    FRONT,
    INFO,
    MOUNT,
    PERSON,
    START_S,
    TIMING,
    Listener,
    Seeing,
    image,
    odometry,
    tf,
)
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scan_scenes import scan_message

from nav_adapter import AwarenessPolicy, NavError
from nav_adapter.policies import AttentionRules
from nav_adapter.ros2 import decode, encode
from nav_adapter.ros2.conversions import to_time
from nav_adapter.ros2.messages.geometry_msgs import (
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_adapter.ros2.messages.nav_msgs import Odometry
from nav_adapter.ros2.messages.std_msgs import Header
from perception import Camera
from perception.laser import LegDetector

DETECTOR = LegDetector()


@pytest.mark.parametrize("silent", ["camera", "odometry"])
def test_a_silent_source_stops_the_robot_until_it_returns(silent: str) -> None:
    nav = Listener()
    nav.bridge.on_camera_info(INFO)
    stood_from = None
    for tick in range(100):
        now = START_S + 0.05 * tick
        talks = now < START_S + 1.0 or now > START_S + 4.0
        if talks or silent != "odometry":
            nav.bridge.on_odometry(odometry(now))
        if talks or silent != "camera":
            nav.bridge.on_image(image(now), now)
        constraints = nav.bridge.tick(now)
        if nav.standing() and stood_from is None:
            stood_from = now
            assert "stale data" in constraints.limited_by
    assert stood_from is not None
    assert stood_from - (START_S + 1.0) <= TIMING.stop_after_s + 0.051
    assert not nav.standing()


def test_every_tick_publishes_every_topic_that_is_wanted_once() -> None:
    once = ["speed_limit", "collision_polygons", "alerts", "stop_zone", "grid", "obstacles"]
    once += ["people", "detections", "markers"]
    wanted = {"speed_limit", "alerts"}
    camera = Camera(64, 48, 50.0, 50.0, 32.0, 24.0)
    every, some = Listener(camera=camera), Listener(camera=camera, wanted=wanted.__contains__)
    for nav, keys in ((every, once), (some, wanted)):
        nav.bridge.on_odometry(odometry(START_S))
        nav.bridge.on_image(image(START_S), START_S)
        constraints = nav.bridge.tick(START_S + 0.01)
        assert {key: len(sent) for key, sent in nav.heard.items()} == dict.fromkeys(keys, 1)
        assert constraints.limited_by == "robot maximum"  # computed all the same
    wanted.add("markers")
    some.bridge.tick(START_S + 0.02)
    assert set(some.heard) == wanted
    # The stop is published on every topic, for late subscribers too.
    some.bridge.stop(START_S + 0.03, "the end")
    assert {"collision_polygons", "stop_zone", "people"} <= set(some.heard)
    assert some.standing()


def test_every_alert_is_in_one_message() -> None:
    approaching = Seeing(lambda now: 6.0 - 1.1 * (now - START_S), 0.0)
    asks = AwarenessPolicy(attention=AttentionRules(min_gain_s=0.5))
    nav = Listener(make_pipeline=lambda camera: approaching, policy=asks)
    nav.bridge.on_camera_info(INFO)
    asked = []
    for tick in range(100):
        now = START_S + 0.05 * tick
        nav.bridge.on_odometry(odometry(now, x=0.5 * (now - START_S)))
        assert nav.bridge.on_image(image(now), now)
        asked += [(now, each) for each in nav.bridge.tick(now).alerts]
    sent = [
        (message.header.stamp, status)
        for message in nav.heard["alerts"]
        for status in message.status[1:]
    ]
    assert [(to_time(now), f"awarenav: {each.kind}") for now, each in asked] == [
        (stamp, status.name) for stamp, status in sent
    ]
    kinds = [status.name.removeprefix("awarenav: ") for _, status in sent]
    # As the person comes nearer: light, then voice, then the horn; and a request to look.
    assert [each for each in kinds if each != "attention"] == ["light", "voice", "horn"]
    assert kinds.count("attention") == 1
    assert all(message.status[0].name == "awarenav: speed limit" for message in nav.heard["alerts"])
    assert len(nav.heard["alerts"]) == 100


def test_the_pose_of_the_camera_can_come_from_tf() -> None:
    nav = Listener(T_base_camera=None)
    nav.bridge.on_camera_info(INFO)
    nav.bridge.on_odometry(odometry(START_S, x=2.0))
    assert not nav.bridge.on_image(image(START_S), START_S)
    assert "no transform between 'camera' and 'odom'" in nav.warnings[-1]
    nav.bridge.on_transforms(tf("base_link", "camera", MOUNT), static=True)
    assert nav.bridge.on_image(image(START_S), START_S)
    assert nav.bridge.frame is not None
    T = nav.bridge.frame.T_odom_camera
    assert np.allclose(T[:3, 3], [2.2, 0.0, 1.4])
    assert np.allclose(T[:3, :3], MOUNT[:3, :3])


def test_refused_images_warn_once_and_stop_the_robot_when_stale() -> None:
    nav = Listener()
    nav.bridge.on_camera_info(INFO)
    for tick in range(80):
        now = START_S + 0.05 * tick
        nav.bridge.on_odometry(odometry(now))
        if tick == 0:
            assert nav.bridge.on_image(image(now), now)
        else:
            assert not nav.bridge.on_image(image(now + 1.0), now)
        nav.bridge.tick(now)
    assert nav.standing()
    assert nav.bridge.counts["images_from_future"] == 79
    assert nav.warnings == ["image: the image's stamp is 1.000 s ahead of this computer's clock"]


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (Odometry(Header(to_time(START_S), "map"), "base_link"), "must be in frame 'odom'"),
        (
            Odometry(
                Header(to_time(START_S), "odom"),
                pose=PoseWithCovariance(Pose(orientation=Quaternion(w=0.0))),
            ),
            "quaternion",
        ),
        (odometry(START_S, speed=math.nan), "speed_mps"),
        (odometry(START_S, x=math.inf), "finite"),
        (odometry(START_S, x=1e300), "1e+06 m"),
        (odometry(START_S, speed=1e300), "speed_mps must be within 100 m/s"),
    ],
)
def test_impossible_odometry_is_refused(message: Odometry, text: str) -> None:
    nav = Listener()
    nav.bridge.on_odometry(message)
    assert text in nav.warnings[-1]
    assert nav.bridge.robot_state is None
    nav.bridge.tick(START_S)
    assert nav.standing()


@settings(max_examples=40)
@given(
    st.sampled_from(["odometry", "camera_info", "transforms", "image", "scan"]),
    st.lists(st.tuples(st.integers(4, 4000), st.integers(0, 255)), min_size=1, max_size=6),
)
@example("odometry", [(1144, 1)])  # the smallest yaw rate above 0
def test_damaged_messages_never_crash_the_bridge_and_its_messages_are_valid(which, damage) -> None:
    nav = Listener(T_base_camera=None, scanners=[FRONT], make_detector=lambda: DETECTOR)
    good = {
        "odometry": odometry(START_S),
        "camera_info": INFO,
        "transforms": tf("base_link", "camera", MOUNT),
        "image": image(START_S),
        "scan": scan_message(START_S, [PERSON]),
    }
    for name, message in good.items():
        if name == which:
            data = bytearray(encode(message))
            for place, value in damage:
                data[4 + place % (len(data) - 4)] = value
            try:
                message = decode(type(message), bytes(data))  # noqa: PLW2901
            except NavError:
                continue
        if name == "image":
            nav.bridge.on_image(message, START_S)
        elif name == "scan":
            nav.bridge.on_scan(0, message, START_S)
        else:
            getattr(nav.bridge, f"on_{name}")(message)
        nav.bridge.tick(START_S)
        nav.standing()
    for messages in nav.heard.values():
        for message in messages:
            encode(message)


def test_lateral_speed_of_the_odometry_counts() -> None:
    """A holonomic robot at 1.2 m/s to the left does not stand."""
    nav = Listener()
    twist = TwistWithCovariance(Twist(Vector3(0.0, 1.2, 0.0)))
    nav.bridge.on_camera_info(INFO)
    nav.bridge.on_odometry(replace(odometry(START_S), twist=twist))
    assert nav.bridge.robot_state.travel_mps == 1.2
    assert nav.bridge.robot_state.velocity_odom_mps == pytest.approx((0.0, 1.2))
    nav.bridge.on_image(image(START_S), START_S)
    nav.bridge.tick(START_S)
    # The stop zone reaches 1.2 · 0.3 + 1.2² / 2 = 1.08 m to the left of the footprint, and no
    # farther ahead than the footprint.
    corners = nav.heard["stop_zone"][-1].polygon.points
    assert max(corner.y for corner in corners) == pytest.approx(0.25 + 1.08)
    assert max(corner.x for corner in corners) == pytest.approx(0.3625)
    too_fast = TwistWithCovariance(Twist(Vector3(0.0, 1e3, 0.0)))
    nav.bridge.on_odometry(replace(odometry(START_S), twist=too_fast))
    assert "speed_mps must be within 100 m/s" in nav.warnings[-1]
