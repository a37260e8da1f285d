"""The measures that others use: each is one function of an episode's course.

A new measure is one function here; the order of the functions is that of ``social.csv``.
docs/social_measures.md has the definitions and their sources. Robot and people are discs, as in the
programmes that define the measures; where a programme departs from its own text, that page says
which of the two is computed here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ..measures import path_length_m, success_weighted
from ._episode import (
    SocialEpisode,
    SocialWork,
    gym_motion,
    heading_changes_rad,
    people_motion,
    robot_motion,
    speed_changes,
    wrapped,
)

Better = Literal["lower", "higher", "neither"]
Source = Literal["general", "HuNavSim", "SocNavGym", "NavWareSet"]
Measure = Callable[[SocialEpisode], float | None]

#: Hall's zones: from, up to but not including, metres.
ZONES_M: Final = {"intimate": (-np.inf, 0.45), "personal": (0.45, 1.2), "social": (1.2, 3.6)}
#: SocNavGym's and SEAN's personal space, from the robot's surface to a person's centre.
GYM_PERSONAL_SPACE_M: Final = 0.45
#: NavWareSet's personal space, and what its text takes off the distance between the centres.
NAVWARE_PERSONAL_SPACE_M: Final = 0.5
NAVWARE_BODIES_M: Final = 0.4
#: Distance from a person to the centre of the group that the person faces.
GROUP_REACH_M: Final = 1.5


@dataclass(frozen=True, slots=True)
class SocialMeasure:
    """One measure that others use.

    Attributes:
        name: column of ``social.csv``; the unit is at its end.
        published: the name that the source gives it.
        source: the programme or data set that defines it; ``"general"`` for papers.
        better: the better direction.
        value: function of an episode; None where the measure does not apply.
    """

    name: str
    published: str
    source: Source
    better: Better
    value: Measure


#: All measures by their names, in the order of docs/social_measures.md.
SOCIAL_MEASURES: Final[dict[str, SocialMeasure]] = {}


def social_measures(episode: SocialEpisode) -> dict[str, float | None]:
    """Return all measures of an episode by their names; None where one does not apply."""
    return {name: each.value(episode) for name, each in SOCIAL_MEASURES.items()}


def _measure(
    source: Source, published: str, better: Better = "lower", name: str = ""
) -> Callable[[Measure], Measure]:
    """Make a function of an episode a measure, under its own name unless another is given."""

    def register(function: Measure) -> Measure:
        column = name or function.__name__
        SOCIAL_MEASURES[column] = SocialMeasure(column, published, source, better, function)
        return function

    return register


def _figures(source: Source, *figures: tuple[str, str, Better, Measure]) -> None:
    """Add measures that are one expression: column, published name, better direction, value."""
    for name, published, better, value in figures:
        _measure(source, published, better, name)(value)


def _zones(source: Source, name: str, published: str, value: Callable[..., float | None]) -> None:
    """Add a measure for each of Hall's zones; a share nearer than social distance is an intrusion.

    Args:
        source: as for :func:`_measure`.
        name: column, with ``{}`` for the zone.
        published: its name at the source, with ``{}`` for the zone.
        value: function of the episode and the zone.
    """
    for zone in ZONES_M:
        better: Better = "neither" if source == "general" or zone == "social" else "lower"
        _measure(source, published.format(zone), better, name.format(zone))(
            partial(value, zone=zone)
        )


# -- From papers ---------------------------------------------------------------------------------


@_measure("general", "SPL", "higher")
def spl(episode: SocialEpisode) -> float | None:
    """Success weighted by path length."""
    return success_weighted(
        episode.success, path_length_m(episode.robot_m), episode.reference_length_m
    )


@_measure("general", "STL", "higher")
def stl(episode: SocialEpisode) -> float | None:
    """Success weighted by time."""
    return success_weighted(episode.success, episode.time_to_goal_s, episode.reference_time_s)


@_measure("general", "Path Irregularity")
def path_irregularity_rad(episode: SocialEpisode) -> float | None:
    """Rotation of the robot over the least that the straight way to the goal needs.

    None without a known goal. The straight way needs the turn from the first heading to the goal.
    """
    if episode.goal_m is None:
        return None
    towards = episode.goal_m - episode.robot_m[0]
    least = 0.0
    if towards.any():
        turn = math.atan2(towards[1], towards[0]) - float(episode.robot_heading_rad[0])
        least = abs(float(wrapped(np.array(turn))))
    return heading_changes_rad(episode.robot_heading_rad) - least


@_measure("general", "path irregularity")
def path_irregularity_radpm(episode: SocialEpisode) -> float | None:
    """The excess rotation per metre of the driven path; None for a path of length 0."""
    excess, length = path_irregularity_rad(episode), path_length_m(episode.robot_m)
    return None if excess is None or length == 0.0 else excess / length


@_measure("general", "path irregularity")
def mean_goal_angle_rad(episode: SocialEpisode) -> float | None:
    """Mean angle between heading and direction to the goal, over all instants.

    Instants exactly at the goal have no direction and are left out.
    """
    if episode.goal_m is None:
        return None
    towards = episode.goal_m - episode.robot_m
    away = np.hypot(towards[:, 0], towards[:, 1]) > 0.0
    if not away.any():
        return None
    angles = np.arctan2(towards[:, 1], towards[:, 0]) - episode.robot_heading_rad
    return float(np.abs(wrapped(angles[away])).mean())


@_measure("general", "TTC", "higher")
def time_to_collision_s(episode: SocialEpisode) -> float | None:
    """Smallest time to collision of two discs that keep their velocities.

    It is 0 while the discs overlap, and None if no course of theirs ever met.
    """
    offset = episode.people_m - episode.robot_m[:, None, :]
    closing = episode.robot_mps[:, None, :] - episode.people_mps
    reach = episode.robot_radius_m + episode.person_radius_m
    along = (offset * closing).sum(axis=-1)
    speed2 = (closing**2).sum(axis=-1)
    gap2 = (offset**2).sum(axis=-1) - reach**2
    discriminant = along**2 - speed2 * gap2
    with np.errstate(divide="ignore", invalid="ignore"):
        # The smaller root, in the form without cancellation.
        time = gap2 / (along + np.sqrt(np.maximum(discriminant, 0.0)))
    meet = (along > 0.0) & (discriminant > 0.0)
    times = np.where(gap2 < 0.0, 0.0, np.where(meet, time, np.inf))
    return _smallest(np.where(episode.present, times, np.inf))


def _zone_s(episode: SocialEpisode, zone: str) -> float | None:
    """Time with the nearest person's disc in the zone; each instant stands for that to the next."""
    if not episode.people:
        return None
    inside = _in_zone(_nearest(_disc_distance_m(episode)), zone)
    return float(np.diff(episode.t_s) @ inside[:-1].astype(np.float64))


