"""Crossings whose scanners publish and see nothing: the robot stops, as if they were silent."""

from __future__ import annotations

import pytest

from sim_tests import run_crossing
from sim_tests.crossing.faults import Fault


def blind(width_deg: float, returns: str) -> Fault:
    return Fault.model_validate(
        {
            "name": "blind",
            "scanner": {"blind": {"width_deg": width_deg, "at_deg": 0.0, "returns": returns}},
        }
    )


@pytest.mark.slow
@pytest.mark.parametrize(("width_deg", "returns"), [(360.0, "inf"), (100.0, "nan")])
def test_a_robot_whose_scanners_are_blind_ahead_stands(width_deg: float, returns: str) -> None:
    fault = blind(width_deg, returns)
    result = run_crossing(
        "standing_in_aisle", policy="balanced", perception="scanner", seed=0, fault=fault
    )
    assert not result.contacts
    assert result.time_to_goal_s is None
    limits = [frame.constraints.speed_limit_mps for frame in result.frames]
    assert max(limits) == 0.0
    assert all(frame.constraints.stale for frame in result.frames)
