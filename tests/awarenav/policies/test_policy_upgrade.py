"""``awarenav policy upgrade``: files of version 0.2 in the settings of today."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from awarenav.cli import main
from nav_adapter import (
    AwarenessPolicy,
    NavAdapter,
    NavError,
    RobotProfile,
    RobotState,
    max_speed_mps,
)
from perception.anthropometry import BODY_RADIUS_M
from tracking import PersonTrack

PRESETS = Path(__file__).with_name("version_0_2")
NAMES = ["assertive", "balanced", "blind", "conservative", "scanner"]
# Awareness is worth nothing, so nothing is lost where aware people move.
ALIKE = "speed: {aware_human_speed_mps: 1.6}\n"
ALPHA = np.linspace(0.0, 1.0, 201)


@pytest.fixture
def upgrade(tmp_path, capsys):
    """Return a function from the text of an old file to status, new policy and lines by key."""

    def upgraded(text):
        old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
        old.write_text(text, encoding="utf-8")
        status = main(["policy", "upgrade", str(old), "--out", str(new)])
        lines = {}
        for line in capsys.readouterr().out.splitlines():
            what, _, rest = line.partition(" ")
            if what in ("kept", "renamed", "replaced", "dropped", "added", "check"):
                key, _, said = rest.strip().partition(": ")
                lines[key] = (what, said)
        return status, AwarenessPolicy.from_yaml(new), lines

    return upgraded


@pytest.mark.parametrize("name", NAMES)
def test_the_presets_of_0_2_are_translated_key_by_key(upgrade, name):
    text = (PRESETS / f"{name}.yaml").read_text(encoding="utf-8")
    status, policy, lines = upgrade(text)
    # Aware people who set off or walk on counted with more than they do now.
    checks = [key for key, (what, _) in lines.items() if what == "check"]
    aware = {"assertive": "0.2", "balanced": "0.7", "conservative": "0.8"}.get(name)
    assert checks == ([] if aware is None else [f"aware people, {aware} m/s"])
    assert status == (0 if aware is None else 1)
    assert policy.speed.unaware_human_speed_mps == (0.0 if name == "scanner" else 1.6)
    assert ("reach" in policy.without) is (name == "scanner")
    assert (policy.noticed_counts_as is None) is (name in ("blind", "conservative", "scanner"))
    section = ""
    for line in filter(str.strip, text.splitlines()):
        key = line.split(":")[0].strip()
        if not line.startswith(" "):
            section = key
            continue
        if section != "rules":
            assert f"{section}.{key}" in lines
    for rule in ("standing", "walking", "turn_within_stop_deg", "protective_field"):
        assert (f"rules.{rule}" in lines) is (f"{rule}:" in text)


def test_what_the_old_file_left_out_keeps_the_old_default(upgrade):
    """The new defaults are 1.5 and 0 m/s: less careful."""
    _, policy, lines = upgrade("speed: {aware_above: 0.7}\n")
    assert policy.speed.unaware_human_speed_mps == 1.6
    assert policy.speed.aware_human_speed_mps == 0.7
    assert policy.speed.aware_above == 0.7
    assert "default of 0.2" in lines["speed.aware_human_speed_mps"][1]
    assert policy.filter.noticed_memory_s == 3.0
    assert lines["filter.noticed_memory_s"][0] == "replaced"


def share(shape, below, above):
    """Return the old share of "aware" at each α, but for hysteresis, and at most the held one."""
    position = np.clip((ALPHA - below) / (above - below), 0.0, 1.0)
    half = 2.5
    return {
        "smoothstep": position**2 * (3.0 - 2.0 * position),
        "linear": position,
        "logistic": 0.5 + 0.5 * np.tanh(half * (2.0 * position - 1.0)) / np.tanh(half),
        "two_level": (above <= ALPHA).astype(float),
    }[shape]


@pytest.mark.parametrize("shape", ["smoothstep", "linear", "logistic", "two_level"])
@pytest.mark.parametrize(("below", "above"), [(0.1, 0.6), (0.0, 1.0), (0.3, 0.305)])
def test_no_shape_becomes_less_careful_at_any_awareness(upgrade, shape, below, above):
    _, policy, lines = upgrade(
        f"inflation: {{shape: {shape}, unaware_below: {below}, aware_above: {above}}}\n"
        f"speed: {{shape: {shape}, unaware_below: {below}, aware_above: {above}}}\n"
    )
    old = share(shape, below, above)
    radius = [policy.inflation.radius_m(alpha) for alpha in ALPHA.tolist()]
    speed = [policy.speed.human_speed_mps(alpha) for alpha in ALPHA.tolist()]
    assert (np.array(radius) >= 1.0 - 0.55 * old - 1e-9).all()
    assert (np.array(speed) >= 1.6 - 0.9 * old - 1e-9).all()
    assert lines["speed.shape"][0] == ("dropped" if shape == "smoothstep" else "replaced")


@pytest.mark.parametrize(
    "points",
    [
        [[0.0, 1.2], [0.5, 0.6], [1.0, 0.5]],
        [[0.1, 1.6], [0.4, 1.0], [0.7, 0.7]],
        [[0.4, 0.9]],
        [[0.0, 0.8]],
        [[0.0, 1.0], [0.005, 0.6]],
    ],
)
def test_no_table_becomes_less_careful_at_any_awareness(upgrade, points):
    status, policy, _ = upgrade(
        f"inflation: {{table_m: {points}}}\nspeed: {{table_mps: {points}}}\n"
        "rules: {walking: {}}\n"
    )
    old = np.interp(ALPHA, *np.array(points).T)
    for value in (policy.inflation.radius_m, policy.speed.human_speed_mps):
        new = np.array([value(alpha) for alpha in ALPHA.tolist()])
        assert (new >= old - 1e-9).all()
        assert (new[0], new[-1]) == (pytest.approx(old[0]), pytest.approx(old[-1]))
    assert status == (0 if len(points) == 1 else 1)


def test_a_watching_level_counts_as_aware(upgrade):
    _, policy, lines = upgrade(
        "speed: {aware_human_speed_mps: 0.5, watching_above: 0.8, watching_human_speed_mps: 0.1}\n"
    )
    assert policy.speed.human_speed_mps(1.0) == 0.5
    assert lines["speed.watching_above"][0] == "dropped"


@pytest.mark.parametrize(
    ("margins", "rules", "clearance_m"),
    [
        ("{minimum_clearance_m: 0.2, separation_clearance_m: 0.3}", "{walking: {}}", 0.3),
        ("{minimum_clearance_m: 0.25, separation_clearance_m: 0.0}", "{walking: {}}", 0.25),
        ("{separation_clearance_m: 0.0}", "{walking: {}}", 0.1),
        ("{separation_clearance_m: 0.2}", "{protective_field: {beside_m: 0.4}}", 0.4),
        ("{}", "{protective_field: {}}", 0.1),
    ],
)
def test_the_largest_clearance_counts(upgrade, margins, rules, clearance_m):
    status, policy, _ = upgrade(f"{ALIKE}margins: {margins}\nrules: {rules}\n")
    assert policy.margins.clearance_m == clearance_m
    assert status == 0


@pytest.mark.parametrize(
    ("noticed", "counts_as"),
    [
        ("null", None),
        ("{counts_as_awareness: 0.5}", 0.5),
        ("{at_least: 0.4}", 0.6),
        ("{at_least: 0.8}", None),
    ],
)
def test_no_belief_counts_that_did_not(upgrade, noticed, counts_as):
    _, policy, _ = upgrade(f"noticed: {noticed}\n")
    assert policy.noticed_counts_as == counts_as


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("rules: {walking: {}, zones: {stop_within_m: 0.5}}", "rules.zones"),
        ("rules: {walking: {}, near_cap: {}}", "rules.near_cap"),
        ("noticed: null\nspeed: {aware_human_speed_mps: 1.0}", "aware people, 1 m/s"),
        ("speed: {table_mps: [[0.0, 1.6], [0.5, 0.4]]}", "aware people, 0.4 m/s"),
        ("rules: {protective_field: {}, start_reserve: {}}", "rules.start_reserve"),
        ("rules: {walking: {velocity_sigmas: 3.0}}", "rules.walking.velocity_sigmas"),
        ("rules: {walking: {}, turn_within_stop_deg: 180}", "rules.turn_within_stop_deg"),
        ("rules: {protective_field: {beside_m: 3}}", "rules.protective_field.beside_m"),
        ("outline: {sweep_s: 1.0}", "outline"),
        ("outline: {unaware_ahead_s: 0.8}", "outline"),
        ("timing: {shrink_after_s: 0.5}", "timing.shrink_after_s"),
    ],
)
def test_what_may_be_less_careful_is_to_be_checked(upgrade, text, key):
    alike = "" if "speed" in text else ALIKE
    status, _, lines = upgrade(alike + text)
    assert status == 1
    assert [each for each, (what, _) in lines.items() if what == "check"] == [key]


@pytest.mark.parametrize("distance_m", [0.3, 1.0, 2.0, 4.0])
def test_people_who_turned_at_once_still_do(upgrade, distance_m):
    """Without the rule for walking, 0.2 had speed and separation alone."""
    _, policy, _ = upgrade("rules: {}\n")
    robot = RobotProfile(
        [[0.35, 0.25], [-0.35, 0.25], [-0.35, -0.25], [0.35, -0.25]], 1.5, 1.0, 1.0, 0.3
    )
    old_mps = max_speed_mps(
        distance_m, 1.6, deceleration_mps2=1.0, reaction_time_s=0.3, clearance_m=0.1
    )
    for velocity in ([0.0, 0.0], [1.2, 0.0], [0.0, 1.2]):
        adapter = NavAdapter(policy, robot)
        for now in (0.0, 0.1, 0.2, 0.3):
            at = np.array([0.35 + BODY_RADIUS_M + distance_m, 0.0])
            track = PersonTrack(
                *(1, now, "confirmed", at, velocity, np.zeros((4, 4))),
                *(0.0, 0.0, 0.0, 1.75, 0.0),
            )
            result = adapter.update((track,), RobotState(now, [0.0, 0.0], 0.0, 0.5, 0.0), now)
        if velocity == [0.0, 0.0]:
            assert result.speed_limit_mps <= float(old_mps)
        assert result.speed_limit_mps < 1.5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothings: {}", "no key 'nothings'"),
        ("rules: {walkng: {}}", "no key 'walkng'"),
        ("speed: {table_mps: [[0.5, 1.0], [0.4, 0.5]]}", "awareness must rise"),
        ("speed: {table_mps: []}", "must hold [awareness, value] pairs"),
        ("speed: {shape: cubic}", "speed.shape must be one of"),
        ("speed: {aware_human_speed_mps: fast}", "speed.aware_human_speed_mps must be a number"),
        ("inflation: {unaware_radius_m: 0.3}", "aware_radius_m must be at most"),
        ("margins: {uncertainty_sigmas: many}", "must be a number"),
        ("timing: null", "timing must be a mapping"),
        ("inflation: null", "inflation must be a mapping"),
        ("reach: {turn_deg: 40}", "policy of the present version"),
        ("attention: null", "policy of the present version"),
        ("- 1", "must hold a mapping"),
    ],
)
def test_a_file_that_is_no_policy_of_0_2_is_refused(tmp_path, capsys, text, message):
    old = tmp_path / "old.yaml"
    old.write_text(text, encoding="utf-8")
    assert main(["policy", "upgrade", str(old), "--out", str(tmp_path / "new.yaml")]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"awarenav policy upgrade: {old}: ")
    assert message in error
    assert list(tmp_path.iterdir()) == [old]


def test_the_old_file_is_never_replaced(tmp_path, capsys):
    old = tmp_path / "old.yaml"
    old.write_text("{}", encoding="utf-8")
    assert main(["policy", "upgrade", str(old), "--out", str(old)]) == 2
    assert "would replace an input" in capsys.readouterr().err
    assert main(["policy", "upgrade", str(old), "--out", str(tmp_path / "new.txt")]) == 2
    assert old.read_text(encoding="utf-8") == "{}"


@pytest.mark.parametrize("name", NAMES)
def test_a_file_of_0_2_is_refused_with_the_way_out(name):
    path = PRESETS / f"{name}.yaml"
    with pytest.raises(NavError, match="unknown key") as caught:
        AwarenessPolicy.from_yaml(path)
    assert str(caught.value).endswith(f"a file of 0.2? awarenav policy upgrade {path}")


@pytest.mark.parametrize("text", ["speed: {aware_sped: 1}", "margin: {}", "speed: 3"])
def test_other_mistakes_get_no_such_hint(tmp_path, text):
    path = tmp_path / "policy.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(NavError) as caught:
        AwarenessPolicy.from_yaml(path)
    assert "0.2?" not in str(caught.value)
