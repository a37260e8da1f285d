"""One file that says how a robot moves around people who have, and have not, noticed it."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, ClassVar

import yaml
from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from tracking import AwarenessFilterConfig
from tracking.config import StrictConfig

from ._errors import NavError
from .policies import (
    InflationPolicy,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    SafetyMargins,
    SpeedPolicy,
    TimeBehaviour,
)


class _ShippedOrOwn:
    """Pydantic marker of a field: the shipped model (or its YAML keys), or a user's own object."""

    def __init__(self, shipped: type[StrictConfig], method: str) -> None:
        self._shipped = shipped
        self._method = method

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        shipped, method = self._shipped, self._method

        def check(value: Any, validate_shipped: Callable[[Any], Any]) -> Any:
            if isinstance(value, (shipped, Mapping)):
                return validate_shipped(value)
            if callable(getattr(value, method, None)) and not isinstance(value, type):
                return value
            raise ValueError(
                f"must be a mapping with the keys of {shipped.__name__} or an object with a "
                f"method {method}(awareness_lower), got {type(value).__name__}"
            )

        def dump(value: Any) -> Any:
            return value.model_dump(mode="json") if isinstance(value, shipped) else value

        return core_schema.no_info_wrap_validator_function(
            check,
            handler.generate_schema(shipped),
            serialization=core_schema.plain_serializer_function_ser_schema(dump),
        )


class AwarenessPolicy(StrictConfig):
    """Everything between a person's awareness and the planner's constraints, in one YAML file.

    Attributes:
        inflation: radius of a person over ``awareness_lower``: the shipped model or an own object.
        speed: assumed human speed over ``awareness_lower``: the shipped model or an own object.
        margins: distances that hold whatever α says.
        timing: how fast obstacles may shrink and how long data may be trusted.
        filter: settings of the tracker's awareness filter, kept here because they decide with the
            rest how soon a glance counts and how long it lasts.
    """

    error: ClassVar[type[ValueError]] = NavError

    inflation: Annotated[InflationPolicy, _ShippedOrOwn(InterpolatedInflation, "radius_m")] = (
        InterpolatedInflation()
    )
    speed: Annotated[SpeedPolicy, _ShippedOrOwn(InterpolatedHumanSpeed, "human_speed_mps")] = (
        InterpolatedHumanSpeed()
    )
    margins: SafetyMargins = SafetyMargins()
    timing: TimeBehaviour = TimeBehaviour()
    filter: AwarenessFilterConfig = AwarenessFilterConfig()

    @classmethod
    def preset(cls, name: str) -> AwarenessPolicy:
        """Load a shipped policy: ``"balanced"`` (the default) or ``"blind"`` (ignores α).

        Raises:
            NavError: there is no preset of that name.
        """
        folder = resources.files("nav_adapter.policies")
        files = {
            entry.name.removesuffix(".yaml"): entry
            for entry in folder.iterdir()
            if entry.name.endswith(".yaml")
        }
        if name not in files:
            near = difflib.get_close_matches(str(name), files, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            raise NavError(
                f"preset must be one of {', '.join(map(repr, sorted(files)))}, got {name!r}{hint}"
            )
        return cls.model_validate(yaml.safe_load(files[name].read_text(encoding="utf-8")))

    def to_yaml(self, path: str | Path) -> None:
        """Write the policy for :meth:`from_yaml`; own policy objects cannot be written."""
        for field, shipped in (
            ("inflation", InterpolatedInflation),
            ("speed", InterpolatedHumanSpeed),
        ):
            value = getattr(self, field)
            if not isinstance(value, shipped):
                raise NavError(
                    f"{field} is a {type(value).__name__}; only {shipped.__name__} can be written "
                    "to YAML"
                )
        super().to_yaml(path)
