"""Searches on a full disk, and files that are not of a search."""

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


def test_an_evaluation_of_other_episodes_is_refused_by_its_name(tmp_path):
    records = [EpisodeRecord("a", seed, "p", "q", "truth", success=True) for seed in range(3)]
    evaluator = PolicyEvaluator(None, None, tmp_path)
    path = tmp_path / "evaluations" / "p-0-2.csv"
    path.parent.mkdir()
    write_records(path, records)
    assert evaluator.evaluate("p", None, range(3), ("a",)).records == tuple(records)
    write_records(path, records[:2])
    with pytest.raises(SimError, match=r"p-0-2\.csv holds other episodes than those of p: move"):
        evaluator.evaluate("p", None, range(3), ("a",))
