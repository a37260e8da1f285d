"""The page of a run: what it holds, what it says of partial runs, and its stills."""

from __future__ import annotations

import base64
import itertools
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from chromium_pipe import Chromium
from page_reader import PageReader
from paths import ROOT
from report_runs import MadeUpRun, failed, made_up_run
from run_scenes import short_jobs

from sim_tests.study.measures import (
    Interval,
    paired_difference,
    percent,
    read_records,
    summarise,
    zero_of_n_upper,
)
from sim_tests.study.report import write_report
from sim_tests.study.runs import plan_jobs, run_jobs

HOSTILE = '<script>alert("x")</script>&\'`{{ 7 * 7 }}'


@pytest.fixture(scope="module")
def run() -> MadeUpRun:
    return made_up_run(scenarios=6, seeds=12, faults=("late_frames",))


@pytest.fixture(scope="module")
def page(run: MadeUpRun, tmp_path_factory: pytest.TempPathFactory) -> PageReader:
    return report(run, tmp_path_factory.mktemp("run"))


def report(run: MadeUpRun, out: Path) -> PageReader:
    return PageReader(write_report(run.write(out), stills=False).read_text("utf-8"))


def changed(run: MadeUpRun, scenario: str = "", **values: object) -> MadeUpRun:
    """The run with other values of the rows of one scenario, or of all."""
    records = tuple(
        replace(each, **values) if scenario in ("", each.scenario) else each for each in run.records
    )
    return replace(run, records=records)


def test_page_is_one_document_that_stands_alone(page: PageReader) -> None:
    assert page.references
    for reference in page.references:
        assert reference.startswith(("#", "data:")), reference
    assert not re.search(r"url\((?!#)|@import", page.style)
    assert not re.search(r"\bfetch\(|XMLHttpRequest|import\(|WebSocket", page.script)
    names = [name for name, _ in page.tags]
    assert set(names).isdisjoint({"iframe", "object", "embed", "base"})
    for name in ("html", "head", "title", "main", "h1", "nav", "script"):
        assert names.count(name) == 1, name
    assert names.count("svg") == 2
    assert len(set(page.ids)) == len(page.ids)
    targets = {reference[1:] for reference in page.references if reference.startswith("#")}
    assert targets <= set(page.ids)
    levels = [int(name[1]) for name in names if re.fullmatch(r"h[1-6]", name)]
    assert all(after <= before + 1 for before, after in itertools.pairwise(levels))


def fewer_s(change: Interval) -> str:
    """Return a difference below 0 as the seconds that are saved."""
    saved = replace(change, value=-change.value, low=-change.high, high=-change.low)
    return saved.text(1)


def test_figures_are_those_of_the_statistics(page: PageReader, run: MadeUpRun) -> None:
    summary = summarise([record for record in run.records if not record.fault])
    for row in summary.policies:
        assert row.means["time_lost_s"].text(1) in page.text
        assert row.means["human_delay_s"].text() in page.text
    for each in summary.comparisons:
        assert each.time_lost_s.text(1) in page.text
    against = {(each.variant, each.part): each for each in summary.comparisons}
    for part, who in (("", "people"), ("attentive", "attentive people")):
        less = fewer_s(against["balanced", part].time_lost_s)
        assert f"A meeting with {who} takes {less} s less than with blind" in page.text
    # Contacts under faults count too.
    balanced = [record for record in run.records if record.policy == "balanced"]
    assert f"The moving robot touched nobody in {len(balanced)} episodes" in page.text
    assert f"up to {percent(zero_of_n_upper(len(balanced)))} remains possible" in page.text


def test_contact_is_never_played_down(run: MadeUpRun, tmp_path: Path) -> None:
    records = list(run.records)
    index = next(n for n, record in enumerate(records) if record.policy == "balanced")
    touched = {"contact": True, "contact_by": "robot", "contacts": 1, "robot_contacts": 1}
    records[index] = replace(records[index], success=False, **touched)
    page = report(replace(run, records=tuple(records)), tmp_path)
    assert "A person and the moving robot touched in 1 of" in page.text
    assert "The robot moved into the person in 1 of them" in page.text
    assert "The moving robot touched nobody" not in page.text
    assert "robot moved into a person" in page.text


