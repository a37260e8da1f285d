"""The sections of a report on single episodes: worst ones with pictures, failed ones, all."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Final

from tqdm import tqdm

from awarenav.files import json_text

from ..measures import NOTHING
from ..runs import Attempt
from ._page import Cell, Row, Section, Still, Table, number_cell
from ._results import Arm, Results, Run, outcome_of, worst_first

#: Most episodes with pictures; of each scenario and arm only the worst.
MOST_STILLS: Final = 4
#: Most lines in the list of episodes, which keeps a report below 2 MB.
MOST_LINES: Final = 3000


def stills_section(run: Run, results: Results, *, pictures: bool, progress: bool) -> Section | None:
    """Return the worst episodes, with pictures if wanted; None without any.

    A failure affects only its own episode. Contacts of any arm come first. Only the arms that
    verdicts are about count for the smallest margins.
    """
    judged = {arm.name for arm in results.judged}
    points = [
        (arm, each)
        for arm in results.arms
        for each in (*arm.episodes, *arm.others)
        if each.record.moving_touched
        or (arm.name in judged and each.record.min_margin_m is not None)
    ]
    found: dict[tuple[str, str], tuple[Arm, Attempt]] = {}
    for arm, each in sorted(points, key=lambda point: worst_first(point[1])):
        found.setdefault((arm.name, each.record.scenario), (arm, each))
    worst = list(found.values())[:MOST_STILLS]
    if not worst:
        return None
    silent = not (pictures and progress)
    with tqdm(worst, desc="stills", unit="episode", file=sys.stderr, disable=silent) as bar:
        stills = [_still(run, arm, each, pictures=pictures) for arm, each in bar]
    lead = (
        "Contacts with the moving robot first, then the smallest margins; of each scenario and "
        "robot only the worst."
    )
    if pictures:
        lead += (
            " Pictures show the instant of the smallest margin: the robot's camera, and the plan. "
            "Discs are people and fans where they look; rings are the obstacles that the robot "
            "kept clear of. Green is aware, red unaware, grey not known."
        )
    return Section("worst", "Worst", lead, stills=stills)


def _still(run: Run, arm: Arm, episode: Attempt, *, pictures: bool) -> Still:
    record = episode.record
    parts = [
        f"seed {record.seed}",
        f"fault {record.fault}" if record.fault else "",
        f"smallest margin {number_cell(record.min_margin_m).text} m",
        f"smallest separation {number_cell(record.min_separation_m).text} m",
        outcome_of(episode),
    ]
    text = ", ".join(filter(None, parts))
    shown: tuple[tuple[str, str], ...] = ()
    if pictures:
        shown, trouble = _pictures(run, episode)
        text += trouble and f". {trouble}"
    return Still(f"{arm.name}, {record.scenario}", text, run.replay(episode), shown)


def _pictures(run: Run, episode: Attempt) -> tuple[tuple[tuple[str, str], ...], str]:
    """Return the pictures of an episode, or the reason why there are none."""
    if episode.number is None:
        return (), "No picture: its job is not known."
    try:
        from ._pictures import pictures_of  # noqa: PLC0415 - imports the simulator

        return pictures_of(run.jobs[episode.number], episode.record)
    except Exception as error:  # a planner or a renderer may raise anything
        return (), f"No picture: {type(error).__name__}: {error}"


def failures_section(run: Run) -> Section | None:
    """Return the errors that ended episodes, the most frequent first; None without any."""
    failed = [each for each in run.episodes if each.record.error]
    lines: list[Row] = []
    for message, times in Counter(each.record.error for each in failed).most_common():
        own = [each for each in failed if each.record.error == message]
        commands = [command for each in own if (command := run.replay(each))]
        lines.append(
            [
                message,
                ", ".join(sorted({each.record.scenario for each in own})),
                ", ".join(sorted({each.record.planner for each in own})),
                number_cell(times, 0),
                Cell(commands[0] if commands else NOTHING, is_command=bool(commands)),
            ]
        )
    if not lines:
        return None
    columns = dict.fromkeys(("Error", "Scenarios", "Planners", "Times", "See the first again"), "")
    lead = "These episodes count as not reaching the goal, and are in no other figure."
    return Section("failed", "Failed", lead, tables=(Table(columns, lines, 3),))


def reproduction_section(run: Run) -> Section:
    """Return the configuration of a run, from which it can be repeated."""
    command = str(run.about.get("command", ""))
    policies = dict.fromkeys((f"Policy {job.policy}", job.policy_text) for job in run.jobs)
    faults = dict.fromkeys((f"Fault {j.fault}", j.fault_text) for j in run.jobs if j.fault)
    return Section(
        "reproduce",
        "Reproduce",
        "" if command else "The command is not known.",
        commands=[command] if command else [],
        texts=[("Versions and settings (run.json)", json_text(run.about)), *policies, *faults],
    )


def episodes_section(run: Run, results: Results, folder: Path) -> Section:
    """Return the list of all episodes, or of too many those with the smallest margins."""
    name_of = {id(e): arm.name for arm in results.arms for e in (*arm.episodes, *arm.others)}
    chosen = list(run.episodes)
    lead = "“Watch” opens a replay page. A command writes the page where there is none yet."
    if len(chosen) > MOST_LINES:
        lead += (
            f" {len(chosen) - MOST_LINES} episodes of larger margins are left out; episodes.csv "
            "has all."
        )
        worst = sorted(chosen, key=worst_first)[:MOST_LINES]
        kept = set(map(id, worst))
        chosen = [each for each in chosen if id(each) in kept]
    with_faults = any(arm.others for arm in results.arms)
    lines: list[Row] = []
    for each in chosen:
        record, command, page = each.record, run.replay(each), run.page(each, folder)
        lines.append(
            [
                number_cell(each.number, 0),
                record.scenario,
                name_of.get(id(each), record.policy),
                *([record.fault] if with_faults else []),
                number_cell(record.seed, 0),
                number_cell(record.time_lost_s, 1),
                number_cell(record.min_margin_m),
                number_cell(record.min_separation_m),
                Cell(outcome_of(each), bad=bool(record.error or record.moving_touched)),
                Cell("Watch", href=page)
                if page
                else Cell(f"{command} --view" if command else "", is_command=bool(command)),
            ]
        )
    names = ["No.", "Scenario", "Robot", *(["Fault"] if with_faults else []), "Seed", "Lost, s"]
    columns = dict.fromkeys((*names, "Margin, m", "Separation, m", "Remark", "Replay"), "")
    table = Table(columns, lines, 3)
    return Section("episodes", "Episodes", lead, tables=(table,), folded=True)
