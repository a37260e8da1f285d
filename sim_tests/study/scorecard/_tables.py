"""The scorecard as tables: their columns, for the page, Markdown, CSV and the terminal."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from awarenav.files import csv_number

from ..measures import BASELINE, Interval
from ..report import NOTHING, number, percent
from ._score import PlannerScore, Score, Scorecard
from ._verdict import OBEYED, exceeded, factor, hits, of, verdicts

#: The columns of the table of scores: heading, and meaning.
COLUMNS: Final[dict[str, str]] = {
    "Goals": "episodes that reached the goal, of all, with the 95 % interval of the share",
    "Median time, s": "median time to goal of the episodes that reached it",
    "Against blind, s": "mean difference of the time lost to that of the policy blind with the "
    "same planner, scenario and seed, with its 95 % interval; negative is faster",
    "Attentive, s": "the same for episodes in which everybody was attentive",
    "Unaware, s": "the same for scenarios in which people are unaware",
    "Contacts": "episodes in which a person and the moving robot touched / the robot moved into a "
    "person / a person walked into the robot, moving or not",
    "Step-out": "expected impacts with unaware people who set off, per 1 000 crossings, with the "
    "95 % interval; an index, not a rate of accidents",
    "Worst step-out, m/s": "the robot's highest closing speed in one of these impacts",
    "Worst margin, m": "smallest separation margin S − S_p of a moving robot",
    "Negative margin": "episodes with a negative margin, with the 95 % interval of the share",
    "Speed limit, m/s": f"largest excess over the speed limit; obeyed: {OBEYED}",
    "Yaw rule, m/s": "the same for |v| + |ω| R and fastest_point_limit_mps",
    "plan(), ms": "median time of a call / 99th percentile",
    "× ref.": "median time of a call, divided by the reference planner's",
}


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell.

    Attributes:
        text: the figure.
        detail: its interval, or a second figure; empty for none.
        bad: whether it is bad news.
    """

    text: str
    detail: str = ""
    bad: bool = False

    @property
    def whole(self) -> str:
        """Figure and detail on one line."""
        return f"{self.text} {self.detail}".rstrip()


@dataclass(frozen=True, slots=True)
class Row:
    """A row: planner, policy, its number among the planners, and the cells of :data:`COLUMNS`."""

    planner: str
    policy: str
    look: int
    cells: tuple[Cell, ...]


@dataclass(frozen=True, slots=True)
class ProbeRow:
    """A row about the probes: planner and look, and cells about radii and speed field."""

    planner: str
    look: int
    changed: Cell
    separation: Cell
    field: Cell
    goals: Cell


def rows(card: Scorecard) -> tuple[Row, ...]:
    """Return the rows of the table of scores, by planner and policy."""
    return tuple(
        Row(planner.name, score.policy, look, _cells(score))
        for look, planner in looks(card)
        for score in planner.scores
    )


def looks(card: Scorecard) -> Iterator[tuple[int, PlannerScore]]:
    """Yield every planner with the number of its colour and shape; a variant has its planner's."""
    look = -1
    for planner in card.planners:
        look += not planner.variant_of
        yield look % 6, planner


def probe_rows(card: Scorecard) -> tuple[ProbeRow, ...]:
    """Return the rows of the table of probes, without variants."""
    return tuple(
        _probe_row(look, planner) for look, planner in looks(card) if not planner.variant_of
    )


def difference(interval: Interval, decimals: int = 1) -> Cell:
    """Return a difference with its interval, as −3.2 and [−4.4, −2.1]; a dash without a value."""
    if not interval.known:
        return Cell(NOTHING)
    value = number(interval.value, decimals, sign=True)
    if not interval.bounded:
        return Cell(value, "[?]")
    low, high = (number(end, decimals, sign=True) for end in (interval.low, interval.high))
    return Cell(value, f"[{low}, {high}]")


def markdown(card: Scorecard) -> str:
    """Return the scorecard as Markdown: verdicts, both tables, and what the columns mean."""
    lines = ["# A planner's scorecard", "", f"{scope(card)}.", ""]
    for verdict in verdicts(card):
        lines += [f"- **{verdict.name}**: {verdict.text}"]
    header = ("planner", "policy", *COLUMNS)
    lines += ["", *_markdown_table(header, [_texts(row) for row in rows(card)]), ""]
    probes = [
        (
            each.planner,
            *(cell.whole for cell in (each.changed, each.separation, each.field, each.goals)),
        )
        for each in probe_rows(card)
    ]
    lines += [*_markdown_table(PROBE_COLUMNS, probes), ""]
    lines += [f"- {name}: {meaning}" for name, meaning in COLUMNS.items()]
    return "\n".join(lines) + "\n"


#: The columns of the table of probes.
PROBE_COLUMNS: Final = (
    "planner",
    "other path with wider radii",
    "more distance, m",
    "with the speed field, s",
    "goals with / without it",
)


