"""The same crossings with every planner, and their results."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

from nav_adapter import AwarenessPolicy
from sim_tests import NOVA_CARTER, CrossingResult, LocalPlanner, Scenario, run_crossing

#: Distance of the worker's stop to the left of the robot's path, metres: near enough that a wide
#: circle covers the path.
STOPS_AT_Y_M = 1.5
#: Radii of unaware people, metres: that of the shipped policy, and a wider one.
RADII_M = {"": 1.0, ", wide": 1.5}
# Overshoot of the motors on a ramp, about.
_OVERSHOOT_MPS = 0.03


@dataclass(frozen=True, slots=True)
class Row:
    """One crossing of one planner."""

    planner: str
    worker: str
    result: CrossingResult

    @property
    def excess_mps(self) -> float:
        """The largest excess of the speed over that allowed one cycle before, m/s.

        Allowed is the limit, or what full braking leaves of a higher speed, since the limit may
        fall faster than the robot can brake.
        """
        frames = self.result.frames
        return max(
            after.robot_state.speed_mps
            - max(
                before.constraints.speed_limit_mps,
                before.robot_state.speed_mps
                - NOVA_CARTER.max_deceleration_mps2 * (after.t_s - before.t_s),
            )
            for before, after in itertools.pairwise(frames)
        )

    @property
    def kept_the_limit(self) -> bool:
        """True if the speed stayed within the allowed one."""
        return self.excess_mps <= _OVERSHOOT_MPS

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
            task, policy=policy(radius_m), planner=make(), perception=perception, seed=seed
        )
        rows.append(Row(name, worker, result))
        done(rows[-1])
    return tuple(rows)
