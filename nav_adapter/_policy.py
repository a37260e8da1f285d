"""Awareness policies: all settings between awareness and the constraints, in one YAML file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from perception.documents import parse_yaml
from perception.errors import not_one_of
from tracking import AwarenessFilterConfig

from ._config import NavConfig
from ._errors import NavError
from .policies import (
    AlertRules,
    AttentionRules,
    InflationPolicy,
    InterpolatedHumanSpeed,
    InterpolatedInflation,
    ReachRules,
    SafetyMargins,
    SpeedPolicy,
    TimeBehaviour,
)

# Presets are read once per process: they are frozen, and reading takes longer than an episode.
_PRESETS: dict[str, AwarenessPolicy] = {}
_SHIPPED: dict[str, type[NavConfig]] = {
    "inflation": InterpolatedInflation,
    "speed": InterpolatedHumanSpeed,
}


class _ShippedOrCustom:
    """Pydantic marker of a field that takes the shipped model, its YAML keys or a custom object."""

    def __init__(self, field: str, method: str) -> None:
        self._shipped, self._method = _SHIPPED[field], method

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        shipped, method = self._shipped, self._method

        def check(value: Any, validate: Callable[[Any], Any]) -> Any:
            if isinstance(value, (shipped, Mapping)):
                return validate(value)
            if callable(getattr(value, method, None)) and not isinstance(value, type):
                return value
            raise ValueError(
                f"must be a mapping with the keys of {shipped.__name__}, or an object with a "
                f"method {method}(awareness_lower), got {type(value).__name__}"
            )

        def dump(value: Any) -> Any:
            return value.model_dump(mode="json") if isinstance(value, shipped) else value

        return core_schema.no_info_wrap_validator_function(
            check,
            handler.generate_schema(shipped),
            serialization=core_schema.plain_serializer_function_ser_schema(dump),
        )


class AwarenessPolicy(NavConfig):
    """All settings between a person's awareness and the planner's constraints.

    Attributes:
        inflation: radius of a person over ``awareness_lower``: a ramp or a custom object.
        speed: U over ``awareness_lower``, the speed that a person may change to: a ramp or a custom
            object.
        reach: how people change their motion and the robot its course.
        without: names of rules of the limit (:mod:`nav_adapter.rules`) that are left out. Without
            ``reach``, ``walking on`` and ``first sight`` do not count either: a robot knows no
            motion of people, and has the protective field of a safety laser scanner alone.
        noticed_counts_as: while ``PersonTrack.noticed`` is at least 0.5, the belief that a person
            who does not look now knows of the robot, the lower bound of α is at least this; None
            for nothing. It needs ``filter.noticed_memory_s`` and a laser scanner: with a camera
            alone it changes nothing.
        alerts: rules for warnings of collisions, or None.
        attention: rules for requests to look at the robot; None asks nobody. In all presets, since
            requests win less time than they cost in impacts (docs/what_it_wins.md).
        margins: distances that hold for every α.
        timing: how fast obstacles may shrink and how long data may be trusted.
        filter: settings of the tracker's awareness filter. They belong to the policy because they
            decide how soon a look at the robot counts and for how long. A ``filter`` of your own
            has no memory of who has noticed the robot unless it sets one.
    """

    inflation: Annotated[InflationPolicy, _ShippedOrCustom("inflation", "radius_m")] = (
        InterpolatedInflation()
    )
    speed: Annotated[SpeedPolicy, _ShippedOrCustom("speed", "human_speed_mps")] = (
        InterpolatedHumanSpeed()
    )
    reach: ReachRules = ReachRules()
    without: tuple[Literal["reach", "walking on", "first sight", "unseen"], ...] = ()
    noticed_counts_as: float | None = Field(default=0.6, ge=0.0, le=1.0)
    alerts: AlertRules | None = AlertRules()
    attention: AttentionRules | None = None
    margins: SafetyMargins = SafetyMargins()
    timing: TimeBehaviour = TimeBehaviour()
    filter: AwarenessFilterConfig = AwarenessFilterConfig(noticed_memory_s=3.0)

    def applies(self, rule: str) -> bool:
        """Return whether a rule of the limit (:mod:`nav_adapter.rules`) counts, given its name.

        Two rules lower the limit for people who are aware to what ``reach`` allows for others.
        Alone, they would slow the robot down for those who have noticed it.
        """
        beside_reach = rule in ("walking on", "first sight") and "reach" in self.without
        return rule not in self.without and not beside_reach

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
            raise NavError(not_one_of("policy", name, sorted(files)))
        policy = cls.model_validate(
            parse_yaml(files[name].read_text(encoding="utf-8"), name, NavError)
        )
        if cls is AwarenessPolicy:
            _PRESETS[name] = policy
        return policy

    @classmethod
    def named(cls, name: str | Path) -> AwarenessPolicy:
        """Return the policy of a YAML file, or the preset of a name that does not end as one.

        Raises:
            NavError: for a file that cannot be used, or a name that is not a preset.
        """
        if Path(name).suffix.lower() in (".yaml", ".yml"):
            return cls.from_yaml(name)
        return cls.preset(str(name))

    def to_yaml(self, path: str | Path) -> None:
        """Write the policy for :meth:`from_yaml`; custom policy objects cannot be written."""
        for field, shipped in _SHIPPED.items():
            value = getattr(self, field)
            if not isinstance(value, shipped):
                raise NavError(
                    f"{field} is a {type(value).__name__}; only {shipped.__name__} can be written "
                    "to YAML"
                )
        super().to_yaml(path)
