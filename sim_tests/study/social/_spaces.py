"""Measures of distance: Hall's zones, personal-space compliance, groups, time to collision.

Robot and people are discs here, as in the programmes that define these measures.
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from perception.arrays import FloatArray

from ._episode import SocialEpisode

Zone = Literal["intimate", "personal", "social"]

#: Hall's zones: from, up to but not including, metres.
ZONES_M: Final[dict[Zone, tuple[float, float]]] = {
    "intimate": (-np.inf, 0.45),
    "personal": (0.45, 1.2),
    "social": (1.2, 3.6),
}
#: SocNavGym's and SEAN's personal space, from the robot's surface to a person's centre.
GYM_PERSONAL_SPACE_M: Final = 0.45
#: NavWareSet's personal space, and what its text takes off the distance between the centres.
NAVWARE_PERSONAL_SPACE_M: Final = 0.5
NAVWARE_BODIES_M: Final = 0.4
#: Distance from a person to the centre of the group that the person faces.
GROUP_REACH_M: Final = 1.5


def disc_distance_m(episode: SocialEpisode) -> FloatArray:
    """Return the (N, P) distances between the discs, 0 for an overlap; infinite for the absent."""
    radii = episode.robot_radius_m + episode.person_radius_m
    return np.maximum(episode.centre_distance_m - radii, 0.0)


def nearest(distances_m: FloatArray) -> FloatArray:
    """Return the (N,) smallest distances; infinite at instants without people."""
    smallest: FloatArray = distances_m.min(axis=1, initial=np.inf)
    return smallest


def mean_closest_m(episode: SocialEpisode) -> float | None:
    """Return HuNavSim's average distance to the closest person; None without people.

    An instant without people adds 0 and counts in the average.
    """
    closest = nearest(disc_distance_m(episode))
    there = np.isfinite(closest)
    return float(closest[there].sum()) / len(closest) if there.any() else None


def smallest_m(distances_m: FloatArray) -> float | None:
    """Return the smallest of (N, P) distances; None without people."""
    smallest = float(distances_m.min(initial=np.inf))
    return smallest if np.isfinite(smallest) else None


def in_zone(distances_m: FloatArray, zone: Zone) -> NDArray[np.bool_]:
    """Return whether (N,) distances lie in one of Hall's zones."""
    low, high = ZONES_M[zone]
    inside: NDArray[np.bool_] = (distances_m >= low) & (distances_m < high)
    return inside


def zone_percent(episode: SocialEpisode, zone: Zone) -> float | None:
    """Return the share of instants with the nearest person's disc in the zone, per cent."""
    if not episode.people:
        return None
    return 100.0 * float(in_zone(nearest(disc_distance_m(episode)), zone).mean())


def zone_s(episode: SocialEpisode, zone: Zone) -> float | None:
    """Return the time with the nearest person's disc in the zone.

    Each instant stands for the time to the next one.
    """
    if not episode.people:
        return None
    inside = in_zone(nearest(disc_distance_m(episode)), zone)
    return float(np.diff(episode.t_s) @ inside[:-1].astype(np.float64))


def group_centres_m(episode: SocialEpisode) -> FloatArray:
    """Return the (N, G, 2) centres of the groups' shared spaces (o-spaces).

    Each member points 1.5 m ahead of the body; the centre is the mean of these points. NaN where a
    member is not there.
    """
    heading = episode.people_heading_rad
    ahead = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    points = episode.people_m + GROUP_REACH_M * ahead
    centres = [points[:, list(group)].mean(axis=1) for group in episode.groups]
    return np.stack(centres, axis=1) if centres else np.zeros((len(heading), 0, 2))


def group_zone_percent(episode: SocialEpisode, zone: Zone) -> float | None:
    """Return the share of instants with the centre of a group in the zone, per cent.

    The distance is that from the centre to the robot's disc. 0 if there is no group, as in
    HuNavSim; None without people.
    """
    if not episode.people:
        return None
    offsets = group_centres_m(episode) - episode.robot_m[:, None, :]
    distances = np.hypot(offsets[..., 0], offsets[..., 1]) - episode.robot_radius_m
    closest = nearest(np.where(np.isnan(distances), np.inf, distances))
    return 100.0 * float(in_zone(closest, zone).mean())


def gym_compliance(episode: SocialEpisode) -> float | None:
    """Return SocNavGym's personal-space compliance, a share of the instants after the first."""
    if not episode.people or len(episode.t_s) < 2:
        return None
    closest = nearest(episode.centre_distance_m)[1:] - episode.robot_radius_m
    return float((closest >= GYM_PERSONAL_SPACE_M).mean())


def navware_psc_percent(episode: SocialEpisode) -> float | None:
    """Return NavWareSet's PSC as its notebook computes it: instants *below* 0.5 m, per cent.

    Distances are those between the centres. Instants without people do not count.
    """
    closest = nearest(episode.centre_distance_m)
    there = np.isfinite(closest)
    if not there.any():
        return None
    return 100.0 * float((closest[there] < NAVWARE_PERSONAL_SPACE_M).mean())


def navware_compliance_percent(episode: SocialEpisode) -> float | None:
    """Return NavWareSet's PSC as its text defines it: instants at 0.5 m or more, per cent.

    Distances are those between the centres less 0.4 m for the two bodies.
    """
    closest = nearest(episode.centre_distance_m)
    there = np.isfinite(closest)
    if not there.any():
        return None
    apart = closest[there] - NAVWARE_BODIES_M
    return 100.0 * float((apart >= NAVWARE_PERSONAL_SPACE_M).mean())


def min_disc_ttc_s(episode: SocialEpisode) -> float | None:
    """Return the smallest time to collision of two discs that keep their velocities.

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
    smallest = float(np.where(episode.present, times, np.inf).min(initial=np.inf))
    return smallest if np.isfinite(smallest) else None
