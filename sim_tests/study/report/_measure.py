"""The measures that the page compares: what each is called and which way is better."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Measure:
    """A measure of an episode.

    Attributes:
        key: column of ``episodes.csv``.
        title: as a heading.
        unit: after numbers.
        better: ``"less"`` or ``"more"``; empty where neither is good in itself.
        meaning: one sentence.
        decimals: of numbers.
        share: true for a share, shown in per cent.
        from_zero: its axis holds 0.
    """

    key: str
    title: str
    unit: str
    better: str
    meaning: str
    decimals: int = 2
    share: bool = False
    from_zero: bool = True


ROBOT_CONTACTS: Final = Measure(
    "robot_contacts",
    "Contacts caused by the robot",
    "%",
    "less",
    "Share of episodes in which the robot moved into a person.",
    share=True,
)
PERSON_CONTACTS: Final = Measure(
    "person_contacts",
    "People who walked into the robot",
    "%",
    "less",
    "Share of episodes in which a person walked into the robot.",
    share=True,
)
SUCCESS: Final = Measure(
    "success",
    "Arrived, touching nobody",
    "%",
    "more",
    "Share of episodes in which the goal was reached and the robot moved into nobody; one that "
    "failed counts as not reached.",
    share=True,
    from_zero=False,
)
TIME_LOST: Final = Measure(
    "time_lost_s",
    "Time lost to people",
    "s",
    "less",
    "Time over that of the same task in the empty hall; one that never arrives lost all its time.",
)
VIOLATION: Final = Measure(
    "violation_time_s",
    "Margin violated",
    "s",
    "less",
    "Seconds an episode with the separation margin S − S_p below 0 at a moving robot.",
    decimals=3,
)
MARGIN: Final = Measure(
    "min_margin_m",
    "Smallest margin",
    "m",
    "more",
    "Smallest separation margin S − S_p at a moving robot: surface distance less the protective "
    "separation of ISO 13855 and ISO/TS 15066.",
)
SEPARATION: Final = Measure(
    "min_separation_m",
    "Smallest separation",
    "m",
    "",
    "Smallest distance between the surfaces of robot and person.",
)
SPEED_NEAREST: Final = Measure(
    "speed_at_min_separation_mps",
    "Speed when nearest",
    "m/s",
    "less",
    "The robot's speed at the instant of smallest separation.",
)

#: Shown first, and on demand.
MAIN: Final = (ROBOT_CONTACTS, TIME_LOST, VIOLATION, SUCCESS, MARGIN, SPEED_NEAREST)
FURTHER: Final = (
    PERSON_CONTACTS,
    SEPARATION,
    Measure(
        "min_time_to_collision_s",
        "Smallest time to collision",
        "s",
        "more",
        "Time until robot and person would touch if both went straight on, at its smallest.",
    ),
    Measure(
        "post_encroachment_s",
        "Post-encroachment time",
        "s",
        "more",
        "Smallest time between one leaving a place and the other entering it.",
    ),
    Measure(
        "personal_s",
        "Time within 1.2 m",
        "s",
        "less",
        "Seconds an episode with a person's surface in the personal zone.",
    ),
    Measure(
        "intimate_s",
        "Time within 0.45 m",
        "s",
        "less",
        "Seconds an episode with a person's surface in the intimate zone.",
    ),
    Measure(
        "human_delay_s",
        "Delay of people",
        "s",
        "less",
        "Time that people took over their free walks, all people of an episode together.",
    ),
    Measure(
        "human_detour_m",
        "Detour of people",
        "m",
        "less",
        "Way that people walked over their free ways, all people of an episode together.",
    ),
    Measure("stops", "Stops", "", "less", "How often the robot came to a stand before the goal."),
    Measure(
        "peak_deceleration_mps2",
        "Peak deceleration",
        "m/s²",
        "less",
        "The robot's strongest braking.",
    ),
    Measure("peak_jerk_mps3", "Peak jerk", "m/s³", "less", "The robot's largest jerk.", decimals=1),
    Measure(
        "spl",
        "Success weighted by path length",
        "",
        "more",
        "1 for every goal reached on the shortest way (Anderson et al. 2018).",
        decimals=3,
    ),
    Measure(
        "awareness_error",
        "Error of α",
        "",
        "less",
        "Mean |α of the track − true α| over the people tracked.",
        decimals=3,
    ),
    Measure("warnings", "Warnings", "", "", "Alerts that the robot asked for."),
)
