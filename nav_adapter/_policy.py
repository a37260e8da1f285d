"""Awareness policies: all settings between awareness and the constraints, in one YAML file."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from pydantic import GetCoreSchemaHandler, model_validator
from pydantic_core import CoreSchema, core_schema

from perception.documents import parse_yaml
from tracking import AwarenessFilterConfig
from tracking.config import StrictConfig

from ._errors import NavError
from .policies import (
    AlertRules,
    InflationPolicy,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    NoticedPeople,
    ObstacleOutline,
    SafetyMargins,
    SpeedPolicy,
    SpeedRules,
    StandingPeople,
    StartReserve,
    TableHumanSpeed,
    TableInflation,
    TimeBehaviour,
    WalkingPeople,
)

# Presets are read once per process: they are frozen, and reading takes longer than an episode.
_PRESETS: dict[str, AwarenessPolicy] = {}
_SHIPPED: dict[str, tuple[type[StrictConfig], ...]] = {
    "inflation": (InterpolatedInflation, TableInflation),
    "speed": (InterpolatedHumanSpeed, TableHumanSpeed),
}


class _ShippedOrCustom:
    """Pydantic marker of a field that takes a shipped model, its YAML keys, or a custom object."""

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


# Long enough for a mean place, short enough to follow the drift of odom.
_STANDING_WINDOW_S: Final = 1.0


class AwarenessPolicy(StrictConfig):
    """All settings between a person's awareness and the planner's constraints.

    Attributes:
        inflation: radius of a person over ``awareness_lower``: a ramp, a table or a custom object.
        speed: assumed human speed over ``awareness_lower``: a ramp, a table or a custom object.
        outline: the part of the obstacles' polygons beyond their circles; by default nothing.
        rules: assumed turns, and speed limits besides speed and separation.
        noticed: what it counts that a person noticed the robot some seconds ago, or None for
            nothing. It needs ``filter.noticed_memory_s`` and a laser scanner: with a camera alone
            it changes nothing.
        alerts: rules for alerts, or None.
        margins: distances that hold for every α.
        timing: how fast obstacles may shrink and how long data may be trusted.
        filter: settings of the tracker's awareness filter. They belong to the policy because they
            decide how soon a look at the robot counts and for how long. A ``filter`` of your own
            has no memory of who has noticed the robot unless it sets one.
    """

    error: ClassVar[type[ValueError]] = NavError

    inflation: Annotated[InflationPolicy, _ShippedOrCustom("inflation", "radius_m")] = (
        InterpolatedInflation()
    )
    speed: Annotated[SpeedPolicy, _ShippedOrCustom("speed", "human_speed_mps")] = (
        InterpolatedHumanSpeed()
    )
    outline: ObstacleOutline = ObstacleOutline()
    rules: SpeedRules = SpeedRules(
        standing=StandingPeople(delay_from_tracks=True),
        walking=WalkingPeople(),
        start_reserve=StartReserve(),
    )
    noticed: NoticedPeople | None = NoticedPeople()
    alerts: AlertRules | None = AlertRules()
    margins: SafetyMargins = SafetyMargins()
    timing: TimeBehaviour = TimeBehaviour()
    filter: AwarenessFilterConfig = AwarenessFilterConfig(noticed_memory_s=5.0)

    @model_validator(mode="after")
    def _check_ceiling(self) -> AwarenessPolicy:
        ceiling_m = self.margins.maximum_radius_m
        if ceiling_m is not None and isinstance(self.inflation, _SHIPPED["inflation"]):
            unaware_m = self.inflation.radius_m(0.0)
            if unaware_m > ceiling_m:
                raise ValueError(
                    "margins.maximum_radius_m must be at least the unaware radius of "
                    f"{unaware_m:g} m, got {ceiling_m:g} m"
                )
        return self

    @property
    def standing_window_s(self) -> float | None:
        """The setting of this name that a tracker needs for ``rules.standing``; None for off."""
        standing = self.rules.standing
        return _STANDING_WINDOW_S if standing is not None and standing.delay_from_tracks else None

    @classmethod
    def preset(cls, name: str) -> AwarenessPolicy:
        """Load a shipped policy.

        ``"balanced"`` is the default and ``"blind"`` ignores α. ``"conservative"`` is more careful
        than the default, ``"assertive"`` less.

        Raises:
            NavError: for a name that is not a preset.
        """
        cached = _PRESETS.get(name) if cls is AwarenessPolicy else None
        if cached is not None:
            return cached
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
        policy = cls.model_validate(
            parse_yaml(files[name].read_text(encoding="utf-8"), name, NavError)
        )
        if cls is AwarenessPolicy:
            _PRESETS[name] = policy
        return policy

    def to_yaml(self, path: str | Path) -> None:
        """Write the policy for :meth:`from_yaml`; custom policy objects cannot be written."""
        for field, shipped in _SHIPPED.items():
            value = getattr(self, field)
            if not isinstance(value, shipped):
                names = " and ".join(model.__name__ for model in shipped)
                raise NavError(
                    f"{field} is a {type(value).__name__}; only {names} can be written to YAML"
                )
        super().to_yaml(path)
