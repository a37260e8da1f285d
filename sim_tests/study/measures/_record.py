"""The measures of an episode: the columns of ``episodes.csv``, each defined where it stands.

A measure is a field here with its title, its better direction and its definition, and a function
that :func:`~sim_tests.study.measures.measure` calls. Tables, files, statistics and the reference
page of the documentation read it from here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, Final, Literal

from ...conditions import AXES, Conditions

#: Awareness of the person who came nearest, before the encounter, and the robot's error about it if
#: there is one; empty if nobody came near.
Awareness = Literal["", "aware", "unaware", "falsely_aware", "missed_aware"]

# That of sim_tests.crossing, whose import needs the simulator.
_STANDING_SPEED_MPS: Final = 0.03
# Units by the end of a name.
_UNITS: Final = {"s": "s", "m": "m", "mps": "m/s", "mps2": "m/s²", "mps3": "m/s³"}


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
    """

    name: str
    title: str
    unit: str
    better: Literal["lower", "higher", "neither"]
    meaning: str
    decimals: int = 2
    share: bool = False


def _column(meaning: str, default: Any) -> Any:
    """Return a field of a record that is a column, but no measure."""
    return field(default=default, metadata={"meaning": meaning})


def _measure(
    title: str,
    meaning: str,
    *,
    better: Literal["lower", "higher", "neither"] = "lower",
    default: int | None = None,
    decimals: int = 2,
) -> Any:
    """Return a field of a record that is a measure; :class:`Metric` describes the arguments.

    Its unit is the end of its name. Without an episode to which it applies, it has the default.
    """
    about = {
        "title": title,
        "meaning": meaning,
        "better": better,
        "decimals": decimals,
    }
    return field(default=default, metadata=about)


