"""The summary of many episodes as tables for the terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Final, TypeVar

from awarenav.cli import styled, table_text
from awarenav.errors import counted

from ._awareness import ATTENTION_WITHIN_M, ATTENTIVE_FROM
from ._metrics import METRICS
from ._record import EpisodeRecord
from ._registry import EVERYBODY, RATIOS
from ._statistics import NOTHING, Interval, number_text, percent
from ._summary import UNCONFIRMED, Comparison, Summary, SummaryRow

# Share of late cycles up to which a computer keeps up.
_KEPT_UP = 0.01

_Row = TypeVar("_Row", Comparison, SummaryRow)


def summary_text(summary: Summary, notes: Iterable[str] = ()) -> str:
    """Return all tables of a summary, each with a heading, and notes on what is left out."""
    if not summary.policies:
        return "no episodes"
    percent = f"{100.0 * summary.level:g} %"
    blocks = [
        _titled(f"Policies: means with {percent} intervals", _table(summary.policies, _POLICIES)),
        _titled("Safety: the worst of all episodes", _table(summary.policies, _SAFETY)),
    ]
    if any(row.means["step_out_all"].known for row in summary.policies):
        title = "Step-out impacts per 1 000 crossings: an index, not a rate of accidents"
        blocks.append(_titled(title, _step_out_table(summary.policies)))
    asking = [row for row in summary.policies if row.asked]
    if asking:
        blocks.append(_titled("Requests for attention", _table(asking, _REQUESTS)))
    if summary.comparisons:
        blocks.append(
            _titled(
                "Pairs of the same scenario and seed", _table(summary.comparisons, _COMPARISONS, 3)
            )
        )
    for title, rows in (
        ("By attention of the scenario's people", summary.attentions),
        ("By awareness of the person who came nearest (not paired)", summary.awareness),
        ("By scenario", summary.scenarios),
    ):
        blocks.append(_titled(title, _table(rows, _PARTS, 2)))
    blocks.append("\n".join([*_notes(summary), *notes]))
    return "\n\n".join(blocks)


def short_text(summary: Summary) -> str:
    """Return the table of policies that the end of a run prints."""
    columns: dict[str, Callable[[SummaryRow], str]] = {
        "policy": lambda row: row.variant,
        "episodes": lambda row: str(row.episodes),
        "success": lambda row: percent(row.success.value),
        "contacts": _moving_contacts,
        "s a meeting": _a_meeting(bounds=False),
        "nearest m": _worst("min_separation_m"),
        "step-out": _step_outs,
        "failed": lambda row: str(row.errors),
    }
    legend = (
        "success: at the goal in time. contacts: episodes in which the moving robot and a person\n"
        "touched. s a meeting: time over that of the same robot alone. nearest: to any person, m.\n"
        "step-out: impacts with people who step out and have never noticed the robot; with all\n"
        "people, per 1 000 crossings."
    )
    return f"{_table(summary.policies, columns)}\n\n{legend}"


def _titled(title: str, table: str) -> str:
    return f"{styled(title, bold=True)}\n\n{table}"


def _table(rows: Sequence[_Row], columns: dict[str, Callable[[_Row], str]], left: int = 1) -> str:
    """Return a table whose columns are functions of a row, by their header."""
    return table_text(
        tuple(columns), ([cell(row) for cell in columns.values()] for row in rows), left
    )


def _mean(name: str, *, bounds: bool = True) -> Callable[[SummaryRow], str]:
    """Return the column of a metric's mean, with or without its interval."""
    metric = RATIOS[name].metric if name in RATIOS else METRICS[name]
    decimals, scale = (0, 100.0) if metric.share else (metric.decimals, 1.0)

    def cell(row: SummaryRow) -> str:
        interval = row.means[name]
        if bounds or not interval.known:
            return interval.text(decimals, scale)
        return number_text(scale * interval.value, decimals)

    return cell


def _a_meeting(*, bounds: bool = True) -> Callable[[SummaryRow], str]:
    """Return the column of the seconds that a meeting costs, with its sign."""
    return lambda row: _signed(row.means["time_lost_s"], bounds=bounds)


def _worst(name: str) -> Callable[[SummaryRow], str]:
    """Return the column of a metric's worst value."""
    decimals = METRICS[name].decimals

    def cell(row: SummaryRow) -> str:
        return number_text(row.worst.get(name), decimals)

    return cell


