"""What a tuning was asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

#: Held-out seeds begin so far after the tuning ones.
HELD_OUT_FROM: Final = 1_000_000


@dataclass(frozen=True, slots=True)
class TuneSettings:
    """What a tuning was asked for.

    Attributes:
        policy_name: what tables call the base policy.
        policy: YAML of the base policy.
        scenarios: YAML of the templates.
        ranges: where to search, by place in the policy.
        trials: policies to try.
        episodes: tuning seeds, each run in every scenario.
        held_out: held-out seeds, each run in every scenario.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: the first tuning seed, and of the sampler.
        sampler: ``"tpe"`` or ``"nsga2"``.
        generation: trials a generation.
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
        """Seeds that trials are judged by."""
        return range(self.seed, self.seed + self.episodes)

    @property
    def held_out_seeds(self) -> range:
        """Seeds that no trial has met; disjoint from the tuning seeds."""
        first = self.seed + HELD_OUT_FROM
        return range(first, first + self.held_out)
