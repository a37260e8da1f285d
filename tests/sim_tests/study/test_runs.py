"""Runs: the same table in every mode, and nothing lost when an episode or the run is killed."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import run_planners
from full_disk import files_up_to
from run_scenes import short_jobs

from sim_tests import SimError
from sim_tests.study.measures import read_records
from sim_tests.study.runs import (
    RunFiles,
    in_parallel,
    read_attempts,
    read_jobs,
    read_rows,
    read_run,
    run_episode,
    run_jobs,
)

HERE = Path(__file__).parent
JOBS = short_jobs(4)


def table(folder):
    return (folder / "episodes.csv").read_bytes()


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """Eight episodes, run one after another in this process."""
    folder = tmp_path_factory.mktemp("serial")
    run_jobs(JOBS, folder, workers=1)
    return folder


@pytest.fixture
def killed(serial, tmp_path):
    """A copy of the run as a kill leaves it after three episodes, which a test may damage."""
    folder = shutil.copytree(serial, tmp_path / "killed")
    files = RunFiles(folder)
    for number in (0, 2, 4, 6, 7):
        files.episode(number).unlink()
    files.episodes.unlink()
    files.run.write_text(json.dumps({**read_run(folder), "state": "running"}))
    return folder


def test_a_run_writes_its_table_its_jobs_and_its_settings(serial):
    records = read_records(serial / "episodes.csv")
    assert [(record.seed, record.policy) for record in records] == [
        (job.seed, job.policy) for job in JOBS
    ]
    assert all(record.success and not record.error for record in records)
    assert all(record.time_without_people_s > 0.0 for record in records)
    assert read_jobs(serial) == JOBS
    assert read_run(serial)["state"] == "complete"
    assert read_run(serial)["versions"]["numpy"]
    assert not (serial / "errors.log").exists()
    attempts = read_attempts(serial)
    assert [attempts[number].record for number in range(8)] == list(records)
    assert all(each.conduct.plan_calls > 10 for each in attempts.values())
    # An episode gives the same row wherever it runs.
    assert run_episode(JOBS[5]) == records[5]
    with (serial / "episodes.csv").open(newline="") as file:
        header, *rows = list(csv.reader(file))
    assert {len(row) for row in rows} == {len(header)}
    assert table(serial).count(b"\n") == len(rows) + 1


def test_parquet_holds_the_same_records(serial):
    pytest.importorskip("pyarrow")
    assert read_records(serial / "episodes.parquet") == read_rows(serial)


def test_failing_episodes_and_processes_affect_no_other(tmp_path, monkeypatch, serial):
    """Two processes: a planner raises, one kills its process twice, one once, and one hangs."""
    monkeypatch.setenv(run_planners.MARKER, str(tmp_path / "died"))
    names = ("Raises", "Dies", "DiesOnce", "Slow", "Hangs")
    jobs = JOBS[:2] + short_jobs(1, planners=[f"run_planners:{name}" for name in names])[::2]
    records = run_jobs(jobs, tmp_path / "run", workers=2, time_limit_s=8.0)
    assert records[:2] == read_rows(serial)[:2]
    raised, died, once, slow, hangs = records[2:]
    assert raised.error == "RuntimeError: no way found, honestly"
    assert (raised.scenario, raised.planner, raised.success) == ("short", "Raises", False)
    assert died.error.startswith("WorkerDied: the process that ran it died, and so did a second")
    assert (tmp_path / "died").exists()
    assert not once.error
    assert replace(once, planner="Slow") == slow
    assert hangs.error == "TimeLimit: ended after the time limit of 8 s"
    log = (tmp_path / "run" / "errors.log").read_text()
    assert "Traceback" in log
    assert "episode 2: short, seed 0" in log


def test_a_killed_run_has_its_rows_and_is_resumed(serial, killed):
    whole = read_rows(serial)
    assert read_rows(killed) == (whole[1], whole[3], whole[5])
    assert run_jobs(JOBS, killed, workers=1, resume=True) == whole
    assert table(killed) == table(serial)
    assert read_run(killed) == read_run(serial)


def test_a_full_disk_ends_a_run_between_episodes_and_it_is_resumed(serial, killed, capsys):
    with files_up_to(1000), pytest.raises(SimError, match="cannot write"):
        run_jobs(JOBS, killed, workers=1, resume=True)
    assert len(read_attempts(killed)) == 3
    run_jobs(JOBS, killed, workers=1, resume=True)
    assert table(killed) == table(serial)


def test_a_file_that_is_not_of_its_episode_is_refused_by_its_name(killed, serial):
    file, other = RunFiles(killed).episode(1), RunFiles(killed).episode(3).read_bytes()
    for damaged in (file.read_bytes()[:99], bytes(99), b'{"record": {}}', other):
        file.write_bytes(damaged)
        with pytest.raises(SimError, match=r"00001\.json is not the file of .* move it away"):
            run_jobs(JOBS, killed, workers=1, resume=True)
    file.unlink()
    run_jobs(JOBS, killed, workers=1, resume=True)
    assert table(killed) == table(serial)


@pytest.mark.parametrize(
    ("jobs", "about", "message"),
    [
        (short_jobs(3), {}, "has 8 episodes, and 6 were asked for"),
        (short_jobs(4, perception="keypoints"), {}, r"perception \('truth', now 'keypoints'\)"),
        (short_jobs(4, faults=["ghosts"]), {}, "another fault"),
        (JOBS, {"versions": {"numpy": "0.1"}}, r"begun with numpy .*, and this is 0\.1"),
        (JOBS, {"settings": {"seed": 4}}, "begun with seed 3, and this has 4: resume with"),
    ],
)
def test_another_run_is_not_resumed(jobs, about, message, killed):
    RunFiles(killed).run.write_text(json.dumps({**read_run(killed), "settings": {"seed": 3}}))
    with pytest.raises(SimError, match=message):
        run_jobs(jobs, killed, workers=1, resume=True, about=about)
    assert len(read_attempts(killed)) == 3


@pytest.mark.parametrize("text", ['{"state": "running", "epi', "[]", None])
def test_episodes_are_kept_where_run_json_cannot_be_read(text, killed):
    RunFiles(killed).run.unlink()
    if text is not None:
        RunFiles(killed).run.write_text(text)
    before = read_attempts(killed)
    with pytest.raises(SimError, match=r"3 episodes of a run whose run\.json cannot be read"):
        run_jobs(short_jobs(1), killed, workers=1)
    assert read_attempts(killed) == before


def test_a_run_is_only_overwritten_on_request(serial, killed, tmp_path):
    with pytest.raises(SimError, match="3 of 8 episodes done: go on with --resume, replace"):
        run_jobs(short_jobs(1), killed, workers=1)
    before = table(serial)
    with pytest.raises(SimError, match="a finished run of 8 episodes: replace it with --overwrite"):
        run_jobs(short_jobs(1), serial, workers=1)
    assert table(serial) == before
    (killed / "mine.txt").write_text("mine")
    records = run_jobs(short_jobs(1), killed, workers=1, overwrite=True)
    assert read_rows(killed) == records == read_rows(serial)[:2]
    assert len(read_attempts(killed)) == 2
    assert (killed / "mine.txt").read_text() == "mine"
    (tmp_path / "episodes.csv").write_text("mine\n")
    with pytest.raises(SimError, match=r"a table episodes\.csv that is not of a run"):
        run_jobs(short_jobs(1), tmp_path, workers=1)
    assert (tmp_path / "episodes.csv").read_text() == "mine\n"


RUN = """
import sys
from pathlib import Path
sys.path.insert(0, {here!r})
from run_scenes import short_jobs
from sim_tests.study.runs import run_jobs
if __name__ == "__main__":
    run_jobs(short_jobs(4, planners=["run_planners:Sleeps"]), {out!r}, workers=2)
