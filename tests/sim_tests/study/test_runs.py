"""Runs: the same table in every mode, and nothing lost when an episode or the run is killed."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import run_planners
from run_scenes import short_jobs

from sim_tests import SimError
from sim_tests.study.measures import read_records
from sim_tests.study.runs import Job, read_jobs, read_run, run_episode, run_jobs

HERE = Path(__file__).parent


def table(folder):
    return (folder / "episodes.csv").read_bytes()


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """Eight episodes, run one after another in this process."""
    folder = tmp_path_factory.mktemp("serial")
    run_jobs(short_jobs(4), folder, workers=1)
    return folder


def test_a_run_writes_its_table_its_jobs_and_its_settings(serial):
    jobs = short_jobs(4)
    records = read_records(serial / "episodes.csv")
    assert [(record.seed, record.policy) for record in records] == [
        (job.seed, job.policy_name) for job in jobs
    ]
    assert all(record.success and not record.error for record in records)
    assert all(record.time_without_people_s > 0.0 for record in records)
    assert read_jobs(serial) == jobs
    assert read_run(serial)["state"] == "complete"
    assert read_run(serial)["versions"]["numpy"]
    assert not (serial / "errors.log").exists()
    # An episode gives the same row wherever it runs.
    assert run_episode(jobs[5]) == records[5]


def test_distributions_are_drawn_from_the_seed_and_not_from_the_policy(serial):
    by_seed = {}
    for record in read_records(serial / "episodes.csv"):
        by_seed.setdefault(record.seed, set()).add(record.min_separation_m)
    assert all(max(values) - min(values) < 0.2 for values in by_seed.values())
    assert len({min(values) for values in by_seed.values()}) == 4


def test_parquet_holds_the_same_records(serial):
    pytest.importorskip("pyarrow")
    records = read_records(serial / "episodes.csv")
    assert read_records(serial / "episodes.parquet") == records


def test_failing_episodes_and_processes_affect_no_other(tmp_path, monkeypatch, serial):
    """Two processes: one planner raises, one kills its process twice, one once."""
    monkeypatch.setenv(run_planners.MARKER, str(tmp_path / "died"))
    names = ("Raises", "Dies", "DiesOnce", "Slow")
    jobs = short_jobs(4) + short_jobs(1, planners=[f"run_planners:{name}" for name in names])[::2]
    records = run_jobs(jobs, tmp_path / "run", workers=2)
    assert records[:8] == read_records(serial / "episodes.csv")
    raised, died, once, slow = records[8:]
    assert raised.error == "RuntimeError: no way found, honestly"
    assert (raised.scenario, raised.planner, raised.success) == ("short", "Raises", False)
    assert died.error.startswith("WorkerDied: ")
    assert "SIGKILL" in died.error
    assert (tmp_path / "died").exists()
    assert not once.error
    assert replace(once, planner="Slow") == slow
    log = (tmp_path / "run" / "errors.log").read_text()
    assert "Traceback" in log
    assert "episode 8: short, seed 0" in log


def test_an_episode_over_the_time_limit_is_ended(tmp_path, monkeypatch, serial):
    """The clock jumps over the limit each time that a planner hangs."""
    marker = tmp_path / "hangs"
    monkeypatch.setenv(run_planners.MARKER, str(marker))
    real_clock, skipped_s = time.monotonic, 0.0

    def clock():
        nonlocal skipped_s
        if marker.exists():
            marker.unlink()
            skipped_s += 1000.0
        return real_clock() + skipped_s

    monkeypatch.setattr(time, "monotonic", clock)
    jobs = short_jobs(1, planners=["run_planners:Hangs", ""])
    records = run_jobs(jobs, tmp_path / "run", workers=1, time_limit_s=900.0)
    assert [record.error for record in records] == [
        "TimeLimit: ended after the time limit of 900 s",
        "TimeLimit: ended after the time limit of 900 s",
        "",
        "",
    ]
    assert records[2:] == read_records(serial / "episodes.csv")[:2]
    with pytest.raises(SimError, match="not on a cluster"):
        run_jobs(jobs, tmp_path / "other", time_limit_s=900.0, scheduler="local")


def test_an_invalid_job_gives_a_row_with_an_error():
    job = Job("nonsense: [", 3, "p", "also: nonsense")
    record = run_episode(job)
    assert record.seed == 3
    assert "SimError" in record.error


@pytest.mark.parametrize("tail", ["", "short,2,bli", "short,2,blind,SamplingPlanner,truth,true"])
def test_an_interrupted_run_is_resumed(tail, serial, tmp_path):
    lines = table(serial).decode().splitlines(keepends=True)
    for name in ("jobs.jsonl", "run.json"):
        (tmp_path / name).write_bytes((serial / name).read_bytes())
    about = json.loads((tmp_path / "run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps({**about, "state": "running"}))
    # Rows in the order in which the episodes ended.
    (tmp_path / "episodes.csv").write_text("".join([lines[0], lines[5], lines[2], lines[1]]) + tail)
    records = run_jobs(short_jobs(4), tmp_path, workers=1, resume=True)
    assert table(tmp_path) == table(serial)
    assert records == read_records(serial / "episodes.csv")


def test_resuming_a_complete_run_runs_nothing(tmp_path, monkeypatch):
    marker, folder = tmp_path / "ran", tmp_path / "run"
    monkeypatch.setenv(run_planners.MARKER, str(marker))
    jobs = short_jobs(1, planners=["run_planners:Leaves"])
    records = run_jobs(jobs, folder, workers=1)
    before = table(folder)
    marker.unlink()
    assert run_jobs(jobs, folder, workers=1, resume=True) == records
    assert table(folder) == before
    assert not marker.exists()


@pytest.mark.parametrize(
    ("jobs", "message"),
    [
        (short_jobs(3), "has 8 episodes, and 6 were asked for"),
        (short_jobs(4, perception="keypoints"), r"perception \('truth', now 'keypoints'\)"),
        (short_jobs(4, faults=["ghosts"]), "another fault"),
    ],
)
def test_another_plan_is_not_resumed(jobs, message, serial):
    before = table(serial)
    with pytest.raises(SimError, match=message):
        run_jobs(jobs, serial, workers=1, resume=True)
    assert table(serial) == before


def test_another_version_is_not_resumed(serial, tmp_path):
    for name in ("jobs.jsonl", "episodes.csv"):
        (tmp_path / name).write_bytes((serial / name).read_bytes())
    about = read_run(serial)
    about["versions"]["numpy"] = "0.1"
    (tmp_path / "run.json").write_text(json.dumps(about))
    with pytest.raises(SimError, match=r"begun with numpy 0\.1"):
        run_jobs(short_jobs(4), tmp_path, workers=1, resume=True)


def test_an_unfinished_run_is_only_overwritten_on_request(serial, tmp_path):
    lines = table(serial).decode().splitlines(keepends=True)
    (tmp_path / "run.json").write_text(json.dumps({"state": "running", "episodes": 8}))
    (tmp_path / "episodes.csv").write_text("".join(lines[:3]))
    with pytest.raises(SimError, match="2 of 8 episodes done: go on with --resume"):
        run_jobs(short_jobs(1), tmp_path, workers=1)
    assert table(tmp_path).decode() == "".join(lines[:3])
    assert len(run_jobs(short_jobs(1), tmp_path, workers=1, overwrite=True)) == 2


def test_unusable_folders_and_numbers_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SimError, match="cannot run into"):
        run_jobs(short_jobs(1), tmp_path / "file", workers=1)
    with pytest.raises(SimError, match="at least one episode"):
        run_jobs([], tmp_path / "out")
    with pytest.raises(SimError, match=r"workers must lie in \[1"):
        run_jobs(short_jobs(1), tmp_path / "out", workers=0)
    with pytest.raises(SimError, match="no run to resume"):
        run_jobs(short_jobs(1), tmp_path / "out", workers=1, resume=True)


RUN = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
from run_scenes import short_jobs
from sim_tests.study.runs import run_jobs
if __name__ == "__main__":
    run_jobs(short_jobs(4, planners=["run_planners:Sleeps"]), {out!r}, workers=2)
"""


