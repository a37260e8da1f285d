"""Names of policies in the simulator: presets of the library, ``scanner``, and files."""

from pathlib import Path

import pytest

from awarenav.policies import read_policy
from nav_adapter import AwarenessPolicy, NavError
from sim_tests import Scenario, SimError, run_crossing
from sim_tests.crossing import named_policy
from sim_tests.search._settings import common_settings
from sim_tests.study.runs import Conditions, plan_jobs, policy_of

PRESETS = ("blind", "conservative", "balanced", "assertive")


@pytest.mark.parametrize("name", PRESETS)
def test_the_presets_of_the_library_keep_their_names(name):
    assert named_policy(name) == (name, AwarenessPolicy.preset(name))


def test_scanner_is_a_preset_of_the_simulator_alone():
    name, scanner = named_policy("scanner")
    assert name == "scanner"
    for alpha in (0.0, 0.5, 1.0):  # today's AMR treats everybody the same
        assert scanner.inflation.radius_m(alpha) == scanner.inflation.radius_m(0.0) == 0.45
    assert scanner.alerts is None
    message = r"'blind', 'conservative', got 'scanner'$"
    for library in (AwarenessPolicy.preset, read_policy):
        with pytest.raises(NavError, match=message):
            library("scanner")


def test_a_policy_a_file_and_a_path_are_named(tmp_path):
    _, scanner = named_policy("scanner")
    assert named_policy(scanner) == ("custom", scanner)
    for file in (tmp_path / "today.yaml", tmp_path / "today.YML"):
        scanner.to_yaml(file)
        assert named_policy(file) == named_policy(str(file)) == ("today", scanner)
    with pytest.raises(SimError, match=r"a preset's name or a \.yaml file"):
        named_policy(Path("scanner"))


@pytest.mark.parametrize(("given", "near"), [("scaner", "scanner"), ("balance", "balanced")])
def test_a_mistyped_name_gets_all_names_and_the_nearest(given, near):
    message = rf"preset must be one of .*'blind'.*'scanner', got '{given}'; did you mean '{near}'"
    with pytest.raises(NavError, match=message):
        named_policy(given)


def test_every_entry_to_the_simulator_knows_the_scanner():
    _, scanner = named_policy("scanner")
    (job,) = plan_jobs(["blind_corner"], ["scanner"], [0], sensors=["scanner"])
    assert (job.policy_name, policy_of(job.policy)) == ("scanner", scanner)
    searched = common_settings("scanner", Conditions(scenario=["blind_corner"]))
    assert searched["policy_name"] == "scanner"
    assert policy_of(searched["policy"]) == scanner
    short = Scenario.shipped("crossing_attentive").model_copy(update={"duration_s": 0.5})
    assert run_crossing(short, policy="scanner").policy == "scanner"