def test_the_first_line_has_the_worst_of_all_episodes(run: MadeUpRun, tmp_path: Path) -> None:
    own = [n for n, each in enumerate(run.records) if each.policy == "balanced"]
    records = [replace(each, min_margin_m=0.3) for each in run.records]
    with_fault = next(n for n in own if records[n].fault)
    records[own[0]] = replace(records[own[0]], min_margin_m=-0.2, time_to_goal_s=None)
    records[with_fault] = replace(records[with_fault], min_margin_m=-0.99)
    missed = sum(records[n].time_to_goal_s is None for n in own)
    page = report(replace(run, records=tuple(records)), tmp_path)
    worst = f"The worst margin is -0.99 m, below 0 in 2 of {len(own)} episodes. "
    assert f"{worst}It misses the goal in {missed} of {len(own)} episodes." in page.text
    assert page.text.index(worst) < page.text.index("The moving robot touched nobody")


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_a_meeting_that_takes_longer_is_said_to_take_more(
    run: MadeUpRun, tmp_path: Path, times: float
) -> None:
    records = tuple(
        replace(each, time_lost_s=times * each.time_lost_s) if each.policy == "balanced" else each
        for each in run.records
        if each.time_lost_s is not None
    )
    page = report(replace(run, records=records, jobs=()), tmp_path)
    assert not re.search(r"takes -", page.text)
    assert (" s more than with blind" in page.text) == (times > 1.0)


def test_without_any_risk_there_is_no_chart_of_it(run: MadeUpRun, tmp_path: Path) -> None:
    page = report(changed(run, violation_time_s=0.0), tmp_path)
    assert [name for name, _ in page.tags].count("svg") == 1


def test_pairs_of_people_who_do_not_watch_are_named_and_left_out(tmp_path: Path) -> None:
    scenario = "crossing_from_the_left"
    run = changed(made_up_run(scenarios=3, seeds=24), scenario, attentive_share=0.4)
    page = report(run, tmp_path)
    assert "24 pairs labelled attentive in which somebody was not measured to be" in page.text
    assert f"({scenario} 24)" in page.text
    counted = [
        [
            each
            for each in run.records
            if (each.policy, each.attention) == (policy, "attentive") and each.scenario != scenario
        ]
        for policy in ("blind", "balanced")
    ]
    less = fewer_s(paired_difference(*counted, "time_lost_s")).partition(" [")[0]
    assert f"A meeting with attentive people takes {less} [" in page.text
    assert f"] s less than with blind ({len(counted[0])} pairs)" in page.text
    assert "attentive, 72 of 72 not" in page.text


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    run = made_up_run(scenarios=2, seeds=2, policies=("blind", "balanced"))
    records = [
        replace(record, scenario=HOSTILE, policy=f"{record.policy}{HOSTILE}", fault=HOSTILE)
        for record in run.records
    ]
    records[3:] = [failed(run.records[3], HOSTILE)]
    hostile = replace(run, records=tuple(records), run={"command": HOSTILE, HOSTILE: HOSTILE})
    page = report(hostile, tmp_path / 'a "folder" <b>')
    assert "alert(" not in page.script
    assert HOSTILE in " ".join(page.texts)
    assert [name for name, _ in page.tags].count("script") == 1


def test_same_folder_same_bytes(run: MadeUpRun, tmp_path: Path) -> None:
    out = run.write(tmp_path)
    first = write_report(out, stills=False).read_bytes()
    second = write_report(out, stills=False, path=tmp_path / "again.html").read_bytes()
    assert first == second
    assert not list(tmp_path.glob("*.part"))


@pytest.fixture(scope="module")
def short_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("short")
    run_jobs(short_jobs(2), out, workers=1)
    return out


def test_an_unfinished_run_says_so(short_run: Path, tmp_path: Path) -> None:
    for name in ("jobs.jsonl", "run.json"):
        text = (short_run / name).read_text().replace('"complete"', '"running"')
        (tmp_path / name).write_text(text)
    (tmp_path / "episodes").mkdir()
    for name in ("00000.json", "00002.json"):
        (tmp_path / "episodes" / name).write_bytes((short_run / "episodes" / name).read_bytes())
    page = PageReader(write_report(tmp_path, stills=False).read_text("utf-8"))
    assert "2 of 4 episodes did not run yet" in page.text
    assert set(re.findall(r"awarenav replay \S+ (\d)\b", page.text)) == {"0", "2"}
    # The conduct of the planner stands on the page of every run.
    assert "It obeys the speed limit." in page.text


def test_failed_episodes_are_counted_and_shown(run: MadeUpRun, tmp_path: Path) -> None:
    records = list(run.records)
    for index in (0, 5, 10):
        records[index] = failed(records[index], "ValueError: the planner gave nan m/s")
    page = report(replace(run, records=tuple(records)), tmp_path)
    assert "3 episodes failed" in page.text
    assert "ValueError: the planner gave nan m/s" in page.text


