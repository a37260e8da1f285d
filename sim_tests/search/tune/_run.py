"""The command ``awarenav tune``: search, write the chosen policies, print a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...crossing.eyes import Perception, PerceptionKind, SensorSet
from .._files import common_settings
from .._optimizer import SamplerName
from ._evaluation import OBJECTIVES
from ._policy_space import read_ranges, shipped_ranges
from ._results import table_lines, write_tuning
from ._settings import TuneSettings
from ._tune import Tuning, require_trials, tune


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneOptions:
    """The options of ``awarenav tune``."""

    policy: str
    scenario: tuple[str, ...]
    ranges: Path | None
    trials: int
    episodes: int
    held_out: int
    generation: int
    sampler: SamplerName
    perception: PerceptionKind
    sensors: SensorSet
    camera: str
    population: str | None
    planner: str
    seed: int
    workers: int
    out: Path
    resume: bool
    overwrite: bool
    as_json: bool


def tune_command(options: TuneOptions) -> int:
    """Run the command and return its exit status.

    Raises:
        SimError: an unusable option.
        NavError: an unusable policy.
    """
    common = common_settings(
        options.policy, options.scenario, options.camera, options.population or ""
    )
    ranges = shipped_ranges() if options.ranges is None else read_ranges(options.ranges)
    settings = TuneSettings(
        **common,
        ranges={key: each.model_dump(mode="json") for key, each in ranges.items()},
        trials=options.trials,
        episodes=options.episodes,
        held_out=options.held_out,
        perception=Perception.of(options.perception, options.sensors).name,
        planner=options.planner,
        seed=options.seed,
        sampler=options.sampler,
        generation=options.generation,
    )

    def report(tuning: Tuning) -> None:
        require_trials(tuning)
        write_tuning(tuning, options.out)
        if options.as_json:
            print((options.out / "chosen.json").read_text(encoding="utf-8"), end="")
            return
        print("\n".join(table_lines(tuning)))
        print("\n".join(_verdict(tuning)))

    tune(
        settings,
        options.out,
        workers=options.workers,
        resume=options.resume,
        overwrite=options.overwrite,
        report=report,
    )
    if not options.as_json:
        print(f"Written to {options.out}")
    return 0


def _verdict(tuning: Tuning) -> list[str]:
    """Return what the tuning has found, as lines of text."""
    base = tuning.anchors[0]
    if not tuning.front:
        return ["In every trial the robot moved into a person at least once: none was chosen."]
    better = next((each for each in tuning.chosen if each.name == "beats_base"), None)
    if better is None:
        return [
            f"No trial is at least as good as {base.name} in both objectives on the tuning seeds: "
            "it lies on the front."
        ]
    time_s, violation_s = (better.held_out.minus(base.held_out, name) for name in OBJECTIVES)
    return [
        f"beats_base is at least as good as {base.name} in both objectives on the tuning seeds. "
        f"On the held-out ones it differs by {time_s.text(2)} s of time lost and "
        f"{violation_s.text(3)} s of violation."
    ]
