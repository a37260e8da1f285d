"""The settings of a tuning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from awarenav.errors import not_one_of
from nav_adapter import AwarenessPolicy

from ...crossing.eyes import Perception
from ...scenario import ScenarioTemplate
from ...study.frontier import TODAY, sensors_of_today
from ...study.runs import Job, plan_jobs
from ...world.errors import SimError
from .._files import templates_of

#: Values of ``--hold-out-scenarios`` beside names.
THIRD: Final = "third"
NONE: Final = "none"
# Distance from the first tuning seed to the first held-out seed.
_HELD_OUT_OFFSET: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class TuneSettings:
    """The settings of a tuning.

    Attributes:
        policy_name: name of the base policy in tables.
        policy: YAML of the base policy.
        scenarios: YAML of the templates.
        ranges: search ranges, by dotted key of the policy file.
        trials: number of policies to try.
        episodes: number of tuning seeds, each run in every scenario.
        held_out: number of held-out seeds, each run in every scenario.
        perception: as for :func:`sim_tests.run_crossing`, such as ``"keypoints+scanner"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: the first tuning seed, and seed of the sampler.
        sampler: ``"tpe"`` or ``"nsga2"``.
        generation: trials per generation.
        hold_out_scenarios: names of the scenarios that no trial runs.
        risk: step-out impacts per 1 000 crossings that a policy may have; None for a twentieth of
            those of today's AMR in the same episodes.
        requests: requests for attention that a policy may make per crossing; None for no bound.
    """

    policy_name: str
    policy: str
    scenarios: tuple[str, ...]
    ranges: dict[str, dict[str, Any]]
    trials: int
    episodes: int
    held_out: int
    perception: str
    planner: str
    seed: int
    sampler: str
    generation: int
    hold_out_scenarios: tuple[str, ...] = ()
    risk: float | None = None
    requests: float | None = None

    @property
    def templates(self) -> tuple[ScenarioTemplate, ...]:
        """All scenarios."""
        return templates_of(self.scenarios)

    @property
    def tuning_templates(self) -> tuple[ScenarioTemplate, ...]:
        """Scenarios by which trials are judged."""
        return tuple(each for each in self.templates if each.name not in self.hold_out_scenarios)

    @property
    def tuning_seeds(self) -> range:
        """Seeds by which trials are judged."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def held_out_seeds(self) -> range:
        """Seeds that no trial has run; disjoint from the tuning seeds."""
        first = self.seed + _HELD_OUT_OFFSET
        return range(first, first + self.held_out)

    def jobs(
        self,
        name: str,
        policy: AwarenessPolicy,
        seeds: Sequence[int],
        templates: Sequence[ScenarioTemplate],
    ) -> tuple[Job, ...]:
        """Return the episodes of a policy: every seed in every one of some scenarios.

        Today's AMR has its laser scanners alone, where the robot has any.

        Raises:
            SimError: an episode that cannot be run.
        """
        perception = Perception.named(self.perception)
        sensors = perception.sensors
        return plan_jobs(
            templates,
            [(name, policy)],
            seeds,
            planners=[self.planner],
            perception=perception.kind or "keypoints",  # without a camera it does not matter
            sensors=[sensors_of_today(sensors) if name == TODAY else sensors],
        )


def held_out_scenarios(
    given: Sequence[str], templates: Sequence[ScenarioTemplate]
) -> tuple[str, ...]:
    """Return the names of the scenarios that no trial runs.

    Args:
        given: names, with or without the robot's; ``"third"`` for every third scenario, the second
            of three first, in the order of what people look at (attentive, mixed, unaware) and of
            the names; or ``"none"``. Of fewer than three scenarios, ``"third"`` holds none out.
        templates: all scenarios of the tuning.

    Raises:
        SimError: an unknown name, or no scenario is left to tune on.
    """
    names = [each.name for each in sorted(templates, key=lambda each: (each.attention, each.name))]
    if tuple(given) == (NONE,):
        return ()
    if tuple(given) == (THIRD,):
        return tuple(names[1::3]) if len(names) >= 3 else ()
    meant = {also: each.name for each in templates for also in each.names}
    for name in given:
        if name not in meant:
            raise SimError(not_one_of("--hold-out-scenarios", name, (THIRD, NONE, *names)))
    chosen = {meant[name] for name in given}
    if len(chosen) == len(names):
        raise SimError("--hold-out-scenarios must leave a scenario to tune on, got all of them")
    return tuple(name for name in names if name in chosen)
