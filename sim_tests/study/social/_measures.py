"""The table of measures that others use: name, published name, source, unit and function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np

from perception.arrays import FloatArray

from ..measures import path_length_m
from ._episode import SocialEpisode
from ._motion import (
    GymMotion,
    excess_rotation_rad,
    heading_changes_rad,
    hunav_acceleration_mps2,
    hunav_overacceleration_mps3,
    hunav_people_speed_mps,
    irregularity_radpm,
    mean_goal_angle_rad,
    mean_of,
    people_heading_changes_rad,
    people_tracks,
    robot_track,
    success_weighted,
)
from ._social_force import SocialWork
from ._spaces import (
    Zone,
    disc_distance_m,
    group_zone_percent,
    gym_compliance,
    mean_closest_m,
    min_disc_ttc_s,
    navware_compliance_percent,
    navware_psc_percent,
    smallest_m,
    zone_percent,
    zone_s,
)

_ZONES: Final[tuple[Zone, ...]] = ("intimate", "personal", "social")

Source = Literal["general", "HuNavSim", "SocNavGym", "NavWareSet"]


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
    better: Literal["lower", "higher", "neither"]
    value: Callable[[SocialEpisode], float | None]


def _spl(episode: SocialEpisode) -> float | None:
    outcome = episode.outcome
    return success_weighted(
        outcome.success, path_length_m(episode.robot_m), outcome.reference_length_m
    )


def _stl(episode: SocialEpisode) -> float | None:
    outcome = episode.outcome
    return success_weighted(outcome.success, outcome.time_to_goal_s, outcome.reference_time_s)


def _mean_speed(episode: SocialEpisode) -> float | None:
    duration_s = float(episode.t_s[-1] - episode.t_s[0])
    return path_length_m(episode.robot_m) / duration_s if duration_s > 0.0 else None


def _gym(
    series: str, reduce: Callable[[FloatArray], float], episode: SocialEpisode
) -> float | None:
    values: FloatArray = getattr(GymMotion.of(episode), series)
    return float(reduce(values)) if len(values) else None


def _work(name: str, episode: SocialEpisode) -> float | None:
    """Return a sum of forces; None without people, except for that of the walls."""
    if not episode.people and name != "obstacles_on_robot":
        return None
    return float(getattr(SocialWork.of(episode), name))


_GENERAL: Final = (
    SocialMeasure("spl", "SPL", "general", "higher", _spl),
    SocialMeasure("stl", "STL", "general", "higher", _stl),
    SocialMeasure(
        "path_irregularity_rad", "Path Irregularity", "general", "lower", excess_rotation_rad
    ),
    SocialMeasure(
        "path_irregularity_radpm", "path irregularity", "general", "lower", irregularity_radpm
    ),
    SocialMeasure(
        "mean_goal_angle_rad", "path irregularity", "general", "lower", mean_goal_angle_rad
    ),
    SocialMeasure("time_to_collision_s", "TTC", "general", "higher", min_disc_ttc_s),
    *(
        SocialMeasure(
            f"{zone}_s",
            f"time in {zone} distance",
            "general",
            "neither",
            partial(zone_s, zone=zone),
        )
        for zone in _ZONES
    ),
    SocialMeasure(
        "human_delay_s", "human delay", "general", "lower", lambda e: e.outcome.human_delay_s
    ),
    SocialMeasure(
        "people_acceleration_mps2",
        "Aavg, of people",
        "general",
        "lower",
        lambda e: mean_of(people_tracks(e).acceleration),
    ),
    SocialMeasure(
        "people_jerk_mps3",
        "Javg, of people",
        "general",
        "lower",
        lambda e: mean_of(people_tracks(e).jerk),
    ),
    SocialMeasure(
        "people_heading_changes_rad",
        "cumulative heading changes, of people",
        "general",
        "lower",
        people_heading_changes_rad,
    ),
)


def _hunav(
    name: str,
    published: str,
    better: Literal["lower", "higher", "neither"],
    value: Callable[[SocialEpisode], float | None],
) -> SocialMeasure:
    return SocialMeasure(f"hunav_{name}", published, "HuNavSim", better, value)


_HUNAV: Final = (
    _hunav("time_s", "time_to_reach_goal", "lower", lambda e: float(e.t_s[-1] - e.t_s[0])),
    _hunav("path_length_m", "path_length", "lower", lambda e: path_length_m(e.robot_m)),
    _hunav(
        "heading_changes_rad",
        "cumulative_heading_changes",
        "lower",
        lambda e: heading_changes_rad(e.robot_heading_rad),
    ),
    _hunav("mean_closest_m", "avg_distance_to_closest_person", "neither", mean_closest_m),
    _hunav(
        "min_distance_m",
        "minimum_distance_to_people",
        "higher",
        lambda e: smallest_m(disc_distance_m(e)),
    ),
    *(
        _hunav(
            f"{zone}_percent",
            f"{zone}_space_intrusions",
            "neither" if zone == "social" else "lower",
            partial(zone_percent, zone=zone),
        )
        for zone in _ZONES
    ),
    *(
        _hunav(
            f"group_{zone}_percent",
            f"group_{zone}_space_intrusions",
            "neither" if zone == "social" else "lower",
            partial(group_zone_percent, zone=zone),
        )
        for zone in _ZONES
    ),
    _hunav(
        "speed_mps",
        "avg_robot_linear_speed",
        "neither",
        lambda e: float(e.robot_speed_mps.mean()),
    ),
    _hunav("acceleration_mps2", "avg_acceleration", "neither", hunav_acceleration_mps2),
    _hunav("overacceleration_mps3", "avg_overacceleration", "neither", hunav_overacceleration_mps3),
    _hunav("people_speed_mps", "avg_pedestrian_velocity", "neither", hunav_people_speed_mps),
    _hunav("force_on_people_mps2", "social_force_on_agents", "lower", partial(_work, "on_people")),
    _hunav("force_on_robot_mps2", "social_force_on_robot", "lower", partial(_work, "on_robot")),
    _hunav(
        "obstacle_force_mps2",
        "obstacle_force_on_robot",
        "lower",
        partial(_work, "obstacles_on_robot"),
    ),
    _hunav("social_work_mps2", "social_work", "lower", partial(_work, "work")),
)

_GYM: Final = (
    SocialMeasure(
        "socnavgym_path_length_m",
        "PATH_LENGTH",
        "SocNavGym",
        "lower",
        lambda e: GymMotion.of(e).path_length_m,
    ),
    *(
        SocialMeasure(
            f"socnavgym_{kind}_{series}",
            f"{letter}_{kind.upper()}",
            "SocNavGym",
            "neither" if letter == "V" else "lower",
            partial(_gym, series, reduce),
        )
        for letter, series in (
            ("V", "speed_mps"),
            ("A", "acceleration_mps2"),
            ("JERK", "jerk_mps3"),
        )
        for kind, reduce in (("min", np.min), ("avg", np.mean), ("max", np.max))
    ),
    SocialMeasure(
        "socnavgym_min_distance_m",
        "MINIMUM_DISTANCE_TO_HUMAN",
        "SocNavGym",
        "higher",
        lambda e: smallest_m(e.centre_distance_m[1:]),
    ),
    SocialMeasure(
        "socnavgym_compliance", "PERSONAL_SPACE_COMPLIANCE", "SocNavGym", "higher", gym_compliance
    ),
)

_NAVWARE: Final = (
    SocialMeasure("navwareset_speed_mps", "Vavg", "NavWareSet", "neither", _mean_speed),
    SocialMeasure(
        "navwareset_acceleration_mps2",
        "Aavg",
        "NavWareSet",
        "lower",
        lambda e: mean_of(robot_track(e).acceleration),
    ),
    SocialMeasure(
        "navwareset_jerk_mps3",
        "Javg",
        "NavWareSet",
        "lower",
        lambda e: mean_of(robot_track(e).jerk),
    ),
    SocialMeasure(
        "navwareset_path_length_m",
        "PLavg",
        "NavWareSet",
        "lower",
        lambda e: path_length_m(e.robot_m),
    ),
    SocialMeasure(
        "navwareset_psc_percent", "PSC, of the notebook", "NavWareSet", "lower", navware_psc_percent
    ),
    SocialMeasure(
        "navwareset_compliance_percent",
        "PSC, of the text",
        "NavWareSet",
        "higher",
        navware_compliance_percent,
    ),
    SocialMeasure(
        "navwareset_min_distance_m",
        "DHmin",
        "NavWareSet",
        "higher",
        lambda e: smallest_m(e.centre_distance_m),
    ),
)

#: All measures by their names, in the order of docs/social_measures.md.
SOCIAL_MEASURES: Final[dict[str, SocialMeasure]] = {
    measure.name: measure for measure in (*_GENERAL, *_HUNAV, *_GYM, *_NAVWARE)
}


def social_measures(episode: SocialEpisode) -> dict[str, float | None]:
    """Return all measures of an episode by their names; None where one does not apply."""
    return {name: each.value(episode) for name, each in SOCIAL_MEASURES.items()}
