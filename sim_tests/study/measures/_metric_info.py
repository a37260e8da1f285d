"""The measures of an episode by name: label, unit, and which way is better."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

Better = Literal["lower", "higher", "neither"]


@dataclass(frozen=True, slots=True)
class MetricInfo:
    """How a number of :class:`EpisodeRecord` is named and read.

    Attributes:
        name: the field.
        label: for people.
        unit: empty for a count or a ratio.
        better: which way is.
        decimals: worth printing.
    """

    name: str
    label: str
    unit: str
    better: Better
    decimals: int = 2


#: Every number of an episode that is averaged, in the order of docs/metrics.md.
METRICS: Final = (
    MetricInfo("time_to_goal_s", "time to goal", "s", "lower"),
    MetricInfo("time_lost_s", "time lost", "s", "lower"),
    MetricInfo("path_length_m", "path length", "m", "lower"),
    MetricInfo("spl", "SPL", "", "higher", 3),
    MetricInfo("stops", "stops", "", "lower"),
    MetricInfo("peak_deceleration_mps2", "peak deceleration", "m/s²", "lower"),
    MetricInfo("peak_jerk_mps3", "peak jerk", "m/s³", "lower"),
    MetricInfo("min_separation_m", "smallest separation", "m", "higher"),
    MetricInfo("speed_at_min_separation_mps", "speed at smallest separation", "m/s", "lower"),
    MetricInfo("max_speed_within_2m_mps", "highest speed within 2 m", "m/s", "lower"),
    MetricInfo("min_margin_m", "smallest margin S − S_p", "m", "higher"),
    MetricInfo("violation_time_s", "margin violated", "s", "lower", 3),
    MetricInfo("min_time_to_collision_s", "smallest time to collision", "s", "higher"),
    MetricInfo("post_encroachment_s", "post-encroachment time", "s", "higher"),
    MetricInfo("intimate_s", "within 0.45 m", "s", "lower"),
    MetricInfo("personal_s", "within 1.2 m", "s", "lower"),
    MetricInfo("robot_contacts", "contacts by the robot", "", "lower", 3),
    MetricInfo("person_contacts", "contacts by people", "", "lower", 3),
    MetricInfo("contact_speed_mps", "speed at contact", "m/s", "lower"),
    MetricInfo("human_delay_s", "delay of people", "s", "lower"),
    MetricInfo("human_detour_m", "detour of people", "m", "lower"),
    MetricInfo("warnings", "warnings", "", "neither"),
    MetricInfo("awareness_error", "error of α", "", "lower", 3),
)
METRIC_BY_NAME: Final = {metric.name: metric for metric in METRICS}
