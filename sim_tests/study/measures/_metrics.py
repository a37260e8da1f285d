"""The measures of an episode: each is one decorated function of the episode's log.

A new measure is one function here: its name is the column of ``episodes.csv``, the end of the name
its unit, its docstring its definition, and the order of the functions that of the columns. Tables,
files, statistics, the report and the reference page of the documentation read the registry.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ...conditions import Conditions
from . import _awareness, _conflict, _driving, _registry
from ._awareness import Awareness
from ._registry import Better, Column, Kind, Metric

if TYPE_CHECKING:
    from ...crossing import CrossingResult
    from ._step_out import StepOutImpacts

#: Far edges of the intimate and the personal zone (E. T. Hall, The Hidden Dimension, 1966).
INTIMATE_M: Final = 0.45
PERSONAL_M: Final = 1.2
#: A control cycle in real time that begins later than this is late.
LATE_S: Final = 0.01
#: The columns of ``episodes.csv`` by name, in their order.
COLUMNS: Final[dict[str, Column]] = {}
#: The measures, which are averaged over episodes, by name.
METRICS: Final[dict[str, Metric]] = {}

_Measure = Callable[["CrossingResult"], Any]


def column(function: _Measure) -> _Measure:
    """Make a function of the log a column that is no number to average."""
    name = function.__name__
    kind = _registry.KINDS[function.__annotations__["return"]]
    meaning = " ".join((inspect.getdoc(function) or "").split())
    COLUMNS[name] = Column(name, kind, meaning, function, _registry.DEFAULTS[kind])
    return function


def measure_of_log(
    title: str, *, better: Better = "lower", decimals: int = 2
) -> Callable[[_Measure], _Measure]:
    """Make a function of the log a measure; :class:`Metric` describes the arguments."""

    def register(function: _Measure) -> _Measure:
        name = function.__name__
        meaning = COLUMNS[column(function).__name__].meaning
        unit = _registry.UNITS.get(name.rpartition("_")[2], "")
        METRICS[name] = Metric(name, title, unit, better, meaning, decimals)
        return function

    return register


def condition(name: str, kind: Kind, meaning: str, default: Any = None) -> None:
    """Add a column that says under which conditions the episode ran; without a default required."""
    COLUMNS[name] = Column(name, kind, meaning, None, default, default is None and kind != "number")


def _conditions(*, required: bool) -> None:
    """Add the columns of the conditions: those that every table has, or those that may be empty."""
    for axis in fields(Conditions):
        if (axis.default is MISSING) == required:
            kind = _registry.KINDS[str(axis.type)]
            condition(axis.name, kind, axis.metadata["meaning"], None if required else axis.default)


_conditions(required=True)


@column
def success(log: CrossingResult) -> bool:
    """The goal was reached, and the robot ran into nobody, no rack and no wall."""
    return log.success


@column
def contact(log: CrossingResult) -> bool:
    """The robot, moving or not, and a person touched."""
    return log.contact


@column
def contact_by(log: CrossingResult) -> str:
    """``"robot"`` if its touching point moved into a person, else ``"person"``, or empty."""
    return log.contact_by


@measure_of_log("Smallest separation", better="higher")
def min_separation_m(log: CrossingResult) -> float | None:
    """Smallest distance between the surfaces of robot and person.

    It is a lower bound where the centres are more than 4 m apart.
    """
    return 0.0 if log.contacts else float(log.nearest_m.min())


@measure_of_log("Time to goal")
def time_to_goal_s(log: CrossingResult) -> float | None:
    """Time until the goal was reached."""
    return log.time_to_goal_s


@measure_of_log("Highest speed within 2 m")
def max_speed_within_2m_mps(log: CrossingResult) -> float | None:
    """The robot's highest speed, at its point nearest to a person whose surface is within 2 m."""
    return log.max_speed_within_2m_mps if log.anybody else None


@measure_of_log("Smallest margin", better="higher")
def min_margin_m(log: CrossingResult) -> float:
    """Smallest separation margin S − S_p at a moving robot.

    It is the surface distance less the protective separation of ISO 13855 and ISO/TS 15066.
    """
    return log.min_margin_m


@measure_of_log("Margin violated", decimals=3)
def violation_time_s(log: CrossingResult) -> float:
    """Seconds an episode with the separation margin S − S_p to anybody below 0, robot moving."""
    return log.violation_time_s


