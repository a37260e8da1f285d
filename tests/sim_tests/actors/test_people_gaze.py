"""Glances: their statistics against closed forms, and the motion of head and eyes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests import SimError
from sim_tests.actors.behaviour import (
    Glances,
    Person,
    PersonMotion,
    PersonSpec,
    RobotBody,
    Surroundings,
)
from sim_tests.actors.behaviour._gaze import Gaze, LogNormalDuration
from sim_tests.actors.behaviour._habits import CLASSIC, RECORDED


def robot_at(x: float, y: float, height_m: float = 1.4) -> RobotBody:
    return RobotBody(x, y, 0.0, 0.0, 0.0, 0.36, 0.25, (x, y, height_m))


def watch(gaze: Gaze, path, seconds: float, sees=lambda t: True, dt_s: float = 0.05):
    """Return rows t, head yaw and pitch, eye yaw and pitch, looking of a person at the origin."""
    rows = []
    for n in range(round(seconds / dt_s)):
        t = n * dt_s
        robot = path(t)
        seen = gaze.in_field_of_view(dt_s, (0.0, 0.0, 0.0), robot) and sees(t)
        gaze.update(t, dt_s, (0.0, 0.0, 0.0), robot, seen)
        rows.append((t, *gaze.angles(dt_s), gaze.looking))
    return np.array(rows)


def test_the_head_turns_smoothly_through_the_front_and_the_eyes_lead():
    """A robot that passes behind a person is lost on one side and found on the other."""
    gaze = Gaze(Glances(watches=True, notices_within_m=20.0), 1.75, np.random.default_rng(0))

    def around(t: float) -> RobotBody:
        angle = min(1.2 + 0.8 * t, 2.0 * math.pi - 1.2)  # from the left, behind, to the right
        return robot_at(4.0 * math.cos(angle), 4.0 * math.sin(angle))

    rows = watch(gaze, around, 8.0)
    t, yaw, eyes = rows[:, 0], rows[:, 1], rows[:, 3]
    rate = np.diff(yaw) / np.diff(t)
    assert np.abs(rate).max() <= 3.2 + 1e-6
    assert np.abs(np.diff(rate)).max() <= 25.0 * 0.05 + 1e-6
    assert np.abs(yaw).max() <= math.radians(80.0) + 1e-9
    assert np.abs(eyes).max() <= math.radians(35.0) + 1e-9
    # First to the left limit, at the end to the right; never through the back.
    assert yaw.max() > 1.35
    assert yaw[-1] == pytest.approx(-1.2, abs=0.05)
    assert np.abs(np.diff(yaw)).max() < 0.2
    assert (eyes[5:12] > 0.2).any()
    assert np.abs(eyes[-5:]).max() < 0.02


def test_a_robot_behind_hidden_or_far_away_is_not_noticed():
    def noticed(where, sees=lambda t: True, **glances):
        gaze = Gaze(Glances(watches=True, **glances), 1.75, np.random.default_rng(0))
        watch(gaze, lambda t: robot_at(*where), 6.0, sees)
        return gaze.noticed_s

    assert noticed((-3.0, 0.5)) is None
    assert noticed((3.0, 0.0), lambda t: False) is None
    assert noticed((13.0, 0.0)) is None
    assert noticed((3.0, 0.0), notices_within_m=0.0) is None
    assert noticed((3.0, 0.0), looker_share=0.0) is None
    # The field of view turns with the head, not with the body.
    assert noticed((0.0, -3.0), away_yaw_deg=80.0) is None
    assert noticed((0.0, -3.0)) is not None
    assert noticed((3.0, 0.0), lambda t: t > 2.0) == pytest.approx(2.3, abs=0.2)
    assert noticed((3.0, 0.0), first_glance_delay_s=1.5) == pytest.approx(1.5, abs=0.2)


def test_glances_alternate_and_stop_for_good_after_giving_up():
    def looks(**glances) -> np.ndarray:
        gaze = Gaze(Glances(**glances), 1.75, np.random.default_rng(4))
        return watch(gaze, lambda t: robot_at(5.0, 1.0), 40.0)[:, 5]

    looking = looks()
    assert 0.2 < looking[100:].mean() < 0.7
    assert np.count_nonzero(np.diff(looking)) > 10
    assert looks(watches=True)[20:].all()
    ended = looks(watches=True, gives_up_after_s=3.0)
    assert ended[20:60].all()
    assert not ended[70:].any()


def test_quartiles_must_lie_on_either_side_of_the_median():
    with pytest.raises(SimError, match="either side of the median"):
        LogNormalDuration.fitted(1.0, (1.2, 2.0))
    with pytest.raises(ValueError, match="glance_quartiles_s"):
        Glances(glance_median_s=2.0)


def planned(keys: list[dict[str, object]], robot: RobotBody, seconds: float) -> list[PersonMotion]:
    """Return the motions of somebody at the origin who faces along x and looks as planned."""
    spec = PersonSpec.model_validate(
        {"name": "p", "route": [{"x_m": 0.0, "y_m": 0.0}], "heading_deg": 0.0, "gaze": keys}
    )
    person = Person(spec, np.random.default_rng(0), np.zeros((0, 4)))
    around = Surroundings(robot, (), lambda: True)
    motions = [person.step(0.05 * tick, around) for tick in range(round(20 * seconds))]
    assert person.noticed_s is None
    return motions


def test_a_planned_gaze_is_as_planned_from_the_start_and_turns_from_key_to_key():
    keys = [
        {"t_s": 0.0, "look": "robot", "yaw_deg": 10.0},
        {"t_s": 3.0, "look": "robot", "yaw_deg": 10.0},
        {"t_s": 5.0, "yaw_deg": -40.0, "pitch_deg": -20.0},
    ]
    for side in (1.0, -1.0):
        robot = robot_at(3.0, 3.0 * side)
        motions = planned(keys, robot, 8.0)
        yaw = np.degrees([motion.head_yaw_rad for motion in motions])
        assert yaw[:60] == pytest.approx(45.0 * side + 10.0, abs=0.1)
        assert yaw[80] == pytest.approx(0.5 * (45.0 * side + 10.0 - 40.0), abs=12.0)
        assert yaw[-1] == pytest.approx(-40.0, abs=0.1)
        assert math.degrees(motions[-1].head_pitch_rad) == pytest.approx(-20.0, abs=0.1)
        assert motions[0].head_pitch_rad < 0.0  # the robot's camera is lower than the eyes


def test_a_planned_gaze_turns_through_the_front_and_no_farther_than_a_head():
    keys = [{"t_s": 0.0, "yaw_deg": 120.0}, {"t_s": 2.0, "yaw_deg": -120.0}]
    yaw = np.degrees([each.head_yaw_rad for each in planned(keys, robot_at(3.0, 0.0), 4.0)])
    assert (yaw[0], yaw[-1]) == pytest.approx((80.0, -80.0), abs=0.1)
    assert np.diff(yaw).max() <= 1e-9


# Whole numbers: none lies on the edge of the field of view.
angles_deg = st.integers(-180, 180)
glances = st.builds(
    Glances,
    notices_within_m=st.sampled_from([0.0, 12.0]),
    watches=st.booleans(),
    away_yaw_deg=st.integers(-80, 80),
    away_pitch_deg=st.integers(-40, 40),
)


@settings(max_examples=40, deadline=None)
@given(glances, angles_deg, st.integers(-3, 3), st.sampled_from([CLASSIC, RECORDED]), angles_deg)
def test_a_look_is_a_glance_that_has_met_the_robot_in_any_world(
    glances, heading_deg, y_m, habits, turned_deg
):
    """Whoever never notices the robot never looks, whatever way head and body face."""

    def looks(turn_deg: float) -> list[float]:
        turn = math.radians(turn_deg)
        spec = PersonSpec(
            name="p",
            route=({"x_m": 0.0, "y_m": 0.0},),
            heading_deg=math.degrees(math.radians(heading_deg + 0.37) + turn),
            glances=glances,
        )
        person = Person(spec, np.random.default_rng(0), np.zeros((0, 4)), habits=habits)
        since_s = []
        for tick in range(80):
            x, y = 4.03 - 0.1 * tick, y_m + 0.52
            x, y = math.cos(turn) * x - math.sin(turn) * y, math.sin(turn) * x + math.cos(turn) * y
            robot = replace(robot_at(x, y), heading_rad=turn)
            person.step(0.05 * tick, Surroundings(robot, (), lambda: True))
            since_s.append(person.since_look_s)
            if person.noticed_s is not None or habits is CLASSIC:
                assert (person.noticed_s is not None) == math.isfinite(since_s[-1])
        return since_s

    here = looks(0.0)
    if habits is CLASSIC:  # recorded people sway and set off by chance along the axes
        assert looks(turned_deg) == pytest.approx(here)
    if glances.notices_within_m == 0.0:
        assert set(here) == {math.inf}
