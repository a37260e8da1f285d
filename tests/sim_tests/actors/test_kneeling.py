"""People on both knees: upright thighs, level shanks, a body that rays meet, and no step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError
from worker_looks import LOOKS

from perception import layouts as kp
from sim_tests import SimError
from sim_tests.actors.behaviour import PersonSpec, RobotBody, Surroundings, Walker, WorkerScript
from sim_tests.actors.body import (
    KNEELING_EYE_HEIGHT_SHARE,
    Activity,
    Worker,
    load_worker,
    skin_points,
)
from sim_tests.world import Warehouse
from sim_tests.world.bullet import pybullet
from sim_tests.world.hall import WarehouseLayout

SHINS = (
    (kp.LEFT_HIP, kp.LEFT_KNEE, kp.LEFT_ANKLE),
    (kp.RIGHT_HIP, kp.RIGHT_KNEE, kp.RIGHT_ANKLE),
)


@pytest.mark.parametrize("look", LOOKS)
@pytest.mark.parametrize("stature_m", [None, 1.1])
def test_thighs_are_upright_and_knees_and_feet_on_the_floor(
    hall: Warehouse, look: str, stature_m: float | None
) -> None:
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


def test_a_kneeling_person_looks_but_never_moves() -> None:
    here = {"x_m": 0.0, "y_m": 0.0}
    with pytest.raises(ValidationError, match=r"'kneeling' stays at one place: .* got 2"):
        PersonSpec(name="k", route=[here, {"x_m": 1.0, "y_m": 0.0}], activity="kneeling")
    with pytest.raises(SimError, match="kneels stays there"):
        Activity("kneeling", "none", 0.5)
    assert WorkerScript(
        path=[{"t_s": 0.0, **here}], activities=[{"t_s": 0.0, "activity": "kneeling"}]
    ).stays
    robot = RobotBody(1.2, 0.0, math.pi, -0.5, 0.0, 0.3, 0.25, (0.9, 0.0, 0.6))
    pitch_rad = {}
    for activity in ("none", "kneeling"):
        spec = PersonSpec(
            name="k", route=[here], activity=activity, heading_deg=0.0, glances={"watches": True}
        )
        person = Walker(spec, np.random.default_rng(0), np.empty((0, 4)))
        for tick in range(40):
            motion = person.motion(0.05 * tick, Surroundings(robot, (), lambda: True))
        pitch_rad[activity] = motion.head_pitch_rad + motion.eye_pitch_rad
        assert person.noticed_s is not None
        moved = float(np.linalg.norm(motion.position_odom_m))
        assert moved == 0.0 if activity == "kneeling" else moved > 0.05
    assert pitch_rad["none"] < pitch_rad["kneeling"] - 0.1
