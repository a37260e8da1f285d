"""Policies against each other: measures as intervals, differences on the same seeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from ._figures import Figures, estimate
from ._measure import FURTHER, MAIN, Measure
from ._panel import Panel, panel

#: Kinds of scenario by what their people look at.
ATTENTIONS: Final = ("attentive", "mixed", "unaware")
_PAIRED: Final = (
    Measure(
        "won_back",
        "Time won back",
        "%",
        "more",
        "Σ (time lost by the reference − by the policy) / Σ time lost by the reference, over pairs "
        "of the same scenario and seed.",
        share=True,
    ),
    Measure(
        "time_lost_s",
        "Difference in time lost",
        "s",
        "less",
        "Mean over pairs: the policy's less the reference's.",
    ),
    Measure(
        "violation_excess",
        "Margin violated longer",
        "%",
        "less",
        "Σ (time of violation of the policy − of the reference) / Σ that of the reference, over "
        "pairs.",
        share=True,
    ),
    Measure(
        "min_separation_m",
        "Difference in smallest separation",
        "m",
        "",
        "Mean over pairs: the policy's less the reference's.",
        decimals=3,
    ),
)
#: What pairs tell that episodes alone do not; for the definitions.
PAIRED_ONLY: Final = (_PAIRED[0], _PAIRED[2])


@dataclass(frozen=True, slots=True)
class ComparisonSection:
    """All panels.

    Attributes:
        main: every arm, every scenario.
        further: measures for those who want more.
        references: names of the arms that differences are taken from.
        paired: differences from them and time won back, by attention of the scenarios.
    """

    main: tuple[Panel, ...]
    further: tuple[Panel, ...]
    references: tuple[str, ...]
    paired: tuple[Panel, ...]


def compare(figures: Figures) -> ComparisonSection:
    """Draw up the comparison."""
    groups = [
        (arm, f"{arm.name}, {attention}", against)
        for arm in figures.shown
        for attention in ATTENTIONS
        if (against := figures.against(arm, attention)) is not None and against.pairs
    ]
    paired = [
        panel(
            measure,
            [(arm, label, getattr(against, measure.key)) for arm, label, against in groups],
            signed=measure.key != "won_back",
        )
        for measure in _PAIRED
        if any(getattr(against, measure.key).known for _, _, against in groups)
    ]
    return ComparisonSection(
        tuple(_panel(figures, measure) for measure in MAIN if _known(figures, measure)),
        tuple(_panel(figures, measure) for measure in FURTHER if _known(figures, measure)),
        tuple(dict.fromkeys(against.baseline for _, _, against in groups)),
        tuple(paired),
    )


def _panel(figures: Figures, measure: Measure) -> Panel:
    rows = [(arm, arm.name, estimate(figures.whole(arm), measure)) for arm in figures.shown]
    return panel(measure, rows)


def _known(figures: Figures, measure: Measure) -> bool:
    return any(estimate(figures.whole(arm), measure).known for arm in figures.shown)
