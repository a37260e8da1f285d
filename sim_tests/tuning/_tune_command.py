"""``awarenav tune`` from its options to its last line."""

from __future__ import annotations

import argparse
from pathlib import Path

from nav_adapter import AwarenessPolicy

from .._scenario_template import ScenarioTemplate
from .._scenario_files import shipped_scenarios
from ..policies._show import read_policy
from ..runs._plan import policy_text
from ._files import table_lines, write_tuning
from ._policy_space import read_ranges, shipped_ranges
from ._settings import TuneSettings
from ._tune import Tuning, require_trials, tune


def tune_command(options: argparse.Namespace) -> int:
    """Run the command and return its exit status.

    Raises:
        SimError: for options that cannot be used.
        NavError: for a policy that cannot be used.
    """
    policy: AwarenessPolicy = read_policy(options.policy)
    ranges = shipped_ranges() if options.ranges is None else read_ranges(options.ranges)
    settings = TuneSettings(
        policy_name=Path(options.policy).stem,
        policy=policy_text(policy),
        scenarios=tuple(template.to_text() for template in templates(options.scenario)),
        ranges={path: each.model_dump(mode="json") for path, each in ranges.items()},
        trials=options.trials,
        episodes=options.episodes,
        held_out=options.held_out,
        perception=options.perception,
        planner=options.planner,
        seed=options.seed,
        sampler=options.sampler,
        generation=options.generation,
    )

    def report(tuning: Tuning) -> None:
        require_trials(tuning)
        write_tuning(tuning, options.out)
        print("\n".join(table_lines(tuning)))
        print("\n".join(_verdict(tuning)))

    tune(settings, options.out, workers=options.workers, resume=options.resume, report=report)
    print(f"Written to {options.out}")
    return 0


def templates(names: list[str]) -> list[ScenarioTemplate]:
    """The scenarios of names and files; ``all`` stands for the shipped ones with a planner."""
    found: dict[str, ScenarioTemplate] = {}
    for name in names:
        if name == "all":
            shipped = [ScenarioTemplate.shipped(each) for each in shipped_scenarios()]
            chosen = [t for t in shipped if t.median().robot.straight_on_speed_mps is None]
        else:
            chosen = [ScenarioTemplate.named(name)]
        found |= {template.name: template for template in chosen}
    return list(found.values())


def _verdict(tuning: Tuning) -> list[str]:
    base = tuning.settings.policy_name
    if not tuning.front:
        return ["In every trial the robot moved into a person at least once: none was chosen."]
    if any(each.name == "beats_base" for each in tuning.chosen):
        return [f"beats_base is at least as good as {base} in both objectives on the tuning seeds."]
    return [f"No trial is at least as good as {base} in both objectives: it lies on the front."]
