"""Contacts: their cause against an independent judge, racks, and robots that people stop."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sim_tests import run_crossing
from sim_tests.actors.robot import KinematicRobot, RobotModel
from sim_tests.crossing._separations import Approach, ContactEvent
from sim_tests.scenario import Scenario
from sim_tests.study.measures import measure
from sim_tests.world import PERSON_GROUP, Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.hall import WarehouseLayout

DISC_M, STEP_S = 0.3, 1.0 / 240.0
KINEMATIC = ("delivery", "omni", "forklift")


def judge(half, twist, disc, velocity):
    """Return who strikes whom, by a rectangle and a disc that keep their motions; None for nobody.

    ``twist`` is the speed forward, to the left and the yaw rate of the rectangle, which starts at
    the origin. Returns the time, and the speed of the struck point of the rectangle towards the
    disc, by differences.
    """
    ahead, left, turn = twist

    def place(x, y, t):
        """The place then of a point of the rectangle."""
        angle = turn * t
        way = [ahead * t, left * t]
        if abs(turn) > 1e-9:
            sin, cos = math.sin(angle) / turn, (1.0 - math.cos(angle)) / turn
            way = [ahead * sin - left * cos, ahead * cos + left * sin]
        return (
            way[0] + x * math.cos(angle) - y * math.sin(angle),
            way[1] + x * math.sin(angle) + y * math.cos(angle),
        )

    for step in range(480):
        t = step * STEP_S
        centre = disc[0] + velocity[0] * t, disc[1] + velocity[1] * t
        base = place(0.0, 0.0, t)
        off, angle = (centre[0] - base[0], centre[1] - base[1]), -turn * t
        own = (
            off[0] * math.cos(angle) - off[1] * math.sin(angle),
            off[0] * math.sin(angle) + off[1] * math.cos(angle),
        )
        point = [min(max(value, -most), most) for value, most in zip(own, half, strict=True)]
        if math.dist(own, point) <= DISC_M:
            struck, later = place(*point, t), place(*point, t + 1e-6)
            gap = math.dist(centre, struck)
            if gap < 1e-6:
                return None
            return t, sum(
                (later[i] - struck[i]) * (centre[i] - struck[i]) / gap for i in (0, 1)
            ) * 1e6
    return None


speeds = st.floats(-1.2, 1.2)


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(st.floats(0.2, 0.8), st.floats(0.2, 0.5)),
    st.tuples(speeds, speeds, st.floats(-2.0, 2.0)),
    st.tuples(st.floats(0.0, math.tau), st.floats(0.05, 0.6)),
    st.tuples(st.floats(0.3, 1.2), st.floats(-0.5, 0.5)),
)
def test_the_cause_of_a_contact_is_that_of_a_judge(half, twist, where, comes) -> None:
    reach_m = math.hypot(*half) + DISC_M + where[1]
    disc = reach_m * math.cos(where[0]), reach_m * math.sin(where[0])
    # It comes nearer, seen from the robot's base; so it may flee from the robot or follow it.
    course = where[0] + math.pi + comes[1]
    velocity = twist[0] + comes[0] * math.cos(course), twist[1] + comes[0] * math.sin(course)
    said = judge(half, twist, disc, velocity)
    assume(said is not None and said[0] > 0.0 and abs(said[1] - 0.03) > 0.08)
    outline = [(x * half[0], y * half[1]) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
    model = RobotModel(
        name="rectangle",
        footprint_m=outline,
        drive="holonomic",
        max_speed_mps=5.0,
        max_acceleration_mps2=10.0,
        max_deceleration_mps2=10.0,
        max_yaw_rate_radps=2.0,
        max_yaw_acceleration_radps2=10.0,
    )
    with Warehouse(WarehouseLayout.named("open")) as hall:
        robot, body = KinematicRobot(hall, model), cylinder(hall)
        robot.command(twist[0], twist[2], twist[1])
        robot.advance(1.0)  # to its speed, and to a heading of its own
        start = robot.motion
        moves = start._replace(forward_mps=velocity[0], left_mps=velocity[1])
        for step in range(480):
            place = start.point(*(disc[i] + velocity[i] * step * STEP_S for i in (0, 1)))
            pybullet.resetBasePositionAndOrientation(
                body, [*place, 0.3], [0, 0, 0, 1], physicsClientId=hall.client
            )
            nearest = hall.nearest(robot.body, body, 0.0)
            if nearest is not None:
                break
            robot.advance(STEP_S, [body])
    assert nearest is not None
    found = ContactEvent(0.0, 0, Approach.at(nearest, robot.motion, moves.velocity_mps, (1.0, 0.0)))
    assert found.by == ("robot" if said[1] > 0.03 else "person")
    assert step * STEP_S == pytest.approx(said[0], abs=0.1)


def cylinder(hall: Warehouse) -> int:
    """A disc that is as high as the robot."""
    shape = pybullet.createCollisionShape(
        pybullet.GEOM_CYLINDER, radius=DISC_M, height=1.0, physicsClientId=hall.client
    )
    body = int(pybullet.createMultiBody(0.0, shape, physicsClientId=hall.client))
    pybullet.setCollisionFilterGroupMask(body, -1, PERSON_GROUP, 0, physicsClientId=hall.client)
    return body


class Drive:
    """A planner that gives one command."""

    def __init__(self, *command: float) -> None:
        self.command = command

    def plan(self, *_: Any) -> tuple[float, ...]:
        return self.command


def scene(place: tuple[float, float] | None = None, heading_deg: float = 180.0, **changed: Any):
    """A hall with a person who stands at a place, and a robot at the origin."""
    data = Scenario.shipped("crossing_from_left").model_dump(mode="json")
    person = {"name": "stands", "heading_deg": heading_deg, "glances": {"notices_within_m": 0.0}}
    data["people"] = []
    if place is not None:
        route = [{"x_m": place[0], "y_m": place[1]}]
        data["people"] = [{**person, "route": route, "social": False}]
    data |= {"robot": {"goal_x_m": 14.0}, "duration_s": 5.0, **changed}
    return Scenario.model_validate(
        {name: value for name, value in data.items() if value is not None}
    )


def drive(scenario: Scenario, *command: float):
    return run_crossing(scenario, policy="scanner", planner=Drive(*command))


def test_a_robot_that_turns_on_the_spot_strikes_with_its_corner() -> None:
    result = drive(scene((0.05, 0.53)), 0.0, 1.5)
    row = measure(result)
    assert (row.contact_by, row.robot_contacts, row.moving_contacts) == ("robot", 1, 1)
    assert not row.success
    first = result.contacts[0]
    # A point of a body that turns at 1.5 rad/s has a speed of at most 1.5 R.
    assert 0.3 < first.robot_speed_mps <= 1.5 * result.robot.circumscribed_radius_m + 0.01
    assert row.min_margin_m < 0.0 < row.step_out_never
    assert row.violation_time_s > 0.0
    assert 0.3 < row.max_speed_within_2m_mps <= 0.67
    assert row.stops == 0


def test_a_robot_that_sets_off_into_somebody_who_touches_it_causes_a_contact() -> None:
    """It stands at first, so whoever touched it then walked into it."""
    result = drive(scene((0.5, 0.0)), 0.5, 0.0)
    first, second = result.contacts[:2]
    assert (first.worker, first.t_s, first.by) == (0, pytest.approx(0.0, abs=0.01), "person")
    assert (second.worker, second.by) == (0, "robot")


@pytest.mark.parametrize("robot", [None, *KINEMATIC])
def test_nobody_is_driven_over(robot: str | None) -> None:
    """Neither by wheels and motors, nor by a body that is moved."""
    result = drive(
        scene((2.5, 0.0), robot_model=robot), 0.6, *(0.0,) * (2 if robot == "omni" else 1)
    )
    assert {contact.by for contact in result.contacts} == {"robot"}
    front_m = float(result.robot.footprint_m[:, 0].max())
    for frame in result.frames:
        gap_m = frame.truth[0].position_odom_m[0] - frame.robot_state.position_odom_m[0]
        assert gap_m > front_m


@pytest.mark.parametrize("place_m", [1.5, 1.9, 2.2, 2.5])
def test_the_first_contact_has_the_speed_before_the_collision(place_m: float) -> None:
    """Physics stops the Carter a hair's breadth before it overlaps somebody."""
    first = drive(scene((place_m, 0.0)), 0.8, 0.0).contacts[0]
    assert (first.by, first.robot_speed_mps) == ("robot", pytest.approx(0.8, abs=0.01))