@dataclass(frozen=True, slots=True, repr=False)
class EpisodeRecord(Conditions):
    """The conditions and the measures of one episode, as docs/simulation.md defines them.

    None means that a measure does not apply to the episode. With an ``error``, every measure keeps
    its default. :data:`COLUMNS` has the meaning of each field.
    """

    success: bool = _column(
        "The goal was reached and the robot touched nobody by its own motion.", False
    )
    contact: bool = _column("The robot, moving or not, and a person touched.", False)
    contact_by: str = _column(
        '``"robot"`` if the robot moved into a person, else ``"person"``, or empty.', ""
    )
    min_separation_m: float | None = _measure(
        "Smallest separation",
        "Smallest distance between the surfaces of robot and person.",
        better="higher",
    )
    time_to_goal_s: float | None = _measure("Time to goal", "Time until the goal was reached.")
    max_speed_within_2m_mps: float | None = _measure(
        "Highest speed within 2 m", "The robot's highest speed with a person's surface within 2 m."
    )
    min_margin_m: float | None = _measure(
        "Smallest margin",
        "Smallest separation margin S − S_p at a moving robot: surface distance less the "
        "protective separation of ISO 13855 and ISO/TS 15066.",
        better="higher",
    )
    violation_time_s: float | None = _measure(
        "Margin violated",
        "Seconds an episode with the separation margin S − S_p below 0 at a moving robot.",
        decimals=3,
    )
    contacts: int = _column("Number of contacts.", 0)
    duration_s: float | None = _column("Simulated time.", None)
    scenario_version: int = _column("Version of the scenario.", 1)
    attention: str = _column(
        'The scenario\'s ``attention``: ``"attentive"``, ``"unaware"`` or ``"mixed"``.', "mixed"
    )
    time_without_people_s: float | None = _column(
        "Time to goal of the same task in the empty hall.", None
    )
    time_lost_s: float | None = _measure(
        "Time lost to people",
        "Time over that of the same task in the empty hall; one that never arrives lost all "
        "its time.",
    )
    path_length_m: float | None = _measure(
        "Path length", "Length of the path that the robot drove."
    )
    spl: float | None = _measure(
        "Success weighted by path length",
        "1 for every goal reached on the shortest way (Anderson et al. 2018).",
        better="higher",
        decimals=3,
    )
    speed_at_min_separation_mps: float | None = _measure(
        "Speed when nearest", "The robot's speed at the instant of smallest separation."
    )
    min_time_to_collision_s: float | None = _measure(
        "Smallest time to collision",
        "Time until robot and person would touch if both went straight on, at its smallest.",
        better="higher",
    )
    post_encroachment_s: float | None = _measure(
        "Post-encroachment time",
        "Smallest time between one leaving a place and the other entering it.",
        better="higher",
    )
    intimate_s: float | None = _measure(
        "Time within 0.45 m", "Seconds an episode with a person's surface in the intimate zone."
    )
    personal_s: float | None = _measure(
        "Time within 1.2 m", "Seconds an episode with a person's surface in the personal zone."
    )
    robot_contacts: int = _measure(
        "Contacts by the robot",
        "Contacts of a robot that moved into a person.",
        default=0,
        decimals=3,
    )
    person_contacts: int = _measure(
        "Contacts by people", "Contacts of people who walked into the robot.", default=0, decimals=3
    )
    contact_speed_mps: float | None = _measure(
        "Speed at contact", "The robot's highest speed at a contact that it caused."
    )
    peak_deceleration_mps2: float | None = _measure(
        "Peak deceleration", "The robot's strongest braking."
    )
    peak_jerk_mps3: float | None = _measure("Peak jerk", "The robot's largest jerk.", decimals=1)
    stops: int = _measure(
        "Stops", "How often the robot came to a stand before the goal.", default=0
    )
    human_delay_s: float | None = _measure(
        "Delay of people",
        "Time that people took over their free walks, all people of an episode together.",
    )
    human_detour_m: float | None = _measure(
        "Detour of people",
        "Way that people walked over their free ways, all people of an episode together.",
    )
    warnings: int = _measure(
        "Warnings", "Warnings of a collision that the robot asked for.", better="neither", default=0
    )
    awareness_error: float | None = _measure(
        "Error of α", "Mean |α of the track − true α| over the people tracked.", decimals=3
    )
    awareness: Awareness = _column(  # noqa: RUF009 - a field, as the others
        "Awareness of the person who came nearest, and the robot's judgement of it.", ""
    )
    reaction: str = _column("Reaction of that person, see :class:`PersonOutcome`.", "")
    error: str = _column(
        "The error that ended the episode, empty for none; with an error, every metric keeps "
        "its default.",
        "",
    )
    nondeterministic: bool = _column(
        "The user's planner gave other commands when it drove the task without people a "
        "second time, with the same seed; the row may differ in another run.",
        False,
    )
    attentive_share: float | None = _measure(
        "Least attentive person",
        "Smallest share of the time for which one of the people had a true α ≥ 0.5, while the"
        " robot was in front of them, in sight and within 5 m.",
        better="neither",
    )
    moving_contacts: int = _measure(
        "Contacts with a moving robot",
        "Contacts of a person and a moving robot, by any cause.",
        default=0,
        decimals=3,
    )
    moving_contact_mps: float | None = _measure(
        "Speed at contact, any cause",
        "The robot's highest speed at a contact with a person, by any cause.",
    )
    step_out_unaware: float | None = _measure(
        "Step-out impacts, unaware",
        "Expected impacts per 1 000 crossings with people who have not looked for 1 s or "
        "never, set off at any time and ignore the robot. An index, not a rate of accidents.",
    )
    step_out_unaware_fast: float | None = _measure(
        "Step-out impacts above 0.25 m/s, unaware",
        "Those step-out impacts with unaware people in which the robot closes at more than "
        "0.25 m/s.",
    )
    step_out_aware: float | None = _measure(
        "Step-out impacts, aware",
        "Expected impacts per 1 000 crossings with people who have looked within 1 s, if "
        "every one who sets off ignores the robot. Few do: an upper bound.",
    )
    step_out_aware_fast: float | None = _measure(
        "Step-out impacts above 0.25 m/s, aware",
        "Those step-out impacts with aware people in which the robot closes at more than 0.25 m/s.",
    )
    step_out_worst_mps: float | None = _measure(
        "Worst step-out impact, unaware",
        "The robot's highest closing speed in a step-out impact with an unaware person.",
    )
    step_out_stress_unaware: float | None = _measure(
        "Step-out impacts of faster starts, unaware",
        "Step-out impacts with unaware people who start faster than recorded: to 1.6 m/s with"
        " a time constant of 0.35 s.",
    )
    step_out_stress_worst_mps: float | None = _measure(
        "Worst step-out impact of faster starts, unaware",
        "The robot's highest closing speed in a step-out impact with an unaware person who "
        "starts faster than recorded.",
    )
    moving_contacts_unaware: int = _measure(
        "Contacts with a moving robot, unaware",
        "Contacts of a moving robot and a person who has not looked for 1 s, or never.",
        default=0,
        decimals=3,
    )
    moving_contact_unaware_mps: float | None = _measure(
        "Speed at contact, unaware",
        "The robot's highest speed at a contact with such a person, by any cause.",
    )
    min_margin_unaware_m: float | None = _measure(
        "Smallest margin, unaware",
        "Smallest separation margin at a moving robot to people who have not looked for 1 s, "
        "or never.",
        better="higher",
    )
    requests: int = _measure(
        "Requests for attention",
        "How often an episode's robot asked somebody to look at it.",
        default=0,
    )
    requests_answered: int = _measure(
        "Requests answered",
        "Requests whose person began to look at the robot within 2.5 s.",
        better="higher",
        default=0,
    )
    requests_needless: int = _measure(
        "Needless requests",
        "Requests to somebody who, a second later, neither set the speed limit nor had looked.",
        default=0,
    )
    asked_twice: int = _measure(
        "People asked twice", "People of an episode who were asked more than once.", default=0
    )
    requests_after_answer: int = _measure(
        "Requests after an answer",
        "Requests to a track that had answered before; there should be none.",
        default=0,
    )

    def __repr__(self) -> str:
        """Return the fields that do not have their default."""
        cells = (
            f"{field.name}={getattr(self, field.name)!r}"
            for field in fields(self)
            if getattr(self, field.name) != field.default
        )
        return f"EpisodeRecord({', '.join(cells)})"

    @property
    def versioned_scenario(self) -> str:
        """The scenario, followed by its version from 2 on."""
        version = "" if self.scenario_version == 1 else f" v{self.scenario_version}"
        return self.scenario + version

    @property
    def moving_touched(self) -> bool:
        """True if a moving robot and a person touched, by any cause.

        Tables of earlier versions tell it by the robot's highest speed at a contact.
        """
        speed_mps = self.speed_at_min_separation_mps or 0.0
        return (
            self.moving_contacts > 0
            or self.robot_touched
            or (self.contact and speed_mps > _STANDING_SPEED_MPS)
        )

    @property
    def robot_touched(self) -> bool:
        """True if the robot moved into a person."""
        return self.robot_contacts > 0 or self.contact_by == "robot"

    @property
    def person_touched(self) -> bool:
        """True if a person walked into the robot."""
        return self.person_contacts > 0 or self.contact_by == "person"


