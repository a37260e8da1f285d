"""The record of a crossing: every metric of docs/simulation.md."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from perception.arrays import FloatArray

from ...crossing import STANDING_SPEED_MPS
from ._awareness import (
    MeasuredAttention,
    awareness_class,
    awareness_error,
    nearest_person,
    track_awareness,
)
from ._conflict import Outline, min_time_to_collision_s, post_encroachment_s
from ._driving import (
    count_stops,
    path_length_m,
    peak_deceleration_and_jerk,
    success_weighted,
)
from ._record import Awareness, EpisodeRecord
from ._record_file import rounded
from ._requests import Requests
from ._step_out import FASTER_STEP_OUT, is_unaware, since_look_of, step_out_impacts
from ._trace import Trace

if TYPE_CHECKING:
    from ...actors.behaviour import PersonOutcome
    from ...crossing import ContactEvent, CrossingResult

#: Far edges of the intimate and the personal zone (E. T. Hall, The Hidden Dimension, 1966).
INTIMATE_M: Final = 0.45
PERSONAL_M: Final = 1.2


def measure(
    result: CrossingResult,
    *,
    time_without_people_s: float | None = None,
    length_without_people_m: float | None = None,
    scenario_version: int = 1,
    attention: str = "mixed",
    fault: str = "",
) -> EpisodeRecord:
    """Return all metrics of a crossing, as docs/simulation.md defines them.

    Numbers are rounded to the six decimals that files keep, so that a record read from a file is
    equal.

    Args:
        result: the crossing.
        time_without_people_s: time to goal of the same task without people; None if that run did
            not reach the goal or was not made.
        length_without_people_m: driven length of the same task without people.
        scenario_version: version of the scenario.
        attention: the scenario's ``attention``.
        fault: name of the fault, empty for none.

    Raises:
        SimError: a result without frames, or with frames that do not hold all people.
    """
    trace = Trace.of(result)
    outline = Outline(result.robot.footprint_m)
    nearest_m = trace.separation_m.min(axis=1, initial=np.inf)
    path_m = path_length_m(trace.robot_odom_m)
    deceleration, jerk = peak_deceleration_and_jerk(trace.t_s, trace.velocity_base_mps)
    delay_s, detour_m = human_cost(result.people)
    awareness, reaction, error = _awareness_of_nearest(result, trace)
    by_robot = [contact for contact in result.contacts if contact.by == "robot"]
    moving = [each for each in result.contacts if each.robot_speed_mps > STANDING_SPEED_MPS]
    unaware = _with_unaware(moving, trace)
    step_out = step_out_impacts(result)
    stress = step_out_impacts(result, FASTER_STEP_OUT)
    requests = Requests.of(result, trace)
    separation_m, speed_then = _smallest_separation(result, trace, nearest_m)
    return _rounded(
        EpisodeRecord(
            scenario=result.scenario,
            seed=result.seed,
            policy=result.policy,
            planner=result.planner,
            perception=result.perception,
            success=result.success,
            contact=result.contact,
            contact_by=result.contact_by,
            min_separation_m=separation_m,
            time_to_goal_s=result.time_to_goal_s,
            max_speed_within_2m_mps=result.max_speed_within_2m_mps if trace.people else None,
            min_margin_m=result.min_margin_m,
            violation_time_s=result.violation_time_s,
            contacts=len(result.contacts),
            duration_s=result.duration_s,
            scenario_version=scenario_version,
            attention=attention,
            fault=fault,
            time_without_people_s=time_without_people_s,
            time_lost_s=time_lost_s(
                result.time_to_goal_s, result.duration_s, time_without_people_s
            ),
            path_length_m=path_m,
            spl=success_weighted(result.success, path_m, length_without_people_m),
            speed_at_min_separation_mps=speed_then,
            min_time_to_collision_s=min_time_to_collision_s(trace, outline),
            post_encroachment_s=post_encroachment_s(trace, outline),
            intimate_s=trace.time_with(nearest_m < INTIMATE_M),
            personal_s=trace.time_with(nearest_m < PERSONAL_M),
            robot_contacts=len(by_robot),
            person_contacts=len(result.contacts) - len(by_robot),
            contact_speed_mps=max((c.robot_speed_mps for c in by_robot), default=None),
            peak_deceleration_mps2=deceleration,
            peak_jerk_mps3=jerk,
            stops=count_stops(
                trace.travel_mps, result.time_to_goal_s is not None, STANDING_SPEED_MPS
            ),
            human_delay_s=delay_s,
            human_detour_m=detour_m,
            warnings=sum(
                alert.kind != "attention"
                for frame in result.frames
                for alert in frame.constraints.alerts
            ),
            awareness_error=error,
            awareness=awareness,
            reaction=reaction,
            attentive_share=MeasuredAttention.of(trace).least_aware_share,
            moving_contacts=len(moving),
            moving_contact_mps=max((each.robot_speed_mps for each in moving), default=None),
            min_margin_unaware_m=_least_margin_to_unaware(result, trace),
            moving_contacts_unaware=len(unaware),
            moving_contact_unaware_mps=max((c.robot_speed_mps for c in unaware), default=None),
            step_out_unaware=step_out.unaware,
            step_out_unaware_fast=step_out.unaware_fast,
            step_out_aware=step_out.aware,
            step_out_aware_fast=step_out.aware_fast,
            step_out_worst_mps=step_out.worst_mps,
            step_out_stress_unaware=stress.unaware,
            step_out_stress_worst_mps=stress.worst_mps,
            requests=requests.requests,
            requests_answered=requests.answered,
            requests_needless=requests.needless,
            asked_twice=requests.asked_twice,
            requests_after_answer=requests.after_answer,
        )
    )


def time_lost_s(
    time_to_goal_s: float | None, duration_s: float, time_without_people_s: float | None
) -> float | None:
    """Return the time over that of the same task without people.

    An episode that does not reach its goal loses all of its duration. None where the time without
    people is not known.
    """
    if time_without_people_s is None:
        return None
    return duration_s if time_to_goal_s is None else time_to_goal_s - time_without_people_s


def human_cost(people: Iterable[PersonOutcome]) -> tuple[float | None, float | None]:
    """Return the summed delay (s) and detour (m) of people over their free walks.

    Somebody who is still on the way counts with the delay so far, which is the least it can become:
    a robot that blocks somebody for good must not score better than one that delays them. The
    detour is that of people who reached the end of their route. Each is None when nobody counts.
    """
    delays, detours = [], []
    for person in people:
        if person.time_s is not None and person.free_time_s is not None:
            delays.append(person.time_s - person.free_time_s)
            if person.free_length_m is not None:
                detours.append(person.length_m - person.free_length_m)
        elif person.late_s is not None:
            delays.append(person.late_s)
    return sum(delays) if delays else None, sum(detours) if detours else None


def _with_unaware(contacts: Sequence[ContactEvent], trace: Trace) -> list[ContactEvent]:
    """Return the contacts with people who had not looked at the robot for 1 s, or never."""
    unaware = is_unaware(since_look_of(trace))
    return [
        each
        for each in contacts
        if unaware[max(int(np.searchsorted(trace.t_s, each.t_s, "right")) - 1, 0), each.worker]
    ]


def _least_margin_to_unaware(result: CrossingResult, trace: Trace) -> float | None:
    """Return the smallest margin of the frames at a moving robot to people who had not looked."""
    margins_m = np.array([frame.margins_m for frame in result.frames], dtype=np.float64)
    counts = is_unaware(since_look_of(trace))
    counts = counts & (trace.travel_mps > STANDING_SPEED_MPS)[:, None]
    return float(margins_m.reshape(counts.shape)[counts].min()) if counts.any() else None


def _smallest_separation(
    result: CrossingResult, trace: Trace, nearest_m: FloatArray
) -> tuple[float | None, float | None]:
    """Return the smallest separation and the robot's speed then; a contact is a separation of 0."""
    if not trace.people:
        return None, None
    if result.contacts:
        return 0.0, max(contact.robot_speed_mps for contact in result.contacts)
    row = int(np.argmin(nearest_m))
    return float(nearest_m[row]), float(trace.travel_mps[row])


def _awareness_of_nearest(
    result: CrossingResult, trace: Trace
) -> tuple[Awareness, str, float | None]:
    """Return awareness class and reaction of the nearest person, and the error of α over all."""
    mean, lower = track_awareness(result, trace)
    error = awareness_error(trace.awareness, mean)
    closest = nearest_person(trace.separation_m)
    if closest is None:
        return "", "", error
    row, person = closest
    awareness = awareness_class(trace.t_s, trace.awareness[:, person], lower[:, person], row)
    reaction = result.people[person].reaction if person < len(result.people) else ""
    return awareness, reaction, error


def _rounded(record: EpisodeRecord) -> EpisodeRecord:
    """Return the record with its numbers rounded as files keep them."""
    numbers = {
        field.name: rounded(getattr(record, field.name))
        for field in fields(record)
        if field.type == "float | None"
    }
    return replace(record, **numbers)  # type: ignore[arg-type]