@pytest.mark.parametrize("robot", [None, *KINEMATIC])
def test_a_rack_that_a_robot_runs_into_counts_once(robot: str | None) -> None:
    start = {"start_x_m": 0.4, "start_heading_deg": 90.0, "goal_x_m": 0.4, "goal_y_m": 5.5}
    scenario = scene(robot=start, robot_model=robot)
    row = measure(drive(scenario, 0.8, *(0.0,) * (2 if robot == "omni" else 1)))
    assert (row.bumps, row.contacts, row.success) == (1, 0, False)


def test_a_drive_between_racks_touches_none() -> None:
    row = measure(run_crossing(scene(duration_s=20.0), policy="scanner"))
    assert (row.bumps, row.success) == (0, True)


def test_people_who_are_away_change_no_row(tmp_path) -> None:
    """They come when the episode is over."""
    table = tmp_path / "late.csv"
    rows = [f"{100 + step},1,{6 + step},1.0" for step in range(5)]
    table.write_text("\n".join(["t_s,id,x_m,y_m", *rows]) + "\n", encoding="utf-8")
    late = scene(replay_csv=str(table), replay_leaves=True, duration_s=14.0)
    found, alone = (
        measure(run_crossing(each, policy="balanced")) for each in (late, scene(duration_s=14.0))
    )
    assert found == alone
    assert found.min_separation_m is found.step_out_never is None


@pytest.mark.parametrize("perception", ["truth", pytest.param("scanner", marks=pytest.mark.full)])
def test_somebody_with_a_phone_is_touched_before_they_notice_whatever_the_cone_says(
    perception: str,
) -> None:
    """They never look by themselves; the cone has them aware as the robot drives before them."""
    result = run_crossing(
        "steps_out_near",
        policy="scanner",
        perception=perception,
        seed=3001,
        population="answers=0,startles=0",
    )
    row = measure(result)
    assert max(view.awareness for frame in result.frames for view in frame.truth) > 0.5
    assert row.moving_contacts == row.moving_contacts_never > 0
    assert row.moving_contact_never_mps == row.moving_contact_mps > 0.25
    assert row.moving_contacts_past == row.moving_contacts_looking == 0
    before = result.contacts[0].t_s
    assert all(
        math.isinf(view.since_look_s)
        for frame in result.frames
        if frame.t_s < before
        for view in frame.truth
    )
