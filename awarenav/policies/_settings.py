"""The settings of policies and robots as plain data: keys, units, ranges, defaults, descriptions.

All of it is read from the pydantic models and their docstrings, so a new setting of a model is a
new control of the policy explorer.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Mapping
from typing import Any, Final

from pydantic import BaseModel

from nav_adapter import AwarenessPolicy
from nav_adapter.policies import (
    AlertRules,
    DistanceZones,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    NearCap,
    NoticedPeople,
    ObstacleOutline,
    ProtectiveField,
    SafetyMargins,
    SpeedRules,
    StandingPeople,
    StartReserve,
    TableHumanSpeed,
    TableInflation,
    TimeBehaviour,
    WalkingPeople,
)
from nav_adapter.ros2 import RobotFile
from tracking import AwarenessFilterConfig

#: The models by name; a field that takes one of several models lists them in ``models``.
_MODELS: Final[tuple[type[BaseModel], ...]] = (
    AwarenessPolicy,
    InterpolatedInflation,
    TableInflation,
    InterpolatedHumanSpeed,
    TableHumanSpeed,
    ObstacleOutline,
    SpeedRules,
    ProtectiveField,
    StandingPeople,
    WalkingPeople,
    StartReserve,
    DistanceZones,
    NearCap,
    NoticedPeople,
    AlertRules,
    SafetyMargins,
    TimeBehaviour,
    AwarenessFilterConfig,
)
#: Fields that take a ramp or a table; the schema of the policy shows the ramp alone.
_VARIANTS: Final[Mapping[str, tuple[type[BaseModel], ...]]] = {
    "inflation": (InterpolatedInflation, TableInflation),
    "speed": (InterpolatedHumanSpeed, TableHumanSpeed),
}
#: Units by the end of a key, the longest end first.
_UNITS: Final = (
    ("_m2ps3", "m²/s³"),
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_per_s", "1/s"),
    ("_deg", "°"),
    ("_logit", "logit"),
    ("_sigmas", "σ"),
    ("_m", "m"),
    ("_s", "s"),
)
# Sliders reach this multiple of the default, or this value where the default is 0 or none. The
# number beside the slider takes the whole range.
_REACH_OF_DEFAULT: Final = 4.0
_REACH_WITHOUT_DEFAULT: Final = 5.0
_STEPS: Final = 200.0

# Fields of a robot file that no speed limit depends on.
_CHANGES_NO_LIMIT: Final = (
    "camera",
    "scanners",
    "max_yaw_rate_radps",
    "max_yaw_acceleration_radps2",
    "min_turning_radius_m",
)


def policy_settings() -> dict[str, Any]:
    """Return the models of a policy by name, each with its text and its fields in their order.

    A field has ``key``, ``text``, ``unit`` and ``kind``: number, boolean, choice, model or table.
    A number has ``low`` and ``high`` (None for no bound) with ``low_open`` and ``high_open``, and
    ``slider``: the low end, the high end and the step of a slider.
    """
    return {model.__name__: _model(model) for model in _MODELS}


def robot_settings() -> list[dict[str, Any]]:
    """Return the fields of a robot file that a speed limit depends on, as those of a policy."""
    fields: list[dict[str, Any]] = _model(RobotFile)["fields"]
    return [field for field in fields if field["key"] not in _CHANGES_NO_LIMIT]


def _model(model: type[BaseModel]) -> dict[str, Any]:
    schema = model.model_json_schema()
    texts = _texts(model)
    required = set(schema.get("required", ()))
    fields = [
        _field(key, entry, texts.get(key, ""), key in required)
        for key, entry in schema["properties"].items()
    ]
    if model is AwarenessPolicy:
        for field in fields:
            if field["key"] in _VARIANTS:
                field["models"] = [each.__name__ for each in _VARIANTS[field["key"]]]
    summary = inspect.getdoc(model) or ""
    return {"text": _plain(summary.split("\n\n", maxsplit=1)[0]), "fields": fields}


def _field(key: str, entry: Mapping[str, Any], text: str, required: bool) -> dict[str, Any]:
    """Return a field as plain data, from its entry in a JSON schema."""
    options = list(entry.get("anyOf") or entry.get("allOf") or [entry])
    nullable = any(option.get("type") == "null" for option in options)
    (value,) = (option for option in options if option.get("type") != "null")
    field: dict[str, Any] = {
        "key": key,
        "text": text,
        "unit": next((unit for end, unit in _UNITS if key.endswith(end)), ""),
        "nullable": nullable,
        "required": required,
        "default": entry.get("default"),
    }
    if "$ref" in value:
        return {**field, "kind": "model", "models": [value["$ref"].rsplit("/", 1)[-1]]}
    if "enum" in value:
        return {**field, "kind": "choice", "choices": value["enum"]}
    if value.get("type") == "boolean":
        return {**field, "kind": "boolean"}
    if value.get("type") == "array":
        bounds = {name: entry[name] for name in ("low", "high") if name in entry}
        return {**field, "kind": "table", **bounds}
    low = value.get("minimum", value.get("exclusiveMinimum"))
    high = value.get("maximum", value.get("exclusiveMaximum"))
    return {
        **field,
        "kind": "number",
        "low": low,
        "high": high,
        "low_open": "exclusiveMinimum" in value,
        "high_open": "exclusiveMaximum" in value,
        "slider": _slider(low, high, field["default"]),
    }


def _slider(low: float | None, high: float | None, default: float | None) -> list[float]:
    """Return the low end, the high end and the step of a slider."""
    start = low or 0.0
    most = math.inf if high is None else high
    if most > 1.0:
        reach = _REACH_OF_DEFAULT * default if default else _REACH_WITHOUT_DEFAULT
        most = min(most, max(reach, 2.0 * start))
    step = _rounded((most - start) / _STEPS)
    if start < step:
        start = 0.0
    return [start, most, step]


def _rounded(value: float) -> float:
    """Return the nearest of 1, 2 and 5 times a power of ten."""
    power = math.floor(math.log10(value))
    digit = min((1.0, 2.0, 5.0, 10.0), key=lambda each: abs(each - value / 10.0**power))
    return float(f"{digit * 10.0**power:.3g}")


def _texts(model: type[BaseModel]) -> dict[str, str]:
    """Return the descriptions of a model's fields, those that it inherits included.

    They stand under "Attributes" in the docstring of the class, or below each field.
    """
    texts: dict[str, str] = {}
    for each in reversed(model.__mro__):
        if not issubclass(each, BaseModel) or each is BaseModel:
            continue
        texts.update(_attribute_texts(each.__dict__.get("__doc__") or ""))
        texts.update(_texts_below_fields(each))
    return {key: _plain(text) for key, text in texts.items()}


def _attribute_texts(doc: str) -> dict[str, str]:
    section = inspect.cleandoc(doc).partition("Attributes:\n")[2]
    entries = re.findall(r"^ {4}(\w+): (.*(?:\n {8}.*)*)", section, flags=re.MULTILINE)
    return {key: " ".join(text.split()) for key, text in entries}


def _texts_below_fields(model: type[BaseModel]) -> dict[str, str]:
    (tree,) = ast.parse(inspect.cleandoc("\n" + inspect.getsource(model))).body
    assert isinstance(tree, ast.ClassDef)
    texts = {}
    for field, after in zip(tree.body, tree.body[1:], strict=False):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
        ):
            texts[field.target.id] = " ".join(str(after.value.value).split())
    return texts


def _plain(text: str) -> str:
    """Return a text of a docstring without roles; code stays between single backticks."""
    text = re.sub(r":\w+:`~?(?:[\w.]*\.)?(\w+)`", r"`\1`", " ".join(text.split()))
    return text.replace("``", "`")