@column
def contacts(log: CrossingResult) -> int:
    """Number of contacts."""
    return len(log.contacts)


@column
def duration_s(log: CrossingResult) -> float:
    """Simulated time."""
    return log.duration_s


condition("scenario_version", "count", "Version of the scenario.", 1)
condition(
    "attention",
    "text",
    'The scenario\'s ``attention``: ``"attentive"``, ``"unaware"`` or ``"mixed"``.',
    "mixed",
)
_conditions(required=False)


@column
def time_without_people_s(log: CrossingResult) -> float | None:
    """Time to goal of the same task in the empty hall."""
    return log.time_without_people_s


@measure_of_log("Time lost to people")
def time_lost_s(log: CrossingResult) -> float | None:
    """Time over that of the same task in the empty hall.

    An episode that never arrives lost all its time.
    """
    if log.time_without_people_s is None:
        return None
    reached_s = log.time_to_goal_s
    return log.duration_s if reached_s is None else reached_s - log.time_without_people_s


@measure_of_log("Path length")
def path_length_m(log: CrossingResult) -> float:
    """Length of the path that the robot drove."""
    return _driving.path_length_m(log.robot_odom_m)


@measure_of_log("Success weighted by path length", better="higher", decimals=3)
def spl(log: CrossingResult) -> float | None:
    """1 for every goal reached on the shortest way (Anderson et al. 2018)."""
    return _driving.success_weighted(
        log.success, _driving.path_length_m(log.robot_odom_m), log.length_without_people_m
    )


@measure_of_log("Speed when nearest")
def speed_at_min_separation_mps(log: CrossingResult) -> float | None:
    """Speed of the robot's nearest point to a person at the instant of smallest separation."""
    fastest = _driving.fastest_mps(log.contacts)
    if fastest is not None or not log.anybody:
        return fastest
    return float(log.nearest_point_mps.flat[int(np.argmin(log.separation_m))])


@measure_of_log("Smallest time to collision", better="higher")
def min_time_to_collision_s(log: CrossingResult) -> float | None:
    """Time until robot and person would touch if both went straight on, at its smallest."""
    return _conflict.min_time_to_collision_s(log)


@measure_of_log("Post-encroachment time", better="higher")
def post_encroachment_s(log: CrossingResult) -> float | None:
    """Smallest time between one leaving a place and the other entering it."""
    return _conflict.post_encroachment_s(log)


@measure_of_log("Time within 0.45 m")
def intimate_s(log: CrossingResult) -> float:
    """Seconds an episode with a person's surface in the intimate zone."""
    return log.time_with(log.nearest_m < INTIMATE_M)


@measure_of_log("Time within 1.2 m")
def personal_s(log: CrossingResult) -> float:
    """Seconds an episode with a person's surface in the personal zone."""
    return log.time_with(log.nearest_m < PERSONAL_M)


@measure_of_log("Contacts by the robot", decimals=3)
def robot_contacts(log: CrossingResult) -> int:
    """Contacts of a robot whose touching point moved into a person."""
    return len(log.contacts_by_robot)


@measure_of_log("Contacts by people", decimals=3)
def person_contacts(log: CrossingResult) -> int:
    """Contacts of people who walked into the robot."""
    return len(log.contacts) - len(log.contacts_by_robot)


@measure_of_log("Contacts with racks and walls", decimals=3)
def bumps(log: CrossingResult) -> int:
    """Contacts of the robot with racks, walls and props."""
    return log.bumps


@measure_of_log("Speed at contact")
def contact_speed_mps(log: CrossingResult) -> float | None:
    """Highest speed of the robot's touching point at a contact that it caused."""
    return _driving.fastest_mps(log.contacts_by_robot)


@measure_of_log("Peak deceleration")
def peak_deceleration_mps2(log: CrossingResult) -> float | None:
    """The robot's strongest braking."""
    return _driving.peak_deceleration_and_jerk(log.t_s, log.velocity_base_mps)[0]


@measure_of_log("Peak jerk", decimals=1)
def peak_jerk_mps3(log: CrossingResult) -> float | None:
    """The robot's largest jerk."""
    return _driving.peak_deceleration_and_jerk(log.t_s, log.velocity_base_mps)[1]


