"""A child is one track in the right place, from keypoints of its body and scans of its legs."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.child_and_seated import SETTLED_S, Case, Sample, encounter


def settled(case: Case, sensors: str = "both") -> list[Sample]:
    samples = list(encounter(case, sensors))  # type: ignore[arg-type]
    return [sample for sample in samples if sample.stamp_s >= SETTLED_S]


def one_track_within(samples: list[Sample], limit_m: float) -> None:
    """Check that there is one track, always the same, with at most this error in 95 %."""
    assert {len(sample.sure) for sample in samples} == {1}
    assert len({sample.sure[0].id for sample in samples}) == 1
    assert np.percentile([sample.error_m for sample in samples], 95.0) <= limit_m


CHILDREN = [
    Case("faces the robot", 1.1, "jamila", (2.5, 0.3), -170.0, duration_s=3.0),
    Case("walks across", 1.1, "kofi", (3.5, 1.2), -90.0, speed_mps=0.8, duration_s=3.0),
    Case("is passed", 1.1, "ivan", (3.0, 1.0), -150.0, drives=True, duration_s=4.5),
    Case(
        *("comes towards a robot that drives", 1.1, "linnea", (5.5, -0.8), 180.0),
        speed_mps=1.0,
        drives=True,
        duration_s=3.5,
    ),
]


@pytest.mark.parametrize("case", CHILDREN, ids=lambda case: case.name)
def test_a_child_is_one_track_within_20_cm(case: Case) -> None:
    one_track_within(settled(case), 0.2)


def test_the_camera_alone_puts_a_child_far_behind_its_place() -> None:
    samples = settled(CHILDREN[0], "camera")
    errors = np.array([sample.error_m for sample in samples])
    away = np.linalg.norm(CHILDREN[0].position_m)
    # Its keypoints are those of an average adult who is 1.71 / 1.1 times as far away.
    assert 0.35 * away < np.median(errors) < 0.75 * away
