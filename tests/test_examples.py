"""Every example runs; the code on the pages is run by ``test_page_code.py``."""

import contextlib
import io
import re
import runpy
import sys
from functools import cache
from unittest.mock import patch

import pytest
from paths import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


# Packages that an example needs beyond the core.
NEEDS = {"orca_rvo2": "pyrvo", "ros2_robot": "cyclonedds"}
# An example that would run for long.
ARGUMENTS = {"ros2_robot": ("1",)}
# Examples that drive end with a line of results.
DRIVING = (
    "crossing_person",
    "dwa_arcs",
    "orca_half_planes",
    "orca_rvo2",
    "mppi_cost",
    "mpc_horizon",
)


@cache
def printed(name, *arguments):
    """Return the output of an example, run as a script with warnings as errors."""
    file = ROOT / "examples" / name
    with (
        contextlib.redirect_stdout(io.StringIO()) as out,
        patch.object(sys, "argv", [str(file), *arguments]),
        patch.object(sys, "path", [str(file.parent), *sys.path]),
    ):
        runpy.run_path(str(file), run_name="__main__")
    return out.getvalue()


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(path):
    if path.stem in NEEDS:
        pytest.importorskip(NEEDS[path.stem], reason="the example needs the extra dev")
    out = printed(path.name, *ARGUMENTS.get(path.stem, ()))
    assert out.strip()
    if path.stem in DRIVING:
        last = out.splitlines()[-1]
        gap_m, excess_mps = (float(x) for x in re.findall(r"(-?[0-9.]+) m(?:/s|,)", last))
        assert "goal reached" in last
        assert gap_m >= 0.2
        assert excess_mps <= 0.01


@pytest.mark.parametrize("name", ["dwa_arcs", "mppi_cost", "orca_half_planes", "orca_rvo2"])
def test_a_planner_that_knows_the_limit_elsewhere_is_sooner_there_than_one_that_does_not(name):
    if name in NEEDS:
        pytest.importorskip(NEEDS[name], reason="the example needs the extra dev")
    planned, straight_on = (
        [
            float(x)
            for x in re.findall(r"([0-9.]+) (?:s|m),", printed(f"{each}.py").splitlines()[-1])
        ]
        for each in (name, "crossing_person")
    )
    assert planned[0] < straight_on[0] - 0.4  # time
    assert planned[1] > straight_on[1]  # gap


def test_the_costmap_example_leaves_the_map_as_it_was(tmp_path):
    picture = tmp_path / "map.png"
    out = printed("nav2_costmap.py", str(picture))
    lethal = [int(text) for text in re.findall(r"(\d+) cells lethal", out)]
    assert lethal[0] > lethal[-1]
    assert "people: 0" in out
    assert picture.stat().st_size > 1000


def test_the_plug_in_example_shows_the_radius_shrink_for_an_aware_person():
    out = printed("plug_into_planner.py")
    radii = [float(text) for text in re.findall(r"radius +([0-9.]+) m", out)]
    limits = [float(text) for text in re.findall(r"limit +([0-9.]+) m/s", out)]
    assert radii[-1] < radii[12] - 0.3
    assert limits[-1] > limits[12]


def test_the_two_sensor_example_keeps_the_person_whom_the_robot_passes():
    out = printed("camera_and_scanner.py")
    times = re.split(r"^ ?(?=[ \d]?\d\.\d s)", out, flags=re.M)[1:]
    people = [re.findall(r"person (\d+) .*least ([0-9.]+)", text) for text in times]
    # The same two people throughout, also when only the scanner sees them.
    assert {tuple(track for track, _ in seen) for seen in people} == {("1", "2")}
    aware = [float(seen[0][1]) for seen in people]
    assert max(aware) > 0.7
    assert all(float(seen[1][1]) == 0.0 for seen in people)
    silent = ["camera is silent" in text for text in times]
    assert sum(silent) > 3
    assert not any(alpha > 0.0 for alpha, gone in zip(aware, silent, strict=True) if gone)
    limits = [float(text) for text in re.findall(r"limit ([0-9.]+) m/s", out)]
    assert max(limits[:10]) == 1.5
    # Without the camera both people count as unaware, and the robot is slower until it has passed.
    gone = silent.index(True)
    assert 0.0 < limits[gone] < 0.8 * limits[gone - 1]
