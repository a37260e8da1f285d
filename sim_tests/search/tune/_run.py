"""The command ``awarenav tune``: search, write the chosen policies, print a table."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ...crossing.eyes import Perception, PerceptionKind, SensorSet
from .._files import common_settings, templates_of
from .._optimizer import SamplerName
from .._verdict import Verdict, command_text, episode_words
from ._finalists import BEATS_BASE
from ._policy_space import read_ranges, shipped_ranges
from ._results import table_lines, write_tuning
from ._settings import TuneSettings, held_out_scenarios
from ._tune import Tuning, require_trials, tune
from ._verdict import is_undecided, verdict_text


@dataclass(frozen=True, slots=True, kw_only=True)
class TuneOptions:
    """The options of ``awarenav tune``."""

    policy: str
    scenario: tuple[str, ...]
    ranges: Path | None
    trials: int
    episodes: int
    held_out: int
    hold_out_scenarios: tuple[str, ...]
    generation: int
    sampler: SamplerName
    risk: float | None
    requests: float | None
    perception: PerceptionKind
    sensors: SensorSet
    camera: str
    robot: str
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
        options.policy,
        options.scenario,
        options.camera,
        options.population or "",
        options.robot,
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
        hold_out_scenarios=held_out_scenarios(
            options.hold_out_scenarios, templates_of(common["scenarios"])
        ),
        risk=options.risk,
        requests=options.requests,
    )

    def report(tuning: Tuning) -> None:
        require_trials(tuning)
        write_tuning(tuning, options.out)
        if options.as_json:
            print((options.out / "chosen.json").read_text(encoding="utf-8"), end="")
            return
        print("\n".join(table_lines(tuning)))
        print("\n".join(_verdict(tuning, options).lines()))

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


def _verdict(tuning: Tuning, options: TuneOptions) -> Verdict:
    """Return what the tuning has shown, and the next command."""
    if tuning.winner is not None:
        command = command_text(
            "falsify",
            *("--policy", options.out / "chosen" / f"{BEATS_BASE}.yaml"),
            *("--against", options.policy),
            *episode_words(options),
            *("--workers", options.workers, "--out", options.out / "falsify"),
        )
    elif is_undecided(tuning):
        command = _continued(options, options.trials, 2 * options.held_out)
    else:
        command = _continued(options, 2 * options.trials, options.held_out)
    return Verdict(verdict_text(tuning), command)


def _continued(options: TuneOptions, trials: int, held_out: int) -> str:
    """Return the command that goes on with the tuning."""
    ranges = () if options.ranges is None else ("--ranges", options.ranges)
    risk = () if options.risk is None else ("--risk", options.risk)
    requests = () if options.requests is None else ("--requests", options.requests)
    return command_text(
        "tune",
        *("--policy", options.policy),
        *episode_words(options),
        *ranges,
        *risk,
        *requests,
        *("--trials", trials, "--episodes", options.episodes, "--held-out", held_out),
        *("--hold-out-scenarios", *options.hold_out_scenarios),
        *("--generation", options.generation, "--sampler", options.sampler),
        *("--seed", options.seed, "--workers", options.workers, "--out", options.out, "--resume"),
    )
