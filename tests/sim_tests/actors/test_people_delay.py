"""The delay of people who have not arrived: a robot that blocks somebody for good costs them."""

import numpy as np
import pytest
from staged_people import run_stage

from sim_tests.actors.behaviour import ALONE, PersonOutcome, PersonSpec, Walker

# An aisle in which a robot and a person cannot pass each other.
AISLE = {"x_min_m": -8.0, "x_max_m": 14.0, "y_min_m": -0.6, "y_max_m": 0.6, "racks": []}


def met_in_the_aisle(seconds: float) -> PersonOutcome:
    """Somebody walks towards a robot that stands."""
    towards = {"name": "blocked", "route": [{"x_m": 8.0, "y_m": 0.0}, {"x_m": -4.0, "y_m": 0.0}]}
    run = run_stage([towards], robot_mps=0.0, seconds=seconds, layout=AISLE)  # type: ignore[arg-type]
    return run.outcomes[0]


def test_somebody_who_is_blocked_is_later_by_every_second():
    soon, later = met_in_the_aisle(12.0), met_in_the_aisle(20.0)
    assert soon.time_s is later.time_s is None
    assert soon.late_s is not None
    assert soon.late_s > 4.0
    assert later.late_s == pytest.approx(soon.late_s + 8.0, abs=0.5)


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"start_s": 1.0, "turns_back_at_m": 4.0, "pauses": [{"at_m": 6.0, "for_s": 3.0}]},
    ],
)
def test_somebody_who_walks_alone_is_never_late(fields):
    route = [{"x_m": 0.0, "y_m": 0.0}, {"x_m": 6.0, "y_m": 0.0}]
    spec = PersonSpec.model_validate({"name": "alone", "route": route, **fields})
    person = Walker(spec, np.random.default_rng(0), np.empty((0, 4)))
    assert person.outcome().late_s is None
    for tick in range(600):
        person.advance(0.05 * tick, ALONE)
        outcome = person.outcome()
        before = 0.05 * tick < spec.start_s
        if before or person.arrived:
            assert outcome.late_s is None
        else:
            assert outcome.late_s == pytest.approx(0.0, abs=1e-6)
    assert person.arrived
