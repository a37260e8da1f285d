"""The same job by ``run_crossing`` and in a run gives the same frames, to the bit."""

from __future__ import annotations

import numpy as np
import pytest
from run_scenes import SHORT

from sim_tests import run_crossing
from sim_tests.scenario import ScenarioTemplate
from sim_tests.study.runs import observed_episode, plan_jobs

_SHORT = SHORT.format(name="short")
ADULT = _SHORT + "    gaze: [{t_s: 0.0, look: robot}]\n"
CHILD = _SHORT + "    stature_m: 1.15\n"
TWO_VIEWS = ADULT + "camera: {views_deg: [0.0, 90.0]}\n"
PIXELS = [
    pytest.param(text, "pixels", "camera", marks=pytest.mark.full)
    for text in (ADULT, CHILD, TWO_VIEWS)
]


@pytest.mark.parametrize(
    ("text", "perception", "sensors"),
    [
        (ADULT, "truth", "camera"),
        (ADULT, "keypoints", "camera"),
        (CHILD, "keypoints", "camera+scanner"),
        *PIXELS,
    ],
)
def test_the_same_job_by_the_api_and_in_a_run_gives_the_same_frames(text, perception, sensors):
    template = ScenarioTemplate.from_text(text)
    (job,) = plan_jobs([template], ["balanced"], [3], perception=perception, sensors=[sensors])
    in_a_run, _ = observed_episode(job)
    by_the_api = run_crossing(
        template.for_seed(3), policy="balanced", perception=job.perception, seed=3
    )
    assert len(in_a_run.frames) == len(by_the_api.frames)
    seen = 0
    for one, other in zip(in_a_run.frames, by_the_api.frames, strict=True):
        assert one.command == other.command
        assert one.constraints.speed_limit_mps == other.constraints.speed_limit_mps
        assert np.array_equal(one.robot_state.position_odom_m, other.robot_state.position_odom_m)
        assert len(one.tracks) == len(other.tracks)
        for track, same in zip(one.tracks, other.tracks, strict=True):
            assert np.array_equal(track.position_odom_m, same.position_odom_m)
            assert np.array_equal(track.covariance_odom, same.covariance_odom)
            assert track.awareness == same.awareness
            seen += 1
    assert seen > 5
