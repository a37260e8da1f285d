"""The plan of a run: every combination once, on the same seeds, with a unique key."""

import numpy as np
import pytest
from run_scenes import short, short_jobs

from nav_adapter import NavError
from sim_tests import SimError
from sim_tests.conditions import ORACLE
from sim_tests.study.runs import plan_jobs, run_episode


def test_every_combination_is_planned_once_and_seeds_are_paired():
    jobs = plan_jobs(
        [short("a"), short("b")],
        ["blind", "balanced"],
        [3, 4],
        planners=["", "run_planners:Slow"],
        perception="truth",
        faults=["none", "misses_30"],
    )
    keys = [job.conditions for job in jobs]
    assert len(set(keys)) == len(jobs) == 2**5
    for policy in ("blind", "balanced"):
        seeds = [(key.scenario, key.seed, key.fault) for key in keys if key.policy == policy]
        assert sorted(set(seeds)) == sorted(
            (scenario, seed, fault)
            for scenario in "ab"
            for seed in (3, 4)
            for fault in ("", "misses_30")
        )
    assert {key.planner for key in keys} == {"ReferencePlanner", "Slow"}


def test_the_oracle_is_balanced_and_knows_the_truth():
    blind, oracle = plan_jobs([short()], ["balanced", ORACLE], [0], perception="keypoints")
    assert oracle.policy_text == blind.policy_text
    assert (blind.perception, oracle.perception) == ("keypoints", "oracle")
    assert oracle.policy == "oracle"


def test_all_scenarios_are_those_that_need_a_planner():
    names = {job.scenario for job in plan_jobs(["all"], ["blind"], [0])}
    assert "crossing_attentive" in names
    assert "paper_encounter" not in names


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"perception": "eyes"}, "perception must be one of 'truth'"),
        ({"faults": ["misses"]}, "fault 'misses' is unknown; did you mean 'misses_30'"),
        ({"faults": ["ghosts", "ghosts"]}, "two episodes have the same"),
        ({"planners": ["run_planners"]}, "module:Class"),
        ({"planners": ["no_such_module:Planner"]}, "No module named 'no_such_module'"),
        ({"planners": ["run_planners:Absent"]}, "has no attribute 'Absent'"),
        ({"planners": ["run_planners:NOT_CALLABLE"]}, "must name a class or a function"),
        ({"planners": ["run_planners:NoPlan"]}, "NoPlan, which has no method plan"),
    ],
)
def test_unusable_arguments_are_refused_before_anything_runs(options, message):
    with pytest.raises(SimError, match=message):
        plan_jobs([short()], ["blind"], [0], **options)


def test_more_episodes_than_fit_into_memory_are_refused_at_once():
    with pytest.raises(SimError, match="at most 10000000 episodes, got 200000000"):
        plan_jobs(["late_glance"], ["blind", "balanced"], range(10**8))


def test_seeds_policies_and_scenarios_are_checked():
    with pytest.raises(SimError, match="seed must be 0 or more, got -1"):
        plan_jobs([short()], ["blind"], [-1])
    with pytest.raises(SimError, match="whole number"):
        plan_jobs([short()], ["blind"], [0.5])
    with pytest.raises(NavError, match="policy must be one of"):
        plan_jobs([short()], ["brave"], [0])
    with pytest.raises(SimError, match="two episodes have the same scenario, seed, policy"):
        plan_jobs([short(), short()], ["blind"], [0])


def test_a_planner_that_uses_the_global_generators_repeats_with_its_seed():
    first, *_, other = short_jobs(2, planners=["run_planners:UsesGlobalRandom"])
    np.random.seed(1)  # noqa: NPY002
    record = run_episode(first)
    expected = np.random.RandomState(1).random()
    assert np.random.random() == expected  # noqa: NPY002 - the global generator is unchanged
    assert run_episode(first) == record
    assert run_episode(other).path_length_m != record.path_length_m
