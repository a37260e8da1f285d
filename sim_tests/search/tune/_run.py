"""The command ``awarenav tune``: search, write the chosen policies, print a table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...conditions import Experiment
from ...scenario import ScenarioTemplate
from .._settings import command_text, common_settings, episode_words, print_results
from ._evaluation import BEATS_BASE
from ._policy_space import read_ranges, shipped_ranges
from ._results import is_undecided, table_lines, verdict_text, write_tuning
from ._tune import TuneSettings, Tuning, held_out_scenarios, tune


def run_tune(
    *,
    experiment: Experiment,
    ranges: Path | None,
    workers: int,
    out: Path,
    resume: bool,
    overwrite: bool,
    as_json: bool,
    **fields: Any,
) -> int:
    """Run the command, whose options these are, and return its exit status.

    The other options are fields of :class:`TuneSettings`, by their names.

    Raises:
        SimError: an unusable option.
        NavError: an unusable policy.
    """
    common = common_settings(experiment)
    templates = [ScenarioTemplate.from_text(text) for text in common["scenarios"]]
    searched = shipped_ranges() if ranges is None else read_ranges(ranges)
    settings = TuneSettings(
        **common,
        **fields,
        ranges={key: each.model_dump(mode="json") for key, each in searched.items()},
        hold_out_scenarios=held_out_scenarios(templates),
    )
    given = {
        "--policy": experiment.one("policy"),
        "--ranges": ranges,
        "--workers": workers,
        "--out": out,
    }

    def report(tuning: Tuning) -> None:
        write_tuning(tuning, out)
        following = _next_command(tuning, experiment, given)
        table, verdict = table_lines(tuning), verdict_text(tuning)
        print_results(out / "chosen.json", table, verdict, following, as_json=as_json)

    tune(settings, out, workers=workers, resume=resume, overwrite=overwrite, report=report)
    return 0


def _next_command(tuning: Tuning, experiment: Experiment, given: Mapping[str, Any]) -> str:
    """Return the next command: falsify the winner, or go on with more seeds or more trials."""
    settings, out = tuning.settings, given["--out"]
    if tuning.winner is not None:
        return command_text(
            *("falsify", "--policy", out / "chosen" / f"{BEATS_BASE}.yaml"),
            *("--against", given["--policy"], *episode_words(experiment)),
            *("--workers", given["--workers"], "--out", out / "falsify"),
        )
    more_seeds = is_undecided(tuning)
    words = ["tune", "--policy", given["--policy"], *episode_words(experiment)]
    for name, value in (
        ("--ranges", given["--ranges"]),
        ("--risk", settings.risk),
        ("--requests", settings.requests),
        ("--trials", settings.trials * (1 if more_seeds else 2)),
        ("--episodes", settings.episodes),
        ("--held-out", settings.held_out * (2 if more_seeds else 1)),
    ):
        if value is not None:
            words += [name, value]
    return command_text(
        *words,
        *("--generation", settings.generation, "--sampler", settings.sampler),
        *("--seed", settings.seed, "--workers", given["--workers"], "--out", out, "--resume"),
    )
