"""A study in Optuna's journal: killed, resumed, shared, damaged, and always the same."""

from __future__ import annotations

import multiprocessing
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from full_disk import files_up_to

from sim_tests import SimError
from sim_tests.search._study import Optimizer, Outcome, Range, SharedStudy, importances

SPACE = {"x": Range(low=-1.0, high=1.0), "y": Range(low=0.1, high=10.0, log=True)}
FIRST = {"x": 5.0, "y": 1.0}
TOTAL = 14


def optimizer(sampler: str = "tpe", generation: int = 4, seed: int = 3) -> Optimizer:
    return Optimizer(sampler, SPACE, generation=generation, seed=seed, first=FIRST)


def outcome(parameters: dict[str, float], sampler: str = "tpe") -> Outcome:
    x, y = parameters["x"], parameters["y"]
    constraints = {} if sampler == "cmaes" else {"c": x - 0.4}
    return Outcome(x * x + 0.1 * y, constraints, {"note": x})


def outcomes(trials: dict[int, dict[str, float]]) -> list[Outcome]:
    return [outcome(parameters) for parameters in trials.values()]


def study(folder: Path, total: int = TOTAL, **changes) -> SharedStudy:
    return SharedStudy(folder / "s.log", optimizer(**changes), total)


def work(folder: Path, total: int = TOTAL, most: int = 1, die_at: int = -1) -> list:
    """Evaluate all trials, ``most`` at once; kill this process in the middle of ``die_at``."""

    def evaluated(trials):
        if die_at in trials:
            os.kill(os.getpid(), signal.SIGKILL)
        return outcomes(trials)

    shared = study(folder, total)
    while len(found := shared.trials()) < total:
        shared.evaluate(most, evaluated)
    return found


def start(folder: Path, die_at: int = -1) -> multiprocessing.Process:
    process = multiprocessing.get_context("fork").Process(
        target=work, args=(folder,), kwargs={"die_at": die_at}
    )
    process.start()
    return process


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    return work(tmp_path_factory.mktemp("whole"))


@pytest.mark.parametrize("die_at", [0, 6])
def test_a_study_killed_and_resumed_is_the_same(tmp_path, uninterrupted, die_at):
    killed = start(tmp_path, die_at)
    killed.join()
    assert killed.exitcode == -signal.SIGKILL
    assert len(study(tmp_path).trials()) == die_at
    assert work(tmp_path) == uninterrupted


def test_two_processes_of_which_one_is_killed_make_the_same_study(tmp_path, uninterrupted):
    killed, other = start(tmp_path, 5), start(tmp_path)
    for process in (killed, other):
        process.join()
    # The first process dies only if it gets trial 5; the second one survives in any case.
    assert killed.exitcode in (0, -signal.SIGKILL)
    assert other.exitcode == 0
    assert work(tmp_path) == uninterrupted


@pytest.mark.parametrize("most", [3, 100])
def test_several_trials_at_once_change_nothing(tmp_path, uninterrupted, most):
    assert work(tmp_path, most=most) == uninterrupted


def test_a_study_continues_with_more_trials(tmp_path, uninterrupted):
    assert work(tmp_path, 5) == uninterrupted[:5]
    assert work(tmp_path) == uninterrupted


def test_processes_take_different_trials_until_only_those_of_others_are_left(
    tmp_path, uninterrupted
):
    mine, theirs = study(tmp_path), study(tmp_path)
    seen = []

    def second(trials):
        seen.append(list(trials))
        return outcomes(trials)

    def first(trials):
        seen.append(list(trials))
        theirs.evaluate(2, second)  # the generation has four
        theirs.evaluate(1, second)  # nobody waits for a process that may have died
        return outcomes(trials)

    mine.evaluate(2, first)
    assert seen == [[0, 1], [2, 3], [0]]
    assert mine.trials() == theirs.trials() == uninterrupted[:4]
    assert work(tmp_path) == uninterrupted


def test_another_search_does_not_continue_a_study(tmp_path):
    work(tmp_path, 5)
    with pytest.raises(SimError, match=r"s\.log was made by another search"):
        study(tmp_path, seed=4)


