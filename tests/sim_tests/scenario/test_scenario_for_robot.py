"""Scenarios fitted to other robots: room for their outline, and time for their speed."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests import NOVA_CARTER, Scenario, SimError, shipped_scenarios
from sim_tests.actors.robot import RobotModel, shipped_robots
from sim_tests.scenario import SCENARIO_SETS
from sim_tests.scenario.catalogue import CONFLICT_M, closest_approaches, person_plan

FORKLIFT = RobotModel.shipped("forklift")
SHIPPED = [Scenario.shipped(name) for name in shipped_scenarios()]
PLANNED = [each for each in SHIPPED if each.robot.straight_on_speed_mps is None]


def test_the_shipped_robot_changes_nothing() -> None:
    assert all(each.with_robot("nova_carter") == each for each in SHIPPED)


@pytest.mark.parametrize("name", ["forklift", "omni", "delivery"])
@pytest.mark.parametrize("scenario", PLANNED, ids=lambda each: each.name)
def test_every_scenario_has_room_and_time_for_every_robot(scenario: Scenario, name: str) -> None:
    model = RobotModel.shipped(name)
    fitted = scenario.with_robot(model)
    assert fitted.name == f"{scenario.name}_{name}"
    task, profile = fitted.robot, model.profile
    # As much room beside the outline as the Nova Carter has, at least.
    wider_m = np.abs(profile.footprint_m[:, 1]).max() - NOVA_CARTER.footprint_m[:, 1].max()
    if task.lane_half_width_m is not None:
        assert task.lane_half_width_m >= scenario.robot.lane_half_width_m + wider_m - 1e-9
    start = np.array([task.start_x_m, task.start_y_m])
    goal = np.array([task.goal_x_m, task.goal_y_m])
    usual = _least_gap_m(scenario, start, goal)
    assert _least_gap_m(fitted, start, goal) >= usual + wider_m - 1e-9
    # As long as the way takes longer.
    way_m = float(np.linalg.norm(goal - start))
    slower_s = way_m / profile.max_speed_mps - way_m / NOVA_CARTER.max_speed_mps
    assert fitted.duration_s >= scenario.duration_s + slower_s - 1e-9
    for before, after in zip(scenario.people, fitted.people, strict=True):
        assert after.start_s >= before.start_s
        assert after.speed_mps == before.speed_mps


def _least_gap_m(scenario: Scenario, start: np.ndarray, goal: np.ndarray) -> float:
    """Return the smallest distance from the line between start and goal to a box of the hall."""
    boxes = scenario.layout.obstacle_boxes_odom
    line = start + np.linspace(0.0, 1.0, 200)[:, None] * (goal - start)
    outside = np.maximum(boxes[:, None, :2] - line, line - boxes[:, None, 2:]).clip(0.0)
    return float(np.hypot(outside[..., 0], outside[..., 1]).min())


def test_order_beside_the_aisle_stays_and_racks_keep_their_size() -> None:
    before = Scenario.shipped("standing_in_aisle")
    after = before.with_robot(FORKLIFT)
    for old, new in zip(before.layout.racks, after.layout.racks, strict=True):
        assert new.x_m == old.x_m
        assert new.width_m == pytest.approx(old.width_m)
        assert abs(new.y_m) > abs(old.y_m)
    extra_m = after.robot.lane_half_width_m - before.robot.lane_half_width_m
    assert abs(after.layout.racks[0].y_m) == pytest.approx(before.layout.racks[0].y_m + extra_m)
    assert after.layout.x_max_m > before.layout.x_max_m


def test_a_task_along_y_is_widened_along_x() -> None:
    data = Scenario.shipped("crowd_of_eight").model_dump()
    data["robot"] |= {"goal_x_m": 0.0, "goal_y_m": 4.0, "start_heading_deg": 90.0}
    before = Scenario.model_validate(data)
    after = before.with_robot(FORKLIFT)
    assert after.layout.x_max_m > before.layout.x_max_m
    assert [rack.y_m for rack in after.layout.racks] == [rack.y_m for rack in before.layout.racks]


@given(turn_rad=st.floats(-math.pi, math.pi), beyond_m=st.floats(-2.0, 2.0))
@settings(max_examples=40, deadline=None, derandomize=True)
def test_people_beside_a_line_at_any_angle_move_as_beside_one_along_an_axis(turn_rad, beyond_m):
    cos, sin = math.cos(turn_rad), math.sin(turn_rad)

    def task(turned: bool) -> Scenario:
        def place(x_m: float, y_m: float) -> dict[str, float]:
            c, s = (cos, sin) if turned else (1.0, 0.0)
            return {"x_m": c * x_m - s * y_m, "y_m": s * x_m + c * y_m}

        hall = dict.fromkeys(("x_min_m", "y_min_m"), -30.0)
        hall |= dict.fromkeys(("x_max_m", "y_max_m"), 30.0)
        route = [place(6.0, -4.0), place(6.0, beyond_m), place(9.0, 5.0)]
        person = {"name": "p", "route": route, "pauses": [{"at_m": 3.0, "for_s": 1.0}]}
        goal = place(12.0, 0.0)
        robot = {"goal_x_m": goal["x_m"], "goal_y_m": goal["y_m"]}
        data = {"name": "t", "duration_s": 20.0, "layout": hall, "robot": robot}
        return Scenario.model_validate({**data, "people": [person]}).with_robot(FORKLIFT)

    usual, turned = task(turned=False), task(turned=True)
    assert turned.duration_s == pytest.approx(usual.duration_s)
    assert turned.layout.aisle_width_m == pytest.approx(usual.layout.aisle_width_m)
    for old, new in zip(usual.people[0].route, turned.people[0].route, strict=True):
        there = (cos * old.x_m - sin * old.y_m, sin * old.x_m + cos * old.y_m)
        assert (new.x_m, new.y_m) == pytest.approx(there, abs=1e-9)
    assert turned.people[0].pauses[0].at_m == pytest.approx(usual.people[0].pauses[0].at_m)


@pytest.mark.parametrize("beside_m", [1e-9, 0.2, -0.2])
def test_a_goal_beside_the_line_hardly_changes_the_fit(beside_m: float) -> None:
    """The aisle is as wide, racks keep their size, and nobody's route moves along the aisle."""
    data = Scenario.shipped("blind_corner").model_dump()
    data["robot"] |= {"lane_half_width_m": None}
    straight = Scenario.model_validate(data).with_robot(FORKLIFT)
    data["robot"] |= {"goal_y_m": data["robot"]["goal_y_m"] + beside_m}
    beside = Scenario.model_validate(data).with_robot(FORKLIFT)
    for name, value in straight.layout.model_dump().items():
        if isinstance(value, float):
            assert beside.layout.model_dump()[name] == pytest.approx(value, abs=0.1), name
    for old, new in zip(straight.layout.racks, beside.layout.racks, strict=True):
        assert new.box_odom_m == pytest.approx(old.box_odom_m, abs=0.15)
    for before, after in zip(straight.people, beside.people, strict=True):
        for old, new in zip(before.route, after.route, strict=True):
            assert (new.x_m, new.y_m) == pytest.approx((old.x_m, old.y_m), abs=0.15)


