"""Reactions of people to a robot on a stage with physics."""

from __future__ import annotations

import numpy as np
import pytest
from staged_people import crosser, run_stage

from sim_tests import Scenario, run_crossing


def test_walk_on_changes_nothing():
    unaware, aware = (run_stage([crosser(reaction, start_s=1.5)]) for reaction in (None, "walk_on"))
    assert aware.outcomes[0].noticed_s is not None
    assert aware.outcomes[0].reaction == "walk_on"
    assert aware.min_separation_m > 0.3  # a nearer robot would be avoided
    # Before the encounter a visible robot pushes the walker a little.
    np.testing.assert_allclose(aware.people[:, 0, :2], unaware.people[:, 0, :2], atol=0.1)
    assert aware.outcomes[0].time_s == pytest.approx(unaware.outcomes[0].time_s, abs=0.1)


def test_wait_stops_short_of_the_robots_line_until_it_has_passed():
    waiting = run_stage([crosser("wait")], seconds=14.0)
    assert waiting.outcomes[0].reaction == "wait"
    _, ahead_m = waiting.crossing()
    assert ahead_m < -0.36  # the robot is past
    before = waiting.robot[:, 0] < 5.0
    assert waiting.people[before, 0, 1].max() < -0.8
    assert waiting.speeds[:, 0][waiting.people[:, 0, 1] < -0.8][60:].min() < 0.1
    assert not waiting.contacts
    assert waiting.outcomes[0].time_s > waiting.outcomes[0].free_time_s + 1.0


def test_waiting_for_a_robot_that_stands_ends_after_some_seconds():
    """The robot drives, then stops for good short of the crossing."""
    result = run_crossing(
        Scenario.model_validate(
            {
                "name": "stands",
                "duration_s": 16.0,
                "layout": "open",
                # It stops at its goal, short of the person's route.
                "robot": {"goal_x_m": 3.4, "goal_tolerance_m": 0.01},
                "people": [crosser("wait")],
            }
        ),
        policy="balanced",
        planner=_StopsAt(3.2),
    )
    y = np.array([frame.truth[0].position_odom_m[1] for frame in result.frames])
    still = np.count_nonzero(np.abs(np.diff(y[40:])) < 0.002) * 0.05
    assert result.people[0].reaction == "wait"
    assert result.people[0].time_s is not None
    assert still > 1.0
    assert y[-1] > 3.5


class _StopsAt:
    """A planner that drives straight ahead at 0.8 m/s and stops at x."""

    def __init__(self, x_m: float) -> None:
        self._x_m = x_m

    def plan(self, robot_state, goal_odom_m, constraints, dt_s):
        return (0.8 if robot_state.position_odom_m[0] < self._x_m - 0.32 else 0.0), 0.0


def test_hurry_goes_first_and_faster_within_human_limits():
    hurrying = run_stage([crosser("hurry", start_s=2.0)])
    assert hurrying.outcomes[0].reaction == "hurry"
    assert 1.3 * 1.34 < hurrying.speeds.max() <= 2.0 + 1e-6
    _, ahead_m = hurrying.crossing()
    assert ahead_m > 0.36
    assert hurrying.outcomes[0].time_s < hurrying.outcomes[0].free_time_s - 0.5


def test_pass_behind_walks_behind_the_robot_without_stopping():
    passing = run_stage([crosser("pass_behind")])
    assert passing.outcomes[0].reaction == "pass_behind"
    _, ahead_m = passing.crossing()
    assert ahead_m < -0.36
    assert passing.people[:, 0, 0].min() < 4.7
    y = passing.people[:, 0, 1]
    assert passing.speeds[(y > -3.0) & (y < 3.0), 0].min() > 0.2
    assert not passing.contacts
    assert passing.outcomes[0].length_m > passing.outcomes[0].free_length_m + 0.05


@pytest.mark.parametrize("reaction", ["wait", "pass_behind"])
def test_a_person_head_on_steps_aside_to_let_the_robot_pass(reaction):
    head_on = run_stage(
        [crosser(reaction, route=[{"x_m": 9.0, "y_m": 0.0}, {"x_m": -2.0, "y_m": 0.0}])],
        seconds=9.0,
    )
    assert head_on.outcomes[0].reaction == reaction
    assert not head_on.contacts
    assert head_on.min_separation_m > 0.2