def _successes(row: SummaryRow) -> str:
    return f"{row.success.count} of {row.episodes}"


def _moving_contacts(row: SummaryRow) -> str:
    return str(row.moving_contact.count) if row.moving_contact.n else NOTHING


def _step_outs(row: SummaryRow) -> str:
    """Return the step-out impacts, never noticed and of all people."""
    return "; ".join(_mean(f"step_out_{each}", bounds=False)(row) for each in ("never", "all"))


def _signed(
    interval: Interval, decimals: int = 2, scale: float = 1.0, *, bounds: bool = True
) -> str:
    text = interval.text(decimals, scale)
    if not bounds:
        text = text.partition(" [")[0]
    return f"+{text}" if interval.known and round(interval.value * scale, decimals) > 0.0 else text


_POLICIES: Final[dict[str, Callable[[SummaryRow], str]]] = {
    "policy": lambda row: row.variant,
    "success": _successes,
    "time to goal s": _mean("time_to_goal_s"),
    "s a meeting": _a_meeting(),
    "SPL": _mean("spl", bounds=False),
    "personal zone s": _mean("personal_s"),
}

_SAFETY: Final[dict[str, Callable[[SummaryRow], str]]] = {
    "policy": lambda row: row.variant,
    "contact, moving": lambda row: row.moving_contact.share_text(),
    "by robot": lambda row: row.robot_contact.share_text(),
    "by person": lambda row: row.person_contact.share_text(),
    "nearest m": _worst("min_separation_m"),
    "margin m": _worst("min_margin_m"),
    "violated s": _worst("violation_time_s"),
    "TTC s": _worst("min_time_to_collision_s"),
    "PET s": _worst("post_encroachment_s"),
}

# The step-out impacts with a group of people, by the name of the group.
_STEP_OUT: Final[dict[str, Callable[[str], Callable[[SummaryRow], str]]]] = {
    "impacts": lambda people: _mean(f"step_out_{people}"),
    "> 0.25 m/s": lambda people: _mean(f"step_out_{people}_fast", bounds=False),
    "worst m/s": lambda people: _worst(f"step_out_{people}_worst_mps"),
    "faster starts": lambda people: _mean(f"step_out_stress_{people}", bounds=False),
    "their worst m/s": lambda people: _worst(f"step_out_stress_{people}_worst_mps"),
}


def _step_out_table(rows: Sequence[SummaryRow]) -> str:
    """Return the step-out impacts of each policy with each group of people, and with all."""
    lines = (
        [row.variant, title, *(column(people)(row) for column in _STEP_OUT.values())]
        for row in rows
        for people, (title, _) in EVERYBODY.items()
    )
    return table_text(("policy", "people", *_STEP_OUT), lines, 2)


_REQUESTS: Final[dict[str, Callable[[SummaryRow], str]]] = {
    "policy": lambda row: row.variant,
    "per crossing": _mean("requests"),
    "per hour": _mean("requests_per_hour"),
    "answered %": _mean("answered_share"),
    "needless %": _mean("needless_share"),
    "people asked twice": _mean("asked_twice"),
    "impacts after an answer": _mean("step_out_answered"),
}

_COMPARISONS: Final[dict[str, Callable[[Comparison], str]]] = {
    "policy": lambda each: each.variant,
    "against": lambda each: each.baseline,
    "episodes": lambda each: each.part or "all",
    "pairs": lambda each: str(each.pairs),
    "s a meeting": lambda each: _signed(each.time_lost_s),
    "violation %": lambda each: _signed(each.violation_excess, 0, 100.0),
    "% of time": lambda each: _signed(each.violation_excess_of_time, 2, 100.0),
    "longer violation": lambda each: each.violates_more.share_text(),
}

_PARTS: Final[dict[str, Callable[[SummaryRow], str]]] = {
    "episodes": lambda row: row.part.replace("_", " "),
    "policy": lambda row: row.variant,
    "success": _successes,
    "contacts": _moving_contacts,
    "step-out": _step_outs,
    "s a meeting": _a_meeting(),
    "nearest m": _worst("min_separation_m"),
    "margin m": _worst("min_margin_m"),
    "violated s": _mean("violation_time_s", bounds=False),
    "α error": _mean("awareness_error", bounds=False),
}