def test_another_robot_fits_the_scenario_as_it_was_written() -> None:
    written = Scenario.shipped("blind_corner")
    fitted = written.with_robot(FORKLIFT)
    assert fitted.with_robot("forklift") == fitted
    assert fitted.with_robot("omni") == written.with_robot("omni")
    # One that has its robot's room already keeps it.
    own = fitted.model_copy()
    assert own.with_robot("forklift") == own
    with pytest.raises(SimError, match="for the robot 'forklift' already, got 'omni'"):
        own.with_robot("omni")


def test_a_fitted_scenario_draws_fitted_ones_and_survives_text() -> None:
    scenario = Scenario.shipped("crossing_from_left")
    fitted = scenario.with_robot("forklift")
    assert fitted.name == "crossing_from_left_forklift"
    assert fitted.draw(3) == scenario.draw(3).with_robot("forklift")
    assert Scenario.from_text(fitted.to_text()).draw(3) == fitted.draw(3)
    assert scenario.with_robot("") is scenario
    # The text of fields keeps their robot, and without one does not mention any.
    assert Scenario.from_text(fitted.model_copy().to_text()) == fitted.with_values({})
    assert "robot_model" not in scenario.model_copy().to_text()


def test_a_slow_robot_gets_more_time() -> None:
    slow = RobotModel.of(replace(NOVA_CARTER, max_speed_mps=0.5))
    before = Scenario.shipped("crossing_from_left")
    after = before.with_robot(slow)
    assert after.duration_s > 2.5 * before.duration_s
    # People wait for as long as the robot takes longer to the middle of its way.
    half_m = 0.5 * math.hypot(before.robot.goal_x_m, before.robot.goal_y_m)
    later_s = after.people[0].start_s - before.people[0].start_s
    assert later_s == pytest.approx(half_m / 0.5 - half_m / 1.5, abs=1.0)
    assert after.layout == before.layout


def _stops_and_turn(scenario: Scenario) -> list[np.ndarray]:
    """Return the places at which the first person stops, in order, and turns back."""
    (person, *_) = scenario.people
    times = np.linspace(0.0, 120.0, 24001)
    places, walked = person_plan(person, times)
    found = []
    for pause in sorted(person.pauses, key=lambda each: each.at_m):
        standing = np.abs(walked - pause.at_m) < 1e-6
        if standing.any():
            found.append(places[standing][0])
    if person.turns_back_at_m is not None:
        found.append(places[int(np.argmin(np.abs(walked - person.turns_back_at_m)))])
    return found


