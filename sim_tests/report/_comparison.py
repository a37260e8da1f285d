"""Policies against each other: measures as intervals, differences on the same seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from ..measures._interval import Interval
from ._arm import Arm
from ._episode import Episode
from ._estimates import difference_of, mean_of, of_attention, share_of, won_back_of
from ._measure import FURTHER, MAIN, MARGIN, TIME_LOST, VIOLATION, Measure
from ._panel import Panel, panel

_WON_BACK: Final = Measure(
    "won_back",
    "Time won back",
    "%",
    "more",
    "Share of the time that the reference loses which the policy does not, on the same seeds.",
    share=True,
)
#: Kinds of scenario by what their people look at.
ATTENTIONS: Final = ("attentive", "mixed", "unaware")


@dataclass(frozen=True, slots=True)
class Comparison:
    """All panels.

    Attributes:
        main: every arm, every scenario.
        further: measures for those who want more.
        reference: name of the arm that differences are taken from, empty without.
        paired: differences from it and time won back, by attention of the scenarios.
    """

    main: tuple[Panel, ...]
    further: tuple[Panel, ...]
    reference: str
    paired: tuple[Panel, ...]


def compare(arms: Sequence[Arm]) -> Comparison:
    """Draw up the comparison of arms over their episodes without a fault."""
    shown = [arm for arm in arms if arm.episodes]
    reference = next((arm for arm in shown if arm.role == "reference"), None)
    return Comparison(
        tuple(_panel(measure, shown) for measure in MAIN if _known(measure, shown)),
        tuple(_panel(measure, shown) for measure in FURTHER if _known(measure, shown)),
        "" if reference is None else reference.name,
        () if reference is None else _paired(reference, shown),
    )


def estimate(measure: Measure, arm: Arm) -> Interval:
    """A measure of one arm."""
    reckon = share_of if measure.share else mean_of
    return reckon(arm.episodes, measure.value)


def _panel(measure: Measure, arms: Sequence[Arm]) -> Panel:
    return panel(measure, [(arm, arm.name, estimate(measure, arm)) for arm in arms])


def _known(measure: Measure, arms: Sequence[Arm]) -> bool:
    return any(measure.value(each.record) is not None for arm in arms for each in arm.episodes)


def _paired(reference: Arm, arms: Sequence[Arm]) -> tuple[Panel, ...]:
    groups = [
        (arm, f"{arm.name}, {attention}", attention)
        for arm in arms
        if arm is not reference
        for attention in ATTENTIONS
        if of_attention(arm.episodes, attention)
    ]
    if not groups:
        return ()

    def parts(arm: Arm, attention: str) -> tuple[Sequence[Episode], Sequence[Episode]]:
        return of_attention(reference.episodes, attention), of_attention(arm.episodes, attention)

    panels = [
        panel(
            _WON_BACK,
            [(arm, label, won_back_of(*parts(arm, kind))) for arm, label, kind in groups],
        )
    ]
    for measure in (TIME_LOST, VIOLATION, MARGIN):
        changed = replace(measure, title=f"{measure.title}, less {reference.name}")
        rows = [
            (arm, label, difference_of(*parts(arm, kind), measure.key))
            for arm, label, kind in groups
        ]
        panels.append(panel(changed, rows, signed=True))
    return tuple(panels)
