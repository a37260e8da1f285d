"""The policies of the frontier: ``balanced`` with another U, with and without awareness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from nav_adapter import AwarenessPolicy

from ...conditions import SensorSet

#: The policy of today's AMR, which is one end of the frontier without awareness.
TODAY: Final = "scanner"
#: U, the speed that people who have not noticed the robot may change to. At 0 everybody is expected
#: to keep to their motion, as people who have noticed the robot are.
SPEEDS_MPS: Final = (0.0, 0.3, 0.6, 1.0, 1.5)
#: What a policy knows: nothing of awareness, who looks, or who has looked as well.
Kind = Literal["blind", "aware", "memory"]
_MEMORY_S: Final = 3.0


def sensors_of_today(sensors: SensorSet) -> SensorSet:
    """Return the sensors of today's AMR: its laser scanners alone, where the robot has any."""
    return "camera" if sensors == "camera" else "scanner"


@dataclass(frozen=True, slots=True)
class Member:
    """A policy of the family.

    The radius of unaware people goes with U: at 1.5 m/s it is that of ``balanced``, at 0 that of
    aware people.

    Attributes:
        kind: ``"blind"`` treats everybody as unaware. ``"aware"`` expects people who look to keep
            to their motion. ``"memory"`` expects it for 3 s after their last look, too.
        speed_mps: U of unaware people.
    """

    kind: Kind
    speed_mps: float

    @property
    def name(self) -> str:
        """The name of the policy in tables, such as ``"aware_u1.5"``."""
        return f"{self.kind}_u{self.speed_mps:g}"

    def policy(self) -> AwarenessPolicy:
        """Return the policy: ``balanced`` with these settings, which asks nobody."""
        data = AwarenessPolicy.preset("balanced").model_dump(mode="json")
        inflation, speed = data["inflation"], data["speed"]
        share = self.speed_mps / speed["unaware_human_speed_mps"]
        aware_m, unaware_m = inflation["aware_radius_m"], inflation["unaware_radius_m"]
        inflation["unaware_radius_m"] = aware_m + share * (unaware_m - aware_m)
        speed["unaware_human_speed_mps"] = self.speed_mps
        speed["aware_human_speed_mps"] = self.speed_mps if self.kind == "blind" else 0.0
        if self.kind == "blind":
            inflation["aware_radius_m"] = inflation["unaware_radius_m"]
        data["attention"] = None
        if self.kind != "memory":
            data["noticed_counts_as"] = None
        data["filter"]["noticed_memory_s"] = _MEMORY_S if self.kind == "memory" else 0.0
        return AwarenessPolicy.model_validate(data)


def family(*, memory: bool) -> tuple[Member, ...]:
    """Return the family; ``memory`` adds the policies that need laser scanners."""
    kinds: tuple[Kind, ...] = ("blind", "aware", "memory") if memory else ("blind", "aware")
    return tuple(
        Member(kind, speed_mps)
        for kind in kinds
        for speed_mps in SPEEDS_MPS
        if kind == "blind" or speed_mps > 0.0  # at 0, awareness changes nothing
    )


def member_named(name: str) -> Member | None:
    """Return the policy of the family with this name; None for any other policy."""
    return next((each for each in family(memory=True) if each.name == name), None)
