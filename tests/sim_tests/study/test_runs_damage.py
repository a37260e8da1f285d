"""Runs on a full disk and with damaged files: what is damaged is set aside and runs again."""

from __future__ import annotations

import json
import re
import shutil

import pytest
from full_disk import files_up_to
from run_scenes import short_jobs

from sim_tests import SimError
from sim_tests.study.measures import read_records
from sim_tests.study.runs import RunFiles, read_jobs, run_jobs
from sim_tests.study.runs._run_folder import RunFolder

JOBS = short_jobs(2)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Four episodes."""
    folder = tmp_path_factory.mktemp("whole")
    run_jobs(JOBS, folder, workers=1)
    return folder


@pytest.fixture
def run(whole, tmp_path):
    """A copy of the run, which a test may damage."""
    return shutil.copytree(whole, tmp_path / "run")


def table(folder):
    return RunFiles(folder).episodes.read_bytes()


def damaged(folder, name="episodes.csv"):
    return (folder / f"{name}.damaged").read_bytes()


def rows(folder):
    return table(folder).splitlines(keepends=True)


def test_a_full_disk_ends_a_run_between_rows_and_it_is_resumed(whole, tmp_path):
    records = read_records(whole / "episodes.csv")
    path = tmp_path / "episodes.csv"
    with RunFolder(tmp_path, JOBS, {}) as folder:
        folder.add(0, records[0])
        size = path.stat().st_size
        with files_up_to(size + 30), pytest.raises(SimError, match=r"too large; .* --resume"):
            folder.add(1, records[1])
        assert path.stat().st_size == size
        folder.add(2, records[2])
    run_jobs(JOBS, tmp_path, workers=1, resume=True)
    assert table(tmp_path) == table(whole)
    assert not (tmp_path / "episodes.csv.damaged").exists()


def test_a_run_begun_before_the_last_columns_existed_is_resumed(whole, run):
    """Its table gets the columns of this version, and no row is set aside."""
    cut = [row.rsplit(b",", 6)[0] for row in rows(whole)[:3]]  # a number and five counts
    (run / "episodes.csv").write_bytes(b"".join(row + b"\n" for row in cut))
    run_jobs(JOBS, run, workers=1, resume=True)
    # The earlier rows stay without the number, and count nothing.
    header, *others = rows(whole)
    assert rows(run) == [header, *(row + b",,0,0,0,0,0\n" for row in cut[1:]), *others[2:]]
    assert not (run / "episodes.csv.damaged").exists()


DAMAGE = {
    "half a row, then the next": (lambda row, after: row[:60] + after, "cells"),
    "half a name, then the next": (lambda row, after: row[:3] + after, "has this episode"),
    "an open quote": (lambda row, after: b'"' + row + after, "unexpected end of data"),
    "zeros, as a power cut leaves": (
        lambda row, after: bytes(len(row) - 1) + b"\n" + after,
        "cells|NUL",
    ),
    "a negative distance": (lambda row, after: _cell(row, 8, b"-2.5") + after, "min_separation_m"),
    "no number": (lambda row, after: _cell(row, 9, b"soon") + after, "time_to_goal_s"),
    "a count below 0": (lambda row, after: _cell(row, 13, b"-1") + after, "contacts must lie in"),
    "another row of the episode": (
        lambda row, after: _cell(after, 8, b"0.5") + after,
        "another row has this episode",
    ),
}


def _cell(row, number, value):
    cells = row.split(b",")
    cells[number] = value
    return b",".join(cells)


@pytest.mark.parametrize("kind", DAMAGE)
def test_a_damaged_row_is_set_aside_and_its_episode_runs_again(kind, whole, run, capsys):
    change, message = DAMAGE[kind]
    header, first, second, third, fourth = rows(run)
    changed = change(second, third)
    RunFiles(run).episodes.write_bytes(b"".join([header, first, changed, fourth]))
    run_jobs(JOBS, run, workers=1, resume=True)
    assert table(run) == table(whole)
    lines = changed.splitlines(keepends=True)
    assert all(line in lines for line in damaged(run).splitlines(keepends=True))
    told = capsys.readouterr().err
    assert "line 3 is damaged" in told or "line 4 is damaged" in told
    assert re.search(message, told)
    assert "their episodes run again" in told


def test_a_damaged_header_is_set_aside(whole, run):
    RunFiles(run).episodes.write_bytes(table(run)[9:])
    run_jobs(JOBS, run, workers=1, resume=True)
    assert table(run) == table(whole)
    assert damaged(run) == rows(whole)[0][9:]


def test_an_episode_with_a_damaged_plan_runs_again(whole, run):
    """Its row may be that of another scenario or policy."""
    path = RunFiles(run).jobs
    before = path.read_bytes()
    lines = before.splitlines(keepends=True)
    for content in (
        [lines[0], lines[1][:90] + b"\n", *lines[2:]],
        [lines[0], lines[1][:90] + lines[2], lines[3]],
    ):
        path.write_bytes(b"".join(content))
        header, first, second, third, fourth = rows(whole)
        wrong = _cell(second, 8, b"0.123456")
        RunFiles(run).episodes.write_bytes(b"".join([header, first, wrong, third, fourth]))
        run_jobs(JOBS, run, workers=1, resume=True)
        assert table(run) == table(whole)
        assert path.read_bytes() == before
        assert lines[1][:90] in damaged(run, "jobs.jsonl")
        assert wrong in damaged(run)
        assert read_jobs(run) == JOBS


def test_a_new_run_in_the_folder_removes_the_damaged_lines_of_the_old_one(run):
    for path in RunFiles(run).damaged:
        path.write_text("half a line\n")
    run_jobs(JOBS[:1], run, workers=1, overwrite=True)
    assert not list(run.glob("*.damaged"))


def test_a_damaged_plan_does_not_hide_another_plan(run):
    path = RunFiles(run).jobs
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([lines[0][:50] + b"\n", *lines[1:]]))
    with pytest.raises(SimError, match="has 4 episodes, and 6 were asked for"):
        run_jobs(short_jobs(3), run, workers=1, resume=True)
    with pytest.raises(SimError, match="another fault"):
        run_jobs(short_jobs(2, faults=["ghosts"]), run, workers=1, resume=True)


def test_a_table_of_an_earlier_version_is_resumed(whole, run):
    """It has fewer columns, and no other mark of its version."""
    about = json.loads(RunFiles(run).run.read_text())
    del about["versions"]
    RunFiles(run).run.write_text(json.dumps(about))
    short = [b",".join(row.strip().split(b",")[:13]) + b"\n" for row in rows(run)]
    RunFiles(run).episodes.write_bytes(b"".join(short[:3]))
    records = run_jobs(JOBS, run, workers=1, resume=True)
    assert not (run / "episodes.csv.damaged").exists()
    assert records[2:] == read_records(whole / "episodes.csv")[2:]
    assert [record.success for record in records] == [True] * 4
