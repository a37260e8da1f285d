"""Clocks of the bridge: steps back, messages from the future, static transforms."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_scenes import MOUNT, START_S, Robot, Seeing, odometry, tf
from hypothesis import given, settings
from hypothesis import strategies as st

from nav_adapter.ros2 import TransformBuffer
from tracking.prediction import PredictionModel

PERIOD_S = 0.05


class Mounted(Robot):
    """A robot that drives, and hears once where its camera is."""

    period_s, speed_mps = PERIOD_S, 0.5

    def __init__(self, **settings) -> None:
        super().__init__(T_base_camera=None, **settings)
        self.bridge.on_transforms(tf("base_link", "camera", MOUNT), static=True)


def test_a_clock_step_of_10_ms_back_changes_nothing() -> None:
    robot = Mounted()
    robot.drive(START_S, 1.0)
    last_s = START_S + 1.0 - PERIOD_S
    # The second reading after the step, of a rate so fast that the clock has not caught up.
    for now_s in (last_s - 0.010, last_s - 0.005):
        constraints = robot.bridge.tick(now_s)
        assert constraints.stamp_s == last_s
        assert not robot.standing()
    for constraints in robot.drive(last_s + 0.04, 1.0):
        assert constraints.limited_by == "robot maximum"
    assert robot.bridge.counts["clock_restarts"] == 0
    assert robot.warnings == []


@settings(max_examples=8)
@given(st.floats(0.0, 3600.0), st.floats(-3600.0, 3600.0))
def test_static_transforms_survive_any_clock_step(before_s: float, step_s: float) -> None:
    robot = Mounted(wanted={"speed_limit", "collision_polygons"}.__contains__)
    robot.drive(START_S + before_s + 3600.0, 0.2)
    # tf_static is latched: it does not come again.
    constraints = robot.drive(START_S + before_s + 3600.2 + step_s, 3.0)
    assert constraints[-1].limited_by == "robot maximum"
    assert not robot.standing()


def test_a_clock_that_was_set_back_starts_the_buffers_anew_after_1_s() -> None:
    robot = Mounted(make_pipeline=lambda camera: Seeing(4.0))
    robot.drive(START_S, 1.0)
    (before,) = robot.bridge.tracks
    new_s = START_S - 500.0
    constraints = robot.drive(new_s, 2.0)
    stood = [each.stamp_s for each in constraints if each.speed_limit_mps == 0.0]
    assert stood[0] == new_s
    assert 1.0 <= stood[-1] - new_s <= 1.1
    assert {each.limited_by for each in constraints[:20]} == {"the clock went backward"}
    assert not constraints[-1].stale
    assert not robot.standing()
    assert "the clock has been set back" in "".join(robot.warnings)
    assert robot.details()["clock_restarts"] == "1"
    # Ids go on, so that nobody inherits the id of somebody else.
    (after,) = robot.bridge.tracks
    assert after.id > before.id
    assert after.stamp_s == constraints[-1].stamp_s


def test_after_a_clock_step_the_limit_rises_slowly_and_the_prediction_stays() -> None:
    """The way to start anew is the adapter's own; a new adapter would allow 1.5 m/s at once."""
    eyes = Seeing(4.0)
    prediction = PredictionModel(lag_per_s2=0.5)
    robot = Mounted(make_pipeline=lambda camera: eyes, prediction=prediction)
    before = robot.drive(START_S, 2.0)[-1].speed_limit_mps
    assert 0.0 < before < 1.4
    eyes.gone = True  # nobody is seen after the step
    constraints = robot.drive(START_S - 500.0, 3.0)
    limits = [each.speed_limit_mps for each in constraints]
    first = next(index for index, limit in enumerate(limits) if limit > 0.0)
    assert limits[first] <= before + 0.3
    assert constraints[first].limited_by == "recovery after stale data"
    assert max(np.diff(limits[first:])) <= 0.05 + 1e-9
    assert limits[-1] == 1.5
    assert {each.speed_basis.prediction for each in constraints[first:]} == {prediction}


def test_one_wrong_reading_of_the_clock_does_not_delete_people() -> None:
    robot = Mounted()
    robot.drive(START_S, 1.0)
    frame = robot.bridge.frame
    assert robot.bridge.tick(START_S - 100.0).limited_by == "the clock went backward"
    assert robot.bridge.frame is frame
    assert robot.step(START_S + 1.0).limited_by == "robot maximum"
    assert robot.bridge.counts["clock_restarts"] == 0


def test_one_odometry_message_from_the_future_does_not_block_the_next_ones() -> None:
    robot = Mounted()
    robot.drive(START_S, 1.0)
    now_s = START_S + 1.0
    robot.bridge.on_odometry(odometry(now_s + 3600.0, x=50.0), now_s)
    for constraints in robot.drive(now_s, 2.0):
        assert constraints.limited_by == "robot maximum"
        assert not constraints.stale
    assert robot.bridge.robot_state is not None
    assert robot.bridge.robot_state.stamp_s == constraints.stamp_s
    assert robot.details()["odometry_from_future"] == "1"
    assert robot.warnings == [
        "odometry: the stamp is 3600.000 s ahead of this computer's clock: refused and counted, "
        "without further warnings"
    ]


def test_without_a_time_odometry_from_the_future_is_dropped_by_the_next_tick() -> None:
    robot = Mounted()
    robot.drive(START_S, 1.0)
    now_s = START_S + 1.0
    robot.bridge.on_odometry(odometry(now_s + 3600.0))
    assert robot.bridge.tick(now_s).limited_by == "no odometry yet"
    assert robot.standing()
    for constraints in robot.drive(now_s + PERIOD_S, 1.0):
        assert constraints.limited_by == "robot maximum"
    assert robot.details()["odometry_from_future"] == "1"


def test_odometry_slightly_ahead_is_used() -> None:
    robot = Mounted()
    robot.drive(START_S, 1.0)
    now_s = START_S + 1.0
    robot.bridge.on_odometry(odometry(now_s + 0.049), now_s)
    assert robot.bridge.tick(now_s).limited_by == "robot maximum"
    assert robot.bridge.robot_state is not None
    assert robot.bridge.robot_state.stamp_s == pytest.approx(now_s + 0.049)


def test_transforms_from_the_future_are_refused_and_counted() -> None:
    robot = Mounted()
    now_s = START_S
    robot.bridge.on_transforms(tf("odom", "base_link", MOUNT, now_s + 3600.0), now_s)
    assert robot.bridge.counts["transforms_from_future"] == 1
    assert "transforms: the stamp is 3600.000 s ahead" in robot.warnings[-1]
    # Localisation stamps map -> odom ahead on purpose: neither used nor counted.
    robot.bridge.on_transforms(tf("map", "odom", MOUNT, now_s + 1.0), now_s)
    assert robot.bridge.counts["transforms_from_future"] == 1
    assert robot.drive(now_s, 1.0)[-1].limited_by == "robot maximum"


def test_the_buffer_forgets_moving_transforms_only() -> None:
    buffer, here = TransformBuffer(), np.eye(4)
    buffer.add("base_link", "camera", 0.0, here, static=True)
    for stamp_s in (1.0, 2.0, 3.0):
        buffer.add("odom", "base_link", stamp_s, here)
    assert buffer.forget(after_s=3.0) == 0
    assert buffer.forget(after_s=2.0) == 1
    assert (buffer.lookup("odom", "camera", 2.0) == here).all()
    assert buffer.forget() == 2
    assert (buffer.lookup("base_link", "camera", 99.0) == here).all()
    with pytest.raises(Exception, match="no transform between"):
        buffer.lookup("odom", "camera", 2.0)
