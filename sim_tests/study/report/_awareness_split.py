"""Episodes by how the person who came nearest stood to the robot, and what it made of that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ._figures import Figures, estimate
from ._measure import MARGIN, TIME_LOST, VIOLATION
from ._panel import Panel, panel, scale_over
from ._text import count, plural

#: Value of ``awareness``, heading and meaning.
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
_MEASURES: Final = (TIME_LOST, VIOLATION, MARGIN)


@dataclass(frozen=True, slots=True)
class AwarenessGroup:
    """One kind of encounter.

    Attributes:
        title: of the group.
        meaning: one sentence.
        counts: for each arm its look, name, episodes and contacts caused by the robot, as texts.
        panels: measures on axes that all groups share.
    """

    title: str
    meaning: str
    counts: tuple[tuple[int, str, str, str], ...]
    panels: tuple[Panel, ...]


def split_by_awareness(figures: Figures) -> tuple[AwarenessGroup, ...]:
    """The groups that hold any episode."""
    rows = {
        kind: [(arm, figures.by_awareness(arm, kind)) for arm in figures.shown]
        for kind, _, _ in GROUPS
    }
    scales = {}
    for measure in _MEASURES:
        estimates = [estimate(row, measure) for group in rows.values() for _, row in group]
        scales[measure.key] = scale_over([each for each in estimates if each.known])
    groups = []
    for kind, title, meaning in GROUPS:
        if all(row is None for _, row in rows[kind]):
            continue
        counts = []
        for arm, row in rows[kind]:
            episodes = 0 if row is None else row.robot_contact.n
            hits = 0 if row is None or not episodes else round(row.robot_contact.value * episodes)
            said = plural(hits, "robot contact") if episodes else ""
            counts.append((arm.look, arm.name, count(episodes), said))
        panels = tuple(
            panel(
                measure,
                [(arm, arm.name, estimate(row, measure)) for arm, row in rows[kind]],
                scale=scales[measure.key],
            )
            for measure in _MEASURES
        )
        groups.append(AwarenessGroup(title, meaning, tuple(counts), panels))
    return tuple(groups)
