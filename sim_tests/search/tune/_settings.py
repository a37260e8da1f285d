"""The settings of a tuning."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

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
        perception: as for :func:`sim_tests.run_crossing`.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: the first tuning seed, and seed of the sampler.
        sampler: ``"tpe"`` or ``"nsga2"``.
        generation: trials per generation.
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

    @property
    def tuning_seeds(self) -> range:
        """Seeds by which trials are judged."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def held_out_seeds(self) -> range:
        """Seeds that no trial has run; disjoint from the tuning seeds."""
        first = self.seed + _HELD_OUT_OFFSET
        return range(first, first + self.held_out)
