"""The work of ``awarenav policy upgrade``: a policy file of 0.2 in the settings of today.

What has no counterpart is dropped. Where the new file may then be less careful than the old one, a
line that begins with "check" says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from nav_adapter import AwarenessPolicy
from perception.documents import read_yaml, yaml_text
from tracking.config import complaints

from ..errors import AwarenavError, counted
from ..files import check_output, write_text
from ._version_0_2 import (
    ACCELERATION_MPS2,
    ALERTS,
    DELAY_S,
    HUMAN_SPEEDS,
    KEPT,
    OF_TODAY,
    OUTLINE,
    PEOPLE,
    RULES,
    SECTIONS,
    SHAPES,
    SHOWN_S,
    TURN_DEG,
    mapping,
    number,
    points_of,
    require_known,
)

# The smallest time constant that a policy can have.
_AT_ONCE_S: Final = 0.05
_SMALLEST_CLEARANCE_M, _LARGEST_CLEARANCE_M = 0.1, 2.0
# A blend over so little of α is a step. At its end a person is aware, as a belief may count.
_STEP: Final = 1e-6


def upgrade_command(old: Path, out: Path | None) -> int:
    """Run the command; return the exit status.

    Raises:
        AwarenavError: for a file that is no policy of 0.2, or one that cannot be written.
    """
    if out is not None:
        check_output(out, (".yaml", ".yml"), [old])
    data = read_yaml(old, AwarenavError)
    try:
        upgrade = Upgrade(data)
        AwarenessPolicy.model_validate(upgrade.policy)
    except ValidationError as cause:
        raise AwarenavError(f"{old}: {complaints(cause)}") from cause
    except AwarenavError as cause:
        raise AwarenavError(f"{old}: {cause}") from cause
    print("\n".join(upgrade.lines))
    print(
        "The limits follow from another model of people's motion and may be higher or lower than "
        f"in 0.2: look at them with awarenav policy show {out or 'NEW.yaml'}"
    )
    if out is not None:
        write_text(out, yaml_text(upgrade.policy))
        print(f"Written to {out}, without the comments of {old}")
    if upgrade.checks:
        print(f"{counted(upgrade.checks, 'line')} to check")
    return 1 if upgrade.checks else 0


class Upgrade:
    """The translation of one file.

    Attributes:
        policy: the new settings, those alone that the old file decides.
        lines: what has become of each setting.
        checks: number of lines that say how the new file may be less careful.
    """

    def __init__(self, data: Any) -> None:
        if not isinstance(data, Mapping):
            raise AwarenavError(f"must hold a mapping of keys, got {type(data).__name__}")
        if today := [key for key in OF_TODAY if key in data]:
            raise AwarenavError(f"this is a policy of the present version: it has {today[0]!r}")
        require_known(data, SECTIONS, "the policy")
        self._old = data
        self.policy: dict[str, Any] = {}
        self.lines: list[str] = []
        self.checks = 0
        self._ramp("inflation", "table_m", "radius_m")
        self._ramp("speed", "table_mps", "human_speed_mps")
        rules, protective = self._rules()
        self._noticed()
        self._margins(protective)
        self._timing()
        self._alerts()
        self._filter()
        self._outline()
        if protective is None:
            self._reach(rules)
        self._lowering_rules(rules)

    def _say(self, what: str, key: str, text: str) -> None:
        self.checks += what == "check"
        self.lines.append(f"{what:8}  {key}: {text}")

    def _section(self, name: str, *others: str) -> Mapping[str, Any]:
        """Return a section of the old file after a check of its keys."""
        known = (*KEPT.get(name, ()), *others)
        return mapping(self._old.get(name, {}), known, name)

    def _keep(self, section: str, given: Mapping[str, Any]) -> dict[str, Any]:
        """Keep the settings that have not changed; return those of the section."""
        kept = {key: given[key] for key in KEPT[section] if key in given}
        for key, value in kept.items():
            self._say("kept", f"{section}.{key}", _text(value))
        if kept:
            self.policy.setdefault(section, {}).update(kept)
        return kept

    def _ramp(self, section: str, table: str, value: str) -> None:
        """Translate radius or speed."""
        unaware, aware = f"unaware_{value}", f"aware_{value}"
        if table in mapping(self._old.get(section, {}), None, section):
            points = points_of(self._section(section, table)[table], f"{section}.{table}")
            (_, first), (above, last) = points[0], points[-1]
            self.policy[section] = {unaware: first, aware: last}
            if above > 0.0 and first != last:
                self._step(section, above)
            self._say(
                "replaced",
                f"{section}.{table}",
                f"{first:g} below an α of {above:g}, {last:g} from there on: no less than the "
                "table anywhere",
            )
            return
        watching = ("watching_above", "watching_human_speed_mps") if section == "speed" else ()
        given = self._section(section, *watching, "shape", "steepness")
        self._keep(section, given)
        if section == "speed":
            for key, old in HUMAN_SPEEDS.items():
                if key not in given:
                    self.policy.setdefault(section, {})[key] = old
                    self._say("kept", f"speed.{key}", f"{old:g}, the default of 0.2")
        shape = given.get("shape", "smoothstep")
        if shape not in SHAPES:
            raise AwarenavError(f"{section}.shape must be one of {SHAPES}, got {shape!r:.80}")
        if shape != "smoothstep":
            above = number(given, "aware_above", 0.6, section)
            self._step(section, above)
            self._say(
                "replaced",
                f"{section}.shape",
                f"{shape} is gone: the unaware value counts below an α of {above:g}; for more, "
                "lower unaware_below",
            )
        elif "shape" in given:
            self._say("dropped", f"{section}.shape", "smoothstep is the only one")
        if "steepness" in given:
            self._say("dropped", f"{section}.steepness", "it is of the shape logistic")
        for key in watching:
            if key in given:
                self._say("dropped", f"speed.{key}", "aware_human_speed_mps counts instead")

    def _step(self, section: str, above: float) -> None:
        self.policy.setdefault(section, {}).update(
            unaware_below=round(max(above - _STEP, 0.0), 6), aware_above=above
        )

    def _rules(self) -> tuple[Mapping[str, Any], Mapping[str, Any] | None]:
        """Return the rules that hold, and the protective field if it replaces the others."""
        if "rules" not in self._old:
            return {"standing": {}, "walking": {}, "start_reserve": {}}, None
        rules = mapping(self._old["rules"], RULES, "rules")
        field = rules.get("protective_field")
        if field is None:
            return rules, None
        field = mapping(field, ("beside_m",), "rules.protective_field")
        self.policy["without"] = ["reach", "walking on", "first sight"]
        self._say("renamed", "rules.protective_field", "without: [reach, walking on, first sight]")
        for key in ("standing", "walking", "turn_within_stop_deg", "people_turn_deg"):
            if rules.get(key) is not None:
                self._say("dropped", f"rules.{key}", "it did not count with a protective field")
        return rules, field

    def _reach(self, rules: Mapping[str, Any]) -> None:
        """Translate the assumptions on motion."""
        reach: dict[str, float] = {}
        if "turn_within_stop_deg" in rules:
            turn_deg = number(rules, "turn_within_stop_deg", TURN_DEG, "rules")
            wide = turn_deg > TURN_DEG
            self._say(
                "check" if wide else "replaced",
                "rules.turn_within_stop_deg",
                "reach.turn_deg, which has another meaning (the robot may leave its course by so "
                "much while it stops) and keeps its default"
                + (f"; more than {TURN_DEG:g} was asked for: raise it" if wide else ""),
            )
        if "people_turn_deg" in rules:
            self._say("replaced", "rules.people_turn_deg", "reach: people may turn anywhere")
        accelerations, delays = [ACCELERATION_MPS2], [0.0]
        margins = self.policy.get("margins", {})
        sigmas = number(margins, "uncertainty_sigmas", 2.0, "margins")
        for key, known in PEOPLE.items():
            if (given := rules.get(key)) is None:
                continue
            name = f"rules.{key}"
            given = mapping(given, known, name)
            accelerations.append(number(given, known[0], ACCELERATION_MPS2, name))
            delays.append(number(given, known[1], DELAY_S, name))
            if number(given, "velocity_sigmas", 0.0, name) > sigmas:
                self._say(
                    "check",
                    f"{name}.velocity_sigmas",
                    f"margins.uncertainty_sigmas counts, {sigmas:g}: raise it",
                )
            if key in self._old.get("rules", {}):
                self._say(
                    "replaced", name, "reach.time_constant_s and reach.delay_s, for everybody"
                )
        if rules.get("walking") is None:
            reach["time_constant_s"] = _AT_ONCE_S
            self._say("replaced", "rules.walking", f"null: reach.time_constant_s {_AT_ONCE_S:g}")
        elif max(accelerations) > ACCELERATION_MPS2:
            share = ACCELERATION_MPS2 / max(accelerations)
            reach["time_constant_s"] = round(max(0.54 * share, _AT_ONCE_S), 3)
            self._say(
                "replaced",
                "rules.….human_acceleration_mps2",
                f"reach.time_constant_s {reach['time_constant_s']:g}, as much shorter",
            )
        if max(delays) > DELAY_S:
            reach["delay_s"] = max(delays)
            self._say("replaced", "rules.….…_delay_s", f"reach.delay_s {max(delays):g}")
        if reach:
            self.policy["reach"] = reach

    def _lowering_rules(self, rules: Mapping[str, Any]) -> None:
        """Say what is lost of the rules that only lowered the limit, and of the closing speed."""
        speed = self.policy["speed"]
        unaware, aware = (number(speed, key, 0.0, "speed") for key in HUMAN_SPEEDS)
        moving = "without" not in self.policy
        if moving and aware < unaware:
            self._say(
                "check",
                f"aware people, {aware:g} m/s",
                "in 0.2 those who set off counted with the speed of unaware people, those who walk "
                "on with that of their track. Now both are expected to change to "
                "speed.aware_human_speed_mps at most. Raise it where they do not",
            )
        if rules.get("start_reserve") is not None:
            self._say(
                "dropped" if moving else "check",
                "rules.start_reserve",
                "people who set off are within U"
                if moving
                else "dropped: without reach no motion of people counts",
            )
        for key in ("zones", "near_cap"):
            if rules.get(key) is not None:
                self._say(
                    "check",
                    f"rules.{key}",
                    "dropped: no limit of distance alone is left. Lower the robot's maximum speed, "
                    "or raise margins.clearance_m",
                )

    def _noticed(self) -> None:
        if "noticed" not in self._old:
            return
        given = self._old["noticed"]
        if given is None:
            self.policy["noticed_counts_as"] = None
            self._say("renamed", "noticed", "noticed_counts_as: null")
            return
        given = mapping(given, ("at_least", "counts_as_awareness"), "noticed")
        counts_as = number(given, "counts_as_awareness", 0.6, "noticed")
        if number(given, "at_least", 0.5, "noticed") > 0.5:
            self.policy["noticed_counts_as"] = None
            self._say(
                "replaced",
                "noticed.at_least",
                "noticed_counts_as: null, since every belief of at least 0.5 would count now",
            )
            return
        self.policy["noticed_counts_as"] = counts_as
        self._say("renamed", "noticed.counts_as_awareness", f"noticed_counts_as: {counts_as:g}")
        if "at_least" in given:
            self._say("dropped", "noticed.at_least", "it is 0.5 always")

    def _margins(self, protective: Mapping[str, Any] | None) -> None:
        """Translate the margins; both clearances, and a protective field, become one."""
        clearances = ("minimum_clearance_m", "separation_clearance_m")
        given = self._section("margins", *clearances, "maximum_radius_m")
        self._keep("margins", given)
        asked = {f"margins.{key}": number(given, key, 0.0, "margins") for key in clearances}
        if protective is not None:
            name = "rules.protective_field"
            asked[f"{name}.beside_m"] = number(protective, "beside_m", 0.1, name)
        largest_m = max(_SMALLEST_CLEARANCE_M, *asked.values())
        if largest_m > _SMALLEST_CLEARANCE_M:
            self.policy.setdefault("margins", {})["clearance_m"] = min(
                largest_m, _LARGEST_CLEARANCE_M
            )
        for key, value in asked.items():
            if key.rpartition(".")[2] not in given and not value:
                continue
            if value > _LARGEST_CLEARANCE_M:
                self._say("check", key, f"clearance_m is at most {_LARGEST_CLEARANCE_M:g}")
            else:
                self._say("renamed", key, f"margins.clearance_m {largest_m:g}, the largest of all")
        if "maximum_radius_m" in given:
            self._say("dropped", "margins.maximum_radius_m", "a circle may be larger")

    def _timing(self) -> None:
        given = self._section("timing", "shrink_after_s", "new_clock_after_s")
        self._keep("timing", given)
        if "shrink_after_s" in given:
            longer = number(given, "shrink_after_s", SHOWN_S, "timing") > SHOWN_S
            self._say(
                "check" if longer else "dropped",
                "timing.shrink_after_s",
                f"awareness counts once frames have shown a person for {SHOWN_S:g} s"
                + (", sooner than before: lower shrink_rate_mps" if longer else ""),
            )
        if "new_clock_after_s" in given:
            self._say("dropped", "timing.new_clock_after_s", "it is 1 s always")

    def _alerts(self) -> None:
        if "alerts" in self._old and self._old["alerts"] is None:
            self.policy["alerts"] = None
            self._say("kept", "alerts", "null")
            return
        given = self._section("alerts", *ALERTS)
        self._keep("alerts", given)
        for key, fixed in ALERTS.items():
            if key in given:
                self._say("dropped", f"alerts.{key}", f"it is {fixed} always")

    def _filter(self) -> None:
        if "filter" not in self._old:
            self._say(
                "replaced", "filter.noticed_memory_s", "3, the default (5, the default of 0.2)"
            )
            return
        self.policy["filter"] = given = dict(mapping(self._old["filter"], None, "filter"))
        for key, value in given.items():
            self._say("kept", f"filter.{key}", _text(value))

    def _outline(self) -> None:
        if "outline" not in self._old:
            return
        given = mapping(self._old["outline"], OUTLINE, "outline")
        longer = any(
            number(given, key, 0.0, "outline") > 0.0 for key in ("unaware_ahead_s", "sweep_s")
        )
        self._say(
            "check" if longer else "dropped",
            "outline",
            "polygons are circles"
            + (
                ", no longer stretched along the motion: a planner that reads them needs "
                "velocities, or nav_adapter.exporters.predicted_circles"
                if longer
                else ""
            ),
        )


def _text(value: Any) -> str:
    return "null" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
