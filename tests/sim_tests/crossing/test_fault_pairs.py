"""Pairs of faults of camera or odometry and of scanners: the robot touches nobody.

Two pairs always run, the others with --full. docs/measures.md has the command for all pairs.
"""

from __future__ import annotations

import pytest

from nav_adapter import AwarenessPolicy
from sim_tests import run_crossing
from sim_tests.crossing.faults import Fault, shipped_faults

SCANNER = tuple(name for name in shipped_faults() if name.startswith("scanner_"))
OTHERS = tuple(name for name in shipped_faults() if name not in SCANNER)
SCENARIOS = ("crossing_from_left", "two_people_one_aware", "blind_corner", "head_on_in_aisle")

# Each fault of camera and odometry once, each of the scanners at least once.
PAIRS = tuple(
    (f"{other}+{SCANNER[3 * row % len(SCANNER)]}", SCENARIOS[row % len(SCENARIOS)])
    for row, other in enumerate(OTHERS)
)


def remembering_policy():
    """Return ``balanced`` with the memory of people who have noticed the robot switched on."""
    data = AwarenessPolicy.preset("balanced").model_dump(mode="json")
    data["filter"]["noticed_memory_s"] = 4.0
    return AwarenessPolicy.model_validate(data)


def test_the_sample_holds_every_fault():
    names = {name for pair, _ in PAIRS for name in pair.split("+")}
    assert names == set(shipped_faults())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pair", "scenario"),
    [
        pytest.param(*each, marks=() if row in (0, 3) else pytest.mark.full)
        for row, each in enumerate(PAIRS)
    ],
)
def test_the_robot_touches_nobody_under_two_faults(pair, scenario):
    result = run_crossing(
        scenario,
        policy=remembering_policy(),
        perception="keypoints+scanner",
        seed=11,
        fault=Fault.of(pair),
    )
    assert result.people
    assert not [contact for contact in result.contacts if contact.by == "robot"]
    # It is no proof of safety that the robot never started.
    assert max(frame.robot_state.speed_mps for frame in result.frames) > 0.3
