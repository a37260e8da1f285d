"""What a falsification was asked for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class FalsifySettings:
    """What a falsification was asked for.

    Attributes:
        policy_name: what tables call the policy.
        policy: YAML of the policy.
        scenarios: YAML of the templates.
        episodes: how many in all.
        people: how many people of a scenario are varied.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        planner: ``"module:Class"``, empty for the reference planner.
        seed: of every episode, and of the search.
        generation: episodes a generation of CMA-ES.
        unsafe_no_floor: the floor was taken away on purpose.
    """

    policy_name: str
    policy: str
    scenarios: tuple[str, ...]
    episodes: int
    people: int
    perception: str
    planner: str
    seed: int
    generation: int
    unsafe_no_floor: bool = False
