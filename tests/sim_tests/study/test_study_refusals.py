"""What the commands of runs refuse: one line, exit status 2, and nothing is written."""

from __future__ import annotations

import pytest
from run_scenes import short_jobs

from awarenav.cli import main
from sim_tests.study.runs import run_jobs


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two policies, without and with a fault: four episodes."""
    folder = tmp_path_factory.mktemp("run")
    run_jobs(short_jobs(1, faults=["none", "misses_30"]), folder, workers=1)
    return folder


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("crossings --robot tank", "'delivery', 'forklift', 'nova_carter', 'omni', got 'tank'"),
        ("report EMPTY", "holds no episodes.csv"),
        ("replay RUN 4", "the run has 4 episodes, numbered 0 to 3, got 4"),
        ("replay RUN short", "SCENARIO:SEED:POLICY"),
        ("replay RUN short:7:blind", "one that it has is short:0:blind"),
        ("replay RUN short:0:blind", "is 2 episodes of the run, give one's number: 0: short"),
        ("replay EMPTY 0", "is not the folder of a run"),
        ("compare RUN/absent", "cannot read the episodes"),
        ("compare RUN --baseline balancd", "did you mean 'balanced'"),
        ("compare RUN --level 95", "--level must lie in (0, 1), got 95"),
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
        ("planners compare run_planners", "or as one of reference, costmap"),
        ("planners compare run_planners:Absent", "has no attribute 'Absent'"),
        (
            "planners compare run_planners:Straight(gain=2)",
            "no argument 'gain'; it has 'robot'",
        ),
        ("planners compare straight_on --seeds 4-2", "the first and the last as 10-19, got '4-2'"),
        (
            "planners compare straight_on --scenario paper_encounter",
            "drives straight on without a planner",
        ),
        ("watch nowhere", "scenario must be one of"),
        ("watch all", "watch shows one crossing"),
        ("watch late_glance --fault scanner_*", "watch shows one crossing"),
        ("watch late_glance --policy brave", "preset must be one of"),
        ("watch late_glance --out no_such_folder/page.html", "there is no folder"),
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
