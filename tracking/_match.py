"""Data association: one-to-one matches of measurements to tracks, and which are ambiguous."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from ._frame import Measurement
from ._person import WALKER_STD_MPS, Track
from ._size import PRICE, Ray, Taken, knows_size, rays
from ._state import Step
from .awareness_filter import Evidence
from .people import WALKING_MPS

# How far a person may walk between two frames, in standard deviations of a new track's velocity.
_REACH_SIGMAS: Final = 3.0
#: A match is ambiguous if a rival match costs (d² + ln det S) at most this much more, a likelihood
#: ratio of e², …
AMBIGUITY_MARGIN: Final = 4.0
#: … and is no further away than this.
AMBIGUITY_M: Final = 0.8
# Two people are not as near to each other.
_DOUBLE_M: Final = 0.25
# Nor are two who walk in file, who keep 0.36 m and 1.06 s apart (Seyfried et al., J. Stat. Mech.
# 2005, P10002): what a sensor without faces sees so near on somebody's way is their other leg.
_STRIDE_M: Final = 0.5
_STRIDE_WIDTH_M: Final = 0.2


class Sight:
    """The match of one track in a frame.

    Attributes:
        taken: the measurement, as the track takes it.
        cost: d² + ln det S.
        ray: of a track whose range the sensor does not share; None for others.
        by_ray: whether the match is possible by the ray alone, since its range disagrees.
        evidence: of awareness; the lower one of a person whom the frame shows twice.
        ambiguous: whether the match may be another person's, as a rival is about as likely.
        jumped: whether the place is far from where the person was expected.
        held: whether a sensor without faces had seen the person without a gap before.
        stands_for_s: time that the frame stands for: that since the frame before, also in the
            second of two frames with one stamp, if the first did not show the person.
    """

    __slots__ = (
        "ambiguous",
        "by_ray",
        "cost",
        "evidence",
        "held",
        "jumped",
        "ray",
        "stands_for_s",
        "taken",
    )

    def __init__(
        self, taken: Taken, cost: float, ray: Ray | None = None, *, by_ray: bool = False
    ) -> None:
        self.taken, self.cost, self.ray, self.by_ray = taken, cost, ray, by_ray
        self.evidence = taken.given.evidence
        self.ambiguous = self.jumped = False
        self.held = True
        self.stands_for_s = 0.0

    @property
    def given(self) -> Measurement:
        """The measurement."""
        return self.taken.given


class Match:
    """The matches of a frame.

    Attributes:
        sights: what the frame shows of each track; None where it does not show it.
        new: measurements that fit no track, and are not weak.
        rivals: pairs of tracks, by their places in the list: the match of the first is ambiguous,
            and the second is the other track that it may be; −1 where it may be nobody known.
    """

    def __init__(self, tracks: int) -> None:
        self.sights: list[Sight | None] = [None] * tracks
        self.new: list[Measurement] = []
        self.rivals: list[tuple[int, int]] = []


class Gates(NamedTuple):
    """Limits within which a match is possible.

    Attributes:
        distance_m: largest distance.
        chi2: largest squared Mahalanobis distance.
        miss_cost: cost of leaving a track and a measurement unmatched.
    """

    distance_m: float
    chi2: float
    miss_cost: float


_Edges = dict[int, dict[int, Sight]]


def matched(tracks: list[Track], step: Step) -> Match:
    """Match the measurements of a frame to the tracks, predicted to it, one to one.

    The cost d² + ln det S is twice the negative log-likelihood of the measurement. Without its
    second term a track that has coasted, and so has a wide S, would take its neighbour's
    measurements. Confirmed tracks choose first, then the others. Each round chooses the matches
    with the least sum of costs, where an unmatched track costs ``miss_cost``. Without that, a
    person whom the frame missed would take the measurement of a neighbour, and the neighbour any
    clutter in reach.

    Weak detections are offered to the confirmed tracks that are left without a match, as in
    ByteTrack (Zhang et al., ECCV 2022).
    """
    measured = step.frame.measurements
    match = Match(len(tracks))
    if not measured:
        return match
    strong = [column for column, one in enumerate(measured) if not one.weak]
    if tracks:
        config, origin = step.config, step.state.origin_m
        reach_m = _REACH_SIGMAS * WALKER_STD_MPS * step.clock.known_period_s
        gates = Gates(max(config.gate_distance_m, reach_m), config.gate_chi2, config.miss_cost)
        along = rays(tracks, step)

        def offer(rows: Sequence[int], columns: list[int]) -> None:
            edges = _edges(tracks, rows, measured, columns, along, origin, gates)
            _associate(match, edges, tracks, measured, gates.miss_cost, step)

        offer(range(len(tracks)), strong)
        if len(strong) < len(measured):
            left = [
                row
                for row, track in enumerate(tracks)
                if track.confirmed and match.sights[row] is None
            ]
            offer(left, [column for column, one in enumerate(measured) if one.weak])
    seen = [track for track, sight in zip(tracks, match.sights, strict=True) if sight]
    match.new = [
        one
        for one in _new([measured[column] for column in strong], match, step.place_m[:2])
        if not any(is_other_leg(one, track, step) for track in seen)
    ]
    return match


def _new(
    measured: list[Measurement], match: Match, origin_m: tuple[float, float]
) -> list[Measurement]:
    """Return the measurements that fit no track, without those that show somebody twice.

    Of two of the same body the nearer one to the sensor counts.
    """
    taken = [sight.given for sight in match.sights if sight is not None]
    used = {id(one) for one in taken}
    left = [one for one in measured if id(one) not in used]
    if not left:
        return left
    found: set[int] = set()
    for one in sorted(left, key=lambda one: (math.dist((one.x, one.y), origin_m), one.x, one.y)):
        if not any(is_same_body(one, other) for other in taken):
            taken.append(one)
            found.add(id(one))
    return [one for one in left if id(one) in found]


def is_same_body(first: Measurement, second: Measurement) -> bool:
    """Return whether two places are nearer than two bodies: a detector reports one person twice."""
    return (first.x - second.x) ** 2 + (first.y - second.y) ** 2 <= _DOUBLE_M**2


def is_other_leg(one: Measurement, track: Track, step: Step) -> bool:
    """Return whether a scanner sees a place on the way of somebody who walks, within a stride."""
    if step.sensor.settings.sees_faces or not track.confirmed or track.speed_mps < WALKING_MPS:
        return False
    dx, dy = one.x - track.x, one.y - track.y
    along_m = (dx * track.vx + dy * track.vy) / track.speed_mps
    across_m = (dx * track.vy - dy * track.vx) / track.speed_mps
    return abs(along_m) <= _STRIDE_M and abs(across_m) <= _STRIDE_WIDTH_M


def _edges(
    tracks: list[Track],
    rows: Iterable[int],
    measured: list[Measurement],
    columns: list[int],
    along: list[Ray | None],
    origin_m: tuple[float, float] | None,
    gates: Gates,
) -> _Edges:
    """Return the matches that pass both gates: the sight of each track at each measurement."""
    # Only measurements within the gate along x are compared: they are in the order of x.
    columns = sorted(columns, key=lambda column: measured[column].x)
    places = [measured[column].x for column in columns]
    lasting = max([measured[column].lasting_std for column in columns], default=0.0) ** 2
    found: _Edges = {}
    for row in rows:
        track, ray = tracks[row], along[row]
        near = columns
        if ray is None and not knows_size(track, lasting):
            first = bisect_left(places, track.x - gates.distance_m)
            near = columns[first : bisect_right(places, track.x + gates.distance_m)]
        for column in near:
            given = measured[column]
            if near is not columns and abs(given.y - track.y) > gates.distance_m:
                continue
            sight = _sight(track, given, ray, origin_m, gates)
            if sight is not None:
                found.setdefault(row, {})[column] = sight
    return found


def _sight(
    track: Track,
    given: Measurement,
    ray: Ray | None,
    origin_m: tuple[float, float] | None,
    gates: Gates,
) -> Sight | None:
    """Return the match of a track and a measurement; None beyond a gate."""
    taken = Taken(track, given, origin_m)
    dx, dy = taken.x - track.x, taken.y - track.y
    near = dx * dx + dy * dy <= gates.distance_m * gates.distance_m
    if not near and ray is None:
        return None
    spread = taken.spread_m2(track)
    if near:
        distance2, log_det = spread.distance2_and_log_det(dx, dy)
        if distance2 <= gates.chi2:
            return Sight(taken, distance2 + log_det, ray)
    if ray is None or not ray.allows(given):
        return None
    distance2, log_det = spread.plus(ray.extra_m2).distance2_and_log_det(dx, dy)
    if distance2 > gates.chi2:
        return None
    return Sight(taken, distance2 + log_det + PRICE, ray, by_ray=True)


def _associate(
    match: Match,
    edges: _Edges,
    tracks: list[Track],
    measured: list[Measurement],
    miss_cost: float,
    step: Step,
) -> None:
    """Write the best set of matches into ``match``, and which of them are ambiguous."""
    owner: dict[int, int] = {}
    for confirmed in (True, False):
        costs = {
            row: {
                column: sight.cost
                for column, sight in found.items()
                if sight.cost < miss_cost and column not in owner
            }
            for row, found in edges.items()
            if tracks[row].confirmed is confirmed
        }
        if costs:
            owner.update(assigned(costs, miss_cost))
    partner = {row: column for column, row in owner.items()}
    for row, column in partner.items():
        match.sights[row] = edges[row][column]
    reach2 = AMBIGUITY_M**2
    for row, found in edges.items():
        for column, sight in found.items():
            holder = owner.get(column)
            if holder == row:
                continue
            own = match.sights[row] if row in partner else None
            if (
                own is not None
                and holder is None
                and (
                    is_same_body(sight.given, own.given)
                    or is_other_leg(sight.given, tracks[row], step)
                )
            ):
                own.evidence = _lower(own.evidence, sight.given.evidence)
                continue
            # The track could have matched this measurement, …
            if own is not None and sight.cost <= own.cost + AMBIGUITY_MARGIN:
                a, b = measured[column], own.given
                if (a.x - b.x) ** 2 + (a.y - b.y) ** 2 <= reach2:
                    match.rivals.append((row, -1 if holder is None else holder))
                    own.ambiguous = True
            # … or this measurement the track.
            other = None if holder is None else match.sights[holder]
            if other is None or holder is None:
                continue
            if sight.cost <= other.cost + AMBIGUITY_MARGIN:
                c, d = tracks[row], tracks[holder]
                if (c.x - d.x) ** 2 + (c.y - d.y) ** 2 <= reach2:
                    match.rivals.append((holder, row))
                    other.ambiguous = True


def _lower(first: Evidence | None, second: Evidence | None) -> Evidence | None:
    """Return the lower awareness, or the only one."""
    if first is None or second is None:
        return first or second
    return min(first, second)


def assigned(costs: dict[int, dict[int, float]], miss_cost: float) -> dict[int, int]:
    """Return the row of each matched column, such that the sum of all costs is least.

    A row without a column costs ``miss_cost``. Shortest augmenting paths on a sparse matrix, as in
    Jonker and Volgenant, Computing 38, 1987, 325-340.

    Args:
        costs: of the columns that each row may have, below ``miss_cost``.
        miss_cost: of having none.
    """
    claims: dict[int, int] = {}
    for found in costs.values():
        for column in found:
            claims[column] = claims.get(column, 0) + 1
    row_of: dict[int, int] = {}
    column_of: dict[int, int] = {}
    row_price: dict[int, float] = {}
    column_price: dict[int, float] = {}
    for start, found in costs.items():
        # A match whose row and column have no other is part of every best set.
        if len(found) <= 1 and all(claims[column] == 1 for column in found):
            row_of.update(dict.fromkeys(found, start))
            continue
        row, reached = start, 0.0
        row_price[start] = 0.0
        distance: dict[int, float] = {}
        settled: dict[int, float] = {}
        before: dict[int, int] = {}
        while True:
            spent = reached - row_price[row]
            # Each row has a column of its own for none.
            for column, cost in (*costs[row].items(), (-1 - row, miss_cost)):
                if column in settled:
                    continue
                far = spent + cost - column_price.get(column, 0.0)
                if far < distance.get(column, math.inf):
                    distance[column], before[column] = far, row
            end = min(distance, key=distance.__getitem__)
            reached = distance.pop(end)
            if end not in row_of:
                break
            settled[end] = reached
            row = row_of[end]
        row_price[start] += reached
        for column, far in settled.items():
            row_price[row_of[column]] += reached - far
            column_price[column] = column_price.get(column, 0.0) - (reached - far)
        while True:
            row = before[end]
            previous = column_of.get(row)
            row_of[end], column_of[row] = row, end
            if row == start or previous is None:
                break
            end = previous
    return {column: row for column, row in row_of.items() if column >= 0}
