"""Strict pydantic models that read and write YAML.

Every config of the project derives from :class:`StrictConfig`. Unknown keys are refused with the
nearest valid name, values are checked, and a config that is written and read again is equal.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Final, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator
from pydantic_core import ErrorDetails

from .documents import keys_of, read_yaml, yaml_text
from .errors import PerceptionError, did_you_mean

_ConfigT = TypeVar("_ConfigT", bound="StrictConfig")


# Keys by which files that are given in the wrong place are known.
_KINDS: Final = {
    "a policy": {"inflation", "speed", "reach", "margins", "timing", "filter", "alerts"},
    "a scenario": {"layout", "people", "workers", "population", "attention", "replay_csv"},
    "the file of a robot": {"footprint_m", "max_speed_mps", "max_deceleration_mps2", "drive"},
    "a camera_info file": {"image_width", "image_height", "camera_matrix", "distortion_model"},
    "a map of map_server": {"image", "resolution", "occupied_thresh", "free_thresh"},
}


def other_kind(data: Mapping[str, Any], keys: Iterable[str]) -> str:
    """Return what a file is that was given in place of one with these keys; empty if unknown."""
    found = {kind: len(known & data.keys()) for kind, known in _KINDS.items()}
    kind = max(found, key=lambda each: found[each])
    return kind if found[kind] > len(data.keys() & set(keys)) else ""


def complaints(error: ValidationError) -> str:
    """Return what is wrong with a config, on one line: the keys, and what was given.

    A model with an unknown key complains of that key alone.
    """
    return "; ".join(map(complaint, error.errors(include_url=False)))


def complaint(details: ErrorDetails) -> str:
    """Return one of the things that are wrong with a config, as ``path: what is wrong``."""
    path = ".".join(map(str, details["loc"])).strip(".")
    message = details["msg"].removeprefix("Value error, ")
    if details["type"] not in ("value_error", "missing"):
        message = f"{message}, got {details['input']!r:.200}"
    return f"{path}: {message}" if path else message


@cache
def _number_keys(config: type[BaseModel]) -> frozenset[str]:
    """Return the keys that hold numbers and no booleans, which pydantic takes for 0 and 1."""
    return frozenset(
        name
        for name, field in config.model_fields.items()
        if (kinds := set(_kinds(field.annotation))) & {int, float} and bool not in kinds
    )


def _kinds(annotation: Any) -> Iterator[Any]:
    """Yield the types that an annotation is made of."""
    if get_origin(annotation) is not Literal:
        yield annotation if isinstance(annotation, type) else None
        for part in get_args(annotation):
            yield from _kinds(part)


def _has_boolean(value: Any) -> bool:
    """Return whether a value is a boolean, or a list with one."""
    if isinstance(value, list | tuple):
        return any(map(_has_boolean, value))
    return isinstance(value, bool)


class StrictConfig(BaseModel):
    """Base of every config: frozen, with finite numbers only; unknown keys are refused by name."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True
    )

    #: The error for a file that cannot be used; each package sets its own.
    error: ClassVar[type[ValueError]] = PerceptionError

    @model_validator(mode="before")
    @classmethod
    def _check_keys(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        valid = list(cls.model_fields)
        for key, value in data.items():
            if key in _number_keys(cls) and _has_boolean(value):
                raise ValueError(
                    f"{key} must be a number, got {value!r:.80}; YAML reads on, off, yes and no as "
                    "true and false"
                )
            if key not in valid:
                near = did_you_mean(key, valid, cutoff=0.5)
                hint = near or f"; valid keys: {', '.join(valid)}"
                raise ValueError(f"unknown key {key!r} in {cls.__name__}{hint}")
        return data

    @classmethod
    def from_yaml(cls: type[_ConfigT], path: str | Path) -> _ConfigT:
        """Read and validate a YAML file.

        Raises:
            ValueError: the package's own error, naming the file and the key.
        """
        path = Path(path)
        data = keys_of(read_yaml(path, cls.error), str(path), cls.error)
        try:
            return cls.model_validate(data)
        except ValidationError as cause:
            kind = other_kind(data, cls.model_fields)
            what = complaints(cause)
            if kind:  # a near key of the wrong kind is no help
                what = f"this is {kind}; {what.partition(';')[0]}"
            raise cls.error(f"{path}: {what}") from cause

    def to_yaml(self, path: str | Path) -> None:
        """Write the config as YAML for :meth:`from_yaml`; the file is replaced in one step."""
        path = Path(path)
        text = self.yaml_text()
        partial = path.with_name(path.name + ".part")
        partial.write_text(text, encoding="utf-8")
        partial.replace(path)

    def yaml_text(self) -> str:
        """Return the text that :meth:`to_yaml` writes.

        Raises:
            ValueError: the package's own error, for a setting that YAML cannot hold.
        """
        for name, field in type(self).model_fields.items():
            if field.exclude and getattr(self, name) != field.default:
                raise self.error(
                    f"{name} of {type(self).__name__} cannot be written as YAML; write the config "
                    f"without it, and set {name} when it is read"
                )
        return yaml_text(self.model_dump(mode="json"))
