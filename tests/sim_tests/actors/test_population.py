"""Populations: the fitted people keep their task, and have the figures they were given."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from sim_tests import run_crossing
from sim_tests.actors.behaviour import (
    Heard,
    Person,
    PersonSpec,
    RobotBody,
    Surroundings,
    draw_person,
    habits_of,
)
from sim_tests.actors.behaviour._habits import GaitVariation, VariationFigures
from sim_tests.crossing.planner import StraightOn
from sim_tests.scenario import Scenario
from tracking.people import NOTICING_S

NO_BOXES = np.zeros((0, 4))


def short(name: str, duration_s: float = 7.5) -> Scenario:
    return Scenario.shipped(name).draw(1).model_copy(update={"duration_s": duration_s})


def positions(scenario: Scenario, population: str | None = None) -> np.ndarray:
    # A robot that drives straight on: neither planner nor policy has a part in what people do.
    result = run_crossing(
        scenario, policy="blind", planner=StraightOn(0.8), seed=1, population=population
    )
    return np.array([[v.position_odom_m for v in frame.truth] for frame in result.frames])


def person(**changes: object) -> PersonSpec:
    data = {"name": "one", "route": [{"x_m": 0.0, "y_m": 3.0}, {"x_m": 0.0, "y_m": -3.0}]}
    return PersonSpec.model_validate({**data, **changes})


def recorded(spec: PersonSpec, rng: np.random.Generator, boxes: np.ndarray) -> Person:
    return Person(spec, rng, boxes, habits=habits_of("recorded"))


def beside(x_m: float = -2.0, speed_mps: float = 0.0) -> Surroundings:
    robot = RobotBody(x_m, 0.0, 0.0, speed_mps, 0.0, 0.36, 0.25, (x_m, 0.0, 0.8))
    return Surroundings(robot, (), lambda: True)


def test_recorded_people_repeat_with_their_seed() -> None:
    scenario = short("late_glance", 3.0)
    first, again = (positions(scenario, "recorded") for _ in range(2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, positions(scenario))


def test_a_scenario_keeps_its_tasks_among_recorded_people() -> None:
    scenario = Scenario.shipped("crossing_attentive").with_population("recorded")
    (worker,) = scenario.people
    assert (worker,) == Scenario.shipped("crossing_attentive").people
    assert Scenario.from_text(scenario.to_text()) == scenario


def test_speed_and_looks_are_drawn_and_the_task_is_kept() -> None:
    rng = np.random.default_rng(0)
    drawn = [draw_person(person(), rng) for _ in range(2000)]
    speeds = np.array([each.speed_mps for each in drawn])
    assert np.median(speeds) == pytest.approx(1.42, abs=0.02)
    assert np.mean(speeds > 1.85) == pytest.approx(0.04, abs=0.015)
    assert {each.glances.looker_share for each in drawn} == {0.886}
    assert draw_person(person(speed_mps=2.2), rng).speed_mps == 2.2
    assert draw_person(person(speed_mps=0.8), rng).speed_mps == 0.8
    assert draw_person(person(glances={"watches": True}), rng).glances.looker_share == 1.0


def test_the_variation_has_the_figures_it_was_given() -> None:
    figures = VariationFigures(0.2, 0.3, 0.1, 0.4, 0.03, 0.0, 0.9, 0.0, 0.0)
    rng = np.random.default_rng(0)
    variation = GaitVariation(figures, rng)
    steps = np.array([variation.step(0.05, 1.0) for _ in range(40_000)])[100:]
    sway_mps = 0.03 * math.tau * 0.9
    assert steps[:, 0].std() == pytest.approx(0.2, rel=0.1)
    assert steps[:, 1].std() == pytest.approx(math.hypot(0.1, sway_mps / math.sqrt(2.0)), rel=0.1)
    # The accelerations are the rates of the velocities.
    assert np.diff(steps[:, 0]) / 0.05 == pytest.approx(steps[1:, 2])
    still = GaitVariation(figures, rng)
    assert np.abs([still.step(0.05, 0.0) for _ in range(50)]).max() == 0.0


def test_people_on_the_way_change_their_mind_and_seated_people_stay() -> None:
    pausing = person(pauses=[{"at_m": 1.0, "for_s": 300.0}])
    on = 0
    for seed in range(12):
        walker = recorded(pausing, np.random.default_rng(seed), NO_BOXES)
        walker.advance(20.0, beside())
        on += walker.place_odom_m[1] < 1.5
    assert on >= 8
    alone = recorded(pausing, np.random.default_rng(0), NO_BOXES)
    alone.advance(20.0, Surroundings(None, (), lambda: False))
    assert alone.place_odom_m[1] == pytest.approx(2.0, abs=0.2)
    clerk = person(route=[{"x_m": 1.0, "y_m": 1.0}], activity="sitting")
    seated = recorded(clerk, np.random.default_rng(0), NO_BOXES)
    seated.advance(30.0, beside())
    assert seated.place_odom_m == (1.0, 1.0)


def watched(habits: str, seed: int, **changes: object) -> tuple[float, bool]:
    """Return the looks until somebody noticed the robot, in seconds, and whether any came before.

    They stand and watch, or what ``changes`` say, and a robot drives past.
    """
    spec = person(glances={"watches": True, "first_glance_delay_s": 0.0}, start_s=30.0)
    one = Person(spec, np.random.default_rng(seed), NO_BOXES, habits=habits_of(habits))
    looks = 0
    for tick in range(200):
        around = replace(beside(-1.5 + 0.01 * tick, 0.2), **changes)
        one.step(0.05 * tick, around)
        if one.noticed_s is not None:
            break
        assert not one.reaction
        looks += one.since_look_s == 0.0
    return 0.05 * looks, looks > 0


def test_half_a_second_of_looks_takes_the_robot_in_by_half() -> None:
    """The rule by which the tracker believes it, for looks of any length."""
    looked_s = np.array([watched("recorded", seed)[0] for seed in range(200)])
    for t_s in (0.25, 0.5, 1.0):
        share = -math.expm1(-t_s / NOTICING_S)
        spread = 4.0 * math.sqrt(share * (1.0 - share) / len(looked_s))
        assert np.mean(looked_s < t_s - 1e-9) == pytest.approx(share, abs=spread)
    assert not any(watched("classic", seed)[1] for seed in range(4))


def test_whoever_is_called_or_touched_takes_the_robot_in_at_once() -> None:
    called, touched = {"heard": (Heard(0.0, 2.0),)}, {"touches": ((1.0, 0.0),)}
    for seed in range(12):
        assert not watched("recorded", seed, **called)[1]
        assert watched("recorded", seed, **touched)[0] <= 0.05
    assert any(watched("recorded", seed)[1] for seed in range(12))


def test_an_errand_leads_out_of_no_rack_and_counts_for_no_walk() -> None:
    # A cell 2.8 m wide: whoever walks off stays in it.
    sides = [(-2.0, 1.4, 2.0, 1.6), (-2.0, -1.6, 2.0, -1.4)]
    walls = np.array([*sides, *((y0, x0, y1, x1) for x0, y0, x1, y1 in sides)])
    spec = person(route=[{"x_m": 0.0, "y_m": 0.0}])
    moved = []
    for seed in range(6):
        walker = recorded(spec, np.random.default_rng(seed), walls)
        walker.advance(30.0, beside(-4.0))
        x, y = walker.place_odom_m
        assert max(abs(x), abs(y)) < 1.2
        assert walker.outcome().free_time_s is None
        moved.append(math.hypot(x, y))
    assert max(moved) > 0.1