@measure_of_log("Stops")
def stops(log: CrossingResult) -> int:
    """Number of times that the robot came to a stand before the goal; turning is no standing."""
    arrived = log.time_to_goal_s is not None
    return _driving.count_stops(log.travel_mps, ~log.moves, arrived)


@measure_of_log("Delay of people")
def human_delay_s(log: CrossingResult) -> float | None:
    """Time that people took over their free walks, all people of an episode together.

    Somebody who is still on the way counts with the delay so far.
    """
    # That is the least it can become: a robot that blocks somebody for good must not score better
    # than one that delays them.
    delays = [late for person in log.people if (late := person.delay_s) is not None]
    return sum(delays) if delays else None


@measure_of_log("Detour of people")
def human_detour_m(log: CrossingResult) -> float | None:
    """Way that people walked over their free ways, all people of an episode together.

    Those count who reached the end of their route.
    """
    detours = [
        person.length_m - person.free_length_m
        for person in log.people
        if None not in (person.time_s, person.free_time_s) and person.free_length_m is not None
    ]
    return sum(detours) if detours else None


@measure_of_log("Warnings", better="neither")
def warnings(log: CrossingResult) -> int:
    """Warnings of a collision that the robot asked for."""
    return sum(
        alert.kind != "attention" for frame in log.frames for alert in frame.constraints.alerts
    )


@measure_of_log("Error of α", decimals=3)
def awareness_error(log: CrossingResult) -> float | None:
    """Mean |α of the track − true α| over the people tracked."""
    tracked, _ = _awareness.track_awareness(log)
    known = np.isfinite(tracked)
    return float(np.abs(tracked - log.awareness)[known].mean()) if known.any() else None


@column
def awareness(log: CrossingResult) -> Awareness:
    """Awareness of the person who came nearest, and the robot's judgement of it."""
    nearest = _awareness.nearest_person(log.separation_m)
    if nearest is None:
        return ""
    (row, person), (_, lower) = nearest, _awareness.track_awareness(log)
    return _awareness.awareness_class(log.t_s, log.looking[:, person], lower[:, person], row)


@column
def reaction(log: CrossingResult) -> str:
    """First reaction of that person, see :class:`PersonOutcome`."""
    _, person = _awareness.nearest_person(log.separation_m) or (0, len(log.people))
    return log.people[person].reaction if person < len(log.people) else ""


condition(
    "error",
    "text",
    "The error that ended the episode, empty for none; with an error, every metric keeps its "
    "default.",
    "",
)
condition(
    "nondeterministic",
    "flag",
    "The user's planner gave other commands when it drove the task without people a second time, "
    "with the same seed; the row may differ in another run.",
    False,
)


@measure_of_log("Least attentive person", better="neither")
def attentive_share(log: CrossingResult) -> float | None:
    """Smallest share of the time for which one of the people looked at it, or had within 1 s.

    Counted while the robot was in front of them, in sight and within 5 m.
    """
    return _awareness.MeasuredAttention.of(log).least_aware_share


@measure_of_log("Contacts with a moving robot", decimals=3)
def moving_contacts(log: CrossingResult) -> int:
    """Contacts of a person and a moving robot, by any cause."""
    return len(log.moving_contacts)


@measure_of_log("Speed at contact, any cause")
def moving_contact_mps(log: CrossingResult) -> float | None:
    """Highest speed of the robot's touching point at a contact with a person, by any cause."""
    return _driving.fastest_mps(log.moving_contacts)


def _by_people(
    people: dict[str, tuple[str, str]],
    name: str,
    title: str,
    meaning: str,
    of: Callable[[CrossingResult, str], float | None],
    **shown: Any,
) -> None:
    """Add a measure for each group of people; ``{}`` stands for the group."""
    for group, (group_title, who) in people.items():

        def measure(log: CrossingResult, group: str = group) -> float | None:
            return of(log, group)

        measure.__name__, measure.__doc__ = name.format(group), meaning.format(who)
        measure_of_log(f"{title}, {group_title}", **shown)(measure)