_zones("general", "{}_distance_s", "time in {} distance", _zone_s)


# Over the walks without a robot; means of all people as NavWareSet takes them.
_figures(
    "general",
    ("human_delay_s", "human delay", "lower", lambda e: e.human_delay_s),
    ("people_acceleration_mps2", "Aavg, of people", "lower", lambda e: people_motion(e)[0]),
    ("people_jerk_mps3", "Javg, of people", "lower", lambda e: people_motion(e)[1]),
)


@_measure("general", "cumulative heading changes, of people")
def people_heading_changes_rad(episode: SocialEpisode) -> float | None:
    """Heading changes of all people together; None without people."""
    if not episode.people:
        return None
    return sum(
        heading_changes_rad(episode.people_heading_rad[there, person])
        for person, there in enumerate(episode.present.T)
    )


# -- HuNavSim ------------------------------------------------------------------------------------


# From the first instant to the last; the polygon through the positions.
_figures(
    "HuNavSim",
    ("hunav_time_s", "time_to_reach_goal", "lower", lambda e: float(e.t_s[-1] - e.t_s[0])),
    ("hunav_path_length_m", "path_length", "lower", lambda e: path_length_m(e.robot_m)),
    (
        "hunav_heading_changes_rad",
        "cumulative_heading_changes",
        "lower",
        lambda e: heading_changes_rad(e.robot_heading_rad),
    ),
)


@_measure("HuNavSim", "avg_distance_to_closest_person", "neither")
def hunav_mean_closest_m(episode: SocialEpisode) -> float | None:
    """Average distance to the closest person; None without people.

    An instant without people adds 0 and counts in the average.
    """
    closest = _nearest(_disc_distance_m(episode))
    there = np.isfinite(closest)
    return float(closest[there].sum()) / len(closest) if there.any() else None


