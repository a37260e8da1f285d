"""Stills of real episodes: pictures of the instant that the table means, or a reason."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from page_reader import PageReader

from sim_tests.study.measures import read_records
from sim_tests.study.report import write_report
from sim_tests.study.runs import plan_jobs, run_jobs


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
        job["policy"] = plan_jobs(["crossing_from_left"], ["conservative"], [0])[0].policy
        job["scenario"] = job["scenario"].replace("duration_s: ", "duration_s: 0.")
    else:
        job["policy"] = "inflation: [what"
    (tmp_path / "jobs.jsonl").write_text(json.dumps(job) + "\n")
    page = PageReader(write_report(tmp_path).read_text("utf-8"))
    assert "No picture: " in page.text
    assert not pictures(page)
    assert "The moving robot touched nobody in 1 episode;" in page.text