def test_reactions_are_drawn_by_their_shares():
    shares = {"wait": 0.5, "claim": 0.5}
    drawn = [
        run_stage([crosser(None) | {"reactions": shares, "glances": {"watches": True}}],
             seconds=4.0, seed=seed).outcomes[0].reaction
        for seed in range(7)
    ]  # fmt: skip
    assert set(drawn) == {"wait", "claim"}


def test_a_blind_person_who_hits_a_standing_robot_stops_and_walks_around_it():
    bump = run_stage(
        [crosser(None, start_s=0.0, glances={"notices_within_m": 0.0})],
        robot_mps=0.0,
        seconds=14.0,
        robot={"start_x_m": 5.0, "goal_x_m": 12.0},
    )
    assert bump.contacts
    assert {contact.by for contact in bump.contacts} == {"person"}
    touch_s = bump.contacts[0].t_s
    after = np.searchsorted(bump.times_s, touch_s)
    assert bump.speeds[after + 1 : after + 4, 0].min() < 0.5
    # The person does not walk through the robot, and does not move it.
    inside = (np.abs(bump.people[:, 0, 0] - bump.robot[:, 0]) < 0.36) & (
        np.abs(bump.people[:, 0, 1] - bump.robot[:, 1]) < 0.25
    )
    assert not inside.any()
    assert np.abs(bump.robot - bump.robot[0]).max() < 0.1
    assert bump.people[-1, 0, 1] > 3.0


def test_a_blind_person_who_walks_into_the_side_of_a_moving_robot_is_the_cause():
    side = run_stage([crosser(None, start_s=3.6)], seconds=9.0)
    assert side.contacts
    assert side.contacts[0].by == "person"


def test_a_person_behind_racks_never_notices_the_robot():
    hidden = run_stage(
        [
            {
                "name": "hidden",
                "route": [{"x_m": 1.0, "y_m": 3.9}, {"x_m": 4.0, "y_m": 3.9}],
                "glances": {"watches": True, "away_yaw_deg": -60.0},
            }
        ],
        layout="crossing",
        seconds=4.0,
    )
    assert hidden.outcomes[0].noticed_s is None
    assert hidden.outcomes[0].reaction == ""


def test_at_a_blind_corner_the_robot_is_noticed_only_past_the_rack():
    corner = run_stage(
        [crosser("wait", route=[{"x_m": 6.0, "y_m": -5.0}, {"x_m": 6.0, "y_m": 5.0}])],
        layout="crossing",
        seconds=8.0,
        robot_mps=0.6,
    )
    noticed_s = corner.outcomes[0].noticed_s
    at = int(np.searchsorted(corner.times_s, noticed_s))
    x, y = corner.people[at, 0, :2]
    rx, ry = corner.robot[at]
    # The straight line to the robot passes the corner of the rack at (4.5, -1.6).
    line_y = y + (4.5 - x) * (ry - y) / (rx - x)
    assert line_y > -1.6 - 0.2
    assert noticed_s > 2.4 + 1.0


def test_people_come_first_and_replayed_ones_after_them(tmp_path):
    table = tmp_path / "one.csv"
    table.write_text("t_s,id,x_m,y_m\n0,a,9,3\n2,a,10,3\n")
    case = Scenario.model_validate(
        {
            "name": "all kinds",
            "duration_s": 1.0,
            "layout": "open",
            "robot": {"goal_x_m": 12.0},
            "people": [{"name": "p", "route": [{"x_m": 8.0, "y_m": 2.0}]}],
            "replay_csv": str(table),
        }
    )
    result = run_crossing(case, policy="balanced")
    xs = [view.position_odom_m[0] for view in result.frames[0].truth]
    assert xs == pytest.approx([8.0, 9.0])
    assert [person.name for person in result.people] == ["p"]
    assert not run_crossing(case.without_people(), policy="balanced").frames[0].truth