@_measure("HuNavSim", "minimum_distance_to_people", "higher")
def hunav_min_distance_m(episode: SocialEpisode) -> float | None:
    """Smallest distance between the discs."""
    return _smallest(_disc_distance_m(episode))


def _zone_percent(episode: SocialEpisode, zone: str) -> float | None:
    """Share of instants with the nearest person's disc in the zone."""
    if not episode.people:
        return None
    return _percent(_in_zone(_nearest(_disc_distance_m(episode)), zone))


def _group_zone_percent(episode: SocialEpisode, zone: str) -> float | None:
    """Share of instants with the centre of a group in the zone, from the robot's disc.

    0 if there is no group, as in HuNavSim; None without people.
    """
    if not episode.people:
        return None
    offsets = _group_centres_m(episode) - episode.robot_m[:, None, :]
    distances = np.hypot(offsets[..., 0], offsets[..., 1]) - episode.robot_radius_m
    return _percent(_in_zone(_nearest(np.where(np.isnan(distances), np.inf, distances)), zone))


_zones("HuNavSim", "hunav_{}_percent", "{}_space_intrusions", _zone_percent)
_zones("HuNavSim", "hunav_group_{}_percent", "group_{}_space_intrusions", _group_zone_percent)


# Mean length of the velocity; Σ Δv/Δt and Σ Δv/Δt² over N − 1 steps, divided by N, signed.
_figures(
    "HuNavSim",
    (
        "hunav_speed_mps",
        "avg_robot_linear_speed",
        "neither",
        lambda e: float(e.robot_speed_mps.mean()),
    ),
    ("hunav_acceleration_mps2", "avg_acceleration", "neither", lambda e: speed_changes(e, 1)),
    (
        "hunav_overacceleration_mps3",
        "avg_overacceleration",
        "neither",
        lambda e: speed_changes(e, 2),
    ),
)


@_measure("HuNavSim", "avg_pedestrian_velocity", "neither")
def hunav_people_speed_mps(episode: SocialEpisode) -> float | None:
    """Mean speed of all people over all instants at which they are there."""
    if not episode.present.any():
        return None
    velocities = episode.people_mps[episode.present]
    return float(np.hypot(velocities[:, 0], velocities[:, 1]).mean())


def _force(name: str, published: str, part: str) -> None:
    """Add a sum of forces; without people None, but for that of the walls."""

    def value(episode: SocialEpisode) -> float | None:
        work: float = getattr(SocialWork.of(episode), part)
        return work if episode.people or part == "obstacles_on_robot" else None

    _measure("HuNavSim", published, name=name)(value)


_force("hunav_force_on_people_mps2", "social_force_on_agents", "on_people")
_force("hunav_force_on_robot_mps2", "social_force_on_robot", "on_robot")
_force("hunav_obstacle_force_mps2", "obstacle_force_on_robot", "obstacles_on_robot")
_force("hunav_social_work_mps2", "social_work", "work")


# -- SocNavGym -----------------------------------------------------------------------------------


@_measure("SocNavGym", "PATH_LENGTH")
def socnavgym_path_length_m(episode: SocialEpisode) -> float:
    """Σ speed · Δt over the instants after the first."""
    return float((gym_motion(episode)[0] * np.diff(episode.t_s)).sum())


def _gym_figure(order: int, reduce: Callable[[FloatArray], float]) -> Measure:
    """Return a figure of the magnitudes of velocity (0), acceleration (1) or jerk (2)."""

    def figure(episode: SocialEpisode) -> float | None:
        values = gym_motion(episode)[order]
        return float(reduce(values)) if len(values) else None

    return figure


_GYM_SERIES: Final[tuple[tuple[str, str, Better], ...]] = (
    ("V", "speed_mps", "neither"),
    ("A", "acceleration_mps2", "lower"),
    ("JERK", "jerk_mps3", "lower"),
)
for _order, (_letter, _series, _better) in enumerate(_GYM_SERIES):
    for _kind, _reduce in (("min", np.min), ("avg", np.mean), ("max", np.max)):
        _measure(
            "SocNavGym", f"{_letter}_{_kind.upper()}", _better, f"socnavgym_{_kind}_{_series}"
        )(_gym_figure(_order, _reduce))


