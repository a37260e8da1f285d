"""The published speed mask: the rate, the info that comes once, and stops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from bridge_scenes import INFO, START_S, Listener, image, odometry
from nav_scenes import ROBOT, person, robot_at
from numpy.typing import NDArray

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError, RobotState
from nav_adapter.exporters import speed_limit_at
from nav_adapter.ros2 import SpeedMaskSettings
from nav_adapter.ros2._speed_mask import SpeedMaskStream
from nav_adapter.ros2.messages import Message
from nav_adapter.ros2.messages.nav_msgs import OccupancyGrid

MASK, INFO_KEY = "speed_mask", "speed_mask_info"


def drive(seconds: float) -> list[tuple[NavConstraints, RobotState]]:
    """Return 20 updates per second: the robot drives up to a person who walks aside."""
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT)
    found = []
    for tick in range(round(20 * seconds)):
        now = 0.05 * tick
        state = robot_at(now, position=(0.5 * now, 0.0), speed_mps=0.5)
        people = [person(now, position=(4.0, 0.3 * now), velocity=(0.0, 0.3))]
        found.append((adapter.update(people, state, now), state))
    return found


def sent(
    stream: SpeedMaskStream, updates: Sequence[tuple[NavConstraints, RobotState | None]], *keys: str
) -> list[tuple[float, str, Any]]:
    """Return stamp, key and message of what the stream sends."""
    wanted = keys or (MASK, INFO_KEY)
    return [
        (constraints.stamp_s, key, message)
        for constraints, state in updates
        for key, message in stream.messages(constraints, state, lambda key: key in wanted)
    ]


def values(mask: Message) -> NDArray[np.int8]:
    assert isinstance(mask, OccupancyGrid)
    return np.frombuffer(mask.data, np.int8).reshape(mask.info.height, mask.info.width)


def test_masks_come_at_their_rate_and_the_info_once() -> None:
    settings = SpeedMaskSettings(rate_hz=4.0, size_m=6.0, resolution_m=0.2, topic="/robot_1/mask")
    found = sent(SpeedMaskStream(settings, "odom"), drive(1.0))
    np.testing.assert_allclose(
        [stamp for stamp, key, _ in found if key == MASK], [0.0, 0.25, 0.5, 0.75]
    )
    # Nav2's filter subscribes to the mask anew at every info.
    (info,) = [message for _, key, message in found if key == INFO_KEY]
    assert (info.filter_mask_topic, info.type) == ("/robot_1/mask", 1)
    mask = found[-1][2]
    assert (mask.info.width, mask.info.height, mask.header.frame_id) == (30, 30, "odom")
    # It does so at the info, so nobody reads the mask before.
    stream = SpeedMaskStream(settings, "odom")
    first = sent(stream, drive(0.5), INFO_KEY)
    assert [(stamp, key) for stamp, key, _ in first] == [(0.0, INFO_KEY)]
    later = sent(stream, drive(1.0)[10:])
    assert {key for _, key, _ in later} == {MASK}
    without_info = sent(SpeedMaskStream(settings, "odom"), drive(0.2), MASK)
    assert [key for _, key, _ in without_info] == [MASK]


def test_a_mask_holds_until_the_next_one() -> None:
    updates = drive(0.6)
    settings = SpeedMaskSettings(rate_hz=2.0, size_m=8.0, resolution_m=0.1)
    found = sent(SpeedMaskStream(settings, "odom"), updates, MASK)
    mask = found[-1][2]
    (constraints,) = [each for each, _ in updates if each.stamp_s == found[-1][0]]
    shares = values(mask)
    assert shares[shares > 0].max() > 1
    origin = mask.info.origin.position
    rows, columns = np.nonzero(shares > 1)
    cells = np.stack([columns, rows], axis=1) + 0.5
    places = np.array([origin.x, origin.y]) + 0.1 * cells
    limits = speed_limit_at(constraints, np.repeat(places[:, None], 2, axis=1), dt_s=0.5)
    allowed_mps = shares[rows, columns] / 100.0 * ROBOT.max_speed_mps
    assert (allowed_mps <= limits.min(axis=1) + 1e-9).all()


def test_a_lack_of_data_is_a_stop_everywhere_at_once() -> None:
    stream = SpeedMaskStream(SpeedMaskSettings(rate_hz=1.0, size_m=4.0), "odom")
    updates = drive(0.5)
    stop = NavConstraints(0.5, (), 0.0, "no data", True)
    assert sent(stream, [(stop, None)]) == []  # nothing to stop in before the first mask
    first = sent(stream, updates, MASK)
    stops = sent(stream, [(stop, None), (NavConstraints(0.55, (), 0.0, "no data", True), None)])
    assert [(stamp, key) for stamp, key, _ in stops] == [(0.5, INFO_KEY), (0.5, MASK)]
    assert values(first[0][2]).max() > 1
    assert (values(stops[1][2]) == 1).all()
    assert stops[1][2].info.origin == first[0][2].info.origin


def test_the_bridge_publishes_the_mask_if_it_is_asked_to() -> None:
    quiet = Listener()
    nav = Listener(speed_mask=SpeedMaskSettings(rate_hz=10.0, size_m=4.0, resolution_m=0.2))
    for listener in (quiet, nav):
        listener.bridge.on_camera_info(INFO)
        for tick in range(5):
            now = START_S + 0.05 * tick
            listener.bridge.on_odometry(odometry(now))
            listener.bridge.on_image(image(now), now)
            listener.bridge.tick(now)
    assert not {MASK, INFO_KEY} & set(quiet.heard)
    assert (len(nav.heard[MASK]), len(nav.heard[INFO_KEY])) == (3, 1)
    assert (values(nav.heard[MASK][-1]) == 0).all()  # nobody: no limit
    nav.bridge.stop(START_S + 0.25, "the end")
    assert (values(nav.heard[MASK][-1]) == 1).all()


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"rate_hz": 51.0}, "rate_hz must be at most 50, got 51"),
        ({"resolution_m": 0.001}, "resolution_m"),
        ({"size_m": 0.01}, "size_m"),
        ({"size_m": 200.0}, "at most 1000000 cells, got size_m 200 and resolution_m 0.1"),
    ],
)
def test_settings_out_of_bounds_are_refused(settings: dict[str, float], text: str) -> None:
    with pytest.raises(NavError, match=text):
        SpeedMaskSettings(**settings)