def test_a_killed_run_is_resumed_and_ends_with_the_same_table(tmp_path):
    jobs = short_jobs(4, planners=["run_planners:Sleeps"])
    program = tmp_path / "run.py"
    program.write_text(RUN.format(here=str(HERE), out=str(tmp_path / "killed")))
    path = tmp_path / "killed" / "episodes.csv"
    command, slowly = [sys.executable, program], {**os.environ, run_planners.SLEEP_S: "0.1"}
    with subprocess.Popen(command, env=slowly, start_new_session=True) as process:
        while not path.exists() or path.read_bytes().count(b"\n") < 3:
            assert process.poll() is None
            time.sleep(0.01)
        # A second run into the same folder is refused.
        with pytest.raises(SimError, match="another process is running"):
            run_jobs(jobs, path.parent, workers=1, resume=True)
        os.kill(process.pid, signal.SIGKILL)
    done = path.read_bytes().count(b"\n") - 1
    assert 0 < done < len(jobs)
    deadline = time.monotonic() + 60.0
    while _group_lives(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not _group_lives(process.pid), "workers outlive the run"
    run_jobs(jobs, path.parent, workers=1, resume=True)
    whole = tmp_path / "whole"
    run_jobs(jobs, whole, workers=1)
    assert path.read_bytes() == table(whole)


def _group_lives(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_rows_are_lines_of_as_many_cells_as_the_header(serial):
    with (serial / "episodes.csv").open(newline="") as file:
        header, *rows = list(csv.reader(file))
    assert {len(row) for row in rows} == {len(header)}
    assert table(serial).count(b"\n") == len(rows) + 1
