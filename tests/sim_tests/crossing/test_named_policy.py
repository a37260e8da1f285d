"""Names of policies in the simulator: presets of the library, ``scanner``, and files."""

from pathlib import Path

import pytest

from nav_adapter import AwarenessPolicy, NavError
from sim_tests import SimError
from sim_tests.crossing import named_policy

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
    for library in (AwarenessPolicy.preset, AwarenessPolicy.named):
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
