"""The rows of ``episodes.csv``."""

import math

from sim_tests import Scenario, run_crossing
from sim_tests.demo import EPISODE_COLUMNS, episode_row


def test_a_row_has_one_cell_per_column_and_no_infinities():
    empty = run_crossing(
        Scenario.shipped("crossing_attentive")
        .without_people()
        .model_copy(update={"duration_s": 0.5}),
        policy="balanced",
    )
    assert math.isinf(empty.min_separation_m)
    row = episode_row(empty)
    assert "inf" not in row
    assert len(row) == len(EPISODE_COLUMNS)
