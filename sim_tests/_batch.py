"""Many crossings in a row, with paired seeds across policies."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from nav_adapter import AwarenessPolicy
from perception import AwarenessPipeline, Camera

from ._crossing import CrossingResult, run_crossing
from ._scenario import Scenario, shipped_scenarios
from ._tables import EpisodeTable


def run_batch(
    scenarios: Sequence[str],
    policies: Sequence[str],
    *,
    perception: str,
    episodes: int,
    seed: int,
    out: Path,
) -> tuple[CrossingResult, ...]:
    """Run every scenario with every policy on the same seeds and write ``episodes.csv``.

    Args:
        scenarios: shipped names, YAML files, or ``"all"`` for the shipped ones that have a planner.
        policies: presets' names or YAML files.
        perception: ``"truth"``, ``"keypoints"`` or ``"pixels"``.
        episodes: seeds a scenario, counted up from ``seed``.
        seed: the first seed.
        out: folder, made when missing; rows appear in ``episodes.csv`` as they are done.

    Raises:
        SimError: an unknown scenario; nothing has run then.
        NavError: an unknown preset or unusable policy file; nothing has run then.
        PerceptionError: for pixels, when the shipped networks cannot be loaded; nothing has run.
    """
    chosen = [scenario for name in scenarios for scenario in _scenarios(name)]
    for policy in policies:
        if policy.endswith((".yaml", ".yml")):
            AwarenessPolicy.from_yaml(policy)
        else:
            AwarenessPolicy.preset(policy)
    if perception == "pixels":
        AwarenessPipeline(Camera.from_fov(640, 480, 1.0))  # says at once which networks are absent
    out.mkdir(parents=True, exist_ok=True)
    runs = list(itertools.product(chosen, range(seed, seed + episodes), policies))
    results = []
    with (
        EpisodeTable(out / "episodes.csv") as table,
        tqdm(runs, desc="crossings", unit="episode", file=sys.stderr) as bar,
    ):
        for scenario, episode_seed, policy in bar:
            result = run_crossing(scenario, policy=policy, perception=perception, seed=episode_seed)
            table.add(result)
            results.append(result)
    return tuple(results)


def _scenarios(name: str) -> list[Scenario]:
    if name == "all":
        shipped = [Scenario.shipped(each) for each in shipped_scenarios()]
        return [each for each in shipped if each.robot.straight_on_speed_mps is None]
    if name.endswith((".yaml", ".yml")):
        return [Scenario.from_yaml(name)]
    return [Scenario.shipped(name)]
