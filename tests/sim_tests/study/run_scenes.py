"""Short episodes for tests of runs."""

from __future__ import annotations

from sim_tests.scenario import Scenario
from sim_tests.study.runs import plan_jobs

SHORT = """
name: {name}
description: Two seconds.
duration_s: 2.0
control_hz: 10.0
layout: {{x_min_m: -3.0, y_min_m: -3.0, x_max_m: 6.0, y_max_m: 3.0}}
robot: {{goal_x_m: 0.6}}
people:
  - name: stands
    route: [{{x_m: {{uniform: {{low: 3.0, high: 4.0}}}}, y_m: -1.0}}]
    glances: {{notices_within_m: 0.0}}
    social: false
"""


def short(name: str = "short") -> Scenario:
    """Return a scenario of a robot that drives 0.6 m, and a person who stands."""
    return Scenario.from_text(SHORT.format(name=name))


def short_jobs(episodes: int = 2, **options):
    """Return episodes of it with two policies, from the truth unless told otherwise."""
    return plan_jobs(
        [short()], ["blind", "balanced"], range(episodes), **{"perception": "truth", **options}
    )
