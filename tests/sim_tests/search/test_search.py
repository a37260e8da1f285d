from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from search_process import SPACE, history, make_optimizer, outcome, work

from nav_adapter import AwarenessPolicy
from sim_tests import SimError
from sim_tests.scenario import shipped_templates
from sim_tests.search import Optimizer, Outcome, Range, SharedStudy, write_or_check_settings
from sim_tests.search.tune import TuneSettings

_TOTAL = 14


def _start(folder: Path, die_at: int = -1) -> subprocess.Popen:
    script = Path(__file__).with_name("search_process.py")
    return subprocess.Popen([sys.executable, str(script), str(folder), str(_TOTAL), str(die_at)])


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    work(folder, _TOTAL)
    return history(folder, _TOTAL)


@pytest.mark.parametrize("die_at", [0, 6])
def test_a_study_killed_and_resumed_is_the_same(tmp_path, uninterrupted, die_at):
    assert _start(tmp_path, die_at).wait() == -9
    assert len(history(tmp_path, _TOTAL)) == die_at
    work(tmp_path, _TOTAL)
    assert history(tmp_path, _TOTAL) == uninterrupted


def test_two_processes_of_which_one_is_killed_make_the_same_study(tmp_path, uninterrupted):
    killed, other = _start(tmp_path, 5), _start(tmp_path)
    # The first process dies only if it gets trial 5; the second one survives in any case.
    assert killed.wait() in (0, -9)
    assert other.wait() == 0
    assert history(tmp_path, _TOTAL) == uninterrupted


def test_claiming_many_trials_at_once_and_telling_them_in_reverse_changes_nothing(
    tmp_path, uninterrupted
):
    with SharedStudy(tmp_path, "s", make_optimizer(), _TOTAL) as study:
        while not study.is_complete:
            for claim in reversed(study.claim(100)):
                study.tell(claim, outcome(claim.parameters))
    assert history(tmp_path, _TOTAL) == uninterrupted


def test_a_study_continues_with_more_trials(tmp_path, uninterrupted):
    work(tmp_path, 5)
    work(tmp_path, _TOTAL)
    assert history(tmp_path, _TOTAL) == uninterrupted


def test_a_trial_belongs_to_one_process_at_a_time(tmp_path):
    with (
        SharedStudy(tmp_path, "s", make_optimizer(), _TOTAL) as first,
        SharedStudy(tmp_path, "s", make_optimizer(), _TOTAL) as second,
    ):
        mine, theirs = first.claim(3), second.claim(3)
        assert [claim.number for claim in mine] == [0, 1, 2]
        assert [claim.number for claim in theirs] == [3]  # the generation has four
        assert second.claim(1) == ()
        mine[1].lock.close()  # as if its process had died
        assert [claim.number for claim in second.claim(1)] == [1]


def test_another_search_does_not_continue_a_study(tmp_path):
    work(tmp_path, 5)
    with pytest.raises(SimError, match="made by another search"):
        SharedStudy(tmp_path, "s", make_optimizer(seed=4), _TOTAL)


def test_a_failed_trial_keeps_its_number_and_is_not_repeated(tmp_path):
    with SharedStudy(tmp_path, "s", make_optimizer(), 8) as study:
        while not study.is_complete:
            for claim in study.claim(4):
                fails = claim.number == 2
                study.tell(claim, Outcome(None) if fails else outcome(claim.parameters))
        states = [trial.state.name for trial in study.finished_trials()]
    assert states == ["COMPLETE"] * 2 + ["FAIL"] + ["COMPLETE"] * 5
    assert len(history(tmp_path, 8)) == 8


def test_values_that_are_not_finite_are_refused(tmp_path):
    with SharedStudy(tmp_path, "s", make_optimizer(), 4) as study:
        (claim,) = study.claim(1)
        with pytest.raises(SimError, match="finite"):
            study.tell(claim, Outcome((math.nan, 0.0)))


@pytest.mark.parametrize("sampler", ["tpe", "nsga2", "cmaes"])
def test_proposals_depend_on_seed_and_outcomes_alone(sampler):
    objectives = 1 if sampler == "cmaes" else 2

    def run(seed: int) -> list[tuple]:
        optimizer, found = make_optimizer(sampler, 6, seed), []
        for _ in range(4):
            proposed = optimizer.ask()
            assert optimizer.ask() == proposed
            found.append(proposed)
            optimizer.tell([outcome(parameters, objectives) for parameters in proposed])
        return found

    first = run(1)
    assert first == run(1)
    assert first != run(2)
    for generation in first:
        for parameters in generation:
            assert all(SPACE[name].low <= v <= SPACE[name].high for name, v in parameters.items())


def test_initial_trials_come_first_and_are_moved_into_the_space():
    optimizer = Optimizer("tpe", SPACE, generation=3, seed=0, initial=[{"x": 5.0, "y": 1.0}])
    assert optimizer.ask()[0] == {"x": 1.0, "y": 1.0}


