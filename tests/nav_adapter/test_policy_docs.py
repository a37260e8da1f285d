"""docs/policies.md shows the figures of the presets and a valid policy file."""

from __future__ import annotations

import re
from dataclasses import replace

import nav_scenes
import numpy as np
import pytest
import yaml
from paths import ROOT

from awarenav.policies._show import FOOTPRINT_M
from nav_adapter import AwarenessPolicy
from nav_adapter.settled import settled_human_speed_mps, settled_radius_m, settled_speed_limit_mps
from perception.anthropometry import BODY_RADIUS_M
from perception.arrays import FloatArray

TEXT = (ROOT / "docs" / "policies.md").read_text(encoding="utf-8")
# Of 0.70 m × 0.50 m, as in the explorer and in `awarenav policy show`.
ROBOT = replace(nav_scenes.ROBOT, footprint_m=np.array(FOOTPRINT_M))
ENDS = np.array([0.0, 1.0])
DISTANCE_M = np.linspace(0.0, 6.0, 6001)


def row(name: str) -> list[list[float]]:
    """Return the numbers of a table row: per preset one value, or an unaware and an aware one."""
    (line,) = [line for line in TEXT.splitlines() if line.startswith(f"| {name}")]
    cells = line.strip("|").split("|")[1:]
    return [[float(number) for number in re.findall(r"\d+\.\d+", cell)] for cell in cells]


def limits(policy: AwarenessPolicy, distance_m: FloatArray) -> FloatArray:
    return settled_speed_limit_mps(policy, ROBOT, distance_m, ENDS[:, None])


@pytest.mark.parametrize(
    ("column", "name"),
    list(enumerate(["blind", "conservative", "balanced", "assertive"])),
)
def test_the_table_of_presets_shows_their_figures(column: int, name: str) -> None:
    policy = AwarenessPolicy.preset(name)
    over_distance = limits(policy, DISTANCE_M)
    expected = {
        "radius, unaware": settled_radius_m(policy, ENDS),
        "assumed human speed": settled_human_speed_mps(policy, ENDS),
        "limit at 1 m": limits(policy, np.array([1.0]))[:, 0],
        "limit at 2 m": limits(policy, np.array([2.0]))[:, 0],
        "limit at 3 m": limits(policy, np.array([3.0]))[:, 0],
        "the robot stands within": DISTANCE_M[(over_distance > 0.0).argmax(axis=1)],
        "full speed beyond": DISTANCE_M[(over_distance > 1.5 - 1e-9).argmax(axis=1)],
    }
    for title, (unaware, aware) in expected.items():
        shown = row(title)[column]
        assert shown[0] == pytest.approx(unaware, abs=0.0051), title
        assert shown[-1] == pytest.approx(aware, abs=0.0051), title
    shrinking = row("shrinks at")[column]
    assert shrinking == [policy.timing.shrink_rate_mps, policy.timing.shrink_after_s]


@pytest.mark.parametrize(
    ("variance", "text"), [(0.0, "leaves 0.28, 0.70 and 1.06 m/s"), (0.01, "0.21, 0.64 and 1.01")]
)
def test_the_page_says_what_is_left_without_moved_m(variance: float, text: str) -> None:
    """Of the rule for people who walk, by the adapter, with the velocity known so well."""
    assert text in " ".join(TEXT.split())
    shown = [float(number) for number in re.findall(r"\d\.\d+", text)]
    for name in ("blind", "conservative", "balanced", "assertive"):
        for distance_m, limit_mps in zip((1.0, 2.0, 3.0), shown, strict=True):
            at_m = ROBOT.footprint_m[:, 0].max() + BODY_RADIUS_M + distance_m
            track = replace(
                nav_scenes.person(position=(at_m, 0.0)),
                covariance_odom=np.diag([0.0, 0.0, variance, variance]),
            )
            found = nav_scenes.settled_update(
                [track], policy=AwarenessPolicy.preset(name), robot=ROBOT
            )
            assert found.speed_limit_mps == pytest.approx(limit_mps, abs=0.0051)


def test_no_preset_has_a_maximum_radius() -> None:
    """The page, claim C2 and the presets agree."""
    for name in ("blind", "conservative", "balanced", "assertive"):
        assert AwarenessPolicy.preset(name).margins.maximum_radius_m is None
    assert "No preset sets a maximum" in TEXT
    safety = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
    assert "where a policy sets one (no preset does)" in safety


def test_the_file_shown_is_a_valid_policy() -> None:
    (block,) = re.findall(r"```yaml\n(.*?)```", TEXT, flags=re.DOTALL)
    policy = AwarenessPolicy.model_validate(yaml.safe_load(block))
    assert policy.rules.zones is not None
    assert policy.outline.sweep_s == 1.0


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
