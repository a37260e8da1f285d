"""The metrics of an episode in one table, which the terminal tables and the HTML report read.

docs/metrics.md has the full definitions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal


@dataclass(frozen=True, slots=True)
class Metric:
    """A number of an episode: its name, its unit and its better direction.

    Attributes:
        name: column of ``episodes.csv``.
        title: for headings.
        unit: empty for a count or a ratio.
        better: the better direction.
        meaning: one sentence.
        decimals: to print.
        share: a share of episodes, printed in per cent.
        from_zero: the axis of a plot includes 0.
        says_better: a plot says which direction is better.
    """

    name: str
    title: str
    unit: str
    better: Literal["lower", "higher", "neither"]
    meaning: str
    decimals: int = 2
    share: bool = False
    from_zero: bool = True
    says_better: bool = True


def _by_name(*metrics: Metric) -> dict[str, Metric]:
    return {metric.name: metric for metric in metrics}


#: Shares of episodes, in per cent.
SHARES: Final = _by_name(
    Metric(
        "success",
        "Arrived, touching nobody",
        "%",
        "higher",
        "Share of episodes in which the goal was reached and the robot moved into nobody; one "
        "that failed counts as not reached.",
        share=True,
        from_zero=False,
    ),
    Metric(
        "moving_contacts",
        "Contacts with a moving robot",
        "%",
        "lower",
        "Share of episodes in which a moving robot and a person touched, by any cause.",
        share=True,
    ),
    Metric(
        "robot_contacts",
        "Contacts caused by the robot",
        "%",
        "lower",
        "Share of episodes in which the robot moved into a person.",
        share=True,
    ),
    Metric(
        "person_contacts",
        "People who walked into the robot",
        "%",
        "lower",
        "Share of episodes in which a person walked into the robot.",
        share=True,
    ),
)

#: Numbers that are averaged over episodes, in the order of docs/metrics.md.
METRICS: Final = _by_name(
    Metric(
        "time_to_goal_s",
        "Time to goal",
        "s",
        "lower",
        "Time until the goal was reached.",
    ),
    Metric(
        "time_lost_s",
        "Time lost to people",
        "s",
        "lower",
        "Time over that of the same task in the empty hall; one that never arrives lost all "
        "its time.",
    ),
    Metric(
        "path_length_m",
        "Path length",
        "m",
        "lower",
        "Length of the path that the robot drove.",
    ),
    Metric(
        "spl",
        "Success weighted by path length",
        "",
        "higher",
        "1 for every goal reached on the shortest way (Anderson et al. 2018).",
        decimals=3,
    ),
    Metric(
        "stops",
        "Stops",
        "",
        "lower",
        "How often the robot came to a stand before the goal.",
    ),
    Metric(
        "peak_deceleration_mps2",
        "Peak deceleration",
        "m/s²",
        "lower",
        "The robot's strongest braking.",
    ),
    Metric(
        "peak_jerk_mps3",
        "Peak jerk",
        "m/s³",
        "lower",
        "The robot's largest jerk.",
        decimals=1,
    ),
    Metric(
        "min_separation_m",
        "Smallest separation",
        "m",
        "higher",
        "Smallest distance between the surfaces of robot and person.",
        says_better=False,  # passing close to an aware person is no fault
    ),
    Metric(
        "speed_at_min_separation_mps",
        "Speed when nearest",
        "m/s",
        "lower",
        "The robot's speed at the instant of smallest separation.",
    ),
    Metric(
        "max_speed_within_2m_mps",
        "Highest speed within 2 m",
        "m/s",
        "lower",
        "The robot's highest speed with a person's surface within 2 m.",
    ),
    Metric(
        "min_margin_m",
        "Smallest margin",
        "m",
        "higher",
        "Smallest separation margin S − S_p at a moving robot: surface distance less the "
        "protective separation of ISO 13855 and ISO/TS 15066.",
    ),
    Metric(
        "min_margin_unaware_m",
        "Smallest margin, unaware",
        "m",
        "higher",
        "Smallest separation margin at a moving robot to people who have not looked for 1 s, or "
        "never.",
    ),
    Metric(
        "violation_time_s",
        "Margin violated",
        "s",
        "lower",
        "Seconds an episode with the separation margin S − S_p below 0 at a moving robot.",
        decimals=3,
    ),
    Metric(
        "min_time_to_collision_s",
        "Smallest time to collision",
        "s",
        "higher",
        "Time until robot and person would touch if both went straight on, at its smallest.",
    ),
    Metric(
        "post_encroachment_s",
        "Post-encroachment time",
        "s",
        "higher",
        "Smallest time between one leaving a place and the other entering it.",
    ),
    Metric(
        "intimate_s",
        "Time within 0.45 m",
        "s",
        "lower",
        "Seconds an episode with a person's surface in the intimate zone.",
    ),
    Metric(
        "personal_s",
        "Time within 1.2 m",
        "s",
        "lower",
        "Seconds an episode with a person's surface in the personal zone.",
    ),
    Metric(
        "step_out_unaware",
        "Step-out impacts, unaware",
        "",
        "lower",
        "Expected impacts per 1 000 crossings with people who have not looked for 1 s or never, "
        "set off at any time and ignore the robot. An index, not a rate of accidents.",
    ),
    Metric(
        "step_out_unaware_fast",
        "Step-out impacts above 0.25 m/s, unaware",
        "",
        "lower",
        "Those step-out impacts with unaware people in which the robot closes at more than "
        "0.25 m/s.",
    ),
    Metric(
        "step_out_worst_mps",
        "Worst step-out impact, unaware",
        "m/s",
        "lower",
        "The robot's highest closing speed in a step-out impact with an unaware person.",
    ),
    Metric(
        "step_out_aware",
        "Step-out impacts, aware",
        "",
        "lower",
        "Expected impacts per 1 000 crossings with people who have looked within 1 s, if every "
        "one who sets off ignores the robot. Few do: an upper bound.",
    ),
    Metric(
        "step_out_aware_fast",
        "Step-out impacts above 0.25 m/s, aware",
        "",
        "lower",
        "Those step-out impacts with aware people in which the robot closes at more than 0.25 m/s.",
    ),
    Metric(
        "step_out_stress_unaware",
        "Step-out impacts of faster starts, unaware",
        "",
        "lower",
        "Step-out impacts with unaware people who start faster than recorded: to 1.6 m/s with a "
        "time constant of 0.35 s.",
    ),
    Metric(
        "step_out_stress_worst_mps",
        "Worst step-out impact of faster starts, unaware",
        "m/s",
        "lower",
        "The robot's highest closing speed in a step-out impact with an unaware person who starts "
        "faster than recorded.",
    ),
    Metric(
        "moving_contacts",
        "Contacts with a moving robot",
        "",
        "lower",
        "Contacts of a person and a moving robot, by any cause.",
        decimals=3,
    ),
    Metric(
        "moving_contact_mps",
        "Speed at contact, any cause",
        "m/s",
        "lower",
        "The robot's highest speed at a contact with a person, by any cause.",
    ),
    Metric(
        "moving_contacts_unaware",
        "Contacts with a moving robot, unaware",
        "",
        "lower",
        "Contacts of a moving robot and a person who has not looked for 1 s, or never.",
        decimals=3,
    ),
    Metric(
        "moving_contact_unaware_mps",
        "Speed at contact, unaware",
        "m/s",
        "lower",
        "The robot's highest speed at a contact with such a person, by any cause.",
    ),
    Metric(
        "robot_contacts",
        "Contacts by the robot",
        "",
        "lower",
        "Contacts of a robot that moved into a person.",
        decimals=3,
    ),
    Metric(
        "person_contacts",
        "Contacts by people",
        "",
        "lower",
        "Contacts of people who walked into the robot.",
        decimals=3,
    ),
    Metric(
        "contact_speed_mps",
        "Speed at contact",
        "m/s",
        "lower",
        "The robot's highest speed at a contact that it caused.",
    ),
    Metric(
        "human_delay_s",
        "Delay of people",
        "s",
        "lower",
        "Time that people took over their free walks, all people of an episode together.",
    ),
    Metric(
        "human_detour_m",
        "Detour of people",
        "m",
        "lower",
        "Way that people walked over their free ways, all people of an episode together.",
    ),
    Metric(
        "warnings",
        "Warnings",
        "",
        "neither",
        "Warnings of a collision that the robot asked for.",
    ),
    Metric(
        "requests",
        "Requests for attention",
        "",
        "lower",
        "How often an episode's robot asked somebody to look at it.",
    ),
    Metric(
        "requests_answered",
        "Requests answered",
        "",
        "higher",
        "Requests whose person began to look at the robot within 2.5 s.",
    ),
    Metric(
        "requests_needless",
        "Needless requests",
        "",
        "lower",
        "Requests to somebody who, a second later, neither set the speed limit nor had looked.",
    ),
    Metric(
        "asked_twice",
        "People asked twice",
        "",
        "lower",
        "People of an episode who were asked more than once.",
    ),
    Metric(
        "requests_after_answer",
        "Requests after an answer",
        "",
        "lower",
        "Requests to a track that had answered before; there should be none.",
    ),
    Metric(
        "awareness_error",
        "Error of α",
        "",
        "lower",
        "Mean |α of the track − true α| over the people tracked.",
        decimals=3,
    ),
    Metric(
        "attentive_share",
        "Least attentive person",
        "",
        "neither",
        "Smallest share of the time for which one of the people had a true α ≥ 0.5, while the "
        "robot was in front of them, in sight and within 5 m.",
    ),
)
