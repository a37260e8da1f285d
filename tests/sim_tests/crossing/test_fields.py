"""Today's AMR with a protective field that stops it and a warning field that slows it."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nav_adapter import NavAdapter, RobotProfile, RobotState
from sim_tests import run_crossing
from sim_tests.crossing import named_policy
from sim_tests.crossing._fields import RESTART_S, SLOW_SHARE, FieldsAdapter
from tracking import PersonTrack

BOX_M = [[0.36, 0.25], [-0.36, 0.25], [-0.36, -0.25], [0.36, -0.25]]
ROBOT = RobotProfile(BOX_M, 1.5, 1.0, 1.0, 0.3)
DT_S = 0.05
_, SCANNER = named_policy("scanner")

PLACES = st.tuples(st.floats(-2.0, 5.0), st.floats(-2.0, 2.0))
SPEEDS = st.floats(0.0, 1.5)


def person(stamp_s, position_m, velocity_mps=(0.0, 0.0)):
    return PersonTrack(
        id=1,
        stamp_s=stamp_s,
        status="confirmed",
        position_odom_m=position_m,
        velocity_odom_mps=velocity_mps,
        covariance_odom=np.diag([1e-6, 1e-6, 1e-6, 1e-6]),
        awareness=1.0,
        awareness_std=0.05,
        awareness_lower=1.0,
        height_m=1.75,
        time_since_seen_s=0.0,
    )


@settings(max_examples=50, deadline=None)
@given(PLACES, SPEEDS, st.floats(-0.5, 0.5))
def test_the_fields_only_ever_lower_the_limit_of_the_scanner(place, speed, yaw_rate):
    state = RobotState(0.0, [0.0, 0.0], 0.0, speed, yaw_rate)
    tracks = (person(0.0, place),)
    scanner = NavAdapter(SCANNER, ROBOT).update(tracks, state, 0.0)
    fields = FieldsAdapter(SCANNER, ROBOT).update(tracks, state, 0.0)
    assert fields.speed_limit_mps <= scanner.speed_limit_mps
    assert fields.fastest_point_limit_mps <= scanner.fastest_point_limit_mps
    mirrored = FieldsAdapter(SCANNER, ROBOT).update(
        (person(0.0, (place[0], -place[1])),), replace(state, yaw_rate_radps=-yaw_rate), 0.0
    )
    assert np.isclose(mirrored.speed_limit_mps, fields.speed_limit_mps, atol=1e-6)


def driven(robot, person_m, leaves_s=np.inf, lasts_s=20.0):
    """Return (stamp, place, speed, rule, the scanner's limit) of a robot with somebody ahead."""
    adapter, scanner = FieldsAdapter(SCANNER, robot), NavAdapter(SCANNER, robot)
    x_m, speed, rows = 0.0, robot.max_speed_mps, []
    for tick in range(round(lasts_s / DT_S)):
        now_s = tick * DT_S
        walked_s = max(now_s - leaves_s, 0.0)
        tracks = (person(now_s, (person_m, walked_s), (0.0, 1.0 if walked_s else 0.0)),)
        state = RobotState(now_s, [x_m, 0.0], 0.0, speed, 0.0)
        found = adapter.update(tracks, state, now_s)
        free_mps = scanner.update(tracks, state, now_s).speed_limit_mps
        rows.append((now_s, x_m, speed, found.limited_by, free_mps))
        after = np.clip(
            found.speed_limit_mps,
            speed - robot.max_deceleration_mps2 * DT_S,
            speed + robot.max_acceleration_mps2 * DT_S,
        )
        x_m, speed = x_m + 0.5 * (speed + after) * DT_S, float(after)
    return rows


@settings(max_examples=20, deadline=None)
@given(st.floats(0.8, 2.0), st.floats(0.6, 2.5), st.floats(0.2, 0.6))
def test_a_robot_slows_for_somebody_who_stands_before_they_stop_it(top_mps, brakes, reaction_s):
    robot = RobotProfile(BOX_M, top_mps, 1.0, brakes, reaction_s)
    rows = driven(robot, 12.0)
    rules = [rule for *_, rule, _ in rows]
    assert list(dict.fromkeys(rules)) == ["robot maximum", "warning field", "protective field"]
    stopped = rules.index("protective field")
    assert rows[stopped][2] <= SLOW_SHARE * top_mps + 1e-6
    assert rows[-1][2] == 0.0
    assert rows[-1][1] + 0.36 <= 12.0 - 0.30  # its front stands before the body


def test_a_stopped_robot_goes_on_once_its_field_has_been_clear_for_two_seconds():
    rows = driven(ROBOT, 6.0, leaves_s=14.0)
    slow_mps = SLOW_SHARE * ROBOT.max_speed_mps
    intruded_s = max(now_s for now_s, *_, free_mps in rows if free_mps < slow_mps)
    stopped_s = max(now_s for now_s, *_, rule, _ in rows if rule == "protective field")
    assert intruded_s > 14.0
    assert abs(stopped_s - intruded_s - RESTART_S) <= DT_S + 1e-9
    assert rows[-1][2] == ROBOT.max_speed_mps


def test_the_face_has_a_name_in_crossings():
    assert named_policy("scanner_warning") == ("scanner_warning", SCANNER)
    rules = {
        frame.constraints.limited_by
        for frame in run_crossing("group_crossing", policy="scanner_warning", seed=50).frames
    }
    assert rules == {"robot maximum", "warning field"}