#: The meaning of each column of ``episodes.csv``, in their order; conditions that may be empty
#: come last.
COLUMNS: Final = {
    each.name: str(each.metadata["meaning"])
    for each in sorted(
        fields(EpisodeRecord), key=lambda each: each.name in AXES and each.default == ""
    )
}

#: Numbers that are averaged over episodes.
METRICS: Final = {
    each.name: Metric(
        name=each.name, unit=_UNITS.get(each.name.rpartition("_")[2], ""), **each.metadata
    )
    for each in fields(EpisodeRecord)
    if "title" in each.metadata
}


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


@dataclass(frozen=True, slots=True)
class Ratio:
    """A ratio of two columns of ``episodes.csv``, each summed over the episodes.

    Attributes:
        metric: name, title and direction of the figure.
        column: the column that is summed.
        over: the column whose sum it is divided by; an episode without a number is left out.
        factor: multiplies the ratio.
    """

    metric: Metric
    column: str
    over: str
    factor: float = 1.0


#: Ratios of sums by the name of their figure, as docs/simulation.md defines them.
RATIOS: Final = {
    each.metric.name: each
    for each in (
        Ratio(
            Metric(
                "requests_per_hour",
                "Requests per hour",
                "",
                "lower",
                "Requests for attention, divided by the simulated time.",
                decimals=1,
            ),
            "requests",
            "duration_s",
            3600.0,
        ),
        Ratio(
            Metric(
                "answered_share",
                "Share of requests answered",
                "%",
                "higher",
                "Share of requests whose person began to look at the robot within 2.5 s.",
                share=True,
            ),
            "requests_answered",
            "requests",
        ),
        Ratio(
            Metric(
                "needless_share",
                "Share of needless requests",
                "%",
                "lower",
                "Share of requests to somebody who, a second later, neither set the speed limit "
                "nor had looked.",
                share=True,
            ),
            "requests_needless",
            "requests",
        ),
    )
}
