"""The command ``awarenav falsify``: search, write the worst cases, print a table."""

from __future__ import annotations

import sys
from pathlib import Path

from ...conditions import Experiment
from .._settings import command_text, common_settings, episode_words, print_results
from ._plot import draw_falsification
from ._results import (
    policy_against,
    records_against,
    table_lines,
    verdict_text,
    write_episodes,
    write_summary,
)
from ._search import Falsification, FalsifySettings, falsify
from ._worst_cases import POLICY_FILE, write_worst


def run_falsify(
    *,
    experiment: Experiment,
    episodes: int,
    against: str,
    people: int,
    worst: int,
    generation: int,
    unsafe_no_floor: bool,
    workers: int,
    out: Path,
    resume: bool,
    overwrite: bool,
    as_json: bool,
) -> int:
    """Run the command, whose options these are, and return its exit status.

    Raises:
        SimError: an unusable option.
        NavError: an unusable policy.
    """
    settings = FalsifySettings(
        **common_settings(experiment),
        episodes=episodes,
        generation=generation,
        people=people,
        unsafe_no_floor=unsafe_no_floor,
    )
    if unsafe_no_floor:
        print(
            "UNSAFE: the adapter's floor is taken away on purpose. No robot may drive like this.",
            file=sys.stderr,
        )
    other = policy_against(against, settings)
    found = falsify(settings, out, workers=workers, resume=resume, overwrite=overwrite)
    write_episodes(found, out / "episodes.csv")
    cases = write_worst(found, out, worst)
    others = records_against(cases, other, settings)
    text = verdict_text(found, cases, others)
    write_summary(found, cases, out / "summary.json", verdict=text, against=others)
    draw_falsification(found, cases, out / "falsify.png")
    rival = against or (other[0] if other else "")
    following = _next_command(found, experiment, rival, out)
    table = table_lines(found, cases)
    print_results(out / "summary.json", table, text, following, as_json=as_json)
    return 1 if found.contacts else 0


def _next_command(found: Falsification, experiment: Experiment, other: str, out: Path) -> str:
    """Return the command to run after the search."""
    if found.settings.unsafe_no_floor:
        return command_text(
            *("falsify", "--policy", experiment.one("policy"), *episode_words(experiment)),
            *("--episodes", found.settings.episodes, "--out", f"{out}_with_floor"),
        )
    own = out / POLICY_FILE
    if found.contacts:
        # The file has the camera, the robot and the population.
        case = (str(out / "worst_001.yaml"),)
        of_case = experiment.replaced(scenario=case, **dict.fromkeys(experiment.changes, ""))
        return command_text(
            *("crossings", *episode_words(of_case), "--policy", own, other),
            *("--seed", experiment["seed"], "--episodes", 1, "--out", out / "worst"),
        )
    return command_text(
        *("crossings", *episode_words(experiment), "--policy", other, own, "--episodes", 44),
        *("--out", out / "crossings"),
    )
