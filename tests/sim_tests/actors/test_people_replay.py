"""Recorded people: exact at their rows, smooth between them; checks of the table."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim_tests import SimError
from sim_tests.actors.behaviour import ALONE, read_recordings, replayed_people

TABLE = """t_s, id, x_m, y_m, heading_rad, head_yaw_rad
0.0, anna, 0.0, 0.0, 3.0, 0.0
0.4, anna, 0.5, 0.1, 3.1, 0.2
0.0, 7, 5.0, 5.0, ,
0.8, anna, 1.0, 0.1, -3.1, -0.4
1.0, 7, 5.0, 6.0, ,
"""


@pytest.fixture
def table(tmp_path):
    path = tmp_path / "people.csv"
    path.write_text(TABLE)
    return path


def test_rows_are_met_exactly(table):
    anna, seven = replayed_people(table)
    assert (anna.recording.name, seven.recording.name) == ("anna", "7")
    assert anna.look != seven.look
    for t, x, y, heading, yaw in (
        (0.0, 0.0, 0.0, 3.0, 0.0),
        (0.4, 0.5, 0.1, 3.1, 0.2),
        (0.8, 1.0, 0.1, -3.1, -0.4),
    ):
        motion = anna.motion(t, ALONE)
        np.testing.assert_allclose(motion.position_odom_m, [x, y], atol=1e-12)
        assert math.remainder(motion.heading_odom_rad - heading, math.tau) == pytest.approx(0.0)
        assert motion.head_yaw_rad == pytest.approx(yaw, abs=1e-12)


def test_between_rows_velocity_is_the_slope_and_headings_turn_the_short_way(table):
    anna, seven = replayed_people(table)
    for t in np.linspace(0.02, 0.78, 20):
        before, now, after = (anna.motion(t + dt, ALONE) for dt in (-1e-5, 0.0, 1e-5))
        slope = (after.position_odom_m - before.position_odom_m) / 2e-5
        np.testing.assert_allclose(now.velocity_odom_mps, slope, atol=1e-3)
        assert 3.0 <= now.heading_odom_rad <= math.tau - 3.1 + 1e-9
    # Without headings the body faces along its path; before and after the rows it stands.
    assert seven.motion(0.5, ALONE).heading_odom_rad == pytest.approx(math.pi / 2)
    for t, y in ((-1.0, 5.0), (4.0, 6.0)):
        motion = seven.motion(t, ALONE)
        np.testing.assert_allclose(motion.position_odom_m, [5.0, y])
        np.testing.assert_allclose(motion.velocity_odom_mps, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "misses t_s, id, x_m, y_m"),
        ("t_s,id,x_m\n", "misses y_m"),
        ("t_s,id,x_m,y_m,speed\n", "unknown columns 'speed'"),
        ("t_s,id,x_m,y_m,x_m\n", "names x_m twice"),
        ("t_s,id,x_m,y_m\n", "holds no rows"),
        ("t_s,id,x_m,y_m\n0,a,1,north\n", "line 2: y_m must be a finite number, got 'north'"),
        ("t_s,id,x_m,y_m\n0,a,1\n", "line 2: y_m must be a finite number"),
        ("t_s,id,x_m,y_m\n0,a,nan,1\n", "line 2: x_m must be a finite number"),
        ("t_s,id,x_m,y_m\n0,,1,1\n", "line 2: id is empty"),
        ("t_s,id,x_m,y_m\n0,a,1,1\n0,a,2,1\n", "two rows for t_s = 0 s"),
        ("t_s,id,x_m,y_m\n0,a,1,1\n0.1,a,9,1\n", "line 3: 'a' moves 8 m in 0.1 s"),
        (
            "t_s,id,x_m,y_m,heading_rad\n0,a,1,1,0\n1,a,2,1,\n",
            "line 3: heading_rad of 'a' is empty here",
        ),
    ],
)
def test_invalid_tables_are_refused(tmp_path, text, message):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(SimError, match=message):
        read_recordings(path)
