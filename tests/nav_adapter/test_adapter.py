"""The adapter at one time: radii, limits, refusals and invariances."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import (
    FLOOR_M,
    ROBOT,
    crowds,
    finite,
    moved_person,
    moved_robot,
    numbers,
    person,
    policy_radius_m,
    robot_at,
    settled_update,
)

from nav_adapter import AwarenessPolicy, NavAdapter, NavConstraints, NavError
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

ALPHA = finite(0.0, 1.0)
WALK = st.lists(crowds(), min_size=1, max_size=4)


def at(tracks: tuple[PersonTrack, ...], stamp_s: float) -> tuple[PersonTrack, ...]:
    """Return the same people, ``stamp_s`` later."""
    return tuple(replace(track, stamp_s=track.stamp_s + stamp_s) for track in tracks)


def settled(
    alpha: float,
    *,
    position: tuple[float, float],
    seconds: float = 2.0,
    policy: AwarenessPolicy | None = None,
) -> NavConstraints:
    """Return the constraints after a person with this α has stood in view for a while."""
    adapter = NavAdapter(AwarenessPolicy() if policy is None else policy, ROBOT)
    for step in range(round(seconds / 0.05) + 1):
        now = 0.05 * step
        result = adapter.update(
            (person(now, position=position, awareness_lower=alpha),),
            robot_at(now, speed_mps=0.1),
            now,
        )
    return result


def path_mps(gap_m: float) -> float:
    """Return the root of v T + v²/2a = gap, with which a robot stops within a gap."""
    a, T = ROBOT.max_deceleration_mps2, ROBOT.reaction_time_s
    return min(-a * T + math.sqrt((a * T) ** 2 + 2.0 * a * gap_m), ROBOT.max_speed_mps)


TURNS_RAD = np.radians(np.linspace(0.0, 30.0, 121))


def ahead_mps(distance_m: float, human_mps: float, maximum_mps: float = 1.5) -> float:
    """Return the limit for somebody who stands straight ahead, from grids of times and courses.

    Their way is that of nav_adapter/reach.py; the robot brakes after its reaction time, on a
    straight course turned by up to 30°, with the front edge of its rectangle first.
    """
    a, T, rules = ROBOT.max_deceleration_mps2, ROBOT.reaction_time_s, AwarenessPolicy().reach
    assert rules is not None
    tau, lowest = rules.time_constant_s, maximum_mps
    ahead, aside = distance_m * np.cos(TURNS_RAD), distance_m * np.sin(TURNS_RAD)
    off = np.maximum(aside - 0.25, 0.0)
    for t in np.linspace(0.0, T + maximum_mps / a, 2000)[1:].tolist():
        late, since = max(t - T, 0.0), t + rules.delay_s
        rho = FLOOR_M + human_mps * (since + tau * math.expm1(-since / tau))
        hit = off < rho
        edge = ahead - 0.3625 - np.sqrt(np.maximum(rho**2 - off**2, 0.0))
        # The way v t − a late²/2 has come to the edge, and the robot still moves: v > a late.
        touches = (edge[hit].min() + 0.5 * a * late**2) / t
        lowest = min(lowest, max(touches, a * late))
    return lowest


@pytest.mark.parametrize("distance_m", [1.2, 1.6, 2.0, 2.4])
def test_one_person_straight_ahead(distance_m: float) -> None:
    aware = settled(1.0, position=(distance_m, 0.0))
    (obstacle,) = aware.obstacles
    assert obstacle.radius_m == pytest.approx(policy_radius_m(AwarenessPolicy(), 1.0))
    assert obstacle.awareness_lower == 1.0
    assert obstacle.height_m == 1.75
    assert not aware.stale
    # Somebody who keeps to their place is what a scanner stops for.
    aware_mps = ahead_mps(distance_m, 0.0)
    assert aware_mps <= path_mps(distance_m - 0.3625 - FLOOR_M)
    assert 0.95 * aware_mps <= aware.speed_limit_mps <= aware_mps + 1e-3

    unaware = settled(0.0, position=(distance_m, 0.0))
    assert unaware.obstacles[0].radius_m == pytest.approx(policy_radius_m(AwarenessPolicy(), 0.0))
    unaware_mps = ahead_mps(distance_m, 1.5)
    assert 0.95 * unaware_mps - 0.01 <= unaware.speed_limit_mps <= unaware_mps + 1e-3
    assert unaware.limited_by == "track 1: reach"
    assert unaware.speed_limit_mps < 0.9 * aware.speed_limit_mps


def test_without_people_the_limit_is_the_robots_maximum() -> None:
    result = NavAdapter(AwarenessPolicy(), ROBOT).update((), robot_at(), 0.0)
    assert result.obstacles == ()
    assert (result.speed_limit_mps, result.limited_by) == (1.5, "robot maximum")
    far = settled(0.0, position=(40.0, 0.0))
    assert (far.speed_limit_mps, far.limited_by) == (1.5, "robot maximum")


@given(low=ALPHA, high=ALPHA, x=finite(-4.0, 4.0), y=finite(-4.0, 4.0))
@settings(max_examples=25)
def test_awareness_never_enlarges_an_obstacle_and_never_slows_the_robot(
    low: float, high: float, x: float, y: float
) -> None:
    low, high = sorted((low, high))
    for seconds in (0.0, 0.3, 1.5):
        less = settled(low, position=(x, y), seconds=seconds)
        more = settled(high, position=(x, y), seconds=seconds)
        assert more.obstacles[0].radius_m <= less.obstacles[0].radius_m + 1e-12
        assert more.speed_limit_mps >= less.speed_limit_mps - 1e-12


@given(walk=WALK, angle=finite(-7.0, 7.0), shift=st.tuples(finite(-50, 50), finite(-50, 50)))
def test_rotating_and_shifting_the_world_changes_no_constraint(
    walk: list[tuple[PersonTrack, ...]], angle: float, shift: tuple[float, float]
) -> None:
    here = NavAdapter(AwarenessPolicy(), ROBOT)
    there = NavAdapter(AwarenessPolicy(), ROBOT)
    for step, people in enumerate(walk):
        now = 0.2 * step
        tracks, state = at(people, now), robot_at(now, heading_rad=0.4, speed_mps=0.7)
        ours = here.update(tracks, state, now)
        theirs = there.update(
            tuple(moved_person(track, angle, np.asarray(shift)) for track in tracks),
            moved_robot(state, angle, np.asarray(shift)),
            now,
        )
        assert theirs.speed_limit_mps == pytest.approx(ours.speed_limit_mps, abs=1e-9)
        assert len(ours.obstacles) == len(theirs.obstacles)
        for a, b in zip(ours.obstacles, theirs.obstacles, strict=True):
            assert b.radius_m == pytest.approx(a.radius_m, abs=1e-9)
            assert b.awareness_lower == a.awareness_lower


@given(walk=WALK, order=st.randoms())
def test_the_order_of_people_does_not_matter(
    walk: list[tuple[PersonTrack, ...]], order: object
) -> None:
    one, other = NavAdapter(AwarenessPolicy(), ROBOT), NavAdapter(AwarenessPolicy(), ROBOT)
    for step, people in enumerate(walk):
        tracks, now = at(people, 0.2 * step), 0.2 * step
        shuffled = list(tracks)
        order.shuffle(shuffled)
        expected = one.update(tracks, robot_at(now), now)
        assert numbers(other.update(iter(shuffled), robot_at(now), now)) == numbers(expected)
        ids = [obstacle.track_id for obstacle in expected.obstacles]
        assert ids == sorted(ids)


@given(walk=WALK, speed=finite(-1.5, 1.5))
def test_floor_and_ceiling_hold_for_anyone(
    walk: list[tuple[PersonTrack, ...]], speed: float
) -> None:
    adapter, before = NavAdapter(AwarenessPolicy(), ROBOT), None
    for step, tracks in enumerate(walk):
        now = 0.2 * step
        result = adapter.update(at(tracks, now), robot_at(now, speed_mps=speed), now)
        assert all(o.radius_m >= FLOOR_M for o in result.obstacles)
        assert {t.id for t in tracks} <= {o.track_id for o in result.obstacles}
        assert 0.0 <= result.speed_limit_mps <= ROBOT.max_speed_mps
        braked = abs(speed) - (0.0 if before is None else now - before)
        assert result.reachable_speed_limit_mps == max(result.speed_limit_mps, braked)
        before = now


class Own:
    """A custom policy with given values."""

    def __init__(
        self, radius: Callable[[float], float] = lambda _: 0.7, speed: float | None = 1.0
    ) -> None:
        self._radius, self._speed = radius, speed

    def radius_m(self, awareness_lower: float) -> float:
        return self._radius(awareness_lower)

    def human_speed_mps(self, awareness_lower: float) -> float | None:
        return self._speed


@pytest.mark.parametrize("radius", [0.0, -3.0, 0.39, 0.41, 5.0])
def test_the_floor_holds_for_any_policy_object(radius: float) -> None:
    """The floor of the field alone is body and clearance; of reach, the way past the person."""
    for reach in (AwarenessPolicy().reach, None):
        policy = AwarenessPolicy(inflation=Own(lambda _: radius), reach=reach)
        adapter = NavAdapter(policy, ROBOT)
        for now in (0.0, 0.5, 1.0, 5.0):
            result = adapter.update((person(now, awareness_lower=1.0),), robot_at(now), now)
            found = result.obstacles[0].radius_m
            assert found >= max(FLOOR_M, radius)
            if reach is None or radius == 5.0:
                assert found == max(FLOOR_M, radius)


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        ({"inflation": Own(lambda _: math.nan)}, r"Own.radius_m\(0\) must be finite, got nan"),
        ({"inflation": Own(lambda a: 2.0 + a)}, "Own must not grow with awareness, got 2 m"),
        ({"inflation": Own(lambda a: math.inf if a else 1.0)}, "must be finite, got inf"),
        ({"speed": Own(speed=-0.1)}, r"Own.human_speed_mps\(0\) must lie in \[0, inf\), got -0.1"),
        ({"speed": Own(speed=None)}, "must be a number, got NoneType"),
    ],
)
def test_invalid_custom_policies_are_refused_by_name(policy: dict[str, Own], message: str) -> None:
    with pytest.raises(NavError, match=message):
        NavAdapter(AwarenessPolicy(**policy), ROBOT)


def test_a_policy_that_fails_later_leaves_the_adapter_as_it_was() -> None:
    broken: list[bool] = []
    own = Own(lambda _: math.nan if broken else 0.7)
    adapter, twin = (NavAdapter(AwarenessPolicy(inflation=own), ROBOT) for _ in range(2))
    for one in (adapter, twin):
        one.update((person(),), robot_at(), 0.0)
    broken.append(True)
    with pytest.raises(NavError, match="radius_m"):
        adapter.update((person(0.1), person(0.1, track_id=2)), robot_at(0.1), 0.1)
    broken.clear()
    later = (person(0.2, awareness_lower=1.0),), robot_at(0.2), 0.2
    assert numbers(adapter.update(*later)) == numbers(twin.update(*later))


def test_a_runner_is_assumed_to_run_on() -> None:
    def limit(velocity: tuple[float, float], alpha: float) -> float:
        return settled_update(
            [person(position=(2.2, 0.0), velocity=velocity, awareness_lower=alpha)]
        ).speed_limit_mps

    for alpha in (0.0, 1.0):
        assert limit((-1.6, 0.0), alpha) < limit((-0.8, 0.0), alpha) < limit((0.0, 0.0), alpha)
    # Whoever has noticed the robot may walk on: 0.3 v + v²/2 + 0.8 (0.3 + v) is the gap of 1.44 m.
    assert 0.75 < limit((-0.8, 0.0), 1.0) <= 0.80
    # Somebody who runs may change to another direction at a run, though not if they are aware.
    assert limit((0.0, 3.0), 0.0) < limit((0.0, 0.0), 0.0)


@settings(max_examples=40)
@given(sigma=finite(0.0, 1.0), x=finite(0.5, 6.0), alpha=st.sampled_from([0.0, 1.0]))
def test_uncertainty_enlarges_the_obstacle_and_lowers_the_limit(
    sigma: float, x: float, alpha: float
) -> None:
    def constraints(sigma_m: float, x_m: float) -> NavConstraints:
        return settled_update([person(position=(x_m, 0.0), sigma_m=sigma_m, awareness_lower=alpha)])

    exact, uncertain = constraints(0.0, x), constraints(sigma, x)
    wider_m = uncertain.obstacles[0].radius_m - exact.obstacles[0].radius_m
    assert wider_m == pytest.approx(2.0 * sigma)
    # Two standard deviations count as much as a body that is nearer by as much.
    nearer = constraints(0.0, max(x - 2.0 * sigma, 0.3))
    assert uncertain.speed_limit_mps <= exact.speed_limit_mps + 1e-9
    if x - 2.0 * sigma > 0.3:
        assert uncertain.speed_limit_mps == pytest.approx(nearer.speed_limit_mps, abs=0.04)


def test_the_most_uncertain_direction_counts() -> None:
    axes = np.linalg.qr(np.array([[1.0, 0.3], [0.2, -1.0]]))[0]
    covariance = np.zeros((4, 4))
    covariance[:2, :2] = axes @ np.diag([0.01, 0.25]) @ axes.T
    covariance[2:, 2:] = 0.16 * np.eye(2)
    track = replace(person(), covariance_odom=0.5 * (covariance + covariance.T))
    adapter = NavAdapter(AwarenessPolicy(), ROBOT)
    result = adapter.update((track,), robot_at(0.3), 0.3, perception_stamp_s=0.3)
    sigma = math.sqrt(0.25 + 0.3**2 * 0.16)
    unaware_m = policy_radius_m(AwarenessPolicy(), 0.0)
    assert result.obstacles[0].radius_m == pytest.approx(unaware_m + 2.0 * sigma)


def test_people_are_predicted_with_the_age_of_their_track() -> None:
    """An old track tells less of where somebody is: the limit falls with its age."""

    def constraints(vx: float, now: float) -> NavConstraints:
        adapter = NavAdapter(AwarenessPolicy(), ROBOT)
        return adapter.update(
            (person(velocity=(vx, 0.0)),), robot_at(now), now, perception_stamp_s=now
        )

    leaving, standing, coming = (constraints(vx, 0.2) for vx in (1.0, 0.0, -1.0))
    np.testing.assert_allclose(leaving.obstacles[0].center_odom_m, [3.2, 0.0])
    assert coming.speed_limit_mps < standing.speed_limit_mps < leaving.speed_limit_mps
    for vx, now in ((1.0, leaving), (0.0, standing), (-1.0, coming)):
        assert now.speed_limit_mps < constraints(vx, 0.0).speed_limit_mps


def test_the_protective_field_counts_the_nearer_of_old_and_predicted_place() -> None:
    """A person last seen walking away may have stopped."""
    field = AwarenessPolicy(reach=None)

    def limit(vx: float) -> float:
        track = person(position=(2.0, 0.0), velocity=(vx, 0.0))
        return NavAdapter(field, ROBOT).update((track,), robot_at(0.2), 0.2).speed_limit_mps

    assert limit(1.0) == limit(0.0) > limit(-1.0) > 0.0


def test_the_distance_driven_since_the_robot_state_counts() -> None:
    def limit(speed: float, age: float) -> float:
        adapter = NavAdapter(AwarenessPolicy(), ROBOT)
        return adapter.update(
            (person(1.0),), robot_at(1.0 - age, speed_mps=speed), 1.0
        ).speed_limit_mps

    # A robot that stood then may have set off since.
    # 0.1 s of it are 5 mm.
    assert limit(0.0, 0.3) < limit(0.0, 0.1) <= limit(0.0, 0.0)
    assert limit(1.0, 0.3) < limit(1.0, 0.1) < limit(1.0, 0.0)


BAD_UPDATES: list[tuple[Callable[[], dict[str, object]], str]] = [
    (lambda: {"tracks": [person(0.5), "person"]}, r"tracks\[1\] must be a PersonTrack, got str"),
    (lambda: {"tracks": None}, "tracks must be an iterable of PersonTrack, got NoneType"),
    (lambda: {"tracks": [person(0.5), person(0.5)]}, "distinct ids, got id 1 twice"),
    (lambda: {"tracks": [person(0.6)]}, r"tracks\[0\].stamp_s must not lie after stamp_s"),
    (lambda: {"robot_state": None}, "robot_state must be a RobotState, got NoneType"),
    (lambda: {"robot_state": robot_at(0.7)}, "robot_state.stamp_s must not lie after stamp_s"),
    (lambda: {"stamp_s": math.nan}, "stamp_s must be finite, got nan"),
    (lambda: {"stamp_s": math.inf}, "stamp_s must be finite, got inf"),
    (lambda: {"stamp_s": "now"}, "stamp_s must be a number, got str"),
    (lambda: {"stamp_s": 0.1}, "must not go backward, got 0.100000 s after 0.400000 s"),
    (lambda: {"perception_stamp_s": math.nan}, "perception_stamp_s must be finite"),
    (lambda: {"perception_stamp_s": 0.8}, "perception_stamp_s must not lie after stamp_s"),
]


@pytest.mark.parametrize(("bad", "message"), BAD_UPDATES)
def test_refused_input_leaves_no_trace(bad: Callable[[], dict[str, object]], message: str) -> None:
    adapter, twin = (NavAdapter(AwarenessPolicy(), ROBOT) for _ in range(2))

    def scene(now: float) -> dict[str, object]:
        return {
            "tracks": (person(now, awareness_lower=0.9), person(now, track_id=4)),
            "robot_state": robot_at(now, speed_mps=0.5),
            "stamp_s": now,
        }

    for now in (0.0, 0.2, 0.4):
        adapter.update(**scene(now))
        twin.update(**scene(now))
    with pytest.raises(NavError, match=message):
        adapter.update(**(scene(0.5) | bad()))
    for now in (0.5, 0.6):
        assert numbers(adapter.update(**scene(now))) == numbers(twin.update(**scene(now)))


def test_wrong_constructor_arguments_are_refused() -> None:
    with pytest.raises(NavError, match="policy must be an AwarenessPolicy, got dict"):
        NavAdapter({}, ROBOT)
    with pytest.raises(NavError, match="robot must be a RobotProfile, got tuple"):
        NavAdapter(AwarenessPolicy(), ())


@pytest.mark.parametrize(("alpha", "human_mps"), [(0.0, 1.5), (0.0, 0.0), (1.0, 0.0)])
def test_a_robot_that_obeys_stands_before_an_approaching_person_arrives(
    alpha: float, human_mps: float
) -> None:
    """Closed loop: the person walks at the assumed speed, and the drive follows the limit.

    The drive uses constraints that are one period old for one more period, and brakes no harder
    than the profile says. Both delays together are within the reaction time.
    """
    period, policy = 0.05, AwarenessPolicy()
    for start_m in (1.5, 2.0, 4.0, 7.0, 11.0):
        adapter, now, x, worker = NavAdapter(policy, ROBOT), 0.0, 0.0, start_m
        speed = command = math.inf
        while speed > 1e-3 and now < 20.0:
            separation = worker - x - 0.3625 - BODY_RADIUS_M
            assert separation > 0.0
            track = person(
                now, position=(worker, 0.0), velocity=(-human_mps, 0.0), awareness_lower=alpha
            )
            state = robot_at(now, position=(x, 0.0), speed_mps=min(speed, 1.5))
            limit = adapter.update((track,), state, now).speed_limit_mps
            if speed == math.inf:
                speed = command = limit
            after = max(command, speed - ROBOT.max_deceleration_mps2 * period)
            x += 0.5 * (speed + after) * period
            worker -= human_mps * period
            speed, command, now = after, limit, now + period
        # It may drive up to somebody who stands, to within what it cannot do in time.
        assert human_mps > 0.0 or alpha == 0.0 or separation < 0.2