def scope(card: Scorecard) -> str:
    """Return what was run, in one line."""
    seeds = f"seeds {card.seeds[0]} to {card.seeds[-1]}" if len(card.seeds) > 1 else "one seed"
    whole = "" if card.episodes == card.planned else f" of {card.planned}"
    return (
        f"{card.episodes}{whole} episodes: {', '.join(card.scenarios)}; {seeds}; perception "
        f"{card.perception}"
    )


def csv_text(card: Scorecard) -> str:
    """Return one line per planner and policy, with plain numbers and both ends of intervals."""
    lines = io.StringIO()
    writer = csv.writer(lines, lineterminator="\n")
    records = [_record(each, score) for each in card.planners for score in each.scores]
    for index, record in enumerate(records):
        if index == 0:
            writer.writerow(record)
        writer.writerow(record.values())
    return lines.getvalue()


def _texts(row: Row) -> tuple[str, ...]:
    return row.planner, row.policy, *(cell.whole for cell in row.cells)


def _markdown_table(header: Sequence[str], lines: Sequence[Sequence[str]]) -> list[str]:
    def line(cells: Sequence[str]) -> str:
        return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"

    return [line(header), line(["---"] * len(header)), *map(line, lines)]


def _cells(score: Score) -> tuple[Cell, ...]:
    time, negative, goals, worst = (
        score.plan_time,
        score.negative_margin,
        score.goals,
        score.worst_margin_m,
    )
    against = [
        Cell(NOTHING) if score.policy == BASELINE else difference(each)
        for each in score.against_blind_s.values()
    ]
    touched = (score.moving_contacts, score.robot_contacts, score.person_contacts)
    contacts, step_out = " / ".join(str(hits(each)) for each in touched), score.step_out_unaware
    return (
        _share(goals, bad=hits(goals) < goals.n),
        Cell(number(score.median_time_s, 1)),
        *against,
        Cell(contacts if score.robot_contacts.n else NOTHING, bad=hits(score.moving_contacts) > 0),
        Cell(step_out.text(1) if step_out.known else NOTHING),
        Cell(number(score.step_out_worst_mps)),
        Cell(number(worst), bad=worst is not None and worst < 0.0),
        _share(negative, bad=hits(negative) > 0),
        Cell(exceeded(score.limit), bad=score.limit.obeyed is False),
        Cell(exceeded(score.fastest_point), bad=score.fastest_point.obeyed is False),
        Cell(NOTHING)
        if time is None
        else Cell(_ms(time.median_s), f"/ {_ms(time.p99_s)}", bad=time.late),
        Cell(NOTHING if time is None or time.ratio is None else factor(time.ratio)),
    )


def _share(share: Interval, *, bad: bool) -> Cell:
    if not share.n:
        return Cell(NOTHING)
    return Cell(of(share), f"[{percent(share.low)}, {percent(share.high)}]", bad)


def _ms(seconds: float) -> str:
    return number(1e3 * seconds, 1 if seconds >= 1e-4 else 3)


def _probe_row(look: int, planner: PlannerScore) -> ProbeRow:
    radii, field = planner.radii, planner.field
    return ProbeRow(
        planner.name,
        look,
        Cell(NOTHING) if radii is None else Cell(of(radii.changed)),
        Cell(NOTHING) if radii is None else difference(radii.separation_m, 2),
        Cell("does not use it") if field is None else difference(field.time_s),
        Cell(NOTHING)
        if field is None
        else Cell(f"{of(field.goals_with)} / {of(field.goals_without)}"),
    )


def _record(planner: PlannerScore, score: Score) -> dict[str, str]:
    time = score.plan_time
    values: dict[str, float | None] = {}
    for name, share in (
        ("goals", score.goals),
        *(
            (f"against_blind{'_' + part if part else ''}_s", each)
            for part, each in score.against_blind_s.items()
        ),
        ("moving_contacts", score.moving_contacts),
        ("robot_contacts", score.robot_contacts),
        ("person_contacts", score.person_contacts),
        ("step_out_unaware", score.step_out_unaware),
        ("negative_margin", score.negative_margin),
    ):
        values |= {name: share.value, f"{name}_low": share.low, f"{name}_high": share.high}
    values |= {
        "median_time_s": score.median_time_s,
        "step_out_worst_mps": score.step_out_worst_mps,
        "worst_margin_m": score.worst_margin_m,
        "limit_excess_mps": score.limit.excess_mps,
        "fastest_point_excess_mps": score.fastest_point.excess_mps,
        "plan_median_ms": None if time is None else 1e3 * time.median_s,
        "plan_p99_ms": None if time is None else 1e3 * time.p99_s,
        "plan_ratio": None if time is None else time.ratio,
    }
    return {
        "planner": planner.name,
        "policy": score.policy,
        "episodes": str(score.episodes),
        "failed": str(score.failed),
        **{name: csv_number(value) for name, value in values.items()},
    }
