"""Starts of simulated bodies before simulated scanners, as ``--parts starts`` measures them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tracking._starts import measure_starts, start_lines, worth_lines


@pytest.mark.slow
def test_no_start_is_earlier_than_the_delay_and_the_velocity_shows_it_later() -> None:
    found = measure_starts(8, 40.0, 0)
    assert found.moving > 200
    assert found.short == 0
    assert np.isfinite(found.standing_s).mean() > 0.8
    assert 0.1 < np.median(found.standing_s) < 0.25
    assert np.median(found.noticed_s) < np.median(found.shown_s)
    assert "0 of" in start_lines("40 Hz", found)[0]


def test_a_shorter_delay_is_worth_more_and_nothing_from_two_fifths_of_a_second_on() -> None:
    saved = [float(line.split()[2]) for line in worth_lines()[1:]]
    limits = [[float(cell) for cell in line.split()[4:]] for line in worth_lines()[1:]]
    assert saved == [0.48, 0.4, 0.32, 0.24, 0.16, 0.0, 0.0]
    assert (np.diff(np.array(limits), axis=0) <= 0.0).all()
    assert limits[-1] == limits[-2]
