"""With pixels, ``run_crossing`` and a run give the same episode, to the bit."""

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


@pytest.mark.parametrize("text", [ADULT, CHILD, TWO_VIEWS])
def test_the_same_seed_gives_the_same_episode_by_the_api_and_in_a_run(text):
    template = ScenarioTemplate.from_text(text)
    (job,) = plan_jobs([template], ["balanced"], range(3, 4), perception="pixels")
    in_a_run, _ = observed_episode(job)
    by_the_api = run_crossing(template.for_seed(3), policy="balanced", perception="pixels", seed=3)
    assert len(in_a_run.frames) == len(by_the_api.frames)
    seen = 0
    for one, other in zip(in_a_run.frames, by_the_api.frames, strict=True):
        assert one.constraints.speed_limit_mps == other.constraints.speed_limit_mps
        assert len(one.tracks) == len(other.tracks)
        for track, same in zip(one.tracks, other.tracks, strict=True):
            assert np.array_equal(track.position_odom_m, same.position_odom_m)
            assert np.array_equal(track.covariance_odom, same.covariance_odom)
            seen += 1
    assert seen > 5
