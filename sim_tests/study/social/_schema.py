"""A checker of JSON values against the few words of JSON Schema that SocNav3's layout needs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

Schema = Mapping[str, Any]

_NUMBER: Final[Schema] = {"type": "number"}
_SHAPE: Final[Schema] = {
    "type": "object",
    "properties": {
        "type": {"type": "string", "enum": ["circle", "rectangle", "polygon"]},
        "width": _NUMBER,
        "length": _NUMBER,
        "height": _NUMBER,  # earlier files write this in place of the length
    },
    "required": ["type", "width"],
}
_POSE: Final[Schema] = {"x": _NUMBER, "y": _NUMBER, "angle": _NUMBER}

#: One instant of a trajectory, an item of ``sequence``.
FRAME_SCHEMA: Final[Schema] = {
    "type": "object",
    "properties": {
        "timestamp": _NUMBER,
        "robot": {
            "type": "object",
            "properties": {
                **_POSE,
                "speed_x": _NUMBER,
                "speed_y": _NUMBER,
                "speed_a": _NUMBER,
                "shape": _SHAPE,
            },
            "required": ["x", "y", "angle", "speed_x", "speed_y", "speed_a", "shape"],
        },
        "goal": {
            "type": "object",
            "properties": {
                **_POSE,
                "type": {"type": "string", "enum": ["go-to", "guide-to", "follow"]},
                "human": {},
                "pos_threshold": _NUMBER,
                "angle_threshold": _NUMBER,
            },
            "required": ["type", "human", "x", "y", "angle"],
        },
        "people": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {**_POSE, "id": _NUMBER, "speed_x": _NUMBER, "speed_y": _NUMBER},
                "required": ["id", "x", "y", "angle"],
            },
        },
        "objects": {
            "type": "array",
            "items": {
                "type": "object",
                "properties": {**_POSE, "id": _NUMBER, "type": {"type": "string"}, "shape": _SHAPE},
                "required": ["id", "type", "x", "y", "angle", "shape"],
            },
        },
    },
    "required": ["timestamp", "robot", "goal", "people", "objects"],
}
_OUTCOME: Final = (
    *("time_to_goal_s", "reference_time_s", "reference_length_m", "human_delay_s"),
    *("robot_radius_m", "person_radius_m"),
)
#: What holds for the whole trajectory. ``awarenav`` is our addition; others need not have it.
EPISODE_SCHEMA: Final[Schema] = {
    "type": "object",
    "properties": {
        "metadata": {"type": "string"},
        "grid": {
            "type": "object",
            "properties": {
                **dict.fromkeys(("width", "height", "cell_size"), _NUMBER),
                **dict.fromkeys(("x_orig", "y_orig", "angle_orig"), _NUMBER),
                "data": {
                    "type": "array",
                    "items": {"type": "array", "items": {"type": "integer", "enum": [-1, 0, 1]}},
                },
            },
            "required": [
                *("width", "height", "cell_size", "x_orig", "y_orig", "angle_orig", "data"),
            ],
        },
        "walls": {
            "type": "array",
            "items": {"type": "array", "items": _NUMBER, "minItems": 4, "maxItems": 4},
        },
        "awarenav": {
            "type": "object",
            "properties": {
                "success": {"type": ["boolean", "null"]},
                **{name: {"type": ["number", "null"]} for name in _OUTCOME},
            },
        },
    },
    "required": ["grid", "walls"],
}
#: A whole trajectory.
TRAJECTORY_SCHEMA: Final[Schema] = {
    **EPISODE_SCHEMA,
    "properties": {
        **EPISODE_SCHEMA["properties"],
        "sequence": {"type": "array", "items": FRAME_SCHEMA, "minItems": 1},
    },
    "required": [*EPISODE_SCHEMA["required"], "sequence"],
}

_WORDS: Final = {
    "number": "a number",
    "integer": "a whole number",
    "string": "a text",
    "boolean": "true or false",
    "array": "a list",
    "object": "an object",
    "null": "null",
}


def problems(value: Any, schema: Schema, where: str = "") -> Iterator[str]:
    """Yield one sentence for each place where a value does not fit, naming the field.

    Args:
        value: of a JSON document.
        schema: types, enumerations, required fields, and lengths of lists count.
        where: the path of the value in messages; empty for the document itself.
    """
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if kinds and not any(_is(value, kind) for kind in kinds):
        words = " or ".join(_WORDS[kind] for kind in kinds)
        yield f"{where or 'the file'} must be {words}, got {value!r:.60}"
        return
    if "enum" in schema and value not in schema["enum"]:
        allowed = ", ".join(map(repr, schema["enum"]))
        yield f"{where} must be one of {allowed}, got {value!r:.60}"
    if isinstance(value, dict):
        for name in schema.get("required", ()):
            if name not in value:
                yield f"{_joined(where, name)} is missing"
        for name, inner in schema.get("properties", {}).items():
            if name in value:
                yield from problems(value[name], inner, _joined(where, name))
    if isinstance(value, list):
        least, most = schema.get("minItems", 0), schema.get("maxItems", math.inf)
        if not least <= len(value) <= most:
            wanted = f"{least}" if least == most else f"at least {least}"
            yield f"{where} must have {wanted} values, got {len(value)}"
        for number, item in enumerate(value):
            yield from problems(item, schema.get("items", {}), f"{where}[{number}]")


def _is(value: Any, kind: str) -> bool:
    if kind == "number":
        return (
            isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        )
    if kind == "integer":
        return isinstance(value, int) and not isinstance(value, bool)
    classes = {"string": str, "boolean": bool, "array": list, "object": dict, "null": type(None)}
    return isinstance(value, classes[kind])


def _joined(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name
