"""The controls of the policy explorer come from the models: keys, ranges, defaults and texts."""

from __future__ import annotations

import json
import random
from typing import Any

import pytest
from chromium_pipe import Chromium
from explorer_cases import OPTIONAL_RULES, random_policy, random_robot, random_state
from pydantic import BaseModel

from awarenav.policies._settings import policy_settings, robot_settings
from awarenav.policies._situation import OVER_TIME, SITUATION
from nav_adapter import AwarenessPolicy
from nav_adapter import policies as parts
from tracking import AwarenessFilterConfig

MODELS: dict[str, type[BaseModel]] = {
    "AwarenessPolicy": AwarenessPolicy,
    "AwarenessFilterConfig": AwarenessFilterConfig,
    **{
        name: value
        for name in parts.__all__
        if isinstance(value := getattr(parts, name), type) and issubclass(value, BaseModel)
    },
}
NUMBERS = [
    (name, field)
    for name, model in policy_settings().items()
    for field in model["fields"]
    if field["kind"] == "number"
]


def refused(model: type[BaseModel], key: str, value: float) -> bool:
    """Return whether the range of a key refuses a value, whatever other keys say."""
    try:
        model.model_validate({key: value})
    except ValueError as error:
        return any(each["loc"] == (key,) for each in getattr(error, "errors", list)())
    return False


def test_every_model_and_every_key_is_there() -> None:
    settings = policy_settings()
    assert settings.keys() == MODELS.keys()
    for name, model in settings.items():
        assert [field["key"] for field in model["fields"]] == list(MODELS[name].model_fields)
        assert model["text"]
        for field in model["fields"]:
            assert field["text"], (name, field["key"])
            assert "``" not in field["text"]
            if not field["required"]:
                default = MODELS[name].model_fields[field["key"]].default
                shown = (
                    default.model_dump(mode="json") if hasattr(default, "model_dump") else default
                )
                assert field["default"] == shown


@pytest.mark.parametrize(
    ("name", "field"), NUMBERS, ids=[f"{name}.{field['key']}" for name, field in NUMBERS]
)
def test_a_range_is_that_of_the_model(name: str, field: dict[str, Any]) -> None:
    model, key = MODELS[name], field["key"]
    for end, is_open, outward in (
        (field["low"], field["low_open"], -1.0),
        (field["high"], field["high_open"], 1.0),
    ):
        assert end is not None
        assert refused(model, key, end) is is_open
        assert refused(model, key, end + outward * 1e-6 * max(1.0, abs(end)))
        assert not refused(model, key, end - outward * 1e-6 * max(1e-3, abs(end)))
    low, high, step = field["slider"]
    assert 0.0 <= low < high <= field["high"]
    assert 50 <= (high - low) / step <= 500
    assert field["default"] is None or low <= field["default"] <= high


def test_units_follow_the_keys() -> None:
    units = {field["key"]: field["unit"] for _, field in NUMBERS}
    assert units["unaware_radius_m"] == "m"
    assert units["unaware_human_speed_mps"] == "m/s"
    assert units["max_evidence_gap_s"] == "s"
    assert units["turn_within_stop_deg"] == "°"
    assert units["acceleration_density_m2ps3"] == "m²/s³"
    assert units["overconfidence_per_s"] == "1/s"
    assert units["aware_above"] == ""
    assert [field["unit"] for field in robot_settings()] == ["m", "m/s", "m/s²", "m/s²", "s", ""]


def test_every_setting_and_every_part_of_the_situation_has_a_control(page: Chromium) -> None:
    everything = {"rules": {name: {} for name in OPTIONAL_RULES}}
    policy = AwarenessPolicy.model_validate(everything).model_dump(mode="json")
    page.evaluate(f"takePolicy({json.dumps(policy)})")
    ids = set(page.evaluate("[...document.querySelectorAll('[id]')].map((each) => each.id)"))

    def leaves(values: dict[str, Any], before: str) -> list[str]:
        found = []
        for key, value in values.items():
            inner = leaves(value, f"{before}{key}.") if isinstance(value, dict) else []
            found += inner or [f"{before}{key}"]
        return found

    wanted = leaves(policy, "")
    assert len(wanted) > 70
    assert set(wanted) <= ids
    sliders = {f"{name}:slider" for name in wanted} & ids
    assert len(sliders) == len([name for name in wanted if page_kind(page, name) == "number"])
    assert set(OVER_TIME) <= set(wanted)
    shown = {f"situation.{field['key']}" for fields in SITUATION.values() for field in fields}
    assert shown - ids == {"situation.awareness", "situation.awareness_std"}
    assert {f"robot.{field['key']}" for field in robot_settings()} <= ids


def page_kind(page: Chromium, name: str) -> str:
    return str(page.evaluate(f"document.getElementById({json.dumps(name)}).type"))


EFFECTS = """(() => {
  const { policies, robots, states } = %s;
  const known = {}, kinds = {};
  const walk = (name, path) => DATA.models[name].fields.forEach((field) => {
    const inner = [...path, field.key];
    if (field.kind === "model") walk(field.models[0], inner);
    else kinds[inner.join(".")] = field;
  });
  walk("AwarenessPolicy", []);
  const all = (policy, robot, state) => {
    const bound = lowerBound(0.7, 0.15, policy.filter);
    const found = answer(policy, robot, state);
    const corners = obstaclePolygon(policy, state, found).map(([x, y]) => x + 3 * y);
    return JSON.stringify([found, bound, Math.max(...corners), Math.min(...corners),
      lowerBound(0.97, 0.001, policy.filter)]);
  };
  const robotOf = (each) => robots[each %% robots.length];
  const before = policies.map((policy, number) =>
    states[number].map((state, each) => all(policy, robotOf(each), state)));
  for (const [id, field] of Object.entries(kinds)) {
    known[id] = 0;
    const path = id.split(".");
    policies.forEach((policy, number) => {
      if (known[id] || get(policy, path) === undefined || get(policy, path) === null) return;
      const other = structuredClone(policy), value = get(policy, path);
      const choices = field.kind === "choice" ? field.choices
        : field.kind === "boolean" ? [!value]
        : [0.5 * value, 1.3 * value, ...field.slider.slice(0, 2)];
      for (const choice of choices) {
        put(other, path, choice);
        try { checkedPolicy(other); } catch { continue; }
        states[number].forEach((state, each) => {
          known[id] += before[number][each] !== all(other, robotOf(each), state);
        });
      }
    });
  }
  return known;
})()"""


def test_settings_that_act_over_time_change_nothing_and_all_others_do(functions: Chromium) -> None:
    draw = random.Random(8)
    policies = [AwarenessPolicy.model_validate({}), *(random_policy(draw) for _ in range(50))]
    data = {
        "policies": [policy.model_dump(mode="json") for policy in policies],
        "robots": [random_robot(draw) for _ in range(5)],
        "states": [[random_state(draw, each.timing) for _ in range(8)] for each in policies],
    }
    effects = functions.evaluate(EFFECTS % json.dumps(data))
    assert {key for key, count in effects.items() if count == 0} == set(OVER_TIME)
    assert len(effects) > 70