def test_a_failed_trial_keeps_its_number_and_is_not_repeated(tmp_path):
    shared = study(tmp_path, 8)
    while len(shared.trials()) < 8:
        shared.evaluate(
            4, lambda trials: [Outcome(None if n == 2 else trials[n]["x"]) for n in trials]
        )
    values = [trial.outcome.value for trial in study(tmp_path, 8).trials()]
    assert [row for row, value in enumerate(values) if value is None] == [2]
    assert len(values) == 8


def test_values_that_are_not_finite_are_refused(tmp_path):
    with pytest.raises(SimError, match="trial 0: the value must be finite"):
        study(tmp_path).evaluate(1, lambda trials: [Outcome(float("nan"))])


def test_a_study_on_a_full_disk_is_said_and_continues(tmp_path, uninterrupted):
    shared = study(tmp_path)
    shared.evaluate(4, outcomes)
    size = (tmp_path / "s.log").stat().st_size
    with files_up_to(size + 500), pytest.raises(SimError, match=r"s\.log: .*--resume"):
        shared.evaluate(4, outcomes)
    assert not (tmp_path / "s.log").read_bytes().endswith(b"\n")
    assert work(tmp_path) == uninterrupted


def test_a_damaged_journal_is_refused_by_its_name(tmp_path):
    work(tmp_path, 5)
    lines = (tmp_path / "s.log").read_bytes().splitlines(keepends=True)
    (tmp_path / "s.log").write_bytes(b"".join([*lines[:3], b"{torn", *lines[3:]]))
    with pytest.raises(SimError, match=r"cannot use .*s\.log"):
        study(tmp_path)


@pytest.mark.parametrize("sampler", ["tpe", "nsga2", "cmaes"])
def test_proposals_depend_on_seed_and_outcomes_alone(sampler):
    def run(seed: int) -> list:
        asked, found = optimizer(sampler, 6, seed), []
        for _ in range(4):
            proposed = asked.ask()
            assert asked.ask() == proposed
            found.append(proposed)
            asked.tell([outcome(parameters, sampler) for parameters in proposed])
        return found

    first = run(1)
    assert first == run(1)
    assert first != run(2)
    assert first[0][0] == {"x": 1.0, "y": 1.0}, "the first trial is moved into the space"
    for generation in first:
        for parameters in generation:
            assert all(SPACE[name].low <= v <= SPACE[name].high for name, v in parameters.items())


@pytest.mark.parametrize("sampler", ["tpe", "nsga2"])
def test_a_constrained_search_turns_to_where_the_constraint_holds(sampler):
    """The objective pulls to x = −1, the constraint wants x ≥ 0.5: a quarter of the space."""
    space = dict.fromkeys("xyz", SPACE["x"])
    asked = Optimizer(sampler, space, generation=12, seed=0, first=dict.fromkeys("xyz", -0.5))
    proposed = []
    for _ in range(8):
        generation = [parameters["x"] for parameters in asked.ask()]
        proposed.append(generation)
        asked.tell([Outcome(x, {"c": 0.5 - x}) for x in generation])
    feasible = (np.array(proposed) >= 0.5).mean(axis=1)
    assert feasible[0] <= 0.25
    assert feasible[-4:].mean() >= 0.4


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: optimizer(generation=1), "at least 2"),
        (lambda: Optimizer("tpe", {}, generation=4, seed=0, first={}), "needs parameters"),
        (lambda: Range(low=1.0, high=1.0), "high must exceed low"),
        (lambda: Range(low=0.0, high=1.0, log=True), "above 0"),
    ],
)
def test_arguments_that_do_not_fit_together_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_importances_sum_to_one_and_find_the_parameter_that_matters():
    space = {"matters": Range(low=0.0, high=1.0), "idle": Range(low=0.0, high=1.0)}
    points = [{"matters": x / 5, "idle": y / 5} for x in range(6) for y in range(6)]
    found = importances(points, [p["matters"] + 0.01 * p["idle"] for p in points], space)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["matters"] > 0.8
    # No parameter matters where no trial differs.
    assert importances(points, [7.0] * 36, space) == {"matters": 0.0, "idle": 0.0}
