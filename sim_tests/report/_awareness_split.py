"""Episodes by how the person who came nearest stood to the robot, and what it made of that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from ._arm import Arm
from ._estimates import mean_of
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


def split_by_awareness(arms: Sequence[Arm]) -> tuple[AwarenessGroup, ...]:
    """The groups that hold any episode."""
    parts = {
        kind: [
            (arm, tuple(each for each in arm.episodes if each.record.awareness == kind))
            for arm in arms
            if arm.episodes
        ]
        for kind, _, _ in GROUPS
    }
    estimates = {
        (kind, measure.key): [mean_of(episodes, measure.value) for _, episodes in parts[kind]]
        for kind, _, _ in GROUPS
        for measure in _MEASURES
    }
    scales = {
        measure.key: scale_over(
            [each for kind, _, _ in GROUPS for each in estimates[kind, measure.key] if each.known]
        )
        for measure in _MEASURES
    }
    groups = []
    for kind, title, meaning in GROUPS:
        if not any(episodes for _, episodes in parts[kind]):
            continue
        counts = []
        for arm, episodes in parts[kind]:
            hits = sum(each.record.robot_contacts > 0 for each in episodes)
            said = plural(hits, "robot contact") if episodes else ""
            counts.append((arm.look, arm.name, count(len(episodes)), said))
        panels = tuple(
            panel(
                measure,
                [
                    (arm, arm.name, each)
                    for (arm, _), each in zip(
                        parts[kind], estimates[kind, measure.key], strict=True
                    )
                ],
                scale=scales[measure.key],
            )
            for measure in _MEASURES
        )
        groups.append(AwarenessGroup(title, meaning, tuple(counts), panels))
    return tuple(groups)
