"""Refusals of people, bodies and robots, whose message says what is valid."""

from __future__ import annotations

from typing import Any

import pytest

from sim_tests import Scenario
from sim_tests.actors.behaviour import Hearing, PersonSpec
from sim_tests.actors.body import load_worker
from sim_tests.crossing import Stage


def person(**fields: Any) -> dict[str, Any]:
    return {"name": "p", "route": [{"x_m": 1.0, "y_m": 0.0}], **fields}


def stage(*people: dict[str, Any], layout: str = "open") -> Stage:
    case = {"name": "x", "duration_s": 1.0, "layout": layout, "robot": {"goal_x_m": 1.0}}
    return Stage(Scenario.model_validate({**case, "people": list(people)}))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: load_worker("nobody"), "must be one of .*got 'nobody'"),
        (lambda: Hearing(heard_within_m=20.0), "heard_within_m must be at most not_heard_beyond"),
        (lambda: Hearing.model_validate({"answer": 0.3}), "did you mean 'answers'"),
        (
            lambda: Scenario.shipped("late_glance").with_population("odd"),
            "population must be one of classic, recorded, got 'odd'",
        ),
        (
            lambda: PersonSpec.model_validate(person(sets_off_within_m=1.0)),
            "sets_off_within_m needs a route of at least two",
        ),
        (
            lambda: PersonSpec.model_validate(person(gaze=[{"t_s": 1.0}, {"t_s": 1.0}])),
            "gaze must have increasing t_s",
        ),
        (lambda: stage(person(), person()), "names of people must be unique"),
        (lambda: stage(person(reactions={"wait": 0.0})), "at least one share"),
        (lambda: stage(person(route=[{"x_m": 0.0, "y_m": 2.2}]), layout="crossing"), "a rack"),
    ],
)
def test_what_nobody_can_be_is_refused(make, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()
