"""The speed from which a robot could have stopped, by when the cause could be seen."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from measured_scenes import ALONG_M, BODY_RADIUS_M, contact, crossing, straight

from sim_tests.study.measures import measure

T_S = np.round(np.arange(0.0, 5.001, 0.05), 2)
AT_S = 4.0
#: 0.2 s until a start is seen and 0.3 s of reaction; the robot brakes at 1 m/s².
UNTIL_BRAKING_S = 0.5
#: Two periods of the log.
SAME_MPS = 0.101
#: A robot at 1 m/s along x is at x = 4 m then, and touches whoever is 0.55 m beside.
TOUCH_M = (4.1, -0.55)


def turned(walk, angle):
    """The same walk in a world that is turned."""
    cos, sin = math.cos(angle), math.sin(angle)

    def there(t):
        x, y, vx, vy = walk(t)
        return cos * x - sin * y, sin * x + cos * y, cos * vx - sin * vy, sin * vx + cos * vy

    return there


def sets_off(warning_s, speed_mps=1.2, along_mps=0.0):
    """Somebody who stands, or walks beside the robot's path, and then comes to it."""

    def walk(t):
        left_s = AT_S - t
        aside_m = speed_mps * min(left_s, warning_s)
        vy = speed_mps if left_s < warning_s else 0.0
        return TOUCH_M[0] - along_mps * left_s, TOUCH_M[1] - aside_m, along_mps, vy

    return walk


def turned_robot(drive, angle):
    def there(t):
        x, y, heading, speed = drive(t)
        x, y, *_ = turned(lambda _: (x, y, 0.0, 0.0), angle)(t)
        return x, y, heading + angle, speed

    return there


def stoppable_mps(walk, *, angle=0.0, boxes=(), speed_mps=1.0):
    start = (AT_S * (1.0 - speed_mps), 0.0)
    record = measure(
        crossing(
            T_S,
            turned_robot(straight(speed_mps, start), angle),
            [turned(walk, angle)],
            contacts=[contact(AT_S, 0, "person", speed_mps)],
            obstacle_boxes_odom_m=np.array(boxes).reshape(-1, 4),
        )
    )
    assert record.moving_contacts == 1
    return record.moving_contact_stoppable_mps


@given(
    warning_s=st.floats(0.1, 3.0),
    speed_mps=st.floats(0.5, 2.0),
    along_mps=st.sampled_from([0.0, 0.5]),
    angle=st.floats(-math.pi, math.pi),
    robot_mps=st.floats(0.1, 1.5),
)
@settings(max_examples=25)
def test_a_robot_has_from_the_start_on(warning_s, speed_mps, along_mps, angle, robot_mps):
    """Whichever way the world is turned, whether they stood or walked, whatever its own speed."""
    assume(warning_s * speed_mps > 0.15)  # the robot passes nobody nearer than that
    walk = sets_off(warning_s, speed_mps, along_mps)
    found = stoppable_mps(walk, angle=angle, speed_mps=robot_mps)
    assert found == pytest.approx(max(warning_s - UNTIL_BRAKING_S, 0.0), abs=SAME_MPS)


@pytest.mark.parametrize("walk", [sets_off(0.0), sets_off(9.0)], ids=["stands", "walks"])
def test_for_whoever_comes_as_they_always_did_it_had_all_the_time(walk):
    assert stoppable_mps(walk) == pytest.approx(AT_S - UNTIL_BRAKING_S)


@given(late_s=st.floats(0.0, 0.049), walks_mps=st.floats(0.0, 2.0))
@settings(max_examples=15)
def test_a_contact_between_two_instants_of_the_log_excuses_no_robot(late_s, walks_mps):
    """Somebody who comes head-on is not near yet at the instant before."""
    at_s = AT_S + late_s

    def walk(t):
        return at_s + ALONG_M + BODY_RADIUS_M + walks_mps * (at_s - t), 0.0, -walks_mps, 0.0

    touched = [contact(at_s, 0, "robot", 1.0)]
    record = measure(crossing(T_S, straight(1.0, (0.0, 0.0)), [walk], contacts=touched))
    found = record.moving_contact_stoppable_mps
    assert found == pytest.approx(at_s - UNTIL_BRAKING_S, abs=SAME_MPS)


@pytest.mark.parametrize("clear_m", [0.8, 1.6, 3.0])
def test_somebody_behind_a_rack_can_be_seen_once_the_line_is_free(clear_m):
    """They walk at 1.2 m/s all along; a side of their body is seen before their centre."""
    edge = TOUCH_M[1] - clear_m
    rack = (-9.0, edge - 9.0, 9.0, edge)
    found = stoppable_mps(sets_off(9.0), boxes=[rack])
    centre_mps = clear_m / 1.2 - UNTIL_BRAKING_S
    assert centre_mps - SAME_MPS <= found <= centre_mps + 0.3 / 1.2 + SAME_MPS