@pytest.mark.parametrize("sampler", ["tpe", "nsga2"])
def test_a_constrained_search_turns_to_where_the_constraint_holds(sampler):
    """The objectives pull to x = −1, the constraint wants x ≥ 0.5: a quarter of the space."""
    space = dict.fromkeys("xyz", SPACE["x"])
    optimizer = Optimizer(sampler, space, generation=12, seed=0, objectives=2)
    proposed = []
    for _ in range(8):
        generation = [parameters["x"] for parameters in optimizer.ask()]
        proposed.append(generation)
        optimizer.tell([Outcome((x, x * x), {"c": 0.5 - x}) for x in generation])
    feasible = (np.array(proposed) >= 0.5).mean(axis=1)
    assert feasible[0] <= 0.25
    assert feasible[-4:].mean() >= 0.5


def test_cma_es_finds_the_bottom_of_a_bowl():
    space = {f"x{i}": Range(low=-1.0, high=1.0) for i in range(4)}
    optimizer, best = Optimizer("cmaes", space, generation=12, seed=0), math.inf
    for _ in range(25):
        proposed = optimizer.ask()
        values = [sum((v - 0.3) ** 2 for v in parameters.values()) for parameters in proposed]
        best = min(best, *values)
        optimizer.tell([Outcome((value,)) for value in values])
    assert best < 1e-3


@pytest.mark.parametrize(
    ("sampler", "generation", "message"),
    [("tpe", 1, "at least 2"), ("cmaes", 4, "one objective")],
)
def test_arguments_that_do_not_fit_together_are_refused(sampler, generation, message):
    with pytest.raises(SimError, match=message):
        Optimizer(sampler, SPACE, generation=generation, seed=0, objectives=2)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"low": 1.0, "high": 1.0}, "high must exceed low"),
        ({"low": 0.0, "high": 1.0, "log": True}, "above 0"),
    ],
)
def test_invalid_ranges_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        Range(**values)


@given(value=st.floats(-10.0, 10.0))
def test_clipping_stays_in_the_range_and_keeps_values_inside(value):
    inside = Range(low=-1.0, high=2.0).clipped(value)
    assert -1.0 <= inside <= 2.0
    assert inside == value or not -1.0 <= value <= 2.0


def _settings(**changed) -> TuneSettings:
    return TuneSettings(
        **{
            "policy_name": "balanced",
            "policy": "{}",
            "scenarios": ("name: a",),
            "ranges": {},
            "trials": 10,
            "episodes": 2,
            "held_out": 3,
            "perception": "truth",
            "planner": "",
            "seed": 0,
            "sampler": "tpe",
            "generation": 4,
            **changed,
        }
    )


def _write_or_check(folder: Path, resume: bool, **changed) -> None:
    write_or_check_settings(
        _settings(**changed), folder, "tune.json", "tuning", resume=resume, may_grow=["trials"]
    )


def test_a_search_is_resumed_with_the_same_settings_or_more_trials(tmp_path):
    folder = tmp_path / "new"
    _write_or_check(folder, False)
    _write_or_check(folder, True)
    _write_or_check(folder, True, trials=20)
    with pytest.raises(SimError, match="already holds a tuning"):
        _write_or_check(folder, False)
    with pytest.raises(SimError, match="another trials: 20, now 10"):
        _write_or_check(folder, True, trials=10)
    with pytest.raises(SimError, match="another perception: 'truth', now 'pixels'"):
        _write_or_check(folder, True, trials=20, perception="pixels")
    with pytest.raises(SimError, match="there is no tuning"):
        _write_or_check(tmp_path / "other", True)
    assert not (tmp_path / "other").exists()


@pytest.mark.parametrize(
    "name", ["truth", "keypoints", "pixels", "keypoints+scanner", "pixels+scanner", "scanner"]
)
def test_the_episodes_of_a_tuning_have_its_perception(name):
    settings = _settings(perception=name)
    balanced = AwarenessPolicy.preset("balanced")
    jobs = settings.jobs("b", balanced, range(7, 9), shipped_templates()[:3])
    assert len(jobs) == 6
    assert {(job.perception, job.policy_name) for job in jobs} == {(name, "b")}
    assert sorted({job.seed for job in jobs}) == [7, 8]


@given(seed=st.integers(0, 10**6), episodes=st.integers(1, 10**6), held_out=st.integers(1, 10**6))
def test_held_out_seeds_differ_from_tuning_seeds(seed, episodes, held_out):
    settings = _settings(seed=seed, episodes=episodes, held_out=held_out)
    tuning, held = settings.tuning_seeds, settings.held_out_seeds
    assert (len(tuning), len(held)) == (episodes, held_out)
    assert tuning.stop <= held.start
