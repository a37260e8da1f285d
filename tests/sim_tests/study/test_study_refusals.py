"""Refusals of measures, runs and their commands, by name, before anything is written."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from measured_scenes import crossing, walking
from run_scenes import short_jobs

from awarenav.cli import main
from sim_tests import SimError
from sim_tests.study.measures import bootstrap_interval, measure, zero_of_n_upper
from sim_tests.study.measures._step_out import StepOut
from sim_tests.study.runs import run_jobs, sample_jobs


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two policies, without and with a fault: four episodes."""
    folder = tmp_path_factory.mktemp("run")
    run_jobs(short_jobs(1, faults=["none", "misses_30"]), folder, workers=1)
    return folder


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("crossings --robot tank", "'delivery', 'forklift', 'nova_carter', 'omni', or a YAML file"),
        ("report EMPTY", "holds no episodes.csv"),
        ("replay RUN 4", "the run has 4 episodes, numbered 0 to 3, got 4"),
        ("replay RUN short", "SCENARIO:SEED:POLICY"),
        ("replay RUN short:7:blind", "one that it has is short:0:blind"),
        ("replay RUN short:0:blind", "is 2 episodes of the run, give one's number: 0: short"),
        ("replay EMPTY 0", "is not the folder of a run"),
        ("compare RUN/absent", "cannot read the episodes"),
        ("compare RUN --baseline balancd", "did you mean 'balanced'"),
        ("compare RUN --level 95", "95.0 is not in the range 0.0<x<1.0"),
        ("compare RUN RUN", "each run once"),
        ("compare RUN --out table.txt", "--out must be a .csv or .parquet file"),
        ("measures none.csv", "cannot read none.csv"),
        ("measures RUN --out x.json", "--out must be a .csv file, got x.json"),
        ("export episode RUN 0 --format socnav", "did you mean 'socnav3'?"),
        (
            "export episode RUN 0 --format navwareset --out x.json",
            "--format navwareset writes files that end in .csv, got x.json",
        ),
        ("frontier EMPTY/nowhere", "nowhere"),
        ("render --resume --out EMPTY/set", "there are no images"),
        ("planners compare run_planners", "or module:Class, e.g. my_robot.planning:MyPlanner"),
        (
            "planners compare run_planners:Straight(gain=2)",
            "no argument 'gain'; it has 'robot'",
        ),
        ("planners compare straight_on --seeds 4-2", "the first and the last as 10-19, got '4-2'"),
        (
            "planners compare straight_on --scenario paper_encounter",
            "drives straight on without a planner",
        ),
        ("watch nowhere", "`awarenav scenario list` lists all"),
        ("crossings --scenario at_wrk", "did you mean 'at_work'?"),
        ("crossings --sensors camera,scanner", "or several joined by '+'"),
        ("watch all", "watch shows one crossing"),
        ("watch late_glance --fault scanner_*", "watch shows one crossing"),
        ("watch late_glance --policy brave", "policy must be one of"),
        ("watch late_glance --out page.pdf", "--out must end in .html"),
        ("report RUN --out page.pdf", "--out must end in .html"),
    ],
)
def test_bad_input_is_refused_before_anything_runs(words, message, run, tmp_path, capsys):
    for name, folder in (("RUN", run), ("EMPTY", tmp_path)):
        words = words.replace(name, str(folder))
    given = words.split()
    if given[0] in ("crossings", "planners"):
        given += ["--out", str(tmp_path / "out")]
    before = sorted(run.iterdir())
    assert main(given) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert "Traceback" not in said.err
    assert sorted(run.iterdir()) == before
    assert not list(tmp_path.iterdir())


def still(**values):
    """One control cycle beside one person, with other values of the result."""
    result = crossing([0.0], lambda t: (0.0, 0.0, 0.0, 0.0), [walking((3.0, 0.0), (0.0, 0.0))])
    return replace(result, **values)


def bootstrapped(values, **options):
    return bootstrap_interval(values, np.random.default_rng(0), **options)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda out: StepOut(speed_mps=0.0), "speed_mps"),
        (lambda out: StepOut(time_constant_s=math.nan), "time_constant_s"),
        (lambda out: StepOut(start_shares=(0.1, 0.1, 0.1)), "start_shares must be 4 shares"),
        (lambda out: StepOut(start_shares=(0.1, 0.1, 0.1, 1.0)), "start_shares must be 4 shares"),
        (lambda out: bootstrapped([1.0, math.nan]), "values must be finite"),
        (lambda out: bootstrapped([1.0, 2.0], strata=["a"]), "strata must be 2 labels"),
        (lambda out: bootstrapped([1.0, 2.0], level=1.0), "level must lie in"),
        (lambda out: zero_of_n_upper(-1), "of 0 to n"),
        (lambda out: measure(still(frames=())), "without frames"),
        (
            lambda out: measure(
                still(frames=(replace(frame := still().frames[0], truth=2 * frame.truth),))
            ),
            "separation of all 2 people",
        ),
        (lambda out: sample_jobs(short_jobs(1), 0), "sample must"),
        (lambda out: sample_jobs(short_jobs(1), 3), "sample must"),
        (lambda out: run_jobs([], out), "at least one episode"),
        (lambda out: run_jobs(short_jobs(1), out, workers=0), r"workers must lie in \[1"),
        (lambda out: run_jobs(short_jobs(1), out, resume=True), "no run to resume"),
        (lambda out: run_jobs(short_jobs(1), out, time_limit_s=0.5), r"time_limit_s must lie in"),
        (
            lambda out: run_jobs(short_jobs(1), out, time_limit_s=9.0, scheduler="local"),
            "not on a cluster",
        ),
    ],
)
def test_what_cannot_be_measured_or_run_is_refused(make, message, tmp_path):
    with pytest.raises(SimError, match=message):
        make(tmp_path / "out")
