"""People who sit or kneel: their limbs, what scanners and rays meet of them, and no step."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from worker_looks import LOOKS

from perception import layouts as kp
from sim_tests import SimError
from sim_tests.actors.behaviour import MovingBody, Person, PersonSpec, RobotBody, Surroundings
from sim_tests.actors.body import (
    KNEELING_EYE_HEIGHT_SHARE,
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
SHINS = ((kp.LEFT_HIP, kp.LEFT_KNEE, kp.LEFT_ANKLE), (kp.RIGHT_HIP, kp.RIGHT_KNEE, kp.RIGHT_ANKLE))


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
def test_seated_thighs_are_level_shanks_upright_and_the_trunk_is_above_the_place(
    hall, look, stature_m
):
    worker = seated(hall, look, stature_m)
    points = in_body(worker.keypoints_odom_m)
    size = worker.stature_m / 1.75
    for hip, knee, ankle in SHINS:
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


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("stature_m", [None, 1.1])
def test_kneeling_thighs_are_upright_and_knees_and_feet_on_the_floor(hall, look, stature_m) -> None:
    worker = Worker(hall, stature_m, look=look)
    worker.place((0.0, 0.0), 0.0, activity="kneeling")
    points = worker.keypoints_odom_m
    for hip, knee, ankle in SHINS:
        thigh, shank = points[knee] - points[hip], points[ankle] - points[knee]
        assert -thigh[2] / np.linalg.norm(thigh) > math.cos(math.radians(15.0))
        assert -shank[0] / np.linalg.norm(shank) > math.cos(math.radians(15.0))
    assert np.linalg.norm(worker.chest_odom_m[:2]) < 0.05
    assert worker.eyes_odom_m[2] == pytest.approx(
        KNEELING_EYE_HEIGHT_SHARE * worker.stature_m, abs=0.03 * worker.stature_m
    )
    skin = load_worker(look).levels[1]
    surface = skin_points(worker.asset.joints_m, worker.pose, skin.vertices_m, skin.weights)
    assert surface[:, 2].min() == pytest.approx(0.0, abs=0.015)
    assert worker.held is None


@pytest.mark.parametrize("stature_m", [1.8, 1.2])
def test_rays_meet_the_shanks_behind_and_pass_above_the_head(stature_m: float) -> None:
    with Warehouse(WarehouseLayout.named("open")) as hall:
        worker = Worker(hall, stature_m)
        worker.place((1.0, 2.0), 0.5 * math.pi, activity="kneeling")
        behind, size = 0.3 * stature_m / 1.75, stature_m / 1.75

        def met(y_m: float, z_m: float) -> bool:
            ray = [[-1.0, y_m, z_m]], [[3.0, y_m, z_m]]
            (hit,) = pybullet.rayTestBatch(*ray, physicsClientId=hall.client)
            return int(hit[0]) == worker.body

        assert met(2.0 - behind, 0.07 * size)  # the shank, where somebody who stands has nothing
        assert met(2.0, 0.3 * size)
        assert met(2.0, 0.6 * stature_m)
        assert not met(2.0 - behind, 0.4 * size)
        assert not met(2.0, 0.8 * stature_m)
        worker.place((1.0, 2.0), 0.5 * math.pi)
        assert met(2.0, 0.8 * stature_m)
        assert not met(2.0 - behind, 0.07 * size)


@pytest.mark.parametrize("activity", ["sitting", "kneeling"])
def test_low_people_watch_but_never_move(activity: str) -> None:
    here = {"x_m": 0.0, "y_m": 0.0}
    with pytest.raises(ValidationError, match=r"one p.*, got 2"):
        PersonSpec(name="s", route=[here, {"x_m": 1.0, "y_m": 0.0}], activity=activity)
    with pytest.raises(SimError, match="stays"):
        Activity(activity, "none", 0.5)
    # A robot before them, and somebody so near that they would step aside.
    robot = RobotBody(1.2, 0.0, math.pi, 0.0, 0.0, 0.3, 0.25, (0.9, 0.0, 0.6))
    near = (MovingBody(0.0, 0.4, 0.0, 0.0),)
    pitches = {}
    for doing in ("none", activity):
        spec = PersonSpec(
            name="s", route=[here], activity=doing, heading_deg=0.0, glances={"watches": True}
        )
        person = Person(spec, np.random.default_rng(0), NO_BOXES)
        around = Surroundings(robot, near if doing == activity else (), lambda: True)
        for tick in range(60):
            touches = ((1.0, 0.0),) if doing == activity and tick == 41 else ()
            motion = person.step(0.05 * tick, replace(around, touches=touches))
            if doing == activity:
                np.testing.assert_array_equal(motion.position_odom_m, [0.0, 0.0])
                assert motion.heading_odom_rad == 0.0
        assert person.noticed_s is not None
        pitches[doing] = motion.head_pitch_rad + motion.eye_pitch_rad
    # The eyes of somebody who stands are higher: they look further down.
    assert pitches["none"] < pitches[activity] - 0.1