"""


@pytest.mark.slow
def test_a_killed_process_leaves_its_episodes_and_no_workers(tmp_path):
    jobs = short_jobs(4, planners=["run_planners:Sleeps"])
    program, out = tmp_path / "run.py", tmp_path / "killed"
    program.write_text(RUN.format(here=str(HERE), out=str(out)))
    command, slowly = [sys.executable, program], {**os.environ, run_planners.SLEEP_S: "0.1"}
    with subprocess.Popen(command, env=slowly, start_new_session=True) as process:
        while len(list(out.glob("episodes/*.json"))) < 2:
            assert process.poll() is None
            time.sleep(0.01)
        # A second run into the same folder is refused.
        with pytest.raises(SimError, match="another process works in"):
            run_jobs(jobs, out, workers=1, resume=True)
        os.kill(process.pid, signal.SIGKILL)
    assert 0 < len(read_attempts(out)) < len(jobs)
    deadline = time.monotonic() + 60.0
    while _group_lives(process.pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not _group_lives(process.pid), "workers outlive the run"
    run_jobs(jobs, out, workers=1, resume=True)
    run_jobs(jobs, tmp_path / "whole", workers=1)
    assert table(out) == table(tmp_path / "whole")


def test_an_interruption_keeps_the_episodes_so_far(tmp_path, serial):
    """SIGTERM as Ctrl-C: the table is written, and the run can be resumed."""
    (deadly,) = short_jobs(1, planners=["run_planners:Terminates"])[:1]
    with pytest.raises(KeyboardInterrupt):
        run_jobs([*JOBS[:2], deadly, *JOBS[2:]], tmp_path, workers=1)
    assert read_records(tmp_path / "episodes.csv") == read_rows(serial)[:2]
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    with pytest.raises(SimError, match="2 of 9 episodes done: go on with --resume"):
        run_jobs(JOBS, tmp_path, workers=1)


def _group_lives(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_items_are_worked_on_in_parallel_and_a_deadly_one_is_given_up():
    here = dict(in_parallel(run_planners.square, range(5), workers=1))
    assert here == {number: number**2 for number in range(5)}
    found = in_parallel(
        run_planners.square, [3, -1, 4], workers=2, on_death=lambda item, reason: item
    )
    assert dict(found) == {0: 9, 1: -1, 2: 16}
    with pytest.raises(SimError, match="the process that ran it died, and so did a second one"):
        dict(in_parallel(run_planners.square, [-1], workers=1, own_process=True))
    assert dict(in_parallel(run_planners.square, [], workers=2)) == {}


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
