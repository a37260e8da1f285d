"""Range of simulated people of any size, with and without further cues."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks.how_far import BOUND_95, Case, HowFar, cases, tracked
from sim_tests.world import Warehouse
from sim_tests.world.hall import WarehouseLayout

STATURES_M = (1.0, 1.3, 1.75, 1.9)
POSTURES = ("standing", "seated", "bent")


@pytest.fixture(scope="module")
def far() -> Iterator[HowFar]:
    with Warehouse(WarehouseLayout.named("open"), renderer="auto") as warehouse:
        yield HowFar(warehouse)


def people(posture: str, cut: str = "whole", count: int = 6, seed: int = 100) -> list[Case]:
    return [
        case
        for one in STATURES_M
        for case in cases(one, posture, cut, count=count, seed=seed)  # type: ignore[arg-type]
    ]


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize("cues", ["none", "floor"])
def test_the_covariance_covers_people_of_any_size(far: HowFar, posture: str, cues: str) -> None:
    results = far.results(people(posture), cues)  # type: ignore[arg-type]
    assert np.mean([one.mahalanobis2 <= BOUND_95 for one in results]) >= 0.9
    if cues == "floor":
        assert np.median([abs(one.range_error) for one in results]) <= 0.08


@pytest.mark.parametrize("cut", ["shelf", "border"])
@pytest.mark.parametrize("cues", ["none", "floor"])
def test_the_covariance_covers_people_who_are_cut_off(far: HowFar, cut: str, cues: str) -> None:
    results = far.results(people("standing", cut), cues)  # type: ignore[arg-type]
    assert np.mean([one.mahalanobis2 <= BOUND_95 for one in results]) >= 0.9


@pytest.mark.parametrize("posture", POSTURES)
def test_a_depth_image_gives_the_range(far: HowFar, posture: str) -> None:
    results = far.results(people(posture, count=2), "depth")
    assert np.median([abs(one.range_error) for one in results]) <= 0.03


@pytest.mark.parametrize("stature_m", [1.1, 1.75])
def test_the_size_that_a_scanner_told_holds(far: HowFar, stature_m: float) -> None:
    (case,) = cases(stature_m, "standing", "whole", count=1, seed=100)
    found = tracked(far, case)
    for part in (found.ranged, found.lost):
        assert np.median([abs(one.range_error) for one in part]) <= 0.03
        assert np.mean([one.mahalanobis2 <= BOUND_95 for one in part]) >= 0.9
