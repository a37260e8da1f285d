"""The results of a falsification: its command, files, table, verdict and next command."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from awarenav.cli import table_text
from awarenav.errors import counted
from awarenav.files import write_csv

from ...conditions import Experiment
from ...crossing import named_policy
from ...study.measures import NOTICED, EpisodeRecord
from ...study.runs import policy_of, policy_text, run_episode
from ...world.errors import SimError
from .._settings import command_text, common_settings, episode_words, print_results, write_json
from ._search import CONTACT_SCORE, Falsification, FalsifySettings, falsify
from ._worst_cases import POLICY_FILE, WorstCase, draw_falsification, write_worst

# The people whom the moving robot must not touch.
_COUNTS: Final = "who had never noticed it, or only when it asked them to"
#: Default of ``--against``, and the other policy for that one itself.
_BASE: Final = "balanced"
_BASE_OF_BASE: Final = "blind"


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
    """Run the command, whose options these are, and return its exit status."""
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
    # Worst cases run again, and a system that shuts down waits for nobody.
    text = verdict_text(found, [], {})
    write_summary(found, [], out / "summary.json", verdict=text, against={})
    if found.interrupted:
        print(f"So far, in {out / 'summary.json'}: {text}", file=sys.stderr)
        raise KeyboardInterrupt
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
    if found.settings.unsafe_no_floor:
        return command_text(
            *("falsify", "--policy", experiment.one("policy"), *episode_words(experiment)),
            *("--episodes", found.settings.episodes, "--out", f"{out}_with_floor"),
        )
    own = out / POLICY_FILE
    if found.contacts:
        # The file has the camera, the robot and the population.
        case = (str(out / "worst_001.yaml"),)
        of_case = experiment.replaced(scenario=case, **dict.fromkeys(experiment.changes))
        return command_text(
            *("crossings", *episode_words(of_case), "--policy", own, other),
            *("--seed", experiment["seed"], "--episodes", 1, "--out", out / "worst"),
        )
    return command_text(
        *("crossings", *episode_words(experiment), "--policy", other, own, "--episodes", 44),
        *("--out", out / "crossings"),
    )


def write_episodes(falsification: Falsification, path: Path) -> None:
    """Write every episode of the search as CSV; the last column has the parameters as JSON."""
    notes = (
        *("min_margin_never_m", "min_separation_m", "contact_by"),
        *("moving_contacts", *(f"moving_contacts_{noticed}" for noticed in NOTICED)),
        *("moving_contacts_asked", "moving_contact_stoppable_mps", "moving_contact_mps", "error"),
    )
    write_csv(
        path,
        ["scenario", "round", "trial", "score", *notes, "levers"],
        (
            [
                *(each.scenario, each.round, each.trial.number, f"{each.score:.6f}"),
                *("" if each.notes.get(note) is None else each.notes[note] for note in notes),
                json.dumps(each.trial.parameters, sort_keys=True),
            ]
            for each in falsification.episodes
        ),
        SimError,
    )


def write_summary(
    falsification: Falsification,
    cases: Sequence[WorstCase],
    path: Path,
    *,
    verdict: str,
    against: Mapping[str, EpisodeRecord],
) -> None:
    """Write the figures of a falsification as JSON."""
    scenarios = {}
    for name in falsification.spaces:
        scores = [each.score for each in falsification.episodes if each.scenario == name]
        contacts = [row for row, each in enumerate(scores) if each <= CONTACT_SCORE]
        scenarios[name] = {
            "episodes": len(scores),
            "contacts": len(contacts),
            "first_contact_at": contacts[0] + 1 if contacts else None,
            "lowest_score": round(min(scores), 6) if scores else None,
        }
    own = (
        *("min_margin_never_m", "min_separation_m", "contact_by", "moving_contacts"),
        *(f"moving_contacts_{noticed}" for noticed in NOTICED),
        *("moving_contacts_asked", "moving_contact_stoppable_mps"),
        *("speed_at_min_separation_mps", "awareness"),
    )
    others = ("policy", "min_margin_never_m", "min_separation_m", "moving_contacts", "error")
    summary: dict[str, Any] = {
        "policy": falsification.settings.policy_name,
        "unsafe_no_floor": falsification.settings.unsafe_no_floor,
        "episodes": len(falsification.episodes),
        "interrupted": falsification.interrupted,
        "contacts": falsification.contacts,
        "inevitable": falsification.inevitable,
        "contact_mps": round(falsification.contact_mps, 6),
        "contacts_with_others": {
            noticed: {"episodes": len(speeds), "contact_mps": round(max(speeds, default=0.0), 6)}
            for noticed, speeds in falsification.other_speeds_mps.items()
        },
        "without_result": falsification.errors,
        "verdict": verdict,
        "scenarios": scenarios,
        "worst": [
            {
                "file": case.path.name,
                "scenario": case.episode.scenario,
                **{name: getattr(case.record, name) for name in own},
                "replays": case.replays,
                "inevitable": case.episode.inevitable,
                "against": None
                if (other := against.get(case.path.name)) is None
                else {name: getattr(other, name) for name in others},
            }
            for case in cases
        ],
    }
    write_json(path, summary)


def table_lines(falsification: Falsification, cases: Sequence[WorstCase]) -> list[str]:
    """Return the worst cases and the totals as lines of text."""
    header = ("file", "scenario", "margin", "separation", "robot", "contact by", "awareness")
    rows = [
        [
            case.path.name + ("" if case.replays else " (DOES NOT REPLAY)"),
            case.episode.scenario,
            f"{_two_decimals(case.record.min_margin_never_m)} m",
            f"{_two_decimals(case.record.min_separation_m)} m",
            f"{_two_decimals(case.record.speed_at_min_separation_mps)} m/s",
            (case.record.contact_by or "-") + (", inevitable" if case.episode.inevitable else ""),
            case.record.awareness or "-",
            case.record.reaction or "-",
        ]
        for case in cases
    ]
    lines = [table_text((*header, "reaction"), rows, left=2), ""]
    contacts, episodes = falsification.contacts, len(falsification.episodes)
    others = ", ".join(
        f"{len(speeds)} {NOTICED[noticed][0]}"
        for noticed, speeds in falsification.other_speeds_mps.items()
    )
    lines.append(
        f"{contacts} of {counted(episodes, 'episode')} with a contact of the moving robot and a "
        f"person {_COUNTS}, {falsification.inevitable} of them inevitable; with others: {others}."
    )
    if falsification.errors:
        broken = counted(falsification.errors, "episode has", "episodes have")
        lines.append(f"{broken} no result; episodes.csv says why.")
    return lines


def policy_against(given: str, settings: FalsifySettings) -> tuple[str, str] | None:
    """Return the name and the YAML of the policy to compare with.

    Args:
        given: a preset or a YAML file; empty for ``balanced``, or ``blind`` for ``balanced``.
        settings: settings of the falsification.

    Returns:
        None if the floor is taken away, which leaves nothing to compare.
    """
    if settings.unsafe_no_floor:
        return None
    names = (given,) if given else (_BASE, _BASE_OF_BASE)
    policies = [(name, policy_text(policy)) for name, policy in map(named_policy, names)]
    own = policy_of(settings.policy)
    return next((each for each in policies if policy_of(each[1]) != own), policies[-1])


def records_against(
    cases: Sequence[WorstCase], against: tuple[str, str] | None, settings: FalsifySettings
) -> dict[str, EpisodeRecord]:
    """Run the worst cases with another policy; return the records by the name of the file."""
    if against is None:
        return {}
    name, policy = against
    other = replace(settings, policy_name=name, policy=policy)
    return {case.path.name: run_episode(other.job(case.scenario)) for case in cases}


def verdict_text(
    falsification: Falsification, cases: Sequence[WorstCase], others: Mapping[str, EpisodeRecord]
) -> str:
    """Return what the search has found about a policy, and what another one does there."""
    name, episodes = falsification.settings.policy_name, len(falsification.episodes)
    contacts, searched = falsification.contacts, counted(len(falsification.episodes), "episode")
    if falsification.settings.unsafe_no_floor:
        found = "finds" if contacts else "does not find"
        return (
            f"the search {found} contacts of a robot without its floor ({contacts} of {episodes})."
        )
    if contacts:
        text = (
            f"{name} is not safe enough: the moving robot and a person {_COUNTS}, touched in "
            f"{contacts} of {searched}, at up to {falsification.contact_mps:.2f} m/s."
        )
        if falsification.inevitable:
            text += (
                f" {falsification.inevitable} of them are inevitable: a robot at 0.25 m/s could "
                "not have stopped either."
            )
    else:
        text = (
            f"no contact of the moving robot and a person {_COUNTS}, with {name} "
            f"in {searched}. A search is not a sample, so this gives no rate."
        )
    return " ".join([text, _others(falsification), *_comparison(name, cases, others)])


def _others(falsification: Falsification) -> str:
    """Return the sentence about people who had noticed it, whom today's AMR touches, too."""
    touched = [
        f"people {NOTICED[noticed][1]} in {len(speeds_mps)} "
        f"({100.0 * len(speeds_mps) / len(falsification.episodes):.1f} %), at up to "
        f"{max(speeds_mps):.2f} m/s"
        for noticed, speeds_mps in falsification.other_speeds_mps.items()
        if speeds_mps
    ]
    if not touched:
        return "Nobody who had noticed it was touched by the moving robot either."
    return (
        f"It touched {_listed(touched)}; the same search with --policy scanner gives these figures "
        "of today's AMR."
    )


