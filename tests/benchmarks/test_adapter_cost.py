"""The benchmark of the adapter compares equal costmaps, and refuses bad input."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.adapter.__main__ import main
from benchmarks.adapter._cost import CYCLE, cost_ms, paint_naively
from benchmarks.adapter._crowd import CELLS, ORIGIN_ODOM_M, RESOLUTION_M, ROBOT, crowd, robot_at
from nav_adapter import AwarenessPolicy, NavAdapter, paint_costmap


def test_the_naive_costmap_equals_ours() -> None:
    (tracks,) = crowd(6, 1, np.random.default_rng(3))
    policy = AwarenessPolicy.preset("balanced")
    constraints = NavAdapter(policy, ROBOT).update(tracks, robot_at(0.0), 0.0)
    ours, naive = np.zeros((2, *CELLS), dtype=np.uint8)
    paint_costmap(ours, ORIGIN_ODOM_M, RESOLUTION_M, constraints)
    paint_naively(naive, constraints)
    # The polygon holds the circle and is less than 1 % wider: 1 cm, or a tenth of a cost.
    assert (naive[ours == 254] == 254).all()
    assert (naive == 254).sum() <= 1.03 * (ours == 254).sum()
    ring = (ours < 254) & (naive < 254)
    ratio = (naive[ring] + 1.0) / (ours[ring] + 1.0)
    assert ratio[ours[ring] > 30].min() >= 1.0 / 1.01
    assert ratio[ours[ring] > 30].max() <= 1.15


def test_every_step_has_a_cost_of_its_own() -> None:
    cost = cost_ms(3, 8, 1, 0, naive=True)
    assert set(cost) == {*CYCLE, "painter", "naive"}
    assert all(milliseconds > 0.0 for milliseconds in cost.values())
    assert cost["naive"] > cost["costmap"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--frames", "0"], "must be a whole number of at least 1, got '0'"),
        (["--seed", "-3"], "--seed must be 0 or more, got -3"),
        (["--out", "no/such/folder/x.json"], "a folder that exists"),
    ],
)
def test_bad_input_is_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2
    assert message in capsys.readouterr().err
