"""A search in generations, and its episodes: resumed, killed, damaged, and always the same."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from full_disk import files_up_to

from nav_adapter import AwarenessPolicy
from sim_tests import SimError
from sim_tests.search._settings import EpisodeRunner
from sim_tests.search._study import Optimizer, Outcome, Range, importances
from sim_tests.study.runs import job_of, policy_text

SPACE = {"x": Range(low=-1.0, high=1.0), "y": Range(low=0.1, high=10.0, log=True)}
FIRST = {"x": 5.0, "y": 1.0}
# A robot that drives for two tenths of a second.
SHORT = """{name: short, duration_s: 0.2, layout: open,
  robot: {goal_x_m: 5.0, straight_on_speed_mps: 0.5}}"""
POLICY = "balanced", policy_text(AwarenessPolicy.preset("balanced"))


def optimizer(sampler: str = "tpe", generation: int = 4, seed: int = 3) -> Optimizer:
    return Optimizer(sampler, SPACE, generation=generation, seed=seed, first=FIRST)


def outcome(parameters: dict[str, float], sampler: str = "tpe") -> Outcome:
    x, y = parameters["x"], parameters["y"]
    constraints = {} if sampler == "cmaes" else {"c": x - 0.4}
    return Outcome(x * x + 0.1 * y, constraints, {"note": x})


def searched(total, made=outcome):
    evaluate = optimizer().generations(lambda trials: list(map(made, trials.values())), total)
    return list(itertools.chain(*evaluate))


def test_a_search_with_more_trials_goes_on_from_one_with_fewer():
    whole = searched(14)
    assert [trial.number for trial in whole] == list(range(14))
    assert searched(5) == whole[:5]


def test_a_failed_trial_keeps_its_number_and_a_value_is_finite():
    values = iter([0.1, 0.2, None, 0.4, *[0.5] * 4])
    found = [each.outcome.value for each in searched(8, lambda _: Outcome(next(values)))]
    assert [row for row, value in enumerate(found) if value is None] == [2]
    assert len(found) == 8
    with pytest.raises(SimError, match="trial 0: the value must be finite"):
        searched(4, lambda _: Outcome(float("nan")))


def run(folder, keys):
    """Return the seeds of the episodes, and the keys of those that ran now."""
    ran = []

    def job(place):
        ran.append(keys[place])
        seed = "abcdef".index(keys[place])
        return job_of(SHORT, POLICY, "", seed=seed, perception="truth")

    with EpisodeRunner(folder, 1, "test") as runner:
        records = runner.run(keys, job)
    assert not any(record.error for record in records)
    return [record.seed for record in records], "".join(ran)


def test_an_episode_runs_once_and_an_unfinished_line_runs_again(tmp_path):
    assert run(tmp_path, "ba") == ([1, 0], "ba")
    assert run(tmp_path, "cab") == ([2, 0, 1], "c")
    file = tmp_path / "episodes.jsonl"
    whole = file.read_bytes()
    file.write_bytes(whole[:-20])  # as a kill or a full disk leaves it
    assert run(tmp_path, "abc") == ([0, 1, 2], "c")
    assert file.read_bytes() == whole
    with files_up_to(len(whole) + 50), pytest.raises(SimError, match="--resume continues"):
        run(tmp_path, "abcd")
    assert run(tmp_path, "abcd") == ([0, 1, 2, 3], "d")
    file.write_bytes(whole.replace(b'"seed"', b'"sed"', 1))
    with pytest.raises(SimError, match=r"episodes\.jsonl, line 1 is no episode"):
        run(tmp_path, "a")


def test_a_failed_episode_is_told_and_runs_again(tmp_path):
    for _ in range(2):
        with EpisodeRunner(tmp_path, 1, "test") as runner:
            job = job_of(SHORT, POLICY, "no.such:Planner", seed=0, perception="truth")
            (record,) = runner.run("a", lambda _, job=job: job)
        assert "no.such" in record.error
    assert not (tmp_path / "episodes.jsonl").exists()
    assert run(tmp_path, "a") == ([0], "a")


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
