"""Speed and separation once more, from docs/safety.md alone: shapely, eigenvalues and bisection.

Nothing here is imported from the adapter but its settings, so that an error in the adapter's closed
form, its geometry or its bookkeeping does not repeat itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from shapely.affinity import rotate, translate
from shapely.geometry import MultiPoint, Point

from nav_adapter import AwarenessPolicy, RobotProfile, RobotState
from tracking import PersonTrack

BODY_M = 0.30


def limit_mps(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    state: RobotState,
    tracks: Sequence[PersonTrack],
    awareness: Sequence[float],
    now: float,
    *,
    known: bool = True,
) -> float:
    """Return the limit of speed and separation for people with these lower bounds of α.

    ``known`` is False at first sight and with stale data, when nobody counts as standing.
    """
    limits = [
        _person_limit_mps(policy, robot, state, track, alpha, now, known)
        for track, alpha in zip(tracks, awareness, strict=True)
    ]
    return min([robot.max_speed_mps, *limits])


def _person_limit_mps(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    state: RobotState,
    track: PersonTrack,
    alpha: float,
    now: float,
    known: bool,
) -> float:
    forward, left = state.speed_mps, 0.0
    if state.velocity_base_mps is not None:
        left = float(state.velocity_base_mps[1])
    travel_mps, state_age_s = math.hypot(forward, left), now - state.stamp_s
    driven_m = _driven_m(robot, travel_mps, state_age_s)
    margin_m = BODY_M + driven_m + _position_margin_m(policy, track, now)
    hull = translate(
        rotate(
            MultiPoint(robot.footprint_m).convex_hull,
            state.heading_odom_rad,
            origin=(0.0, 0.0),
            use_radians=True,
        ),
        *state.position_odom_m,
    )
    places = [
        track.position_odom_m + age_s * track.velocity_odom_mps
        for age_s in (0.0, now - track.stamp_s)
    ]
    footprint_gap_m = min(hull.distance(Point(place)) for place in places) - margin_m
    reach_m = max(math.hypot(x, y) for x, y in robot.footprint_m)
    circle_gap_m = (
        min(math.dist(place, state.position_odom_m) for place in places) - reach_m - margin_m
    )
    share = 1.0
    if abs(forward) >= 0.05 or abs(left) > 0.1:
        counted = left if abs(left) > 0.1 else 0.0
        course = state.heading_odom_rad + math.atan2(counted, forward)
        turn = math.radians(policy.rules.turn_within_stop_deg)
        turn += abs(state.yaw_rate_radps) * state_age_s
        if counted == 0.0 and robot.drive not in ("differential", "ackermann"):
            turn += math.atan2(abs(left), abs(forward))
        if robot.max_acceleration_mps2 * state_age_s >= travel_mps:
            turn = math.pi
        share = max(_share(place - state.position_odom_m, course, turn) for place in places)
    human_mps = _human_mps(policy, state, track, alpha)
    begun_s = None
    if known and _stands(policy, track, now):
        begun_s = _begun_s(policy, track)
    age_s = now - track.stamp_s

    def walked_m(time_s: float) -> float:
        return _walked_m(policy, human_mps, time_s, begun_s)

    limits = [
        _fastest_mps(policy, robot, footprint_gap_m, age_s, 1.0, walked_m),
        _fastest_mps(policy, robot, circle_gap_m, age_s, share, walked_m),
    ]
    if known and policy.rules.walking is not None and _is_fresh(policy, track, now):
        braking_s = robot.reaction_time_s + age_s
        turned_m = _turned_way(policy, state, track, human_mps, braking_s)
        limits.append(_fastest_mps(policy, robot, circle_gap_m, age_s, share, turned_m))
    return max(limits)


def _is_fresh(policy: AwarenessPolicy, track: PersonTrack, now: float) -> bool:
    seen_s = track.stamp_s - track.time_since_seen_s
    return track.status == "confirmed" and now - seen_s <= policy.timing.fresh_within_s


def _turned_way(
    policy: AwarenessPolicy,
    state: RobotState,
    track: PersonTrack,
    human_mps: float,
    braking_s: float,
) -> Callable[[float], float]:
    """The way towards the robot of somebody whose velocity changes by bounded accelerations."""
    rule = policy.rules.walking
    a, unnoticed_s = rule.human_acceleration_mps2, rule.turn_delay_s + track.time_since_seen_s
    variance = max(np.linalg.eigvalsh(track.covariance_odom[2:, 2:])[-1], 0.0)
    to_robot = state.position_odom_m - track.position_odom_m
    coming_mps = track.velocity_odom_mps @ to_robot / max(math.hypot(*to_robot), 1e-9)
    coming_mps += rule.velocity_sigmas * math.sqrt(variance)
    # The time since which somebody who stood may be walking; before the present if negative.
    since_s = unnoticed_s + coming_mps / a
    nearer_m = max(a * unnoticed_s**2 - a * max(since_s, 0.0) ** 2, 0.0) / 2.0

    def way_m(time_s: float) -> float:
        top_mps = a * max(time_s + max(since_s, -braking_s), 0.0)
        tip_mps = max(top_mps - human_mps, 0.0)
        return min((top_mps**2 - tip_mps**2) / (2.0 * a), human_mps * time_s) + nearer_m

    return way_m


def _stands(policy: AwarenessPolicy, track: PersonTrack, now: float) -> bool:
    """Return True if a fresh measurement shows a confirmed person standing (assumption 8)."""
    rule = policy.rules.standing
    if rule is None or not _is_fresh(policy, track, now):
        return False
    variance = max(np.linalg.eigvalsh(track.covariance_odom[2:, 2:])[-1], 0.0)
    return math.hypot(*track.velocity_odom_mps, math.sqrt(variance)) <= rule.standing_below_mps


def _begun_s(policy: AwarenessPolicy, track: PersonTrack) -> float | None:
    """The time since which somebody who stands may walk; None if nobody can say (assumption 8)."""
    rule = policy.rules.standing
    least_s = rule.start_delay_s + track.time_since_seen_s
    if not rule.delay_from_tracks:
        return least_s
    return None


def _walked_m(
    policy: AwarenessPolicy, human_mps: float, time_s: float, begun_s: float | None
) -> float:
    """The way of a person in this time; ``begun_s`` is None for somebody who does not stand."""
    rule = policy.rules.standing
    if rule is None or begun_s is None:
        return human_mps * time_s
    since_s = time_s + begun_s
    # The area under the speed over time: a triangle, less the tip above the speed assumed.
    top_mps = rule.human_acceleration_mps2 * since_s
    tip_mps = max(top_mps - human_mps, 0.0)
    way_m = (top_mps**2 - tip_mps**2) / (2.0 * rule.human_acceleration_mps2)
    return min(way_m, human_mps * time_s)


def _driven_m(robot: RobotProfile, travel_mps: float, age_s: float) -> float:
    """The way of a robot that speeds up since its state, step by step up to its top speed."""
    top_mps = max(travel_mps, robot.max_speed_mps)
    by_speed_m = travel_mps * age_s + robot.max_acceleration_mps2 * age_s * age_s / 2.0
    return min(by_speed_m, top_mps * age_s)


def _share(offset_m: np.ndarray, course_rad: float, turn_rad: float) -> float:
    """The share of the way that can lead to a point, once the course has turned towards it."""
    bearing = math.atan2(offset_m[1], offset_m[0])
    angle = abs(math.remainder(bearing - course_rad, math.tau))
    return max(0.0, math.cos(max(0.0, angle - turn_rad)))


def _position_margin_m(policy: AwarenessPolicy, track: PersonTrack, now: float) -> float:
    ahead_s = min(now - track.stamp_s, policy.timing.stop_after_s)
    F = np.eye(4)
    F[0, 2] = F[1, 3] = ahead_s
    covariance = (F @ track.covariance_odom @ F.T)[:2, :2]
    sigma_m = math.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 0.0))
    sigmas = policy.margins.uncertainty_sigmas
    if now - (track.stamp_s - track.time_since_seen_s) > policy.timing.fresh_within_s:
        sigmas = max(sigmas, policy.margins.unseen_sigmas)
    return sigmas * sigma_m


def _human_mps(
    policy: AwarenessPolicy, state: RobotState, track: PersonTrack, alpha: float
) -> float:
    """The speed assumed of a person towards the robot (assumption 1, claim C12)."""
    assumed, unaware = policy.speed.human_speed_mps(alpha), policy.speed.human_speed_mps(0.0)
    walking = math.hypot(*track.velocity_odom_mps)
    closing = 0.0
    if walking > 0.0:
        to_robot = state.position_odom_m - track.position_odom_m
        course = math.atan2(track.velocity_odom_mps[1], track.velocity_odom_mps[0])
        off = abs(math.remainder(math.atan2(to_robot[1], to_robot[0]) - course, math.tau))
        brisk = min(max((walking / max(unaware, 1e-9) - 0.75) / 0.25, 0.0), 1.0)
        turn = math.radians(policy.rules.people_turn_deg) * brisk
        closing = walking * math.cos(max(off - turn, 0.0))
    if walking > unaware:
        excess = walking - unaware
        running = min(excess / max(0.25 * unaware, 1e-9), 1.0)
        assumed = max(assumed + excess, (1.0 - running) * assumed + running * walking)
    return max(assumed, closing)


def _fastest_mps(
    policy: AwarenessPolicy,
    robot: RobotProfile,
    gap_m: float,
    track_age_s: float,
    share: float,
    walked_m: Callable[[float], float],
) -> float:
    """The highest speed whose protective separation fits into the gap, by bisection."""
    a, T = robot.max_deceleration_mps2, robot.reaction_time_s + track_age_s

    def fits(v: float) -> bool:
        way_m = v * T + v * v / (2.0 * a)
        clearance_m = policy.margins.separation_clearance_m
        return walked_m(T + v / a) + share * way_m + clearance_m <= gap_m

    low, high = 0.0, 2.0 * robot.max_speed_mps
    if not fits(low):
        return 0.0
    if fits(high):
        return high
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low