def _step_out(people: dict[str, tuple[str, str]], name: str, starts: str = "") -> None:
    """Add the step-out impacts with groups of people, and the worst one with each."""
    _by_people(
        people,
        name,
        f"Step-out impacts{starts}",
        f"Expected impacts{starts} per 1 000 crossings with people {{}}. They set off at any time "
        "and ignore the robot. An index, not a rate of accidents.",
        lambda log, group: _impacts(log, starts)[group].impacts,
    )
    _by_people(
        people,
        f"{name}_worst_mps",
        f"Worst step-out impact{starts}",
        f"The robot's highest closing speed in a step-out impact{starts} with people {{}}.",
        lambda log, group: _impacts(log, starts)[group].worst_mps,
    )


def _impacts(log: CrossingResult, starts: str = "") -> Mapping[str, StepOutImpacts]:
    """Return the step-out impacts of people who start as recorded, or faster."""
    from . import _step_out as model  # noqa: PLC0415 - needs the simulator

    return model.step_out_impacts(log, model.FASTER_STEP_OUT if starts else model.STEP_OUT)


_step_out(_registry.STEP_OUT_PEOPLE, "step_out_{}")
_by_people(
    _registry.STEP_OUT_PEOPLE,
    "step_out_{}_fast",
    "Step-out impacts above 0.25 m/s",
    "The step-out impacts with people {} in which the robot closes at over 0.25 m/s.",
    lambda log, group: _impacts(log)[group].fast,
)
_step_out(_registry.EVERYBODY, "step_out_stress_{}", " of faster starts")


@measure_of_log("Step-out impacts, not looking")
def step_out_not_looking(log: CrossingResult) -> float:
    """Step-out impacts with people who have never looked, or more than 1 s ago."""
    return _impacts(log)["never"].impacts + _impacts(log)["past"].impacts


_by_people(
    _registry.CONTACT_PEOPLE,
    "moving_contacts_{}",
    "Contacts with a moving robot",
    "Contacts of a moving robot and people {}.",
    # A float, as earlier rows have none.
    lambda log, group: float(len(_awareness.moving_contacts_of(log, group))),
)
_by_people(
    _registry.CONTACT_PEOPLE,
    "moving_contact_{}_mps",
    "Speed at contact",
    "The robot's highest speed at such a contact with people {}, by any cause.",
    lambda log, group: _driving.fastest_mps(_awareness.moving_contacts_of(log, group)),
)


@measure_of_log("Speed that could have stopped", better="neither")
def moving_contact_stoppable_mps(log: CrossingResult) -> float | None:
    """Highest speed from which a robot could have stood before such a contact, by any cause.

    It brakes once the motion that led to the contact could be seen; below 0.25, it is inevitable.
    """
    from ._inevitable import stoppable_mps  # noqa: PLC0415 - needs the simulator

    return max((stoppable_mps(log, each) for each in log.moving_contacts), default=None)


_by_people(
    _registry.NOTICED,
    "min_margin_{}_m",
    "Smallest margin",
    "Smallest separation margin at a moving robot to people {}.",
    _awareness.min_margin_of,
    better="higher",
)


@measure_of_log("Requests for attention")
def requests(log: CrossingResult) -> int:
    """Number of times that an episode's robot asked somebody to look at it."""
    return _awareness.requests_of(log).requests


@measure_of_log("Requests answered", better="higher")
def requests_answered(log: CrossingResult) -> int:
    """Requests whose person began to look at the robot within 2.5 s."""
    return _awareness.requests_of(log).answered


@measure_of_log("Needless requests")
def requests_needless(log: CrossingResult) -> int:
    """Requests to somebody who, a second later, neither set the speed limit nor had looked."""
    return _awareness.requests_of(log).needless


@measure_of_log("People asked twice")
def asked_twice(log: CrossingResult) -> int:
    """People of an episode who were asked more than once."""
    return _awareness.requests_of(log).asked_twice


@measure_of_log("Requests after an answer")
def requests_after_answer(log: CrossingResult) -> int:
    """Requests to a track that had answered before; there should be none."""
    return _awareness.requests_of(log).after_answer


@column
def late_share(log: CrossingResult) -> float | None:
    """Share of control cycles that began over 10 ms late, with a stack outside in real time."""
    late_s = _driving.late_s(log.frames)
    return sum(each > LATE_S for each in late_s) / len(late_s) if late_s else None


@column
def late_worst_s(log: CrossingResult) -> float | None:
    """The latest beginning of a control cycle, with a stack outside in real time."""
    return max(_driving.late_s(log.frames), default=None)
