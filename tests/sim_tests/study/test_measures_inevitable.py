"""Contacts that nobody could have prevented: the warning, and what braking takes."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from measured_scenes import contact, crossing, straight

from sim_tests.study.measures import measure

T_S = np.round(np.arange(0.0, 5.001, 0.05), 2)
AT_S = 4.0
#: 0.2 s until a start is seen, 0.3 s of reaction, and 1 m/s at 1 m/s².
NEEDS_S = 1.5
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


def inevitable(walk, *, angle=0.0, boxes=(), speed_mps=1.0):
    where = contact(AT_S, 0, "person", speed_mps)
    start = (AT_S * (1.0 - speed_mps), 0.0)
    record = measure(
        crossing(
            T_S,
            straight(speed_mps, start, angle),
            [turned(walk, angle)],
            contacts=[where],
            obstacle_boxes_odom_m=np.array(boxes).reshape(-1, 4),
        )
    )
    assert record.moving_contacts == 1
    return record.moving_contacts_inevitable == 1.0


@given(
    warning_s=st.floats(0.1, 3.0).filter(lambda each: abs(each - NEEDS_S) > 0.11),
    speed_mps=st.floats(0.5, 2.0),
    along_mps=st.sampled_from([0.0, 0.5]),
    angle=st.floats(-math.pi, math.pi),
)
def test_a_start_too_late_to_brake_for_is_inevitable(warning_s, speed_mps, along_mps, angle):
    """Whichever way the world is turned, and whether they stood or walked before."""
    assume(warning_s * speed_mps > 0.15)  # the robot passes nobody nearer than that
    found = inevitable(sets_off(warning_s, speed_mps, along_mps), angle=angle)
    assert found == (warning_s < NEEDS_S)


@pytest.mark.parametrize("walk", [sets_off(0.0), sets_off(9.0)], ids=["stands", "walks"])
def test_whoever_comes_as_they_always_did_could_be_braked_for(walk):
    assert not inevitable(walk)


def test_a_slower_robot_has_fewer_excuses():
    assert inevitable(sets_off(1.0))
    assert not inevitable(sets_off(1.0), speed_mps=0.3)


@pytest.mark.parametrize(("clear_m", "late"), [(0.8, True), (3.0, False)])
def test_somebody_behind_a_rack_can_be_seen_once_the_line_is_free(clear_m, late):
    """They walk at 1.2 m/s all along; the rack hides them until they are so far from the robot."""
    edge = TOUCH_M[1] - clear_m
    rack = (-9.0, edge - 9.0, 9.0, edge)
    assert inevitable(sets_off(9.0), boxes=[rack]) == late