@pytest.mark.parametrize("missing", ["jobs.jsonl", "run.json"])
@pytest.mark.parametrize("how", ["gone", "torn", "list"])
def test_missing_files_cost_only_what_was_in_them(missing: str, how: str, tmp_path: Path) -> None:
    out = made_up_run(scenarios=2, seeds=2).write(tmp_path)
    if how == "gone":
        (out / missing).unlink()
    else:
        (out / missing).write_text('{"a": ' if how == "torn" else "[1]\n")
    page = PageReader(write_report(out, stills=False).read_text("utf-8"))
    assert f"{missing} cannot be read" in page.text
    assert "a meeting with people takes" in page.text


def test_command_writes_where_it_is_told_without_the_simulator(tmp_path: Path) -> None:
    out = made_up_run(scenarios=1, seeds=1).write(tmp_path / "run")
    page = tmp_path / "page.html"
    code = (
        "import sys; from awarenav.cli import main; "
        f"main(['report', {str(out)!r}, '--no-stills', '--out', {str(page)!r}]); "
        "print([n for n in ('pybullet', 'av') if n in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    written, modules = done.stdout.splitlines()
    assert str(page) in written
    assert page.exists()
    assert modules == "[]"


def test_a_browser_shows_the_page_on_a_phone_and_sorts_its_tables(
    tmp_path: Path, chromium: Chromium
) -> None:
    page = write_report(made_up_run(scenarios=3, seeds=2).write(tmp_path), stills=False)
    for width_px in (1280, 390):
        chromium.open(page, width=width_px, dark=width_px == 390)
        assert chromium.evaluate("document.documentElement.scrollWidth") <= width_px
    sorted_s = """(() => {
      const [head] = [...document.querySelectorAll("#episodes ~ * th")]
        .filter((each) => each.textContent === "Lost, s");
      head.firstChild.click();
      const column = head.cellIndex;
      const rows = [...head.closest("table").tBodies[0].rows];
      return rows.map((row) => +row.cells[column].textContent);
    })()"""
    lost_s = chromium.evaluate(sorted_s)
    assert lost_s == sorted(lost_s, reverse=True)
    assert chromium.evaluate(sorted_s) == sorted(lost_s)
    assert chromium.complaints() == []


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("run")
    jobs = plan_jobs(["crossing_from_left"], ["balanced"], [0], perception="truth")
    run_jobs(jobs, out, workers=1)
    return out


def pictures(page: PageReader) -> list[np.ndarray]:
    sources = [values["src"] for name, values in page.tags if name == "img"]
    data = [base64.b64decode(source.partition("base64,")[2]) for source in sources]
    return [cv2.imdecode(np.frombuffer(each, np.uint8), cv2.IMREAD_COLOR) for each in data]


def test_worst_episode_is_shown_at_its_least_margin(folder: Path) -> None:
    text = write_report(folder).read_text("utf-8")
    page = PageReader(text)
    assert write_report(folder).read_text("utf-8") == text
    camera, plan = pictures(page)
    assert camera.shape == plan.shape
    assert camera.std() > 10.0
    assert plan.std() > 10.0
    (record,) = read_records(folder / "episodes.csv")
    assert record.min_margin_m is not None
    assert f"smallest margin {record.min_margin_m:.2f} m" in page.text
    times = set(re.findall(r" at ([0-9.]+) s", " ".join(v.get("alt", "") for _, v in page.tags)))
    assert len(times) == 1
    assert record.duration_s is not None
    assert 0.0 < float(times.pop()) < record.duration_s


@pytest.mark.parametrize("how", ["other", "broken"])
def test_a_failing_still_costs_only_itself(folder: Path, tmp_path: Path, how: str) -> None:
    """A job that is not the one of the row, or none at all, gives words instead of pictures."""
    for name in ("episodes.csv", "run.json"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    job = json.loads((folder / "jobs.jsonl").read_text())
    if how == "other":
        other, *_ = plan_jobs(["crossing_from_left"], ["conservative"], [0])
        job["policy_text"] = other.policy_text
        job["scenario_text"] = job["scenario_text"].replace("duration_s: ", "duration_s: 0.")
    else:
        job["policy_text"] = "inflation: [what"
    (tmp_path / "jobs.jsonl").write_text(json.dumps(job) + "\n")
    page = PageReader(write_report(tmp_path).read_text("utf-8"))
    assert "No picture: " in page.text
    assert not pictures(page)
    assert "The moving robot touched nobody in 1 episode;" in page.text
