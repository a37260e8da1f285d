"""Eyes that report the truth, and the choice of eyes by name."""

from __future__ import annotations

import numpy as np

from perception import AttentionCone
from sim_tests import run_crossing
from sim_tests.crossing import Stage
from sim_tests.crossing.eyes import MapView, TrueEyes
from sim_tests.scenario import ScenarioTemplate

CONE = AttentionCone()


def test_the_oracle_sees_in_all_directions_but_not_through_racks() -> None:
    """Blind corner: the worker comes out of a cross aisle behind a rack."""
    scenario = ScenarioTemplate.shipped("blind_corner").median()
    result = run_crossing(scenario, policy="balanced", perception="oracle")
    start = scenario.model_copy(update={"duration_s": 0.5})
    everywhere = run_crossing(start, policy="balanced", perception="truth")
    first = {
        kind: next(frame.t_s for frame in run.frames if frame.observations)
        for kind, run in (("oracle", result), ("truth", everywhere))
    }
    assert first["truth"] == 0.0
    assert first["oracle"] > 0.0
    # It reports the truth about the people it sees.
    for frame in result.frames:
        for observation, worker in zip(frame.observations, frame.observed_workers, strict=True):
            assert observation.awareness == frame.truth[worker].awareness
    # A worker behind the robot is still seen, outside the camera's field of view.
    behind = [
        observation.position_camera_m[2] < 0.0
        for frame in result.frames
        for observation in frame.observations
    ]
    assert any(behind)


def test_the_oracle_sees_everybody_who_is_not_hidden_by_a_high_box() -> None:
    scenario = ScenarioTemplate.shipped("crowd_of_eight").median()
    with Stage(scenario, np.zeros(len(scenario.workers)), np.random.default_rng(0)) as stage:
        view = MapView.of(stage.warehouse)
        T_odom_camera = stage.amr.T_odom_camera
        truth = stage.truth(CONE, T_odom_camera)
        positions = np.array([each.position_camera_m for each in truth])
        odom = positions @ T_odom_camera[:2, :3].T + T_odom_camera[:2, 3]
        free = view.visibility(odom, T_odom_camera) > 0.0
        near = np.linalg.norm(positions, axis=1) <= 20.0
        seen = [worker for _, worker in TrueEyes(view).observe(0.0, T_odom_camera, truth)]
        assert seen == np.flatnonzero(free & near).tolist()
        everybody = [worker for _, worker in TrueEyes().observe(0.0, T_odom_camera, truth)]
        assert everybody == np.flatnonzero(near).tolist()
