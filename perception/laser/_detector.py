"""Detection of people in laser scans, by their legs or by the trolley that they push."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ..arrays import FloatArray, finite_number, set_fields
from ..errors import PerceptionError
from ._candidates import CandidateKind, PersonCandidate
from ._clusters import Clusters, clusters_of
from ._hypotheses import Hypotheses, LegClassifier, OnnxLegClassifier, hypotheses_of
from ._memory import OccupancyMemory
from ._points import ScanPoints
from ._static_map import StaticMap

# A single cluster at least this wide is two legs that touch.
_TWO_LEGS_M: Final = 0.24
# A pair is preferred to a single leg of it; its odds, as a logarithm, are raised by this.
_PAIR_LOG_ODDS: Final = 10.0
# Two people are not nearer to each other than this.
_APART_M: Final = 0.3
# Nor than this, if of one of them no more than a leg is in view.
_PART_APART_M: Final = 0.68
# A person is far more likely where the floor was free before than where something always stood. The
# classifier has seen single scans with people all around, so its odds are changed by these factors'
# logarithms.
_CAME_LOG_ODDS: Final = 3.0
_ALWAYS_LOG_ODDS: Final = -2.0
# The same for a single narrow cluster: a post. Neither counts where two legs were seen.
_POST_LOG_ODDS: Final = -5.0
_CAME_SHARE: Final = 0.5
# The same for a hypothesis this near to somebody found this recently.
_RECENT_LOG_ODDS: Final = 1.5
_RECENT_M: Final = 0.35
_RECENT_S: Final = 0.3
_MOST_RECENT: Final = 32
# Two legs are remembered at this score, number of points each, and distance.
_SURE_SCORE: Final = 0.8
_SURE_POINTS: Final = 3
_SURE_APART_M: Final = 0.16
# What looks as much like a person as this in one scan is not learned as something that stands
# still.
_ALIKE_SCORE: Final = 0.6
# A cluster of which more than this share is known to stand still is no person.
_STILL_SHARE: Final = 0.3
# Size of a trolley, fewest points of it, and the share that must lie where the floor was free.
_TROLLEY_M: Final = (0.3, 1.6)
_TROLLEY_POINTS: Final = 5
_TROLLEY_CAME: Final = 0.8
_TROLLEY_SCORE: Final = 0.5
# It stands this far before or behind the surfaces at its sides, if these have not come as well.
_TROLLEY_APART_FROM_M: Final = 0.3
# A trolley this near to a person found by the legs is that person's.
_TROLLEY_APART_M: Final = 1.2
# Legs beside it would be seen, so somebody who pushes it stands behind it. This is the least that
# they can be behind the surface that is seen, and the standard deviation of their place.
_TROLLEY_BEHIND_M: Final = 0.3
_TROLLEY_STD_M: Final = 0.6
_SURELY_M: Final = 1e-3
# People farther away are not reported.
_MAX_RANGE_M: Final = 10.0


@dataclass(frozen=True, slots=True)
class LegDetectorConfig:
    """Settings of a :class:`LegDetector`.

    Attributes:
        score_threshold: candidates with a lower score are dropped.
        range_noise_m: standard deviation of the scanner's ranges.
        learn: learn what stands still.

    Raises:
        PerceptionError: for a value out of range.
    """

    score_threshold: float = 0.5
    range_noise_m: float = 0.015
    learn: bool = True

    def __post_init__(self) -> None:
        for name, high in (("score_threshold", 1.0), ("range_noise_m", 0.2)):
            value = finite_number(name, getattr(self, name), minimum=0.0, maximum=high)
            set_fields(self, **{name: value})


class LegDetector:
    """Finds people in the scans of one robot, and learns which surroundings stand still.

    All scanners of a robot share one detector. It needs the scans in the order of their time.

    Args:
        config: settings.
        classifier: judges hypotheses; None for the shipped network.
        static_map: map of what stands still; None without. What it holds is never a person, but
            in scans that contradict it: the robot is then elsewhere.

    Attributes:
        map_contradicted: whether the latest scan that shows enough of the map contradicts it.

    Raises:
        PerceptionError: for a missing or altered network.
    """

    def __init__(
        self,
        config: LegDetectorConfig | None = None,
        *,
        classifier: LegClassifier | None = None,
        static_map: StaticMap | None = None,
    ) -> None:
        self.config = LegDetectorConfig() if config is None else config
        self._map: StaticMap | None = None
        self.static_map = static_map
        self.map_contradicted = False
        self._classify = OnnxLegClassifier() if classifier is None else classifier
        self._memory = OccupancyMemory()
        self._found: deque[tuple[float, FloatArray]] = deque(maxlen=_MOST_RECENT)

    @property
    def static_map(self) -> StaticMap | None:
        """The map of what stands still; set it anew when the robot's place in the map changes."""
        return self._map

    @static_map.setter
    def static_map(self, static_map: StaticMap | None) -> None:
        if static_map is not None and not isinstance(static_map, StaticMap):
            raise PerceptionError(
                f"static_map must be a StaticMap, got {type(static_map).__name__}"
            )
        self._map = static_map

    def detect(self, points: ScanPoints, scanner: int = 0) -> tuple[PersonCandidate, ...]:
        """Return the people in a scan, the most certain first.

        Args:
            points: the scan's points in odom, from :func:`scan_points`.
            scanner: number of the scanner, from 0.
        """
        config, usable = self.config, points.usable
        xy = points.points_odom_m[:, :2]
        if self._map is not None and (wrong := self._map.is_contradicted(points)) is not None:
            self.map_contradicted = wrong
        known = self._known(xy, usable)
        clusters = clusters_of(
            xy,
            points.ranges_m,
            usable,
            points.origins_odom_m[len(usable) // 2, :2],
            points.angle_increment_rad,
            config.range_noise_m,
            known,
        )
        is_still = clusters.still > _STILL_SHARE * clusters.counts
        # Nothing else is asked of what stands still than whether it may be learned.
        learns = config.learn and self._memory.is_due(points.stamp_s, scanner)
        hypotheses = hypotheses_of(
            clusters,
            xy,
            points.ranges_m,
            points.angle_increment_rad,
            None if learns else is_still,
        )
        judged = np.array(self._classify(hypotheses.features), dtype=np.float64)
        first, left = hypotheses.first, hypotheses.left
        alike = judged[:, 0] >= _ALIKE_SCORE
        np.putmask(judged[:, 0], is_still[first] | is_still[left], 0.0)
        if config.learn and len(first):
            narrow = (hypotheses.second < 0) & (clusters.widths_m[first] < _TWO_LEGS_M)
            seen = self._memory.had_two_legs(hypotheses.centres_m, points.stamp_s)
            recent = self._recently(points.stamp_s)
            alike |= seen
            always = np.where(narrow, _POST_LOG_ODDS, _ALWAYS_LOG_ODDS)
            np.putmask(always, seen, 0.0)
            judged[:, 0] = _with_memory(judged[:, 0], clusters, hypotheses, recent, always)
        chosen, places = _chosen(clusters, hypotheses, judged, config.score_threshold)
        candidates = _candidates(points.stamp_s, clusters, hypotheses, judged, chosen, places)
        taken = np.zeros(len(clusters.starts), dtype=bool)
        taken[first[chosen]] = True
        taken[left[chosen]] = True
        if config.learn:
            people_m = np.array(places).reshape(-1, 2)
            for number in _trolleys(clusters, taken, people_m):
                taken[number] = True
                candidates.append(_trolley(points.stamp_s, clusters, number))
            self._found.append((points.stamp_s, people_m))
            legs = _surely_two_legs(clusters, hypotheses, judged[:, 0], chosen)
            if learns:
                taken[first[alike]] = True
                taken[left[alike]] = True
                person = np.zeros(len(usable), dtype=bool)
                person[clusters.rays] = taken[clusters.cluster]
                self._memory.update(points, person, scanner)
            if legs:
                self._memory.note_two_legs(hypotheses.centres_m[legs], points.stamp_s)
        x, y = clusters.origin_m.tolist()
        return tuple(
            candidate
            for candidate in candidates
            if math.dist(candidate.position_odom_m.tolist(), (x, y)) <= _MAX_RANGE_M
        )

    def _known(self, points_m: FloatArray, usable: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return (N,) −1 for points that stand still, 1 for those that have come, 0 otherwise."""
        known = np.zeros(len(usable), dtype=np.int64)
        rows = usable.nonzero()[0]
        own = points_m.T.take(rows, axis=1).T
        found = self._memory.known(own) if self.config.learn else known[rows]
        if self._map is not None and not self.map_contradicted:
            found[self._map.holds(own) & (found == 0)] = -1
        known[rows] = found
        return known

    def _recently(self, now_s: float) -> FloatArray:
        """Return (K, 2) the places where people were found just before."""
        places = [found for stamp, found in self._found if 0.0 <= now_s - stamp <= _RECENT_S]
        return np.concatenate(places) if places else np.zeros((0, 2))


def _with_memory(
    score: FloatArray,
    clusters: Clusters,
    hypotheses: Hypotheses,
    recent_m: FloatArray,
    always: FloatArray,
) -> FloatArray:
    """Return the scores (H,) with what is known about the place where each hypothesis stands."""
    first, left = hypotheses.first, hypotheses.left
    pair = hypotheses.second >= 0
    came, counts = clusters.came, clusters.counts
    has_come = came[first] + pair * came[left] >= _CAME_SHARE * (
        counts[first] + pair * counts[left]
    )
    safe = np.minimum(np.maximum(score, 1e-6), 1.0 - 1e-6)
    odds = np.log(safe / (1.0 - safe)) + np.where(has_come, _CAME_LOG_ODDS, always)
    if len(recent_m):
        to = hypotheses.centres_m[:, None] - recent_m
        near = ((to * to).sum(axis=2) < _RECENT_M**2).any(axis=1)
        odds += _RECENT_LOG_ODDS * (near & (has_come | (always > _POST_LOG_ODDS)))
    return np.asarray(np.where(score > 0.0, 1.0 / (1.0 + np.exp(-odds)), 0.0))


def _trolleys(clusters: Clusters, taken: NDArray[np.bool_], people_m: FloatArray) -> list[int]:
    """Return the clusters that have come, have a trolley's size and stand before all around."""
    low, high = _TROLLEY_M
    fits = (clusters.came >= _TROLLEY_CAME * clusters.counts) & ~taken
    fits &= clusters.counts >= _TROLLEY_POINTS
    fits &= (clusters.widths_m >= low) & (clusters.widths_m <= high)
    if not fits.any():
        return []
    moves = clusters.came >= _CAME_SHARE * clusters.counts
    apart = np.abs(clusters.steps_m) > _TROLLEY_APART_FROM_M
    apart[0, 1:] |= moves[:-1]
    apart[1, :-1] |= moves[1:]
    fits &= apart[0] & apart[1]
    found: list[int] = []
    others = people_m
    for number in fits.nonzero()[0].tolist():
        centre = clusters.centres_m[number]
        if len(others) and np.linalg.norm(others - centre, axis=1).min() < _TROLLEY_APART_M:
            continue
        found.append(number)
        others = np.concatenate([others, centre[None]])
    return found


def _chosen(
    clusters: Clusters, hypotheses: Hypotheses, judged: FloatArray, threshold: float
) -> tuple[list[int], list[FloatArray]]:
    """Return the best hypotheses that do not contradict each other, and the people's places."""
    score = np.minimum(np.maximum(judged[:, 0], 1e-6), 1.0 - 1e-6)
    likely = (score >= threshold).nonzero()[0]
    if not len(likely):
        return [], []
    score, first, second = score[likely], hypotheses.first[likely], hypotheses.second[likely]
    narrow = (clusters.widths_m[first] < _TWO_LEGS_M).tolist()
    odds = np.log(score / (1.0 - score)) + _PAIR_LOG_ODDS * (second >= 0)
    x, y = hypotheses.rays[likely].T
    away, aside = judged[likely, 1], judged[likely, 2]
    places = hypotheses.centres_m[likely].copy()
    places[:, 0] += away * x
    places[:, 0] -= aside * y
    places[:, 1] += away * y
    places[:, 1] += aside * x
    chosen: list[int] = []
    taken: list[list[float]] = []
    used: set[int] = set()
    rows = zip(first.tolist(), second.tolist(), places.tolist(), strict=True)
    each = list(rows)
    for row in np.argsort(-odds, kind="stable").tolist():
        one, other, place = each[row]
        own = {one} if other < 0 else {one, other}
        if own & used:
            continue
        used |= own
        # What is too near is the other leg of somebody found by one leg. A narrow cluster beside
        # somebody is a leg of theirs that was met in two parts.
        apart_m = _PART_APART_M if other < 0 and narrow[row] else _APART_M
        if all(math.dist(place, before) >= apart_m for before in taken):
            chosen.append(row)
            taken.append(place)
    return likely[chosen].tolist(), [places[row] for row in chosen]


def _surely_two_legs(
    clusters: Clusters, hypotheses: Hypotheses, score: FloatArray, chosen: list[int]
) -> list[int]:
    """Return the chosen pairs of legs that are no post broken in two by noise."""
    centres, counts = clusters.centres_m, clusters.counts
    legs = []
    for row in chosen:
        one, other = int(hypotheses.first[row]), int(hypotheses.second[row])
        if other < 0 or score[row] < _SURE_SCORE or min(counts[one], counts[other]) < _SURE_POINTS:
            continue
        if math.dist(centres[one].tolist(), centres[other].tolist()) >= _SURE_APART_M:
            legs.append(row)
    return legs


def _candidates(
    stamp_s: float,
    clusters: Clusters,
    hypotheses: Hypotheses,
    judged: FloatArray,
    chosen: list[int],
    places_m: list[FloatArray],
) -> list[PersonCandidate]:
    """Return the candidates of the chosen hypotheses."""
    if not chosen:
        return []
    rays = hypotheses.rays[chosen]
    one_leg = hypotheses.second[chosen] < 0
    one_leg &= clusters.widths_m[hypotheses.first[chosen]] < _TWO_LEGS_M
    kinds: list[CandidateKind] = ["one_leg" if one else "two_legs" for one in one_leg.tolist()]
    candidates = []
    rows = zip(judged[chosen].tolist(), rays.tolist(), places_m, kinds, strict=True)
    for (score, _, _, along, aside), ray, place, kind in rows:
        covariance = _covariance(ray, max(along, _SURELY_M), max(aside, _SURELY_M))
        person = min(max(score, 0.0), 1.0)
        candidates.append(PersonCandidate(stamp_s, place, covariance, person, kind))
    return candidates


def _trolley(stamp_s: float, clusters: Clusters, number: int) -> PersonCandidate:
    centre = clusters.centres_m[number]
    away = centre - clusters.origin_m
    ray = away / max(math.hypot(*away.tolist()), 1e-6)
    covariance = _TROLLEY_STD_M**2 * np.eye(2)
    return PersonCandidate(
        stamp_s, centre + _TROLLEY_BEHIND_M * ray, covariance, _TROLLEY_SCORE, "trolley"
    )


def _covariance(ray: list[float], along_std_m: float, aside_std_m: float) -> FloatArray:
    """Return (2, 2) from standard deviations along a unit vector and across it."""
    x, y = ray
    along, aside = along_std_m * along_std_m, aside_std_m * aside_std_m
    mixed = (along - aside) * x * y
    return np.array(
        [
            (along * x * x + aside * y * y, mixed),
            (mixed, along * y * y + aside * x * x),
        ]
    )
