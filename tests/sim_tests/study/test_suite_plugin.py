"""The crossings as a test-suite of the user's: what passes, what fails, and what is said."""

import os
import re
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import paths
import pytest
from run_scenes import SHORT

from sim_tests import SimError
from sim_tests.actors.robot import RobotModel
from sim_tests.study.measures import EpisodeRecord
from sim_tests.study.runs import read_jobs, template_of
from sim_tests.study.suite import EpisodeThresholds, Thresholds
from sim_tests.study.suite.plugin import pytest_addoption

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
# In an environment that was installed before the entry point was there.
PLUGIN = (
    []
    if any(entry.name == "awarenav" for entry in entry_points(group="pytest11"))
    else ["-p", "sim_tests.study.suite.plugin"]
)


def run_pytest(folder, *arguments):
    paths = [str(ROOT), str(HERE), os.environ.get("PYTHONPATH", "")]
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *PLUGIN, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "short.yaml").write_text(SHORT.format(name="short"))
    return tmp_path


SUITE = ["--pyargs", "sim_tests", "--awarenav-scenario", "short.yaml", "--awarenav-workers", "1",
         "--awarenav-perception", "truth", "--awarenav-episodes", "2"]  # fmt: skip


def test_the_page_has_every_option():
    parser = pytest.Parser(_ispytest=True)
    pytest_addoption(parser)
    options = parser.parse_known_args([])
    names = {f"--{name.replace('_', '-')}" for name in vars(options) if "awarenav" in name}
    page = (paths.ROOT / "docs" / "test-suite.md").read_text(encoding="utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| `--awarenav-")]
    found = {word for line in rows for word in re.findall(r"`(--awarenav-[a-z]+)", line)}
    assert found == names
    assert len(names) >= 12


def test_a_good_planner_passes(folder):
    done = run_pytest(folder, *SUITE, "-v", "-W", "error")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "test_episode[short-0] PASSED" in done.stdout
    assert "test_episode[short-1] PASSED" in done.stdout
    assert "test_all_episodes PASSED" in done.stdout
    assert (folder / "awarenav-suite" / "episodes.csv").exists()


def test_a_bad_planner_fails_with_the_check_the_scenario_the_seed_and_the_replay(folder):
    (folder / "thresholds.yaml").write_text("scenarios: {short: {reaches_goal: true}}")
    done = run_pytest(
        folder, *SUITE, "--awarenav-thresholds", "thresholds.yaml",
        "--awarenav-planner", "run_planners:Slow", "--awarenav-policy", "blind",
    )  # fmt: skip
    # Half a metre a second for two seconds passes the goal without stopping there.
    assert done.returncode == 1, done.stdout + done.stderr
    assert "reaches_goal: not within" in done.stdout
    assert "short, seed 1, policy blind, Slow" in done.stdout
    assert "awarenav replay awarenav-suite 1" in done.stdout
    assert "min_success_rate: 0.000, asked for 0.9" in done.stdout
    assert "Traceback" not in done.stdout


def test_a_chosen_test_runs_its_episode_alone_with_the_robot_and_people_asked_for(folder):
    (folder / "thresholds.yaml").write_text("scenarios: {short: {min_separation_m: 50.0}}")
    done = run_pytest(
        folder, *SUITE, "-k", "short_delivery-1", "--awarenav-thresholds", "thresholds.yaml",
        "--awarenav-robot", "delivery", "--awarenav-population", "recorded",
    )  # fmt: skip
    assert done.returncode == 1, done.stdout + done.stderr
    assert "asked for 50 (short_delivery, seed 1," in done.stdout
    (job,) = read_jobs(folder / "awarenav-suite")
    scenario = template_of(job.scenario).for_seed(1)
    assert scenario.robot_model == RobotModel.shipped("delivery")
    assert scenario.population == "recorded"
    assert (folder / "awarenav-suite" / "episodes.csv").read_text().count("\n") == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--awarenav-planner", "nowhere:Planner"], "No module named 'nowhere'"),
        pytest.param(
            ["--awarenav-population", "modern"],
            "population must be one of classic, recorded, got 'modern'",
            marks=pytest.mark.full,
        ),
        pytest.param(
            ["--awarenav-policy", "brave"], "preset must be one of", marks=pytest.mark.full
        ),
        pytest.param(
            ["--awarenav-episodes", "none"],
            "--awarenav-episodes must be a whole number",
            marks=pytest.mark.full,
        ),
    ],
)
def test_options_that_cannot_be_used_are_said_once(folder, arguments, message):
    done = run_pytest(folder, *SUITE, *arguments)
    assert done.returncode == 2
    assert message in done.stdout
    assert "Traceback" not in done.stdout


def test_other_peoples_tests_are_left_alone(folder):
    (folder / "test_theirs.py").write_text(
        "import sys\n"
        "def test_nothing_of_ours_is_loaded():\n"
        "    heavy = {'pybullet', 'cv2', 'numpy', 'pydantic', 'sim_tests.crossing'}\n"
        "    assert not heavy & set(sys.modules)\n"
    )
    done = run_pytest(folder, "-q", "-W", "error")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout
    assert [path.name for path in folder.iterdir() if "awarenav" in path.name] == []


def record(**values):
    return EpisodeRecord("a", 0, "p", "q", "truth", **{"success": True, **values})


@pytest.mark.parametrize(
    ("thresholds", "good", "bad", "name"),
    [
        ({}, {"robot_contacts": 0, "contacts": 1}, {"robot_contacts": 1}, "max_robot_contacts"),
        ({"max_contacts": 1}, {"contacts": 1}, {"contacts": 2}, "max_contacts"),
        (
            {"min_separation_m": 0.5},
            {"min_separation_m": 0.5},
            {"min_separation_m": 0.49},
            "min_separation_m",
        ),
        (
            {"max_violation_time_s": 0.1},
            {"violation_time_s": 0.1},
            {"violation_time_s": 0.2},
            "max_violation_time_s",
        ),
        ({"max_time_lost_s": 2.0}, {"time_lost_s": 2.0}, {"time_lost_s": 2.1}, "max_time_lost_s"),
        (
            {"reaches_goal": True},
            {"time_to_goal_s": 3.0},
            {"time_to_goal_s": None, "duration_s": 9.0},
            "reaches_goal",
        ),
        ({}, {}, {"error": "broke"}, "runs to its end"),
    ],
)
def test_thresholds_hold_up_to_their_limit(thresholds, good, bad, name):
    checks = EpisodeThresholds(**thresholds)
    assert list(checks.failures(record(**good))) == []
    (failure,) = checks.failures(record(**bad))
    assert failure.startswith(name)


def test_thresholds_over_all_episodes():
    records = [record(violation_time_s=0.0), record(violation_time_s=0.3, success=False)]
    checks = Thresholds(min_success_rate=0.5, max_mean_violation_time_s=0.15)
    assert list(checks.failures(records)) == []
    tight = Thresholds(min_success_rate=0.6, max_mean_violation_time_s=0.1)
    assert [failure.split(":")[0] for failure in tight.failures(records)] == [
        "min_success_rate",
        "max_mean_violation_time_s",
    ]


def test_thresholds_with_unknown_keys_are_refused(tmp_path):
    path = tmp_path / "thresholds.yaml"
    path.write_text("episode: {max_robot_contact: 0}")
    with pytest.raises(SimError, match="did you mean 'max_robot_contacts'"):
        Thresholds.from_yaml(path)