def _with_person(**person: Any) -> Scenario:
    data = Scenario.shipped("turns_back").model_dump()
    data["people"] = [{"name": "p", "speed_mps": 1.0, **person}]
    return Scenario.model_validate(data)


@pytest.mark.parametrize("robot", ["forklift", "omni"])
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["stops_midway", "turns_back"])
def test_people_stop_and_turn_where_they_did_beside_the_lane(
    name: str, seed: int, robot: str
) -> None:
    before = Scenario.shipped(name).draw(seed)
    after = before.with_robot(robot)
    stretch = after.layout.aisle_width_m / before.layout.aisle_width_m
    (old,), (new,) = _stops_and_turn(before), _stops_and_turn(after)
    assert new == pytest.approx([old[0], stretch * old[1]], abs=6e-3)


def test_stops_keep_their_place_beyond_a_corner_and_on_the_way_back() -> None:
    """The route goes along the aisle, across it, and back again from a turn beyond the aisle."""
    route = [(10.0, -1.0), (6.0, -1.0), (6.0, 5.0)]
    before = _with_person(
        route=[{"x_m": x, "y_m": y} for x, y in route],
        pauses=[{"at_m": at_m, "for_s": 2.0} for at_m in (2.0, 4.5, 8.0, 12.0)],
        turns_back_at_m=8.5,
    )
    after = before.with_robot(FORKLIFT)
    places = [(8.0, -1.0), (6.0, -0.5), (6.0, 3.0), (6.0, 0.0), (6.0, 3.5)]
    assert np.array(_stops_and_turn(before)) == pytest.approx(np.array(places), abs=6e-3)
    inner_m, extra_m = (
        0.5 * before.layout.aisle_width_m,
        0.5 * (after.layout.aisle_width_m - before.layout.aisle_width_m),
    )
    assert extra_m > 0.3

    def moved(y: float) -> float:
        return y * (1.0 + extra_m / inner_m) if abs(y) <= inner_m else y + math.copysign(extra_m, y)

    fitted = [(x, moved(y)) for x, y in places]
    assert np.array(_stops_and_turn(after)) == pytest.approx(np.array(fitted), abs=6e-3)


def test_a_stop_after_the_end_of_a_route_stays_after_it() -> None:
    ends = [{"x_m": 7.0, "y_m": -3.0}, {"x_m": 7.0, "y_m": 3.0}]
    before = _with_person(route=ends, pauses=[{"at_m": 6.5, "for_s": 1.0}], turns_back_at_m=7.0)
    (person,) = before.with_robot(FORKLIFT).people
    length_m = abs(person.route[1].y_m - person.route[0].y_m)
    assert length_m > 6.0
    assert person.pauses[0].at_m == pytest.approx(length_m + 0.5)
    assert person.turns_back_at_m is not None
    assert person.turns_back_at_m > length_m


ROBOTS = [name for name in shipped_robots() if name != "nova_carter"]
DRAWS = 40


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize(
    "name",
    [
        name
        for each in SCENARIO_SETS
        for name in shipped_scenarios(each)
        if name != "paper_encounter"  # its robot drives straight on
    ],
)
def test_people_come_as_near_to_another_robot_as_to_the_one_of_the_scenario(
    name: str, robot: str
) -> None:
    """Between surfaces: people are farther from the lane by what is wider."""
    scenario = Scenario.shipped(name)
    fitted = scenario.with_robot(robot)
    lanes_m = [each.layout.aisle_width_m for each in (scenario, fitted)]
    lane_m = scenario.robot.lane_half_width_m
    wider_m = 0.5 * (lanes_m[1] - lanes_m[0])
    if lane_m is not None:
        wider_m = max(wider_m, fitted.robot.lane_half_width_m - lane_m)
    before_m, after_m = (_nearest_m(each) for each in (scenario, fitted))
    conflicts = float(np.mean(before_m < CONFLICT_M))
    assert np.mean(after_m < CONFLICT_M + wider_m) == pytest.approx(conflicts, abs=0.16)
    assert np.median(after_m) == pytest.approx(np.median(before_m), abs=wider_m + 0.35)


def _nearest_m(scenario: Scenario) -> np.ndarray:
    """Return how near somebody would come to the robot in each draw if nobody reacted."""
    draws = range(DRAWS if scenario.distributions else 1)
    nearest = [min(closest_approaches(scenario.draw(seed)).values()) for seed in draws]
    return np.array([distance_m for distance_m, _ in nearest])