@_measure("SocNavGym", "MINIMUM_DISTANCE_TO_HUMAN", "higher")
def socnavgym_min_distance_m(episode: SocialEpisode) -> float | None:
    """Smallest distance between the centres after the first instant."""
    return _smallest(episode.centre_distance_m[1:])


@_measure("SocNavGym", "PERSONAL_SPACE_COMPLIANCE", "higher")
def socnavgym_compliance(episode: SocialEpisode) -> float | None:
    """Share of the instants after the first with nobody in the personal space."""
    if not episode.people or len(episode.t_s) < 2:
        return None
    closest = _nearest(episode.centre_distance_m)[1:] - episode.robot_radius_m
    return float((closest >= GYM_PERSONAL_SPACE_M).mean())


# -- NavWareSet ----------------------------------------------------------------------------------


@_measure("NavWareSet", "Vavg", "neither")
def navwareset_speed_mps(episode: SocialEpisode) -> float | None:
    """Driven length over time."""
    duration_s = float(episode.t_s[-1] - episode.t_s[0])
    return path_length_m(episode.robot_m) / duration_s if duration_s > 0.0 else None


_figures(
    "NavWareSet",
    ("navwareset_acceleration_mps2", "Aavg", "lower", lambda e: robot_motion(e)[0]),
    ("navwareset_jerk_mps3", "Javg", "lower", lambda e: robot_motion(e)[1]),
    ("navwareset_path_length_m", "PLavg", "lower", lambda e: path_length_m(e.robot_m)),
)


@_measure("NavWareSet", "PSC, of the notebook")
def navwareset_psc_percent(episode: SocialEpisode) -> float | None:
    """PSC as the notebook computes it: instants *below* 0.5 m between the centres.

    Instants without people do not count.
    """
    closest = _nearest(episode.centre_distance_m)
    there = np.isfinite(closest)
    return _percent(closest[there] < NAVWARE_PERSONAL_SPACE_M) if there.any() else None


@_measure("NavWareSet", "PSC, of the text", "higher")
def navwareset_compliance_percent(episode: SocialEpisode) -> float | None:
    """PSC as the text defines it: instants at 0.5 m or more, less 0.4 m for the two bodies."""
    closest = _nearest(episode.centre_distance_m)
    there = np.isfinite(closest)
    apart = closest[there] - NAVWARE_BODIES_M
    return _percent(apart >= NAVWARE_PERSONAL_SPACE_M) if there.any() else None


@_measure("NavWareSet", "DHmin", "higher")
def navwareset_min_distance_m(episode: SocialEpisode) -> float | None:
    """Smallest distance between the centres."""
    return _smallest(episode.centre_distance_m)


# -- What several measures need ------------------------------------------------------------------


def _disc_distance_m(episode: SocialEpisode) -> FloatArray:
    """Return the (N, P) distances between the discs, 0 for an overlap; infinite for the absent."""
    radii = episode.robot_radius_m + episode.person_radius_m
    return np.maximum(episode.centre_distance_m - radii, 0.0)


def _nearest(distances_m: FloatArray) -> FloatArray:
    """Return the (N,) smallest distances; infinite at instants without people."""
    smallest: FloatArray = distances_m.min(axis=1, initial=np.inf)
    return smallest


def _smallest(values: FloatArray) -> float | None:
    """Return the smallest of (N, P) values; None without a finite one."""
    smallest = float(values.min(initial=np.inf))
    return smallest if np.isfinite(smallest) else None


def _percent(condition: NDArray[np.bool_]) -> float:
    return 100.0 * float(condition.mean())


def _in_zone(distances_m: FloatArray, zone: str) -> NDArray[np.bool_]:
    """Return whether (N,) distances lie in one of Hall's zones."""
    low, high = ZONES_M[zone]
    inside: NDArray[np.bool_] = (distances_m >= low) & (distances_m < high)
    return inside


def _group_centres_m(episode: SocialEpisode) -> FloatArray:
    """Return the (N, G, 2) centres of the groups' shared spaces (o-spaces).

    Each member points 1.5 m ahead of the body; the centre is the mean of these points. NaN where a
    member is not there.
    """
    heading = episode.people_heading_rad
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    points = episode.people_m + GROUP_REACH_M * ahead
    centres = [points[:, list(group)].mean(axis=1) for group in episode.groups]
    return np.stack(centres, axis=1) if centres else np.zeros((len(heading), 0, 2))