def _comparison(
    name: str, cases: Sequence[WorstCase], others: Mapping[str, EpisodeRecord]
) -> list[str]:
    """Return the sentences about the same situations with the other policy."""
    pairs = [(case.record, others[case.path.name]) for case in cases if case.path.name in others]
    pairs = [pair for pair in pairs if not any(record.error for record in pair)]
    if not pairs:
        return []
    other = pairs[0][1].policy
    touched = [
        sum(record.moving_contacts > 0 for record in side) for side in zip(*pairs, strict=True)
    ]
    margins = [
        (mine.min_margin_never_m, theirs.min_margin_never_m)
        for mine, theirs in pairs
        if mine.min_margin_never_m is not None and theirs.min_margin_never_m is not None
    ]
    better = sum(theirs > mine for mine, theirs in margins)
    worse = sum(theirs < mine for mine, theirs in margins)
    parts = [f"touches a person while it moves in {touched[1]} ({name} in {touched[0]})"]
    if margins:
        deepest = [min(side) for side in zip(*margins, strict=True)]
        parts += [
            f"keeps more margin in {better} and less in {worse}",
            f"falls to {deepest[1]:.2f} m at worst ({name} to {deepest[0]:.2f} m)",
        ]
    return [
        f"In the {counted(len(pairs), 'worst case')} of this search, {other} {_listed(parts)}.",
        f"They were searched for {name}, so they show where it does worse, not how often.",
    ]


def _listed(words: Sequence[str]) -> str:
    """Return words as ``"a, b and c"``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _two_decimals(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"
