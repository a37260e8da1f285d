"""One file that says how a robot moves around people who have, and have not, noticed it."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, ClassVar

import yaml
from pydantic import GetCoreSchemaHandler, model_validator
from pydantic_core import CoreSchema, core_schema

from tracking import AwarenessFilterConfig
from tracking.config import StrictConfig

from ._errors import NavError
from .policies import (
    AlertRules,
    InflationPolicy,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    ObstacleOutline,
    SafetyMargins,
    SpeedPolicy,
    SpeedRules,
    TableHumanSpeed,
    TableInflation,
    TimeBehaviour,
)

# Read once a process: presets are frozen, and an episode takes less time than its YAML.
_PRESETS: dict[str, AwarenessPolicy] = {}
_SHIPPED: dict[str, tuple[type[StrictConfig], ...]] = {
    "inflation": (InterpolatedInflation, TableInflation),
    "speed": (InterpolatedHumanSpeed, TableHumanSpeed),
}


class _ShippedOrOwn:
    """Pydantic marker of a field: a shipped model (or its YAML keys), or a user's own object."""

    def __init__(self, field: str, method: str) -> None:
        self._ramp, self._table = _SHIPPED[field]
        self._method = method

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        ramp, table, method = self._ramp, self._table, self._method

        def check(value: Any, validate_ramp: Callable[[Any], Any]) -> Any:
            if isinstance(value, table):
                return value
            if isinstance(value, Mapping) and any(str(key).startswith("table") for key in value):
                return table.model_validate(dict(value))
            if isinstance(value, (ramp, Mapping)):
                return validate_ramp(value)
            if callable(getattr(value, method, None)) and not isinstance(value, type):
                return value
            raise ValueError(
                f"must be a mapping with the keys of {ramp.__name__} or {table.__name__}, or an "
                f"object with a method {method}(awareness_lower), got {type(value).__name__}"
            )

        def dump(value: Any) -> Any:
            shipped = isinstance(value, (ramp, table))
            return value.model_dump(mode="json") if shipped else value

        return core_schema.no_info_wrap_validator_function(
            check,
            handler.generate_schema(ramp),
            serialization=core_schema.plain_serializer_function_ser_schema(dump),
        )


class AwarenessPolicy(StrictConfig):
    """Everything between a person's awareness and the planner's constraints, in one YAML file.

    Attributes:
        inflation: radius of a person over ``awareness_lower``: a ramp, a table or an own object.
        speed: assumed human speed over ``awareness_lower``: a ramp, a table or an own object. The
            default has a level for people who watch the robot; a ``speed`` of one's own has none
            unless it says so.
        outline: what the obstacles' polygons add to their circles; by default nothing.
        rules: speed limits beside speed and separation, and whom limits are about.
        alerts: who is warned and when, or none.
        margins: distances that hold whatever α says.
        timing: how fast obstacles may shrink and how long data may be trusted.
        filter: settings of the tracker's awareness filter, kept here because they decide with the
            rest how soon a glance counts and how long it lasts.
    """

    error: ClassVar[type[ValueError]] = NavError

    inflation: Annotated[InflationPolicy, _ShippedOrOwn("inflation", "radius_m")] = (
        InterpolatedInflation()
    )
    speed: Annotated[SpeedPolicy, _ShippedOrOwn("speed", "human_speed_mps")] = (
        InterpolatedHumanSpeed(watching_above=0.8, watching_human_speed_mps=0.05)
    )
    outline: ObstacleOutline = ObstacleOutline()
    rules: SpeedRules = SpeedRules()
    alerts: AlertRules | None = AlertRules()
    margins: SafetyMargins = SafetyMargins()
    timing: TimeBehaviour = TimeBehaviour()
    filter: AwarenessFilterConfig = AwarenessFilterConfig()

    @model_validator(mode="after")
    def _ceiling_above_unaware(self) -> AwarenessPolicy:
        ceiling_m = self.margins.maximum_radius_m
        if ceiling_m is not None and isinstance(self.inflation, _SHIPPED["inflation"]):
            unaware_m = self.inflation.radius_m(0.0)
            if unaware_m > ceiling_m:
                raise ValueError(
                    "margins.maximum_radius_m must be at least the unaware radius of "
                    f"{unaware_m:g} m, got {ceiling_m:g} m"
                )
        return self

    @classmethod
    def preset(cls, name: str) -> AwarenessPolicy:
        """Load a shipped policy.

        ``"balanced"`` is the default, ``"blind"`` ignores α, ``"conservative"`` and
        ``"assertive"`` lie on either side of the default.

        Raises:
            NavError: there is no preset of that name.
        """
        kept = _PRESETS.get(name) if cls is AwarenessPolicy else None
        if kept is not None:
            return kept
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
        policy = cls.model_validate(yaml.safe_load(files[name].read_text(encoding="utf-8")))
        if cls is AwarenessPolicy:
            _PRESETS[name] = policy
        return policy

    def to_yaml(self, path: str | Path) -> None:
        """Write the policy for :meth:`from_yaml`; own policy objects cannot be written."""
        for field, shipped in _SHIPPED.items():
            value = getattr(self, field)
            if not isinstance(value, shipped):
                names = " and ".join(model.__name__ for model in shipped)
                raise NavError(
                    f"{field} is a {type(value).__name__}; only {names} can be written to YAML"
                )
        super().to_yaml(path)
