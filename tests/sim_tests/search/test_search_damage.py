"""Searches on a full disk and with damaged files: the rest is kept, the episodes run again."""

from __future__ import annotations

import pytest
from full_disk import files_up_to

from sim_tests import SimError
from sim_tests.search import Optimizer, Outcome, Range, SharedStudy
from sim_tests.search.tune._evaluator import PolicyEvaluator
from sim_tests.study.measures import EpisodeRecord, write_records

RANGES = {"x": Range(low=0.0, high=1.0)}


def study(folder, total=40):
    return SharedStudy(folder, "a", Optimizer("tpe", RANGES, generation=4, seed=3), total)


def square(claims):
    return [Outcome((claim.parameters["x"] ** 2,)) for claim in claims]


def complete(shared):
    while not shared.is_complete:
        shared.evaluate(4, square)


def finish(folder):
    with study(folder) as shared:
        complete(shared)
        return [(trial.params, trial.values) for trial in shared.finished_trials()]


def test_a_study_on_a_full_disk_is_said_and_continues(tmp_path):
    expected = finish(tmp_path / "whole")
    folder = tmp_path / "full"
    with study(folder) as shared:
        shared.evaluate(4, square)
        size = (folder / "study.db-wal").stat().st_size
        with files_up_to(size + 5000), pytest.raises(SimError, match=r"study\.db: .*--resume"):
            complete(shared)
    assert finish(folder) == expected


@pytest.mark.parametrize(
    ("damage", "reason"),
    [
        (lambda data: data[:-20], "episodes are missing"),
        (lambda data: b"".join(data.splitlines(keepends=True)[:-1]), "episodes are missing"),
        (lambda data: data.replace(b",true,", b",tr", 1), "cells"),
        (lambda data: data.replace(b"1.5", b"-1.5", 1), "min_separation_m must lie in"),
        (lambda data: data.replace(b"\na,0", b"\na,7", 1), "episodes are missing"),
    ],
)
def test_a_damaged_evaluation_is_set_aside_and_runs_again(damage, reason, tmp_path, capsys):
    def records():
        return tuple(
            EpisodeRecord("a", seed, "p", "q", "truth", success=True, min_separation_m=1.5)
            for seed in range(3)
        )

    evaluator = PolicyEvaluator(None, None, tmp_path)
    evaluator._run = lambda *_: records()
    path = tmp_path / "evaluations" / "p-0-2.csv"
    path.parent.mkdir()
    write_records(path, records())
    whole = path.read_bytes()
    assert evaluator.evaluate("p", None, range(3), ("a",)).records == records()
    path.write_bytes(damage(whole))
    assert evaluator.evaluate("p", None, range(3), ("a",)).records == records()
    assert path.read_bytes() == whole
    assert (path.parent / "p-0-2.csv.damaged").read_bytes() == damage(whole)
    assert reason in capsys.readouterr().err
