"""The plan of a run: every combination once, on the same seeds, with a unique key."""

import numpy as np
import pytest
from run_scenes import short, short_jobs

from nav_adapter import AwarenessPolicy, NavError
from sim_tests import SimError
from sim_tests.crossing.eyes import ORACLE
from sim_tests.crossing.faults import Fault
from sim_tests.crossing.planner import SamplingPlanner
from sim_tests.scenario import ScenarioTemplate
from sim_tests.study.runs import (
    fault_of,
    job_key,
    make_planner,
    plan_jobs,
    policy_of,
    run_episode,
    template_of,
)


def test_every_combination_is_planned_once_and_seeds_are_paired():
    jobs = plan_jobs(
        [short("a"), short("b")],
        ["blind", "balanced"],
        [3, 4],
        planners=["", "run_planners:Slow"],
        perception="truth",
        faults=["none", "misses_30"],
    )
    keys = [job_key(job) for job in jobs]
    assert len(set(keys)) == len(jobs) == 2**5
    for policy in ("blind", "balanced"):
        seeds = [(key.scenario, key.seed, key.fault) for key in keys if key.policy == policy]
        assert sorted(set(seeds)) == sorted(
            (scenario, seed, fault)
            for scenario in "ab"
            for seed in (3, 4)
            for fault in ("", "misses_30")
        )
    assert {key.planner for key in keys} == {"SamplingPlanner", "Slow"}


def test_a_job_holds_scenario_policy_and_fault():
    (job,) = plan_jobs(["crossing_attentive"], ["blind"], [0], faults=["frozen_camera"])
    assert template_of(job.scenario) == ScenarioTemplate.shipped("crossing_attentive")
    assert policy_of(job.policy) == AwarenessPolicy.preset("blind")
    assert fault_of(job.fault) == Fault.shipped("frozen_camera")


def test_the_oracle_is_balanced_and_knows_the_truth():
    blind, oracle = plan_jobs([short()], ["balanced", ORACLE], [0], perception="keypoints")
    assert oracle.policy == blind.policy
    assert (blind.perception, oracle.perception) == ("keypoints", "oracle")
    assert oracle.policy_name == "oracle"


def test_all_scenarios_are_those_that_need_a_planner():
    names = {job_key(job).scenario for job in plan_jobs(["all"], ["blind"], [0])}
    assert "crossing_attentive" in names
    assert "paper_encounter" not in names


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"perception": "eyes"}, "perception must be one of 'truth'"),
        ({"faults": ["misses"]}, "fault must be one of .* did you mean 'misses_30'"),
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


def test_seeds_policies_and_scenarios_are_checked():
    with pytest.raises(SimError, match="seed must lie in"):
        plan_jobs([short()], ["blind"], [-1])
    with pytest.raises(SimError, match="whole number"):
        plan_jobs([short()], ["blind"], [0.5])
    with pytest.raises(NavError, match="preset must be one of"):
        plan_jobs([short()], ["brave"], [0])
    with pytest.raises(SimError, match="two episodes have the same scenario name"):
        plan_jobs([short(), short()], ["blind"], [0])


def test_planners_are_made_with_the_arguments_they_take():
    scenario = short().median()
    assert make_planner("", scenario) is None
    boxes = scenario.layout.obstacle_boxes_odom
    np.testing.assert_array_equal(make_planner("run_planners:with_boxes", scenario).boxes, boxes)
    assert make_planner("run_planners:Slow", scenario).robot.max_speed_mps > 0.0
    reference = make_planner("sim_tests.crossing.planner:SamplingPlanner", scenario)
    assert isinstance(reference, SamplingPlanner)


def test_the_reference_planner_given_by_its_name_drives_the_same():
    (plain,) = short_jobs(1)[:1]
    (named,) = short_jobs(1, planners=["sim_tests.crossing.planner:SamplingPlanner"])[:1]
    assert run_episode(named) == run_episode(plain)


def test_a_planner_that_uses_the_global_generators_repeats_with_its_seed():
    first, *_, other = short_jobs(2, planners=["run_planners:UsesGlobalRandom"])
    np.random.seed(1)  # noqa: NPY002
    record = run_episode(first)
    expected = np.random.RandomState(1).random()
    assert np.random.random() == expected  # noqa: NPY002 - the global generator is unchanged
    assert run_episode(first) == record
    assert run_episode(other).path_length_m != record.path_length_m