def _notes(summary: Summary) -> list[str]:
    """Return the legend, and one line for each policy with episodes that are left out."""
    notes = [
        "s a meeting: time over that of the same robot alone; against another policy, the\n"
        "difference. violation: longer violation of the margin S − S_p, relative to that of the\n"
        "other, and to the time that it takes. nearest, margin, violated, TTC, PET under safety:\n"
        "the worst of all episodes. contact, moving: a person and the moving robot touched, by\n"
        "any cause. step-out: step-out impacts, never noticed; all. (…): the exact interval.\n"
        "[?]: too few for an interval.\n"
        "docs/measures.md defines all figures."
    ]
    if any(row.part == UNCONFIRMED for row in summary.attentions):
        notes.append(
            f"{UNCONFIRMED}: the scenario says attentive, but somebody was aware of the robot for\n"
            f"less than {100.0 * ATTENTIVE_FROM:.0f} % of the time with it in front within "
            f"{ATTENTION_WITHIN_M:g} m, or it was not measured"
        )
    for row in summary.policies:
        if row.errors:
            notes.append(
                f"{row.variant}: {_of(row.errors, row.episodes)} broke off with an error; "
                "failed episodes count as no success and are in no other figure"
            )
        lost = row.means["time_lost_s"]
        ran = row.episodes - row.errors
        if row.nondeterministic:
            notes.append(nondeterminism_note(row.variant, row.nondeterministic, ran))
        again = row.means["requests_after_answer"]
        if again.value > 0.0:
            notes.append(
                f"{row.variant}: {counted(round(again.value * again.n), 'request')} to people who "
                "had answered; there should be none"
            )
        not_reached = ran - row.means["time_to_goal_s"].n
        if not_reached:
            notes.append(
                f"{row.variant}: {_of(not_reached, ran)} did not reach the goal; such an episode "
                "has lost all of its time, and has no time to goal"
            )
        if lost.n < ran:
            notes.append(
                f"{row.variant}: time lost is known for {_of(lost.n, ran)}, as it needs the same "
                "task without people"
            )
    for each in summary.comparisons:
        if each.part == "" and each.time_lost_s.left_out:
            notes.append(
                f"{each.variant}: {_of(each.time_lost_s.left_out, each.pairs, 'pair')} left out of "
                "the seconds a meeting"
            )
    return notes


def nondeterminism_notes(records: Iterable[EpisodeRecord]) -> tuple[str, ...]:
    """Return one sentence about each planner that is not deterministic in some episode.

    And one about each in real time whose computer did not keep up.
    """
    records = tuple(records)
    by_planner: dict[str, list[bool]] = {}
    for record in records:
        if not record.error:  # an episode that broke off says nothing
            by_planner.setdefault(record.planner, []).append(record.nondeterministic)
    return tuple(
        nondeterminism_note(planner, sum(flags), len(flags))
        for planner, flags in sorted(by_planner.items())
        if any(flags)
    ) + tuple(
        _lateness_note(planner, [each for each in records if each.planner == planner])
        for planner in sorted({each.planner for each in records if _is_behind(each)})
    )


def _is_behind(record: EpisodeRecord) -> bool:
    return (record.late_share or 0.0) > _KEPT_UP


def _lateness_note(planner: str, records: Sequence[EpisodeRecord]) -> str:
    behind = [each for each in records if _is_behind(each)]
    return (
        f"{planner}: {_of(len(behind), len(records))} could not keep up with the clock: over "
        f"{100.0 * _KEPT_UP:g} % of the cycles began more than 10 ms late (at worst "
        f"{max(each.late_worst_s for each in behind):.2f} s). Give the computer less to do, or the "
        "planner a lower pace."
    )


def nondeterminism_note(label: str, differing: int, episodes: int) -> str:
    """Return the sentence about a planner, or about a policy and its planner."""
    return (
        f"{label}: the planner is not deterministic. In {_of(differing, episodes)} it drove the "
        "task without people differently the second time, with the same seed, or is a stack "
        "outside; such rows may differ when they are run again."
    )


def _of(part: int, whole: int, name: str = "episode") -> str:
    """Return ``"1 of 1 episode"``, ``"3 of 20 episodes"``."""
    return f"{part} of {counted(whole, name)}"
