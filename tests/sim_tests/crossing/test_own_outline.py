"""No track lies within the outline of a robot that touches nobody."""

from __future__ import annotations

import numpy as np
import pytest

from sim_tests import run_crossing


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 5])
def test_a_driving_robot_does_not_find_people_in_itself(seed: int) -> None:
    within: list[tuple[float, list[float]]] = []

    def look(frame, stage) -> None:
        state, corners = frame.robot_state, stage.amr.profile.footprint_m
        cos, sin = np.cos(state.heading_odom_rad), np.sin(state.heading_odom_rad)
        for track in frame.tracks:
            place = [[cos, sin], [-sin, cos]] @ (track.position_odom_m - state.position_odom_m)
            if (place > corners.min(axis=0)).all() and (place < corners.max(axis=0)).all():
                within.append((frame.t_s, place.tolist()))

    result = run_crossing(
        "late_glance", policy="balanced", perception="keypoints+scanner", seed=seed, observer=look
    )
    assert result.success
    assert not within
