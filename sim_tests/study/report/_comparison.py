"""Section of a report: metrics of every arm, and differences on the same seeds."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from ..measures import METRICS, RATIOS, SHARES, UNCONFIRMED, Metric
from ._panel import Panel, panel
from ._statistics import MARGIN, TIME_LOST, VIOLATION, RunStatistics, estimate

#: Metrics that are shown first.
MAIN: Final = (
    SHARES["moving_contacts"],
    METRICS["step_out_unaware"],
    TIME_LOST,
    VIOLATION,
    SHARES["success"],
    MARGIN,
    METRICS["speed_at_min_separation_mps"],
)
#: Metrics that are shown on demand.
FURTHER: Final = (
    SHARES["robot_contacts"],
    SHARES["person_contacts"],
    *(
        METRICS[name]
        for name in (
            "step_out_unaware_fast",
            "step_out_worst_mps",
            "step_out_aware",
            "step_out_aware_fast",
            "step_out_stress_unaware",
            "step_out_stress_worst_mps",
            "moving_contact_mps",
            "min_separation_m",
            "min_time_to_collision_s",
            "post_encroachment_s",
            "personal_s",
            "intimate_s",
            "human_delay_s",
            "human_detour_m",
            "stops",
            "peak_deceleration_mps2",
            "peak_jerk_mps3",
            "spl",
            "awareness_error",
            "warnings",
        )
    ),
)
#: Metrics of requests for attention, which are shown where somebody was asked.
REQUESTS: Final = (
    METRICS["requests"],
    *(each.metric for each in RATIOS.values()),
    METRICS["asked_twice"],
)
#: Parts of the episodes by what their people look at.
ATTENTIONS: Final = ("attentive", UNCONFIRMED, "mixed", "unaware")
# Fields of a Comparison.
_PAIRED: Final = (
    Metric(
        "won_back",
        "Time won back",
        "%",
        "higher",
        "Σ (time lost by the reference − by the policy) / Σ time lost by the reference, over pairs "
        "of the same scenario and seed.",
        share=True,
    ),
    Metric(
        "time_lost_s",
        "Difference in time lost",
        "s",
        "lower",
        "Mean over pairs: the policy's less the reference's.",
    ),
    Metric(
        "violation_excess",
        "Margin violated longer",
        "%",
        "lower",
        "Σ (time of violation of the policy − of the reference) / Σ that of the reference, over "
        "pairs.",
        share=True,
    ),
    Metric(
        "step_out_unaware",
        "Difference in step-out impacts, unaware",
        "",
        "lower",
        "Mean over pairs: the policy's less the reference's, per 1 000 crossings.",
    ),
    Metric(
        "min_separation_m",
        "Difference in smallest separation",
        "m",
        "neither",
        "Mean over pairs: the policy's less the reference's.",
        decimals=3,
    ),
)
#: Metrics that only pairs have, for the definitions.
PAIRED_ONLY: Final = (_PAIRED[0], _PAIRED[2])


@dataclass(frozen=True, slots=True)
class ComparisonSection:
    """The panels of the comparison.

    Attributes:
        main: metrics that are shown first, over all scenarios.
        further: metrics that are shown on demand, over all scenarios.
        requests: requests for attention, over all scenarios; empty where nobody was asked.
        references: names of the arms that differences are taken from.
        paired: differences and time won back, by attention of the scenarios.
    """

    main: tuple[Panel, ...]
    further: tuple[Panel, ...]
    requests: tuple[Panel, ...]
    references: tuple[str, ...]
    paired: tuple[Panel, ...]


def comparison_section(statistics: RunStatistics) -> ComparisonSection:
    """Return the panels of the comparison."""
    groups = [
        (arm, f"{arm.name}, {attention}", against)
        for arm in statistics.shown
        for attention in ATTENTIONS
        if (against := statistics.against(arm, attention)) is not None and against.pairs
    ]
    paired = [
        panel(
            metric,
            [(arm.look, label, getattr(against, metric.name)) for arm, label, against in groups],
            signed=metric.name != "won_back",
        )
        for metric in _PAIRED
        if any(getattr(against, metric.name).known for _, _, against in groups)
    ]
    asked = any(statistics.of_arm(arm).asked for arm in statistics.shown)
    return ComparisonSection(
        _panels(statistics, MAIN),
        _panels(statistics, FURTHER),
        _panels(statistics, REQUESTS) if asked else (),
        tuple(dict.fromkeys(against.baseline for _, _, against in groups)),
        tuple(paired),
    )


def _panels(statistics: RunStatistics, metrics: Iterable[Metric]) -> tuple[Panel, ...]:
    """Return a panel of all arms for each metric that is known for any of them."""
    panels = []
    for metric in metrics:
        rows = [
            (arm.look, arm.name, estimate(statistics.of_arm(arm), metric))
            for arm in statistics.shown
        ]
        if any(interval.known for _, _, interval in rows):
            panels.append(panel(metric, rows))
    return tuple(panels)
