"""The cost of the robot to people: they are compared with themselves, the robot absent."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_tests.actors.behaviour import Heard, Person, PersonSpec, RobotBody, Surroundings, habits_of

DT_S = 0.05
NO_BOXES = np.empty((0, 4))


def walkers(seed: int, population: str, count: int, **fields: object) -> list[Person]:
    """Return new people who walk beside each other and past others, in one hall."""
    rng = np.random.default_rng(seed)
    people = []
    for number in range(count):
        start_m, end_m = rng.uniform(-4.0, 4.0, 2).tolist()
        route = [{"x_m": start_m, "y_m": -4.0}, {"x_m": end_m, "y_m": 4.0}]
        route = route[:: 1 if number % 2 else -1]
        start_s = float(rng.uniform(0.0, 2.0))
        data = {"name": f"{number}", "route": route, "start_s": start_s, **fields}
        spec, habits = PersonSpec.model_validate(data), habits_of(population)
        people.append(Person(spec, rng.spawn(1)[0], NO_BOXES, habits=habits))
    Person.bring_together(people)
    return people


def walk(people: list[Person], seconds: float, robot: RobotBody | None = None) -> None:
    """Let people walk among each other."""
    bodies: list = [None] * len(people)
    for step in range(round(seconds / DT_S)):
        for number, person in enumerate(people):
            others = tuple(each for each in (*bodies[:number], *bodies[number + 1 :]) if each)
            person.advance(step * DT_S, Surroundings(robot, others, lambda: True))
        bodies = [person.moving_body for person in people]


@given(
    seed=st.integers(0, 10_000),
    population=st.sampled_from(["classic", "recorded"]),
    count=st.integers(1, 3),
    pause_s=st.sampled_from([0.0, 2.0]),
    seconds=st.sampled_from([4.0, 25.0]),
)
@settings(max_examples=20, deadline=None, derandomize=True)
def test_nobody_is_delayed_without_a_robot(seed, population, count, pause_s, seconds):
    pauses = [{"at_m": 3.0, "for_s": pause_s}] if pause_s else []
    people = walkers(seed, population, count, pauses=pauses)
    walk(people, seconds)
    for person in people:
        outcome = person.outcome()
        if person.arrived:
            assert outcome.time_s == outcome.free_time_s
            assert outcome.length_m == outcome.free_length_m
        else:
            assert outcome.late_s is None or outcome.late_s < 1e-9


def test_only_what_the_robot_does_is_delay():
    """It stands in the way of everybody; they meet each other as they would without it."""
    robot = RobotBody(0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 0.3, (0.4, 0.0, 1.2))
    met, free = walkers(3, "recorded", 3), walkers(3, "recorded", 3)
    walk(met, 30.0, robot)
    walk(free, 30.0)
    for person, same in zip(met, free, strict=True):
        outcome, alone = person.outcome(), same.outcome()
        assert outcome.free_time_s == alone.time_s
        assert outcome.free_length_m == alone.length_m
    assert sum(each.outcome().time_s - each.outcome().free_time_s for each in met) > 0.5


@pytest.mark.parametrize("later_s", [0.2, 0.9])
def test_a_second_request_does_not_end_a_startle(later_s):
    """Somebody who has begun to step aside finishes the step, whatever they hear meanwhile."""
    robot = RobotBody(-3.0, 0.0, 0.0, 0.8, 0.0, 0.4, 0.3, (-3.0, 0.0, 1.2))
    spec = PersonSpec.model_validate({"name": "p", "route": [{"x_m": 0.0, "y_m": 0.6}]})
    farthest_m = []
    for second in ((), (Heard(2.0, startle="stop"),)):
        person = Person(spec, np.random.default_rng(0), NO_BOXES)
        places_m = []
        for step in range(80):
            heard = (Heard(1.0, startle="aside"),) if step == 10 else ()
            if step == round((1.0 + later_s) / DT_S):
                heard = second
            person.step(step * DT_S, Surroundings(robot, (), lambda: False, heard=heard))
            places_m.append(person.place_odom_m[1])
        farthest_m.append(max(places_m))
    assert farthest_m[0] == farthest_m[1] > 0.8
