"""The table of measures that others use: name, published name, source, unit and function."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np

from perception.arrays import FloatArray

from ..measures import path_length_m, success_weighted
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
    people_heading_changes_rad,
    people_motion,
    robot_motion,
)
from ._social_force import SocialWork
from ._spaces import (
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

Better = Literal["lower", "higher", "neither"]
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
    better: Better
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


def _named(
    source: Source, *measures: tuple[str, str, Better, Callable[[SocialEpisode], float | None]]
) -> tuple[SocialMeasure, ...]:
    """Return the measures of one source."""
    prefix = "" if source == "general" else f"{source.lower().removesuffix('sim')}_"
    return tuple(
        SocialMeasure(prefix + name, published, source, better, value)
        for name, published, better, value in measures
    )


def _zones(
    suffix: str, published: str, value: Callable[..., float | None], intrusion: bool = True
) -> tuple[tuple[str, str, Better, Callable[[SocialEpisode], float | None]], ...]:
    """Return one measure for each of Hall's zones; nearer than social distance is an intrusion."""
    return tuple(
        (
            suffix.format(zone),
            published.format(zone),
            "lower" if intrusion and zone != "social" else "neither",
            partial(value, zone=zone),
        )
        for zone in ("intimate", "personal", "social")
    )


_GYM_SERIES: Final[tuple[tuple[str, str, Better], ...]] = (
    ("V", "speed_mps", "neither"),
    ("A", "acceleration_mps2", "lower"),
    ("JERK", "jerk_mps3", "lower"),
)
_GYM_KINDS: Final = (("min", np.min), ("avg", np.mean), ("max", np.max))

_GENERAL: Final = _named(
    "general",
    ("spl", "SPL", "higher", _spl),
    ("stl", "STL", "higher", _stl),
    ("path_irregularity_rad", "Path Irregularity", "lower", excess_rotation_rad),
    ("path_irregularity_radpm", "path irregularity", "lower", irregularity_radpm),
    ("mean_goal_angle_rad", "path irregularity", "lower", mean_goal_angle_rad),
    ("time_to_collision_s", "TTC", "higher", min_disc_ttc_s),
    *_zones("{}_s", "time in {} distance", zone_s, intrusion=False),
    ("human_delay_s", "human delay", "lower", lambda e: e.outcome.human_delay_s),
    ("people_acceleration_mps2", "Aavg, of people", "lower", lambda e: people_motion(e)[0]),
    ("people_jerk_mps3", "Javg, of people", "lower", lambda e: people_motion(e)[1]),
    (
        "people_heading_changes_rad",
        "cumulative heading changes, of people",
        "lower",
        people_heading_changes_rad,
    ),
)
_HUNAV: Final = _named(
    "HuNavSim",
    ("time_s", "time_to_reach_goal", "lower", lambda e: float(e.t_s[-1] - e.t_s[0])),
    ("path_length_m", "path_length", "lower", lambda e: path_length_m(e.robot_m)),
    (
        "heading_changes_rad",
        "cumulative_heading_changes",
        "lower",
        lambda e: heading_changes_rad(e.robot_heading_rad),
    ),
    ("mean_closest_m", "avg_distance_to_closest_person", "neither", mean_closest_m),
    (
        "min_distance_m",
        "minimum_distance_to_people",
        "higher",
        lambda e: smallest_m(disc_distance_m(e)),
    ),
    *_zones("{}_percent", "{}_space_intrusions", zone_percent),
    *_zones("group_{}_percent", "group_{}_space_intrusions", group_zone_percent),
    ("speed_mps", "avg_robot_linear_speed", "neither", lambda e: float(e.robot_speed_mps.mean())),
    ("acceleration_mps2", "avg_acceleration", "neither", hunav_acceleration_mps2),
    ("overacceleration_mps3", "avg_overacceleration", "neither", hunav_overacceleration_mps3),
    ("people_speed_mps", "avg_pedestrian_velocity", "neither", hunav_people_speed_mps),
    ("force_on_people_mps2", "social_force_on_agents", "lower", partial(_work, "on_people")),
    ("force_on_robot_mps2", "social_force_on_robot", "lower", partial(_work, "on_robot")),
    (
        "obstacle_force_mps2",
        "obstacle_force_on_robot",
        "lower",
        partial(_work, "obstacles_on_robot"),
    ),
    ("social_work_mps2", "social_work", "lower", partial(_work, "work")),
)
_GYM: Final = _named(
    "SocNavGym",
    ("path_length_m", "PATH_LENGTH", "lower", lambda e: GymMotion.of(e).path_length_m),
    *(
        (f"{kind}_{series}", f"{letter}_{kind.upper()}", better, partial(_gym, series, reduce))
        for letter, series, better in _GYM_SERIES
        for kind, reduce in _GYM_KINDS
    ),
    (
        "min_distance_m",
        "MINIMUM_DISTANCE_TO_HUMAN",
        "higher",
        lambda e: smallest_m(e.centre_distance_m[1:]),
    ),
    ("compliance", "PERSONAL_SPACE_COMPLIANCE", "higher", gym_compliance),
)
_NAVWARE: Final = _named(
    "NavWareSet",
    ("speed_mps", "Vavg", "neither", _mean_speed),
    ("acceleration_mps2", "Aavg", "lower", lambda e: robot_motion(e)[0]),
    ("jerk_mps3", "Javg", "lower", lambda e: robot_motion(e)[1]),
    ("path_length_m", "PLavg", "lower", lambda e: path_length_m(e.robot_m)),
    ("psc_percent", "PSC, of the notebook", "lower", navware_psc_percent),
    ("compliance_percent", "PSC, of the text", "higher", navware_compliance_percent),
    ("min_distance_m", "DHmin", "higher", lambda e: smallest_m(e.centre_distance_m)),
)

#: All measures by their names, in the order of docs/social_measures.md.
SOCIAL_MEASURES: Final[dict[str, SocialMeasure]] = {
    measure.name: measure for measure in (*_GENERAL, *_HUNAV, *_GYM, *_NAVWARE)
}


def social_measures(episode: SocialEpisode) -> dict[str, float | None]:
    """Return all measures of an episode by their names; None where one does not apply."""
    return {name: each.value(episode) for name, each in SOCIAL_MEASURES.items()}
