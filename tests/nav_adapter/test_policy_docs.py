"""The pages show the figures of the presets, and the tests of the safety argument exist."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import nav_scenes
import numpy as np
import pytest
import yaml
from nav_scenes import SCANNER
from paths import ROOT

from awarenav.cli import main
from nav_adapter import AwarenessPolicy
from nav_adapter.policies import AttentionRules
from nav_adapter.reach import Reach
from nav_adapter.rules import RULES, rules_of
from perception.anthropometry import BODY_RADIUS_M
from tools.docs_site.rules import PAGE, rules_list, with_rules

TEXT = (ROOT / "docs" / "policies.md").read_text(encoding="utf-8")
PRESETS = ["blind", "conservative", "balanced", "assertive"]
FRONT_M = 0.35
# Of 0.70 m × 0.50 m, as in `awarenav policy show`.
ROBOT = replace(
    nav_scenes.ROBOT,
    footprint_m=np.array([[FRONT_M, 0.25], [-FRONT_M, 0.25], [-FRONT_M, -0.25], [FRONT_M, -0.25]]),
)


def policy_row(name: str) -> list[list[float]]:
    """Return the numbers of a table row: per preset one value, or an unaware and an aware one."""
    (line,) = [line for line in TEXT.splitlines() if line.startswith(f"| {name} |")]
    cells = line.strip("|").split("|")[1:]
    return [[float(number) for number in re.findall(r"\d+\.\d+", cell)] for cell in cells]


@pytest.mark.parametrize(("column", "name"), list(enumerate(PRESETS)))
def test_the_table_of_presets_shows_what_the_command_prints(column, name, capsys) -> None:
    assert main(["policy", "show", name, "--json", "--out", "none"]) == 0
    table = json.loads(capsys.readouterr().out)[name]
    policy = AwarenessPolicy.preset(name)
    ahead, beside = (np.array(table[f"limit_{side}_mps"]) for side in ("ahead", "beside"))
    assert table["distance_m"][:3] == [1.0, 2.0, 3.0]
    expected = {
        "radius of the policy, unaware → aware": [policy.inflation.radius_m(a) for a in (0.0, 1.0)],
        "radius for this robot": table["radius_m"],
        "U, unaware → aware": table["human_speed_mps"],
        "limit, 1 m ahead": ahead[:, 0],
        "limit, 2 m ahead": ahead[:, 1],
        "limit, 3 m ahead": ahead[:, 2],
        "limit, 1 m along and 1.2 m beside": beside[:, 0],
    }
    for title, values in expected.items():
        shown = policy_row(title)[column]
        assert shown[0] == pytest.approx(values[0], abs=0.0051), title
        assert shown[-1] == pytest.approx(values[-1], abs=0.0051), title
    assert policy_row("shrinks at")[column] == [policy.timing.shrink_rate_mps]
    assert policy_row("noticed counts as")[column] == [
        each for each in (policy.noticed_counts_as,) if each is not None
    ]


@pytest.mark.parametrize(("column", "name"), list(enumerate(PRESETS)))
def test_the_robot_is_at_full_speed_beyond_the_distance_shown(column: int, name: str) -> None:
    shown = policy_row("full speed beyond, ahead")[column]
    for alpha, at_m in ((0.0, shown[0]), (1.0, shown[-1])):
        for off_m, full in ((-0.03, False), (0.03, True)):
            place = (FRONT_M + BODY_RADIUS_M + at_m + off_m, 0.0)
            result = nav_scenes.settled_update(
                [nav_scenes.person(position=place, awareness_lower=alpha)],
                policy=AwarenessPolicy.preset(name),
                robot=ROBOT,
                state=nav_scenes.robot_at(speed_mps=0.75),
            )
            assert (result.speed_limit_mps == ROBOT.max_speed_mps) is full


def test_the_file_shown_is_the_default_policy_with_every_setting() -> None:
    (block,) = re.findall(r"```yaml\n(.*?)```", TEXT, flags=re.DOTALL)
    data = yaml.safe_load(block)
    asks = yaml.safe_load(
        re.sub(r"attention: null.*\n", "attention:\n", block).replace("\n#", "\n")
    )
    assert AttentionRules(**asks["attention"]) == AttentionRules()
    assert asks["attention"].keys() == AttentionRules.model_fields.keys()
    policy = AwarenessPolicy.model_validate(data)
    assert policy == AwarenessPolicy() == AwarenessPolicy.preset("balanced")
    whole = policy.model_dump(mode="json")
    assert data.keys() == whole.keys()
    for section, values in data.items():
        if isinstance(values, dict) and section != "filter":
            assert values.keys() == whole[section].keys()


def test_every_test_named_in_the_safety_argument_exists() -> None:
    root = ROOT
    safety = (root / "docs" / "safety.md").read_text(encoding="utf-8")
    named = re.findall(r"`((?:tests/[\w/]+/)?test_\w+\.py)?(?:::(test_\w+))?`", safety)
    file = ""
    checked = 0
    for path, function in named:
        if path:
            file = path if "/" in path else f"tests/nav_adapter/{path}"
            assert (root / file).exists(), file
        if function:
            checked += 1
            assert f"def {function}(" in (root / file).read_text(encoding="utf-8"), function
    assert checked >= 12


def test_an_aware_person_who_walks_may_stop_or_walk_on() -> None:
    policy = AwarenessPolicy.preset("balanced")
    aware_mps, unaware_mps = map(policy.speed.human_speed_mps, (1.0, 0.0))
    walker = Reach(
        *(0.0, 0.0, 1.2, 0.0, aware_mps),
        policy.reach.time_constant_s,
        policy.reach.delay_s,
        margin_m=policy.margins.floor_m,
        within_m=policy.margins.within_m(aware_mps, unaware_mps),
    )
    assert walker.radius_m(1.8) == pytest.approx(0.33, abs=0.005)
    assert walker.may_walk_on
    assert 1.2 * walker.walking_on().drift_s(2.0) == pytest.approx(2.4, abs=0.01)


def test_the_safety_argument_lists_the_rules_of_the_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_rules(page)
    assert [f"`{rule.name}`" for rule in RULES] == re.findall(
        r"^- \*\*(`.*?`)\*\*", rules_list(), re.M
    )
    # Each rule of one person can be left out by its name, but for the floor.
    left_out = AwarenessPolicy(without=SCANNER)
    assert [rule.name for rule in rules_of(left_out)] == ["in the path"]
