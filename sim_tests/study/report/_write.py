"""The report of a run as one HTML page, section by section."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Final

from awarenav.errors import counted
from perception.anthropometry import BODY_RADIUS_M
from perception.documents import parse_yaml

from ...conditions import REFERENCE_IN_TABLES, planner_name
from ...world.errors import SimError
from ..measures import (
    METRICS,
    NOTHING,
    OVERSHOOT_MPS,
    RATIOS,
    UNCONFIRMED,
    EpisodeRecord,
    SummaryRow,
    measured_part,
    nondeterminism_notes,
    paired,
    paired_difference,
    proportion_interval,
)
from ..runs import Attempt, Job, answering_note
from ._charts import episode_chart, risk_chart
from ._episodes import episodes_section, failures_section, reproduction_section, stills_section
from ._page import Cell, Row, Section, Table, interval_cell, number_cell, share_cell, write_page
from ._results import Arm, Results, Run, moving_contacts

# Awareness classes, and their meaning.
_AWARENESS: Final = {
    "aware": "aware, and recognised",
    "unaware": "has not looked, and recognised",
    "falsely_aware": "has not looked, taken for aware: dangerous",
    "missed_aware": "aware, not recognised: costs time",
}
_REQUESTS: Final = ("requests", *RATIOS, "asked_twice", "step_out_answered")
# The people of the step-out impacts in the table of robots.
_IMPACTS: Final = ("never", "all")
_REPORT: Final = "report.html"
#: Paths or distances that differ by less count as the same.
SAME_PATH_M: Final = 0.01


def write_report(
    out_dir: Path | str, *, stills: bool = True, path: Path | None = None, progress: bool = False
) -> Path:
    """Write the report of a run and return its path; the file appears whole or not at all.

    The same folder gives the same page, byte for byte. The page says what is missing or unfinished
    in the folder.

    Raises:
        SimError: there is no ``episodes.csv``, it is not a table of episodes, or the page cannot
            be written.
    """
    run = Run.read(out_dir)
    results = Results.of(run)
    path = run.path / _REPORT if path is None else path
    failures = failures_section(run)
    notices = [*run.missing, *nondeterminism_notes(each.record for each in run.episodes)]
    if failures is not None:
        failed = sum(bool(each.record.error) for each in run.episodes)
        notices.append(f"{counted(failed, 'episode')} failed; see “{failures.title}”.")
    if not run.episodes:
        notices.append("No episode has finished yet.")
    sections = [
        arms_section(results),
        charts_section(results),
        planners_section(results, run),
        scenarios_section(results, run.jobs),
        awareness_section(results),
        requests_section(results, run),
        faults_section(results),
        stills_section(run, results, pictures=stills, progress=progress),
        failures,
        metrics_section(results),
        reproduction_section(run),
        episodes_section(run, results, path.parent),
    ]
    write_page(
        path,
        _title(run),
        [section for section in sections if section is not None],
        lead=f"Under the fault {results.fault}." if results.fault else "",
        verdicts=[(arm.name, results.verdict(arm)) for arm in results.judged],
        notices=notices,
    )
    return path


def _title(run: Run) -> str:
    """Return the numbers of crossings, scenarios, policies, planners and seeds."""
    records = [each.record for each in run.episodes if each.record.policy != run.wide_policy]
    planners = len({each.planner for each in records})
    parts = [
        counted(len({each.versioned_scenario for each in records}), "scenario"),
        counted(len({each.policy for each in records}), "policy", "policies"),
        *([counted(planners, "planner")] if planners > 1 else []),
        counted(len({each.seed for each in records}), "seed"),
    ]
    return f"{counted(len(records), 'crossing')}: {', '.join(parts)}"


def arms_section(results: Results) -> Section:
    """Return the table of arms, and that of differences on the same seeds."""
    arms = Table(
        {
            "Robot": "policy, and planner and perception where they differ",
            "Success": "goal reached, and the robot moved into nobody",
            "Contacts, moving": "episodes in which a person and the moving robot touched, by any "
            "cause",
            "It moved into them": "episodes in which the robot moved into a person",
            "A meeting, s": METRICS["time_lost_s"].meaning,
            "Negative margin, s": METRICS["violation_time_s"].meaning,
            "Least margin, m": "the worst episode",
            **{
                METRICS[name].title: METRICS[name].meaning
                for group in _IMPACTS
                for name in (f"step_out_{group}", f"step_out_{group}_worst_mps")
            },
        },
        [_arm_row(arm) for arm in results.arms],
        caption="Means and shares with 95 % intervals. Step-out impacts: per 1 000 crossings, an "
        "index, not an accident rate.",
    )
    parts = ("", "attentive", UNCONFIRMED, "mixed", "unaware")
    differences: list[Row] = [
        [
            arm.name,
            part or "all",
            number_cell(against.pairs, 0),
            interval_cell(against.time_lost_s, 1),
            interval_cell(against.violation_excess, 0, 100.0),
            interval_cell(against.step_out_never, 1),
            interval_cell(against.step_out_all, 1),
            interval_cell(against.min_separation_m),
        ]
        for arm in results.arms
        for part in parts
        if (against := results.against(arm, part)) is not None and against.pairs
    ]
    columns = {
        "Robot": "",
        "People": "what the scenario says that they look at, where it was measured to be so",
        "Pairs": "of episodes with the same scenario and seed",
        "A meeting, s": "mean difference; less is faster",
        "Negative margins, %": "Σ (its time − that of blind) / Σ of blind",
        **{METRICS[f"step_out_{group}"].title: "mean difference" for group in _IMPACTS},
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
        *(
            cell
            for group in _IMPACTS
            for cell in (
                interval_cell(row.means[f"step_out_{group}"], 1),
                _worst(row, f"step_out_{group}_worst_mps"),
            )
        ),
    ]


def _worst(row: SummaryRow | None, name: str) -> Cell:
    value = None if row is None else row.worst.get(name)
    return number_cell(value, bad=name == "min_margin_m" and value is not None and value < 0.0)


def charts_section(results: Results) -> Section:
    """Return the charts."""
    charts = (*risk_chart(results.arms), episode_chart(results.arms))
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
    names = ("Nearest person", "Robot", "Episodes", "Contacts, moving", "A meeting, s")
    columns = dict.fromkeys((*names, "Negative margin, s", "Smallest margin, m"), "")
    lead = "Whether the person who came nearest had seen the robot, and whether it knew."
    return Section("awareness", "Awareness", lead, tables=(Table(columns, lines, 2),))


def scenarios_section(results: Results, jobs: Iterable[Job]) -> Section:
    """Return the table of scenarios, with the arms as columns."""
    arms = results.arms
    rows = {(row.part, row.variant): row for row in results.summary.scenarios}
    columns = {"Scenario": "", "People": "its label, and episodes in which they were not so"}
    columns |= {"Episodes": "of all robots", "Contacts, moving": "of each robot"}
    for title, meaning, shown in (
        ("a meeting, s", "mean", arms),
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
        "Robot": "",
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
        "Definitions with their sources: docs/measures.md. Intervals of means are bias-corrected "
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


def planners_section(results: Results, run: Run) -> Section | None:
    """Return the conduct of the planners; None for a run whose conduct is not known."""
    lines: list[Row] = [
        _conduct_row(arm, _reference_of(arm, results))
        for arm in results.arms
        if any(each.conduct is not None for each in arm.episodes)
    ]
    if not lines:
        return None
    conduct = Table(
        {
            "Robot": "",
            "Speed limit, m/s": "largest excess of the travel speed over speed_limit_mps",
            "Episodes over": f"with an excess of more than {OVERSHOOT_MPS:g} m/s",
            "Yaw rule, m/s": "the same for |v| + |ω| R and fastest_point_limit_mps",
            "Episodes over it": f"with an excess of more than {OVERSHOOT_MPS:g} m/s",
            "plan(), ms": "median over episodes of the median of a call's processor time",
            "99th percentile, ms": "median over episodes; red if longer than the control cycle",
            "× reference": "median time of a call, divided by the reference planner's",
            "Repeats itself": "gives the same commands with the same seed",
        },
        lines,
        caption=f"Obeyed: no excess of more than {OVERSHOOT_MPS:g} m/s, about the motors' "
        "overshoot. Times depend on the computer and its load.",
    )
    tables = (conduct, _radii_table(results, run)) if results.probe and run.jobs else (conduct,)
    return Section("planners", "Planners", tables=tables)


def _reference_of(arm: Arm, results: Results) -> Sequence[Attempt]:
    """Return the episodes of the reference planner with the policy and perception of an arm."""
    same = (arm.variant.policy, REFERENCE_IN_TABLES, arm.variant.perception)
    for each in results.arms:
        if (each.variant.policy, each.variant.planner, each.variant.perception) == same:
            return each.episodes
    return ()


def _conduct_row(arm: Arm, reference: Sequence[Attempt]) -> Row:
    conducts = [each.conduct for each in arm.episodes if each.conduct is not None]
    peers = {_task(each): each.conduct for each in reference if each.conduct is not None}
    ratios = [
        each.conduct.plan_median_s / peer.plan_median_s
        for each in arm.episodes
        if each.conduct is not None
        and (peer := peers.get(_task(each))) is not None
        and peer.plan_median_s > 0.0
    ]
    p99_s = median(each.plan_p99_s for each in conducts)
    repeats = not any(each.record.nondeterministic for each in arm.episodes)
    return [
        arm.name,
        *_obedience([each.limit_excess_mps for each in conducts]),
        *_obedience([each.fastest_point_excess_mps for each in conducts]),
        number_cell(1e3 * median(each.plan_median_s for each in conducts)),
        number_cell(1e3 * p99_s, bad=p99_s > median(each.cycle_s for each in conducts)),
        number_cell(median(ratios) if ratios else None),
        Cell("yes" if repeats else "no"),
    ]


def _task(episode: Attempt) -> tuple[str, int]:
    return episode.record.scenario, episode.record.seed


def _obedience(excesses: Iterable[float | None]) -> tuple[Cell, Cell]:
    """Return the cells of the largest excess over a limit, and of the episodes over it."""
    known = [each for each in excesses if each is not None]
    if not known:
        return Cell(NOTHING), Cell(NOTHING)
    largest, over = max(known), sum(each > OVERSHOOT_MPS for each in known)
    text = f"{largest:+.2f}" if over else "obeyed"
    share = proportion_interval(over, len(known))
    return Cell(text, largest, bad=over > 0), share_cell(share, bad_from=1e-9)


def _radii_table(results: Results, run: Run) -> Table:
    """Return what wider radii change, with everything else the same."""
    from ..runs import policy_of  # noqa: PLC0415 - imports the simulator

    wide = next(job for job in run.jobs if job.policy == run.wide_policy)
    widest_m = policy_of(wide.policy_text).inflation.radius_m(0.0)
    probed = run.wide_policy.partition(",")[0]
    lines: list[Row] = []
    for arm in results.arms:
        if arm.variant.policy != probed:
            continue
        after = [e.record for e in results.probe if e.record.planner == arm.variant.planner]
        pairs = [
            pair
            for pair in paired([each.record for each in arm.episodes], after)
            if not any(each.error for each in pair)
        ]
        changed = sum(_differs(*pair) for pair in pairs)
        near = sum(
            first.min_separation_m is not None and first.min_separation_m < widest_m - BODY_RADIUS_M
            for first, _ in pairs
        )
        says = "uses them" if changed else "ignores them" if near else "nobody came near"
        lines.append(
            [
                planner_name(arm.variant.planner),
                share_cell(proportion_interval(changed, len(pairs))),
                number_cell(near, 0),
                interval_cell(
                    paired_difference(
                        [first for first, _ in pairs],
                        [second for _, second in pairs],
                        "min_separation_m",
                    )
                ),
                Cell(says if pairs else NOTHING, bad=says == "ignores them"),
            ]
        )
    columns = {
        "Planner": "",
        "Other path": f"length or distance kept differs by more than {SAME_PATH_M:g} m",
        "Somebody near": "episodes in which the robot came into a wider circle",
        "More distance, m": "mean difference of the smallest separation",
        "Radii": "",
    }
    caption = f"Whether a planner uses the radii: {run.wide_policy}; speed limits are the same."
    return Table(columns, lines, caption=caption)


def _differs(one: EpisodeRecord, other: EpisodeRecord) -> bool:
    """Return whether two episodes have another path: its length, or the distance kept, differs."""
    if (one.time_to_goal_s is None) != (other.time_to_goal_s is None):
        return True
    for name in ("path_length_m", "min_separation_m"):
        first, second = getattr(one, name), getattr(other, name)
        if (first is None) != (second is None):
            return True
        if first is not None and abs(first - second) > SAME_PATH_M:
            return True
    return False
