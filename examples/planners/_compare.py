"""The same crossings with every planner, and their results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from nav_adapter import AwarenessPolicy
from sim_tests import CrossingResult, LocalPlanner, Scenario, run_crossing
from sim_tests.study.measures import OVERSHOOT_MPS, limit_excess_mps

#: Distance of the worker's stop to the left of the robot's path, metres: near enough that a wide
#: circle covers the path.
STOPS_AT_Y_M = 1.5
#: Radii of unaware people, metres: that of the shipped policy, and a wider one.
RADII_M = {"": 1.0, ", wide": 1.5}


@dataclass(frozen=True, slots=True)
class Row:
    """One crossing of one planner."""

    planner: str
    worker: str
    result: CrossingResult

    @property
    def excess_mps(self) -> float:
        """The largest excess of the speed over the allowed one, m/s."""
        return limit_excess_mps(self.result.frames, self.result.robot) or 0.0

    @property
    def kept_the_limit(self) -> bool:
        """True if the speed stayed within the allowed one."""
        return self.excess_mps <= OVERSHOOT_MPS

    @property
    def is_good(self) -> bool:
        """True if the robot reached the goal within the limit and touched nobody."""
        return self.result.success and self.kept_the_limit

    def line(self) -> str:
        """Return a row of a Markdown table."""
        time_s = self.result.time_to_goal_s
        took = "never" if time_s is None else f"{time_s:.1f}"
        separation_m = self.result.min_separation_m
        gap = "–" if separation_m > 1e6 else f"{separation_m:.2f}"
        kept = "yes" if self.kept_the_limit else f"+{self.excess_mps:.2f} m/s"
        touched = self.result.contact_by or "nobody"
        return f"| {self.planner} | {self.worker} | {took} | {gap} | {kept} | {touched} |"


HEADER = (
    "| planner | worker | time to goal, s | least separation, m | within the limit | contact by |\n"
    "| --- | --- | --- | --- | --- | --- |"
)


def scenario(name: str) -> Scenario:
    """Return a shipped crossing whose worker stops nearer to the robot's path."""
    data = Scenario.shipped(name).model_dump()
    path = data["workers"][0]["path"]
    for point in path:
        point["y_m"] = min(point["y_m"], STOPS_AT_Y_M)
    path[1]["t_s"] = 4.5
    return Scenario.model_validate(data)


def policy(unaware_radius_m: float) -> AwarenessPolicy:
    """Return the default policy with another radius for unaware people."""
    balanced = AwarenessPolicy.preset("balanced")
    data = balanced.model_dump()
    data["inflation"]["unaware_radius_m"] = unaware_radius_m
    return AwarenessPolicy.model_validate(data)


def compare(
    name: str,
    make: Callable[[], LocalPlanner],
    *,
    perception: str = "truth",
    seed: int = 0,
    done: Callable[[Row], None] = lambda row: None,
) -> tuple[Row, ...]:
    """Cross with nobody, an aware worker, an unaware one, and one with a wider radius.

    Args:
        name: name of the planner.
        make: returns a new planner for each crossing.
        perception: as in :func:`sim_tests.run_crossing`.
        seed: seed of every crossing.
        done: called with each row.
    """
    aware, unaware = scenario("crossing_attentive"), scenario("crossing_distracted")
    cases = [("nobody", aware.without_people(), 1.0), ("aware", aware, 1.0)]
    cases += [(f"unaware{label}", unaware, radius_m) for label, radius_m in RADII_M.items()]
    rows = []
    for worker, task, radius_m in cases:
        result = run_crossing(
            task,
            policy=policy(radius_m),
            planner=make(),
            perception=perception,
            seed=seed,
            population="answers=0,startles=0",  # a worker who answers would be none of these
        )
        rows.append(Row(name, worker, result))
        done(rows[-1])
    return tuple(rows)
