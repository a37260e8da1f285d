"""A summary as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

from ._interval import Interval, number_text
from ._metric_info import METRIC_BY_NAME

if TYPE_CHECKING:
    from ._summary import Comparison, Summary, SummaryRow

_ATTENTIONS: Final = {
    "": "all",
    "attentive": "attentive",
    "unaware": "unaware",
    "mixed": "mixed",
}


def summary_text(summary: Summary) -> str:
    """All tables, each with a heading, and what was left out."""
    if not summary.policies:
        return "no episodes"
    percent = f"{100.0 * summary.level:g} %"
    blocks = [
        _titled(f"Policies: means with {percent} intervals", _policy_table(summary.policies)),
        _titled("Safety: the worst of all episodes", _safety_table(summary.policies)),
    ]
    if summary.comparisons:
        blocks.append(
            _titled(
                "Pairs of the same scenario and seed",
                _comparison_table(summary.comparisons),
            )
        )
    for title, rows in (
        ("By attention of the scenario's people", summary.attentions),
        ("By awareness of the person who came nearest (not paired)", summary.awareness),
        ("By scenario", summary.scenarios),
    ):
        blocks.append(_titled(title, _part_table(rows)))
    blocks += _notes(summary)
    return "\n\n".join(blocks)


def table_text(header: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> str:
    """Columns aligned, the first ``left`` of them to the left and the others to the right."""
    lines = [list(header), *(list(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]

    def line_text(cells: list[str]) -> str:
        aligned = [
            cell.ljust(width) if column < left else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return "  ".join(aligned).rstrip()

    rule = "  ".join("-" * width for width in widths)
    return "\n".join([line_text(lines[0]), rule, *(line_text(line) for line in lines[1:])])


def share_text(share: Interval) -> str:
    """``"3 of 200 (≤ 4.3 %)"``: how many, and the upper end of the exact interval."""
    if not share.n:
        return "–"
    count = round(share.value * share.n)
    return f"{count} of {share.n} (≤ {_percent(share.high)})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 0.0995 else f"{100.0 * share:.0f} %"


def _titled(title: str, table: str) -> str:
    return f"{title}\n\n{table}"


def _mean(row: SummaryRow, name: str, bounds: bool = True) -> str:
    interval, decimals = row.means[name], METRIC_BY_NAME[name].decimals
    if bounds or not interval.known:
        return interval.text(decimals)
    return number_text(interval.value, decimals)


def _worst(row: SummaryRow, name: str) -> str:
    value = row.worst.get(name)
    return "–" if value is None else number_text(value, METRIC_BY_NAME[name].decimals)


def _policy_table(rows: Sequence[SummaryRow]) -> str:
    header = ("policy", "success", "time to goal s", "time lost s", "SPL", "personal zone s")
    return table_text(
        header,
        (
            (
                row.variant,
                f"{round(row.success.value * row.episodes)} of {row.episodes}",
                _mean(row, "time_to_goal_s"),
                _mean(row, "time_lost_s"),
                _mean(row, "spl", bounds=False),
                _mean(row, "personal_s"),
            )
            for row in rows
        ),
    )


def _safety_table(rows: Sequence[SummaryRow]) -> str:
    header = (
        "policy",
        "contact by robot",
        "by person",
        "least m",
        "margin m",
        "violated s",
        "TTC s",
        "PET s",
    )
    return table_text(
        header,
        (
            (
                row.variant,
                share_text(row.robot_contact),
                share_text(row.person_contact),
                *(
                    _worst(row, name)
                    for name in (
                        "min_separation_m",
                        "min_margin_m",
                        "violation_time_s",
                        "min_time_to_collision_s",
                        "post_encroachment_s",
                    )
                ),
            )
            for row in rows
        ),
    )


def _comparison_table(comparisons: Sequence[Comparison]) -> str:
    header = (
        "policy",
        "against",
        "episodes",
        "pairs",
        "won back %",
        "time lost s",
        "violation %",
        "% of time",
        "longer violation",
    )
    return table_text(
        header,
        (
            (
                each.variant,
                each.baseline,
                _ATTENTIONS.get(each.part, each.part),
                str(each.pairs),
                each.won_back.text(0, 100.0),
                _signed(each.time_lost_s),
                _signed(each.violation_excess, 0, 100.0),
                _signed(each.violation_excess_of_time, 2, 100.0),
                share_text(each.violates_more),
            )
            for each in comparisons
        ),
        left=3,
    )


def _signed(interval: Interval, decimals: int = 2, scale: float = 1.0) -> str:
    text = interval.text(decimals, scale)
    return f"+{text}" if interval.known and round(interval.value * scale, decimals) > 0.0 else text


def _part_table(rows: Sequence[SummaryRow]) -> str:
    header = (
        "episodes",
        "policy",
        "success",
        "by robot",
        "time lost s",
        "least m",
        "margin m",
        "violated s",
        "α error",
    )
    return table_text(
        header,
        (
            (
                row.part.replace("_", " "),
                row.variant,
                f"{round(row.success.value * row.episodes)} of {row.episodes}",
                str(round(row.robot_contact.value * row.robot_contact.n))
                if row.robot_contact.n
                else "–",
                _mean(row, "time_lost_s"),
                _worst(row, "min_separation_m"),
                _worst(row, "min_margin_m"),
                _mean(row, "violation_time_s", bounds=False),
                _mean(row, "awareness_error", bounds=False),
            )
            for row in rows
        ),
        left=2,
    )


def _notes(summary: Summary) -> list[str]:
    notes = [
        "won back: share of the time that the other loses. violation: longer violation of the\n"
        "margin S − S_p, relative to that of the other, and to the time that it takes. least,\n"
        "margin, violated, TTC, PET under safety: the worst of all episodes. (≤ x %): upper end\n"
        "of the exact interval. [?]: too few for an interval. docs/metrics.md defines all figures."
    ]
    for row in summary.policies:
        if row.errors:
            notes.append(
                f"{row.variant}: {row.errors} of {row.episodes} episodes broke off with an error; "
                "they count as no success and are in no other figure"
            )
        lost = row.means["time_lost_s"]
        ran = row.episodes - row.errors
        astray = ran - row.means["time_to_goal_s"].n
        if astray:
            notes.append(
                f"{row.variant}: {astray} of {ran} episodes did not reach the goal; they lost all "
                "of their time, and have no time to goal"
            )
        if lost.n < ran:
            notes.append(
                f"{row.variant}: time lost is known for {lost.n} of {ran} episodes, those whose "
                "task was also done without people"
            )
    for each in summary.comparisons:
        if each.part == "" and each.won_back.left_out:
            notes.append(
                f"{each.variant}: {each.won_back.left_out} of {each.pairs} pairs are left out of "
                "the time won back"
            )
    return ["\n".join(notes)]
