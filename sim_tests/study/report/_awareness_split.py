"""Section of a report: episodes by awareness of the nearest person and the robot's judgement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ._panel import Panel, panel, scale_over
from ._statistics import MARGIN, TIME_LOST, VIOLATION, RunStatistics, estimate
from ._text import count, plural

#: Awareness class, heading and meaning of each group.
GROUPS: Final = (
    ("aware", "Aware, and recognised", "The person had seen the robot, and the robot knew."),
    ("unaware", "Unaware, and recognised", "The person had not, and the robot did not think so."),
    (
        "falsely_aware",
        "Unaware, taken for aware",
        "The dangerous mistake: the person had not seen the robot, but it thought so.",
    ),
    (
        "missed_aware",
        "Aware, not recognised",
        "The mistake that costs time: the person had seen the robot, but it did not know.",
    ),
)
_METRICS: Final = (TIME_LOST, VIOLATION, MARGIN)


@dataclass(frozen=True, slots=True)
class AwarenessGroup:
    """The episodes of one awareness class.

    Attributes:
        title: heading of the group.
        meaning: one sentence.
        counts: look and name of each arm, its episodes and its contacts with the moving
            robot, as texts.
        panels: metrics on axes that all groups share.
    """

    title: str
    meaning: str
    counts: tuple[tuple[int, str, str, str], ...]
    panels: tuple[Panel, ...]


def split_by_awareness(statistics: RunStatistics) -> tuple[AwarenessGroup, ...]:
    """Return the groups that hold any episode."""
    rows = {
        kind: [(arm, statistics.by_awareness(arm, kind)) for arm in statistics.shown]
        for kind, _, _ in GROUPS
    }
    scales = {}
    for metric in _METRICS:
        estimates = [estimate(row, metric) for part in rows.values() for _, row in part]
        scales[metric.name] = scale_over([each for each in estimates if each.known])
    groups = []
    for kind, title, meaning in GROUPS:
        if all(row is None for _, row in rows[kind]):
            continue
        counts = []
        for arm, row in rows[kind]:
            episodes = 0 if row is None else row.moving_contact.n
            hits = 0 if row is None or not episodes else round(row.moving_contact.value * episodes)
            contacts = plural(hits, "contact") if episodes else ""
            counts.append((arm.look, arm.name, count(episodes), contacts))
        panels = tuple(
            panel(
                metric,
                [(arm.look, arm.name, estimate(row, metric)) for arm, row in rows[kind]],
                scale=scales[metric.name],
            )
            for metric in _METRICS
        )
        groups.append(AwarenessGroup(title, meaning, tuple(counts), panels))
    return tuple(groups)
