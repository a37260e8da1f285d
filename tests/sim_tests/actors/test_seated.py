"""People who sit: level thighs on a seat that scanners and the robot meet, and who never move."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError
from worker_looks import LOOKS

from perception import layouts as kp
from sim_tests import SimError
from sim_tests.actors.behaviour import (
    MovingBody,
    PersonSpec,
    RobotBody,
    Surroundings,
    Walker,
)
from sim_tests.actors.body import (
    SEATED_EYE_HEIGHT_SHARE,
    Activity,
    Worker,
    load_worker,
    skin_points,
)
from sim_tests.world import Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.hall import WarehouseLayout
from sim_tests.world.sightlines import cut_surfaces

NO_BOXES = np.empty((0, 4))
HEADING_RAD = 0.7
PLACE_M = np.array([1.0, -2.0])
SEATED = {"t_s": 0.0, "activity": "sitting"}


def seated(hall: Warehouse, look: str, stature_m: float | None = None, **seat: str) -> Worker:
    worker = Worker(hall, stature_m, look=look, **seat)
    worker.place(PLACE_M, HEADING_RAD, activity="sitting")
    return worker


def in_body(points_odom_m: np.ndarray) -> np.ndarray:
    """Return points in the heading frame of the place."""
    c, s = math.cos(HEADING_RAD), math.sin(HEADING_RAD)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return (points_odom_m - [*PLACE_M, 0.0]) @ turn


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("stature_m", [None, 1.1])
def test_thighs_are_level_shanks_upright_and_the_trunk_is_above_the_place(
    hall: Warehouse, look: str, stature_m: float | None
) -> None:
    worker = seated(hall, look, stature_m)
    points = in_body(worker.keypoints_odom_m)
    size = worker.stature_m / 1.75
    for hip, knee, ankle in (
        (kp.LEFT_HIP, kp.LEFT_KNEE, kp.LEFT_ANKLE),
        (kp.RIGHT_HIP, kp.RIGHT_KNEE, kp.RIGHT_ANKLE),
    ):
        thigh, shank = points[knee] - points[hip], points[ankle] - points[knee]
        assert abs(math.asin(thigh[2] / np.linalg.norm(thigh))) < math.radians(15.0)
        assert -shank[2] / np.linalg.norm(shank) > math.cos(math.radians(15.0))
        assert thigh[0] > 0.3 * size
    # The place is that of the trunk, as for people who stand.
    assert np.linalg.norm(in_body(worker.chest_odom_m)[:2]) < 0.05
    assert np.linalg.norm(points[:5, :2].mean(axis=0)) < 0.2 * size
    assert worker.eyes_odom_m[2] == pytest.approx(
        SEATED_EYE_HEIGHT_SHARE * worker.stature_m, abs=0.03 * worker.stature_m
    )
    # Shoes stand on the floor.
    skin = load_worker(look).levels[1]
    lowest = skin_points(worker.asset.joints_m, worker.pose, skin.vertices_m, skin.weights)[
        :, 2
    ].min()
    assert lowest == pytest.approx(0.0, abs=0.012)


def test_at_a_scanners_height_there_are_two_shanks_before_four_legs(hall: Warehouse) -> None:
    worker = seated(hall, "giulia")
    normal = np.array([0.0, 0.0, 1.0])
    skin = worker.skin.surface(1)
    assert skin is not None
    shanks = in_body(cut_surfaces([skin], normal, 0.2)[0].reshape(-1, 3))
    surface = worker.held_object.surface(1)
    assert surface is not None
    legs = in_body(cut_surfaces([surface], normal, 0.2)[0].reshape(-1, 3))
    assert shanks[:, 0].min() > 0.25
    assert 0.3 < shanks[:, 0].mean() < 0.5
    assert np.all(np.abs(shanks[:, 1]) > 0.02)
    assert {(x > 0.03, y > 0.0) for x, y, _ in legs} == {
        (front, left) for front in (False, True) for left in (False, True)
    }
    assert legs[:, 0].max() < shanks[:, 0].min()


def test_a_robot_meets_the_seat_and_it_leaves_with_the_person() -> None:
    with Warehouse(WarehouseLayout.named("open")) as hall:
        worker = seated(hall, "mateo", seat="box")
        above, below = [*PLACE_M, 1.9], [*PLACE_M, 0.2]
        behind = [*(PLACE_M - [math.cos(HEADING_RAD), math.sin(HEADING_RAD)]), 0.2]

        def met(start: list[float]) -> int:
            (hit,) = pybullet.rayTestBatch([start], [below], physicsClientId=hall.client)
            return int(hit[0])

        assert met(above) == worker.body
        assert met(behind) not in (-1, worker.body)
        worker.place(PLACE_M + 3.0, 0.0)
        assert worker.held is None
        assert (met(above), met(behind)) == (-1, -1)


def test_nobody_sits_down_or_stands_up(hall: Warehouse) -> None:
    for before, name in (("none", "sitting"), ("sitting", "phone")):
        with pytest.raises(SimError, match="stays seated"):
            Activity(name, before, 0.5)
    with pytest.raises(SimError, match=r"seat must be one of 'stool', 'box', got 'sofa'"):
        Worker(hall, seat="sofa")  # type: ignore[arg-type]


def test_a_seated_person_watches_but_never_moves() -> None:
    here = {"x_m": 0.0, "y_m": 0.0}
    with pytest.raises(ValidationError, match="route must have one point, got 2"):
        PersonSpec(name="s", route=[here, {"x_m": 1.0, "y_m": 0.0}], activity="sitting")
    spec = PersonSpec(
        name="s", route=[here], activity="sitting", heading_deg=0.0, glances={"watches": True}
    )
    person = Walker(spec, np.random.default_rng(0), NO_BOXES)
    standing = Walker(
        spec.model_copy(update={"activity": "none"}), np.random.default_rng(0), NO_BOXES
    )
    # A robot before them, and somebody so near that they would step aside.
    robot = RobotBody(1.2, 0.0, math.pi, 0.0, 0.0, 0.3, 0.25, (0.9, 0.0, 0.6))
    around = Surroundings(robot, (MovingBody(0.0, 0.4, 0.0, 0.0),), lambda: True)
    pitches = {}
    for name, walker in (("seated", person), ("standing", standing)):
        for tick in range(60):
            motion = walker.motion(0.05 * tick, around)
            if name == "seated":
                np.testing.assert_array_equal(motion.position_odom_m, [0.0, 0.0])
                assert motion.heading_odom_rad == 0.0
            if tick == 40 and name == "seated":
                walker.touch(1.0, 0.0)
        pitches[name] = motion.head_pitch_rad + motion.eye_pitch_rad
    assert person.noticed_s is not None
    # The eyes of somebody who stands are higher: they look further down.
    assert pitches["standing"] < pitches["seated"] - 0.1
