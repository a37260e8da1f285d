"""The sections of a report: arms, charts, scenarios, faults, failures, episodes, reproduction."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from tqdm import tqdm

from awarenav.files import json_text
from perception.documents import parse_yaml

from ...world.errors import SimError
from ..measures import (
    METRICS,
    NOTHING,
    RATIOS,
    UNCONFIRMED,
    SummaryRow,
    measured_part,
    paired_difference,
)
from ..runs import Job, answering_note
from ._charts import episode_chart, risk_chart
from ._page import Cell, Row, Section, Still, Table, interval_cell, number_cell, share_cell
from ._results import Arm, Episode, Results, Run, moving_contacts

#: Most episodes with pictures; of each scenario and arm only the worst.
MOST_STILLS: Final = 4
#: Most lines in the list of episodes, which keeps a report below 2 MB.
MOST_LINES: Final = 3000
# Awareness classes, and their meaning.
_AWARENESS: Final = {
    "aware": "aware, and recognised",
    "unaware": "unaware, and recognised",
    "falsely_aware": "unaware, taken for aware: dangerous",
    "missed_aware": "aware, not recognised: costs time",
}
_REQUESTS: Final = ("requests", *RATIOS, "asked_twice")


def arms_section(results: Results) -> Section:
    """Return the table of arms, and that of differences on the same seeds."""
    arms = Table(
        {
            "Arm": "policy, and planner and perception where they differ",
            "Success": "goal reached, and the robot moved into nobody",
            "Contacts, moving": "episodes in which a person and the moving robot touched, by any "
            "cause",
            "by the robot": "episodes in which the robot moved into a person",
            "Time lost, s": METRICS["time_lost_s"].meaning,
            "Negative margin, s": METRICS["violation_time_s"].meaning,
            "Least margin, m": "the worst episode",
            "Step-out impacts, unaware": METRICS["step_out_unaware"].meaning,
            "Worst, m/s": METRICS["step_out_worst_mps"].meaning,
        },
        [_arm_row(arm) for arm in results.arms],
        caption="Means and shares with 95 % intervals. Step-out impacts: per 1 000 crossings, an "
        "index and no rate of accidents.",
    )
    parts = ("", "attentive", UNCONFIRMED, "mixed", "unaware")
    differences: list[Row] = [
        [
            arm.name,
            part or "all",
            number_cell(against.pairs, 0),
            interval_cell(against.won_back, 0, 100.0),
            interval_cell(against.time_lost_s, 1),
            interval_cell(against.violation_excess, 0, 100.0),
            interval_cell(against.step_out_unaware, 1),
            interval_cell(against.min_separation_m),
        ]
        for arm in results.arms
        for part in parts
        if (against := results.against(arm, part)) is not None and against.pairs
    ]
    columns = {
        "Arm": "",
        "People": "what the scenario says that they look at, where it was measured to be so",
        "Pairs": "of episodes with the same scenario and seed",
        "Time won back, %": "Σ (time lost by blind − by the arm) / Σ time lost by blind",
        "Time lost, s": "mean difference; less is faster",
        "Negative margins, %": "Σ (time of the arm − of blind) / Σ of blind",
        "Step-out impacts": "mean difference, unaware people, per 1 000 crossings",
        "Separation, m": "mean difference of the smallest separation",
    }
    paired = Table(columns, differences, 2, "Differences to blind with the same planner and seeds.")
    return Section("arms", "Policies", tables=(arms, paired) if differences else (arms,))


def _arm_row(arm: Arm) -> Row:
    row = arm.row
    return [
        arm.name,
        share_cell(row.success),
        share_cell(row.moving_contact, bad_from=1e-9),
        number_cell(row.robot_contact.count, 0, bad=row.robot_contact.count > 0),
        interval_cell(row.means["time_lost_s"], 1),
        interval_cell(row.means["violation_time_s"]),
        _worst(row, "min_margin_m"),
        interval_cell(row.means["step_out_unaware"], 1),
        _worst(row, "step_out_worst_mps"),
    ]


def _worst(row: SummaryRow | None, name: str) -> Cell:
    value = None if row is None else row.worst.get(name)
    return number_cell(value, bad=name == "min_margin_m" and value is not None and value < 0.0)


def charts_section(results: Results) -> Section:
    """Return the charts."""
    charts = (risk_chart(results.arms), episode_chart(results.arms))
    return Section("charts", "Time against risk", charts=charts)


def awareness_section(results: Results) -> Section | None:
    """Return the episodes by what the nearest person and the robot knew; None without any."""
    found = {(row.part, row.variant): row for row in results.summary.awareness}
    lines: list[Row] = [
        [
            meaning,
            arm.name,
            number_cell(row.episodes, 0),
            share_cell(row.moving_contact, bad_from=1e-9),
            interval_cell(row.means["time_lost_s"], 1),
            interval_cell(row.means["violation_time_s"]),
            interval_cell(row.means["min_margin_m"]),
        ]
        for kind, meaning in _AWARENESS.items()
        for arm in results.arms
        if (row := found.get((kind, arm.name))) is not None
    ]
    if not lines:
        return None
    names = ("Nearest person", "Arm", "Episodes", "Contacts, moving", "Time lost, s")
    columns = dict.fromkeys((*names, "Negative margin, s", "Smallest margin, m"), "")
    lead = "Whether the person who came nearest had seen the robot, and whether it knew."
    return Section("awareness", "Awareness", lead, tables=(Table(columns, lines, 2),))


def scenarios_section(results: Results, jobs: Iterable[Job]) -> Section:
    """Return the table of scenarios, with the arms as columns."""
    arms = results.arms
    rows = {(row.part, row.variant): row for row in results.summary.scenarios}
    compared = [arm for arm in arms if results.against(arm) is not None]
    columns = {"Scenario": "", "People": "its label, and episodes in which they were not so"}
    columns |= {"Episodes": "of all arms", "Contacts, moving": "by arm"}
    for title, meaning, shown in (
        ("time lost, s", "mean", arms),
        ("won back, %", "of what blind loses", compared),
        ("negative margin, s", "mean", arms),
        ("least margin, m", "the worst episode", arms),
    ):
        columns |= {f"{arm.name}: {title}": meaning for arm in shown}
    records = [each.record for arm in arms for each in arm.episodes]
    lines: list[Row] = []
    for scenario in sorted({record.versioned_scenario for record in records}):
        own = [record for record in records if record.versioned_scenario == scenario]
        label = own[0].attention
        others = sum(measured_part(record) != label for record in own)
        found = [rows.get((scenario, arm.name)) for arm in arms]
        touched = {
            arm.name: row.moving_contact.count
            for arm, row in zip(arms, found, strict=True)
            if row is not None and row.moving_contact.count
        }
        backs = (results.against(arm, scenario, scenario=True) for arm in compared)
        lines.append(
            [
                scenario,
                f"{label}, {others} of {len(own)} not" if others else label,
                number_cell(len(own), 0),
                Cell(
                    ", ".join(f"{name} {number}" for name, number in touched.items()) or "0",
                    sum(touched.values()),
                    bad=bool(touched),
                ),
                *(_mean(row, "time_lost_s", 1) for row in found),
                *(number_cell(None if b is None else 100.0 * b.won_back.value, 0) for b in backs),
                *(_mean(row, "violation_time_s", 2) for row in found),
                *(_worst(row, "min_margin_m") for row in found),
            ]
        )
    lead = " ".join(recorded_people(jobs))
    return Section("scenarios", "Scenarios", lead, tables=(Table(columns, lines, 2),))


def _mean(row: SummaryRow | None, name: str, decimals: int) -> Cell:
    return number_cell(None if row is None else row.means[name].value, decimals)


def recorded_people(jobs: Iterable[Job]) -> tuple[str, ...]:
    """Return a sentence about each scenario of recorded people: whether they react to the robot."""
    notes: dict[str, str] = {}
    for text in dict.fromkeys(job.scenario_text for job in jobs):
        try:
            data = parse_yaml(text, "scenario", SimError)
        except SimError:
            continue
        if isinstance(data, dict) and data.get("replay_csv"):
            does = (
                "leave their paths where the robot forces them off, and return"
                if data.get("replay_reacts")
                else "do not react to the robot"
            )
            name = str(data.get("name", ""))
            notes[name] = f"The recorded people of {name} {does}."
    return tuple(notes[name] for name in sorted(notes))


def faults_section(results: Results) -> Section | None:
    """Return each fault with each arm, compared with the same seeds without it."""
    lines: list[Row] = []
    for fault in sorted({each.record.fault for arm in results.arms for each in arm.others}):
        for arm in results.arms:
            before = [each.record for each in arm.episodes]
            ran = [e for e in arm.others if e.record.fault == fault and not e.record.error]
            if not ran:
                continue
            now = [each.record for each in ran]
            margins = [each.min_margin_m for each in now if each.min_margin_m is not None]
            lines.append(
                [
                    fault,
                    arm.name,
                    share_cell(moving_contacts(ran), bad_from=1e-9),
                    interval_cell(paired_difference(before, now, "time_lost_s"), 1),
                    interval_cell(paired_difference(before, now, "violation_time_s")),
                    number_cell(min(margins, default=None), bad=min(margins, default=0.0) < 0.0),
                ]
            )
    if not lines:
        return None
    columns = {
        "Fault": "",
        "Arm": "",
        "Contacts, moving": "",
        "Time lost more, s": "mean difference to the same seeds without the fault",
        "Negative margin more, s": "mean difference to the same seeds without the fault",
        "Least margin, m": "the worst episode",
    }
    return Section("faults", "Faults", tables=(Table(columns, lines, 2),))


def requests_section(results: Results, run: Run) -> Section | None:
    """Return the figures of requests for attention; None where nobody was asked."""
    if not any(arm.row.asked for arm in results.arms):
        return None
    table = _metrics_table(results, _REQUESTS)
    return Section("requests", "Requests", answering_note(run.about), tables=(table,))


def metrics_section(results: Results) -> Section:
    """Return all means, with their definitions."""
    lead = (
        "Definitions with their sources: docs/simulation.md. Intervals of means are bias-corrected "
        "and accelerated bootstraps within scenarios. Those of shares are exact (Clopper and "
        "Pearson 1934); for none of n the one-sided bound 1 − 0.05^(1/n)."
    )
    names = [name for name in METRICS if name not in _REQUESTS]
    tables = (_metrics_table(results, names),)
    return Section("metrics", "Metrics", lead, tables=tables, folded=True)


def _metrics_table(results: Results, names: Iterable[str]) -> Table:
    known = METRICS | {name: ratio.metric for name, ratio in RATIOS.items()}
    lines: list[Row] = []
    for metric in (known[name] for name in names):
        means = [arm.row.means[metric.name] for arm in results.arms]
        if any(each.known for each in means):
            scale = 100.0 if metric.share else 1.0
            decimals = 0 if metric.share else metric.decimals
            title = f"{metric.title}, {metric.unit}" if metric.unit else metric.title
            cells = [interval_cell(each, decimals, scale) for each in means]
            lines.append([title, *cells, metric.meaning])
    columns = {"Metric": "", **dict.fromkeys((arm.name for arm in results.arms), ""), "Meaning": ""}
    return Table(columns, lines)


def stills_section(run: Run, results: Results, *, pictures: bool, progress: bool) -> Section | None:
    """Return the worst episodes, with pictures if wanted; None without any.

    A failure affects only its own episode. Contacts of any arm come first. Only the arms that
    verdicts are about count for the smallest margins.

    Args:
        run: the run, whose jobs are run again.
        results: its figures.
        pictures: run the episodes again for pictures.
        progress: show progress on standard error.
    """
    judged = {arm.name for arm in results.judged}
    points = [
        (arm, each)
        for arm in results.arms
        for each in (*arm.episodes, *arm.others)
        if each.record.moving_touched
        or (arm.name in judged and each.record.min_margin_m is not None)
    ]
    found: dict[tuple[str, str], tuple[Arm, Episode]] = {}
    for arm, each in sorted(points, key=lambda point: worst_first(point[1])):
        found.setdefault((arm.name, each.record.scenario), (arm, each))
    worst = list(found.values())[:MOST_STILLS]
    if not worst:
        return None
    silent = not (pictures and progress)
    with tqdm(worst, desc="stills", unit="episode", file=sys.stderr, disable=silent) as bar:
        stills = [_still(run, arm, each, pictures=pictures) for arm, each in bar]
    lead = (
        "Contacts with the moving robot first, then the smallest margins; of each scenario and arm "
        "only the worst."
    )
    if pictures:
        lead += (
            " Pictures show the instant of the smallest margin: the robot's camera, and the plan. "
            "Discs are people and fans where they look; rings are the obstacles that the robot "
            "kept clear of. Green is aware, red unaware, grey not known."
        )
    return Section("worst", "Worst", lead, stills=stills)


def _still(run: Run, arm: Arm, episode: Episode, *, pictures: bool) -> Still:
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


def _pictures(run: Run, episode: Episode) -> tuple[tuple[tuple[str, str], ...], str]:
    """Return the pictures of an episode, or the reason why there are none."""
    if episode.number is None:
        return (), "No picture: its job is not known."
    try:
        from ._pictures import pictures_of  # noqa: PLC0415 - needs the simulator

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
    lead = "These episodes count as no success, and are in no other figure."
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
    """Return the list of all episodes, or of those with the smallest margins if there are too many.

    Args:
        run: the run.
        results: its figures.
        folder: of the report, where the links to replay pages begin.
    """
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
    names = ["No.", "Scenario", "Arm", *(["Fault"] if with_faults else []), "Seed", "Lost, s"]
    columns = dict.fromkeys((*names, "Margin, m", "Separation, m", "Remark", "Replay"), "")
    table = Table(columns, lines, 3)
    return Section("episodes", "Episodes", lead, tables=(table,), folded=True)


def worst_first(episode: Episode) -> tuple[int, float, tuple[str, int, int]]:
    """Return a sort key: contacts with the moving robot, then errors, then the smallest margins."""
    record = episode.record
    severity = 0 if record.moving_touched else 1 if record.error else 2
    margin = float("inf") if record.min_margin_m is None else record.min_margin_m
    return severity, margin, (record.scenario, record.scenario_version, record.seed)


def outcome_of(episode: Episode) -> str:
    """Return a remark on the outcome of an episode; empty for a success."""
    record = episode.record
    if record.error:
        return f"failed: {record.error}"
    if record.robot_touched:
        return "robot moved into a person"
    if record.moving_touched:
        return "a person walked into the moving robot"
    if record.person_contacts:
        return "a person walked into the robot"
    return "goal not reached" if record.time_to_goal_s is None else ""
