"""The messages for constraints, the limit as Nav2 keeps it, and the conversion of stamps."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nav_scenes import ROBOT, crowds, finite, person, robot_at
from shapely import affinity
from shapely.geometry import Point as ShapelyPoint
from shapely.geometry import Polygon

from nav_adapter import (
    Alert,
    AwarenessPolicy,
    NavAdapter,
    NavConstraints,
    NavError,
    RobotProfile,
    RobotState,
    paint_costmap,
)
from nav_adapter.alerts import Answer
from nav_adapter.ros2 import (
    SLOWEST_MPS,
    STOP_POLYGON_ID,
    Frames,
    SpeedMaskSettings,
    alerts,
    circle_objects,
    collision_polygons,
    detections,
    markers,
    occupancy_grid,
    outgoing,
    people,
    speed_limit,
    stop_zone,
    teb_obstacles,
)
from nav_adapter.ros2._speed_mask import SpeedMaskStream
from nav_adapter.ros2.conversions import to_seconds, to_time
from nav_adapter.ros2.messages.diagnostic_msgs import DiagnosticStatus
from nav_adapter.ros2.messages.visualization_msgs import Marker

FOOTPRINT = Polygon(ROBOT.footprint_m)


def limited(limit_mps: float) -> NavConstraints:
    return NavConstraints(5.0, (), limit_mps, "a test", False)


def around(tracks) -> NavConstraints:
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), ROBOT)
    return adapter.update(tracks, robot_at(), 0.0)


def shape(polygon) -> Polygon:
    return Polygon([(corner.x, corner.y) for corner in polygon.points])


@given(finite(0.0, 1e6), finite(0.02, 10.0), st.booleans())
def test_a_speed_limit_is_never_read_as_no_limit_or_above_the_maximum(limit, maximum, percentage):
    message = speed_limit(limited(limit), maximum, percentage=percentage)
    # The limit that a controller with this maximum reads.
    meant = message.speed_limit * (maximum / 100.0 if percentage else 1.0)
    assert message.percentage is percentage
    assert message.speed_limit > 0.0
    assert SLOWEST_MPS * (1.0 - 1e-12) <= meant < maximum
    assert meant <= max(limit, SLOWEST_MPS) * (1.0 + 1e-12)
    if SLOWEST_MPS <= limit <= 0.999 * maximum:
        assert meant == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize("maximum", [0.0, -1.0, SLOWEST_MPS, float("nan"), float("inf"), "fast"])
def test_a_maximum_that_is_too_small_or_not_finite_is_refused(maximum) -> None:
    with pytest.raises(NavError, match="max_speed_mps"):
        speed_limit(limited(0.5), maximum)


@given(finite(0.0, 2.0**31 - 2.0))
def test_stamps_keep_their_nanoseconds(stamp_s: float) -> None:
    time = to_time(stamp_s)
    assert 0 <= time.nanosec < 1_000_000_000
    assert to_seconds(time) == pytest.approx(stamp_s, abs=3e-7)
    exact = stamp_s - int(stamp_s)
    assert abs(time.sec - int(stamp_s) + 1e-9 * time.nanosec - exact) <= 0.51e-9


@pytest.mark.parametrize("stamp_s", [-1.0, float("nan"), float("inf"), 2.0**31])
def test_a_stamp_that_ros_cannot_hold_is_refused(stamp_s: float) -> None:
    with pytest.raises(NavError, match="stamp_s"):
        to_time(stamp_s)


@settings(max_examples=40)
@given(crowds())
def test_every_person_has_a_polygon_and_the_stop_polygon_comes_last(tracks) -> None:
    constraints = around(tracks)
    *persons, stop = collision_polygons(constraints, ROBOT, robot_at())
    assert stop.polygon.id == STOP_POLYGON_ID
    assert {each.polygon.id for each in persons} == {o.track_id for o in constraints.obstacles}
    by_id = {each.polygon.id: shape(each.polygon.polygon) for each in persons}
    gaps = []
    for obstacle in constraints.obstacles:
        circle = ShapelyPoint(obstacle.center_odom_m).buffer(obstacle.radius_m)
        # Single precision on the wire, double precision here.
        assert by_id[obstacle.track_id].buffer(1e-6).contains(circle)
    for each in persons:
        obstacle = next(o for o in constraints.obstacles if o.track_id == each.polygon.id)
        gaps.append(float(np.linalg.norm(obstacle.center_odom_m)) - obstacle.radius_m)
    assert gaps == sorted(gaps, reverse=True)


@given(finite(0.0, 1.5))
def test_the_stop_polygon_is_in_the_footprint_exactly_when_the_limit_cannot_be_sent(limit) -> None:
    (stop,) = collision_polygons(limited(limit), ROBOT, None, base_frame="base")
    drawn = shape(stop.polygon.polygon)
    assert stop.header.frame_id == "base"
    if limit < SLOWEST_MPS:
        assert FOOTPRINT.contains_properly(drawn)
        assert drawn.area > 0.5 * FOOTPRINT.area
    else:
        assert drawn.distance(FOOTPRINT) > 900.0


@given(finite(-1.5, 1.5))
def test_the_stop_zone_is_the_footprint_stretched_by_the_stopping_distance(speed: float) -> None:
    zone = shape(stop_zone(ROBOT, speed, 5.0).polygon)
    # The stopping distance v·T + v²/2a.
    reach = abs(speed) * ROBOT.reaction_time_s + speed**2 / (2.0 * ROBOT.max_deceleration_mps2)
    ahead = affinity.translate(FOOTPRINT, np.sign(speed) * reach)
    wanted = FOOTPRINT.union(ahead).convex_hull
    assert zone.symmetric_difference(wanted).area < 1e-9


@settings(max_examples=40)
@given(crowds(), finite(-5.0, 5.0), finite(-5.0, 5.0))
def test_the_grid_is_occupied_where_the_costmap_is_lethal(tracks, x: float, y: float) -> None:
    constraints = around(tracks)
    grid = occupancy_grid(constraints, (x, y), size_m=6.0, resolution_m=0.1)
    cells = np.frombuffer(grid.data, np.int8).reshape(grid.info.height, grid.info.width)
    corner = np.array([grid.info.origin.position.x, grid.info.origin.position.y])
    costs = paint_costmap(np.zeros((60, 60), np.uint8), corner, 0.1, constraints)
    assert np.array_equal(cells == 100, costs == 254)
    assert set(np.unique(cells)) <= {0, 100}
    # The grid moves by whole cells, so that its cells stay at the same places.
    assert np.allclose(corner / 0.1, np.round(corner / 0.1), atol=1e-6)
    assert (np.abs(corner + 3.0 - [x, y]) <= 0.1 + 1e-9).all()


@pytest.mark.parametrize(
    "change", [{"size_m": 0.0}, {"size_m": 500.0}, {"size_m": 1e308}, {"resolution_m": 0.0}]
)
def test_a_grid_without_cells_or_with_too_many_is_refused(change) -> None:
    with pytest.raises(NavError):
        occupancy_grid(limited(1.0), (0.0, 0.0), **change)


@settings(max_examples=40)
@given(crowds())
def test_every_person_is_in_the_messages_of_circles_obstacles_boxes_and_markers(tracks) -> None:
    constraints = around(tracks)
    circles, teb = circle_objects(constraints), teb_obstacles(constraints, frame_id="world")
    assert teb.header.frame_id == "world"
    assert len({each.uuid.uuid for each in circles}) == len(circles)
    assert [each.uuid for each in circle_objects(constraints)] == [each.uuid for each in circles]
    for obstacle, circle, moving, found in zip(
        constraints.obstacles,
        circles,
        teb.obstacles,
        detections(constraints).detections,
        strict=True,
    ):
        x, y = obstacle.center_odom_m
        vx, vy = obstacle.velocity_odom_mps
        assert (circle.fill, circle.value, circle.radius) == (True, 100, obstacle.radius_m)
        assert (circle.center.x, circle.center.y) == (x, y)
        (center,) = moving.polygon.points
        assert (center.x, center.y, moving.radius, moving.id) == (
            (x, y, obstacle.radius_m, obstacle.track_id)
        )
        assert (moving.velocities.twist.linear.x, moving.velocities.twist.linear.y) == (vx, vy)
        size, box = found.bbox.size, found.bbox.center
        assert (size.x, size.y, size.z) == (*(2.0 * obstacle.radius_m,) * 2, obstacle.height_m)
        assert box.position.z == 0.5 * obstacle.height_m
        # The rotation about z turns x to the person's direction.
        turn = box.orientation
        heading = np.array([1.0 - 2.0 * turn.z**2, 2.0 * turn.w * turn.z])
        assert np.allclose(heading * math.hypot(vx, vy), (vx, vy), atol=1e-9)
        scores = {each.hypothesis.class_id: each.hypothesis.score for each in found.results}
        assert scores == {"person": 1.0, "aware_person": obstacle.awareness_lower}
    first, *rest = markers(constraints, robot_at()).markers
    assert first.action == Marker.DELETEALL
    assert len({(each.ns, each.id) for each in rest}) == len(rest)
    assert all(each.lifetime.sec > 0 for each in rest)
    assert sum(each.ns == "body" for each in rest) == len(constraints.obstacles)
    assert constraints.limited_by in rest[-1].text


def test_people_carry_awareness_in_their_tags() -> None:
    seen = person(track_id=4, position=(3.0, 1.0), velocity=(0.5, 0.0), awareness_lower=0.75)
    constraints = around([seen])
    (message,) = people(constraints, [seen]).people
    tags = dict(zip(message.tagnames, message.tags, strict=True))
    assert message.name == "4"
    assert float(tags["awareness_lower"]) == constraints.obstacles[0].awareness_lower
    assert float(tags["radius_m"]) == pytest.approx(constraints.obstacles[0].radius_m, abs=5e-4)
    assert float(tags["awareness"]) == seen.awareness
    assert tags["status"] == "confirmed"
    assert message.reliability == 1.0
    # Of a person without a track, whom the adapter still keeps.
    (kept,) = people(constraints, []).people
    assert kept.reliability == 0.0
    assert kept.tagnames == ("awareness_lower", "radius_m")


ALERTS = st.builds(
    Alert,
    track_id=st.integers(0, 99),
    kind=st.sampled_from(["light", "voice", "horn"]),
    time_to_closest_s=finite(0.0, 30.0),
    closest_gap_m=finite(0.0, 5.0),
    reason=st.text(max_size=20),
)


@settings(max_examples=40)
@given(st.lists(ALERTS, max_size=4), st.booleans(), st.booleans())
def test_alerts_follow_the_state_of_the_limit_as_warnings(given_alerts, stale, suffices) -> None:
    constraints = replace(
        limited(0.25), alerts=tuple(given_alerts), stale=stale, braking_suffices=suffices
    )
    state, *warnings = alerts(constraints).status
    wanted = DiagnosticStatus.WARN if stale else DiagnosticStatus.OK
    assert state.level == (wanted if suffices else DiagnosticStatus.ERROR)
    assert state.name == "awarenav: speed limit"
    assert constraints.limited_by in state.message
    values = {each.key: each.value for each in state.values}
    assert values["speed_limit_mps"] == "0.250"
    assert values["braking_suffices"] == ("true" if suffices else "false")
    assert values["stale"] == ("true" if stale else "false")
    for alert, status in zip(given_alerts, warnings, strict=True):
        assert (status.level, status.message) == (DiagnosticStatus.WARN, alert.reason)
        assert status.name == f"awarenav: {alert.kind}"
        values = {each.key: each.value for each in status.values}
        assert int(values["track_id"]) == alert.track_id
        assert values["time_to_closest_s"] == f"{alert.time_to_closest_s:.3f}"
        assert values["closest_gap_m"] == f"{alert.closest_gap_m:.3f}"
        assert not {"means", "wins_s"} & set(values)


@pytest.mark.parametrize("means", ["light", "voice"])
def test_requests_and_answers_are_no_fault_and_follow_the_warnings(means: str) -> None:
    warning = Alert(3, "horn", 1.0, 0.2, "track 3: 1.0 s to contact")
    request = Alert(4, "attention", 0.0, 1.5, "limits the robot", means=means, wins_s=2.1)
    constraints = replace(
        limited(0.25), alerts=(warning, request), answers=(Answer(4, 0.9), Answer(7, 1.25))
    )
    _, horn, asked, *answers = alerts(constraints).status
    assert (horn.name, horn.level) == ("awarenav: horn", DiagnosticStatus.WARN)
    assert (asked.name, asked.level) == ("awarenav: attention", DiagnosticStatus.OK)
    assert asked.message == "limits the robot"
    values = {each.key: each.value for each in asked.values}
    assert values["track_id"] == "4"
    assert (values["means"], values["wins_s"]) == (means, "2.100")
    assert [(each.name, each.level) for each in answers] == [
        ("awarenav: answer", DiagnosticStatus.OK)
    ] * 2
    told = [{each.key: each.value for each in status.values} for status in answers]
    assert told == [{"track_id": "4", "after_s": "0.900"}, {"track_id": "7", "after_s": "1.250"}]


MPPI_RADPS = 1.9


def obeying(sent_mps: float, robot: RobotProfile, share: np.ndarray, yaw_rate: float) -> float:
    """Return the speed of the robot's fastest point under a controller that obeys the message.

    Args:
        sent_mps: the limit in the message.
        robot: its profile.
        share: (2,) in [-1, 1], of the limits of x and y that the controller uses.
        yaw_rate: in [-1, 1], of the controller's largest yaw rate, which it scales.
    """
    velocity = sent_mps * share
    if robot.moves_sideways is False:
        velocity[1] = 0.0
    turn = yaw_rate * (robot.max_yaw_rate_radps or MPPI_RADPS) * sent_mps / robot.max_speed_mps
    if robot.min_turning_radius_m is not None:
        most = abs(velocity[0]) / robot.min_turning_radius_m
        turn = min(max(turn, -most), most)
    x, y = robot.footprint_m.T
    return float(np.hypot(velocity[0] - turn * y, velocity[1] + turn * x).max())


robots = st.builds(
    lambda drive, yaw_rate, offset, speed: replace(
        ROBOT,
        drive=drive,
        max_yaw_rate_radps=yaw_rate,
        footprint_m=ROBOT.footprint_m + np.array([offset, 0.0]),
        max_speed_mps=speed,
        min_turning_radius_m=0.9 if drive == "ackermann" else None,
    ),
    st.sampled_from(["differential", "holonomic", "ackermann", None]),
    st.none() | finite(0.1, 4.0),
    finite(-0.36, 0.36),
    finite(0.3, 2.5),
)
shares = st.sampled_from([-1.0, 0.0, 1.0]) | finite(-1.0, 1.0)


@given(robots, finite(0.02, 3.0), shares, shares, shares, st.booleans())
def test_no_point_is_faster_than_the_limit_under_an_obedient_controller(
    robot, limit, x, y, yaw_rate, percentage
):
    constraints = NavConstraints(0.0, (), limit, "a test", False, robot=robot)
    message = speed_limit(constraints, robot.max_speed_mps, percentage=percentage)
    sent_mps = message.speed_limit * (robot.max_speed_mps / 100.0 if percentage else 1.0)
    fastest = obeying(sent_mps, robot, np.array([x, y]), yaw_rate)
    assert sent_mps <= SLOWEST_MPS + 1e-12 or fastest <= limit + 1e-9


@pytest.mark.parametrize(
    ("drive", "factor"),
    [
        ("differential", 1.0 + 1.9 / 1.5 * math.hypot(0.3625, 0.25)),
        ("holonomic", math.sqrt(2.0) + 1.9 / 1.5 * math.hypot(0.3625, 0.25)),
        (None, math.sqrt(2.0) + 1.9 / 1.5 * math.hypot(0.3625, 0.25)),
    ],
)
def test_what_is_sent_is_no_lower_than_it_must_be(drive: str | None, factor: float) -> None:
    """1.56 times the limit at the corner of a differential drive, 1.97 of one that moves aside."""
    robot = replace(ROBOT, drive=drive)
    constraints = NavAdapter(AwarenessPolicy.preset("balanced"), robot).update(
        [person(position=(3.0, 0.0))], robot_at(speed_mps=0.5), 0.0
    )
    assert 0.1 < constraints.speed_limit_mps < 1.4
    messages = dict(outgoing(constraints, (), robot, robot_at(), Frames()))
    sent = messages["speed_limit"].speed_limit
    assert sent == pytest.approx(constraints.speed_limit_mps / factor)
    turned = obeying(sent, robot, np.array([1.0, 1.0]), 1.0)
    assert 0.8 * constraints.speed_limit_mps < turned <= constraints.speed_limit_mps


@pytest.mark.parametrize("drive", ["differential", "holonomic", None])
def test_where_nobody_is_the_robot_keeps_its_own_maximum(drive: str | None) -> None:
    robot = replace(ROBOT, drive=drive)
    adapter = NavAdapter(AwarenessPolicy.preset("balanced"), robot)
    constraints = adapter.update([], robot_at(), 0.0)
    assert speed_limit(constraints, 1.5).speed_limit == pytest.approx(0.999 * 1.5)


@given(st.floats(0.1, 1.5), st.floats(-1.5, 1.5), st.floats(0.05, 1.4), st.floats(0.0, 1.0))
def test_on_its_curve_no_point_of_a_robot_that_keeps_it_is_faster_than_the_limit(
    speed_mps, yaw_rate_radps, limit_mps, slower
):
    curve = replace(ROBOT, brakes_on_curve=True, drive="differential", max_yaw_rate_radps=1.5)
    state = RobotState(5.0, [0.0, 0.0], 0.0, speed_mps, yaw_rate_radps)
    constraints = replace(limited(limit_mps), robot=curve)
    worst_mps = speed_limit(constraints, 1.5).speed_limit
    sent_mps = speed_limit(constraints, 1.5, state=state).speed_limit
    assert worst_mps <= sent_mps <= limit_mps
    turning = min(abs(yaw_rate_radps) / speed_mps, 1.5 / curve.max_speed_mps)
    driven_mps = (1.0 - slower) * sent_mps
    assert driven_mps * (1.0 + curve.circumscribed_radius_m * turning) <= limit_mps + 1e-9
    assert (
        speed_limit(
            replace(constraints, robot=replace(curve, brakes_on_curve=False)), 1.5, state=state
        ).speed_limit
        == worst_mps
    )


def test_a_limit_that_is_too_low_to_send_is_a_stop_on_every_topic() -> None:
    robot = replace(ROBOT, drive="holonomic")
    limit = 1.5 * SLOWEST_MPS
    constraints = NavConstraints(0.0, (), limit, "a test", False, robot=robot)
    messages = dict(outgoing(constraints, (), robot, robot_at(), Frames()))
    assert messages["speed_limit"].speed_limit == SLOWEST_MPS
    corners = messages["collision_polygons"].polygon.polygon.points
    assert all(abs(corner.x) < 1.0 for corner in corners)


def test_the_speed_mask_is_for_the_fastest_point_too() -> None:
    masks = {}
    for drive in ("differential", "holonomic"):
        robot = replace(ROBOT, drive=drive)
        adapter = NavAdapter(AwarenessPolicy.preset("balanced"), robot)
        constraints = adapter.update([person(position=(3.0, 0.0))], robot_at(), 0.0)
        stream = SpeedMaskStream(SpeedMaskSettings(size_m=8.0), "odom")
        (_, mask), *_ = (
            each
            for each in stream.messages(constraints, robot_at(), lambda key: True)
            if each[0] == "speed_mask"
        )
        masks[drive] = np.frombuffer(mask.data, np.int8).astype(float)
    limited = masks["differential"] > 10.0
    assert limited.any()
    assert masks["holonomic"][limited] / masks["differential"][limited] == pytest.approx(
        (1.0 + 0.5578) / (math.sqrt(2.0) + 0.5578), abs=0.08
    )
    assert ((masks["holonomic"] == 0.0) == (masks["differential"] == 0.0)).all()
