"""Policies between files, Python and the page: equal both ways, refused by both."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from chromium_pipe import Chromium
from explorer_cases import OPTIONAL_RULES, random_policy
from paths import ROOT

from nav_adapter import AwarenessPolicy, NavError
from tracking.config import StrictConfig

PRESETS = ("blind", "conservative", "balanced", "assertive")
RANDOM = [random_policy(random.Random(seed)) for seed in range(40)]


def read_by_page(functions: Chromium, text: str) -> Any:
    """Return the policy that the page reads from a text, or its message about the text."""
    return functions.evaluate(
        f"""(() => {{
          try {{ return checkedPolicy(parseYaml({json.dumps(text)})); }}
          catch (error) {{
            if (!(error instanceof PolicyError || error instanceof YamlError)) throw error;
            return error.message;
          }}
        }})()"""
    )


def written_by_page(functions: Chromium, policy: AwarenessPolicy) -> str:
    values = json.dumps(policy.model_dump(mode="json"))
    text = functions.evaluate(f"policyYaml(checkedPolicy({values}))")
    assert isinstance(text, str)
    return text


def refusal(text: str, tmp_path: Path) -> str:
    file = tmp_path / "policy.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(NavError) as caught:
        AwarenessPolicy.from_yaml(file)
    return str(caught.value)


def test_files_of_python_are_the_same_policy_in_the_page(
    functions: Chromium, tmp_path: Path
) -> None:
    for policy in [*map(AwarenessPolicy.preset, PRESETS), AwarenessPolicy(), *RANDOM]:
        file = tmp_path / "policy.yaml"
        policy.to_yaml(file)
        assert read_by_page(functions, file.read_text("utf-8")) == policy.model_dump(mode="json")


def test_files_of_the_page_are_the_same_policy_in_python(
    functions: Chromium, tmp_path: Path
) -> None:
    for policy in [*map(AwarenessPolicy.preset, PRESETS), AwarenessPolicy(), *RANDOM]:
        file = tmp_path / "policy.yaml"
        file.write_text(written_by_page(functions, policy), encoding="utf-8")
        assert AwarenessPolicy.from_yaml(file) == policy
        assert read_by_page(functions, file.read_text("utf-8")) == policy.model_dump(mode="json")


@pytest.mark.parametrize("name", PRESETS)
def test_the_shipped_files_with_their_comments_are_read(functions: Chromium, name: str) -> None:
    text = (ROOT / "nav_adapter" / "policies" / f"{name}.yaml").read_text("utf-8")
    assert read_by_page(functions, text) == AwarenessPolicy.preset(name).model_dump(mode="json")


def test_the_file_shown_in_the_documentation_is_read(functions: Chromium) -> None:
    (text,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/policies.md").read_text(), re.DOTALL)
    policy = AwarenessPolicy.model_validate(yaml.safe_load(text))
    assert read_by_page(functions, text) == policy.model_dump(mode="json")


FORMS = [
    "---\nmargins: {uncertainty_sigmas: 1}\n",
    "inflation:\n  table_m:\n  - [0.1, 1.0]  # a pair\n  - - 0.5\n    - 0.6\n",
    "inflation: {table_m: [[0, 1],\n  [0.5, 0.7],\n  [1.0, 0.5]]}\n",
    "speed:\n    shape: 'linear'\n    aware_human_speed_mps: .5\n",
    'speed: {"shape": "logistic", steepness: 1.2e+1}\n',
    "alerts: ~\nnoticed:\nrules:\n  zones: {}\n",
    "alerts: null\nrules: {standing: {delay_from_tracks: yes}, near_cap: {within_m: 2}}\n",
    "rules:\n  walking: {}  # as its defaults are\n  standing:\n",
    "filter: {clip_awareness: 1e-9, lower_bound_confidence: '0.95'}\n",
    "filter: {clip_awareness: 1e-2, memory_s: 15E-1}\n",
    "\ufeffmargins:\r\n  maximum_radius_m: 3.0\r\n",
]


@pytest.mark.parametrize("text", FORMS)
def test_other_forms_of_yaml_mean_the_same_in_both(
    functions: Chromium, tmp_path: Path, text: str
) -> None:
    file = tmp_path / "policy.yaml"
    file.write_text(text, encoding="utf-8", newline="")
    policy = AwarenessPolicy.from_yaml(file)
    assert read_by_page(functions, text) == policy.model_dump(mode="json")


def misspelt() -> list[tuple[str, str]]:
    """Return texts with one key that has a letter too many, for every key of every model."""
    found = []
    dumped = AwarenessPolicy.model_validate(
        {"rules": {name: {} for name in OPTIONAL_RULES}}
    ).model_dump(mode="json")

    def walk(values: dict[str, Any], path: list[str]) -> None:
        for key, value in values.items():
            wrong = key[:3] + "x" + key[3:]
            nested: Any = {wrong: 1.0}
            for outer in reversed(path):
                nested = {outer: nested}
            found.append((key, yaml.safe_dump(nested)))
            if isinstance(value, dict):
                walk(value, [*path, key])

    walk(dumped, [])
    return found


def test_an_unknown_key_is_refused_with_the_nearest_key_as_in_python(
    functions: Chromium, tmp_path: Path
) -> None:
    keys = misspelt()
    assert len(keys) > 70
    for key, text in [*keys, ("", "nothing_like_it: 3\n"), ("", "rules: {zzz: 1}\n")]:
        told = read_by_page(functions, text)
        assert isinstance(told, str), text
        assert told in refusal(text, tmp_path), text
        if key:
            assert f"did you mean '{key}'?" in told


WRONG = [
    "",
    "# nothing but a comment",
    "inflation: {unaware_below: 0.7}",
    "inflation: {unaware_below: 1.0}",
    "inflation: {aware_radius_m: 1.2}",
    "inflation: {unaware_radius_m: 0}",
    "inflation: {shape: round}",
    "inflation: {table_m: []}",
    "inflation: {table_m: [[0.1, 1.0], [0.1, 0.5]]}",
    "inflation: {table_m: [[0.1, 0.5], [0.2, 0.6]]}",
    "inflation: {table_m: [[0.1, 0.5, 3]]}",
    "inflation: {table_m: [[1.1, 0.5]]}",
    "inflation: {table_m: [[0.1, 11]]}",
    "inflation: {table_m: 3}",
    "inflation: {table_m: [[0.1, 0.5]], shape: linear}",
    "speed: {watching_above: 0.8}",
    "speed: {watching_above: 0.5, watching_human_speed_mps: 0.05}",
    "speed: {watching_above: 0.8, watching_human_speed_mps: 0.8}",
    "speed: {shape: two_level, watching_above: 0.8, watching_human_speed_mps: 0.05}",
    "speed: {aware_human_speed_mps: 2.0}",
    "speed: {table_mps: [[0.5, 10.5]]}",
    "outline: {aware_ahead_s: 0.5}",
    "rules: {turn_within_stop_deg: 44.9}",
    "rules: {standing: {start_delay_s: 0.05}}",
    "rules: {standing: {delay_from_tracks: 3}}",
    "rules: {walking: {human_acceleration_mps2: 0.05}}",
    "rules: {walking: {turn_delay_s: 2.1}}",
    "rules: {walking: {velocity_sigmas: null}}",
    "rules: {walking: {start_delay_s: 0.2}}",
    "rules: {walking: true}",
    "rules: {zones: {stop_within_m: 3.0}}",
    "rules: {near_cap: 3}",
    "rules: null",
    "margins: {minimum_clearance_m: 0.05}",
    "margins: {maximum_radius_m: 0.35}",
    "margins: {maximum_radius_m: 0.9}",
    "margins: {uncertainty_sigmas: .nan}",
    "margins: {uncertainty_sigmas: many}",
    "margins: {uncertainty_sigmas: null}",
    "timing: {fresh_within_s: 0.6}",
    "timing: {stop_after_s: 0.4}",
    "noticed: 0.5",
    "filter: {unseen_time_constant_s: 0.1}",
    "filter: {clip_awareness: 0.5}",
    "- inflation",
    "inflation",
    "a: [1, 2",
    "a: {b: 1",
    "a: 'b",
    "a: b: c",
    "inflation:\n\tshape: linear",
    "inflation:\n  shape: linear\n unaware_below: 0.1",
    "{a: " * 80,
    "[" * 80,
    "inflation: !!python/object:os.system {}",
    "inflation: *other",
]


@pytest.mark.parametrize("text", WRONG)
def test_what_python_refuses_the_page_refuses(
    functions: Chromium, tmp_path: Path, text: str
) -> None:
    assert refusal(text, tmp_path)
    told = read_by_page(functions, text)
    assert isinstance(told, str)
    assert told


def test_the_page_and_python_agree_on_random_changes(functions: Chromium) -> None:
    """Any setting at, just inside and just beyond the ends of its range."""
    draw = random.Random(1)
    cases = []
    for _ in range(600):
        values = draw.choice(RANDOM).model_dump(mode="json")
        model: dict[str, Any] = values
        fields: list[str] = list(model)
        key = draw.choice(fields)
        while isinstance(model[key], dict):
            model = model[key]
            key = draw.choice(list(model))
        if isinstance(model[key], (int, float)) and not isinstance(model[key], bool):
            scale = draw.choice([0.0, 0.1, 0.5, 1.5, 2.0, 10.0, 100.0, -1.0])
            model[key] = draw.choice([model[key] * scale, 1.0, 0.5, 5.0, 10.0])
        cases.append(values)
    accepted = functions.evaluate(
        f"""{json.dumps(cases)}.map((values) => {{
          try {{ checkedPolicy(values); return true; }}
          catch (error) {{ if (!(error instanceof PolicyError)) throw error; return false; }}
        }})"""
    )
    wanted = [is_valid(AwarenessPolicy, values) for values in cases]
    assert accepted == wanted
    assert 60 < sum(wanted) < 540


def is_valid(model: type[StrictConfig], values: dict[str, Any]) -> bool:
    try:
        model.model_validate(values)
    except ValueError:
        return False
    return True
