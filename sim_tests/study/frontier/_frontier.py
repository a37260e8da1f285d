"""The frontier of a run: its policies, their time and impacts, and what awareness wins."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from nav_adapter import AwarenessPolicy
from perception.arrays import FloatArray

from ...world.errors import SimError
from ..measures import (
    EpisodeRecord,
    Interval,
    bootstrap_interval,
    resampled_interval,
    resampled_means,
)

#: The policy of today's AMR, which is one end of the frontier without awareness.
TODAY: Final = "scanner"
#: U, the speed that people who have not noticed the robot may change to. At 0 everybody is expected
#: to keep to their motion, as people who have noticed the robot are.
SPEEDS_MPS: Final = (0.0, 0.3, 0.6, 1.0, 1.5)
#: The risk: step-out impacts with all people, per 1 000 crossings.
RISK: Final = "step_out_all"
#: What a policy knows: nothing of awareness, who looks, or who has looked as well.
Kind = Literal["blind", "aware", "memory"]
_MEMORY_S: Final = 3.0
_ATTENTIVE: Final = "attentive"

_Task = tuple[str, int, int]


def sensors_of_today(sensors: str) -> str:
    """Return the sensors of today's AMR: its laser scanners alone, where the robot has any."""
    return "scanner" if "scanner" in sensors.split("+") else sensors


@dataclass(frozen=True, slots=True)
class Member:
    """A policy of the family.

    The radius of unaware people goes with U: at 1.5 m/s it is that of ``balanced``, at 0 that of
    aware people.

    Attributes:
        kind: ``"blind"`` treats everybody as unaware. ``"aware"`` expects people who look to keep
            to their motion, as ``balanced`` does. ``"memory"`` expects it for 3 s after their last
            look, too.
        speed_mps: U of unaware people.
    """

    kind: Kind
    speed_mps: float

    @property
    def name(self) -> str:
        """The name of the policy in tables, such as ``"aware_u1.5"``."""
        return f"{self.kind}_u{self.speed_mps:g}"

    def policy(self) -> AwarenessPolicy:
        """Return the policy: ``balanced`` with these settings."""
        data = AwarenessPolicy.preset("balanced").model_dump(mode="json")
        inflation, speed = data["inflation"], data["speed"]
        share = self.speed_mps / speed["unaware_human_speed_mps"]
        aware_m, unaware_m = inflation["aware_radius_m"], inflation["unaware_radius_m"]
        inflation["unaware_radius_m"] = aware_m + share * (unaware_m - aware_m)
        speed["unaware_human_speed_mps"] = self.speed_mps
        speed["aware_human_speed_mps"] *= share
        if self.kind == "blind":
            speed["aware_human_speed_mps"] = self.speed_mps
            inflation["aware_radius_m"] = inflation["unaware_radius_m"]
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


@dataclass(frozen=True, slots=True)
class Point:
    """A policy on the frontier.

    Attributes:
        name: name of the policy.
        member: its place in the family; None for today's AMR and for any other policy.
        time_lost_s: mean time lost to people.
        time_over_today: time to the goal over that of today's AMR on the same episodes; an episode
            that never arrives counts with what it lasted.
        impacts: mean step-out impacts with all people, per 1 000 crossings: the risk.
        never_noticed: those of them with people who have never noticed the robot.
    """

    name: str
    member: Member | None
    time_lost_s: Interval
    time_over_today: Interval
    impacts: Interval
    never_noticed: Interval


@dataclass(frozen=True, slots=True)
class Worth:
    """The gain from awareness with one policy, against the line of the policies without awareness.

    The line goes through today's AMR and the policies without awareness, from one to the next. A
    policy that is slower than another and has no fewer impacts is not on it. The line is not
    prolonged: a policy with fewer impacts than any on the line is compared with the last on it,
    which wins less than there is. There is no figure for one with more impacts, or slower, than
    any on the line.

    Attributes:
        member: the policy.
        at_equal_risk_s: seconds won at equal step-out impacts with all people.
        attentive_s: the same in the scenarios with attentive people alone, against the same mix of
            policies of the line.
        at_equal_time: impacts avoided at equal time lost, per 1 000 crossings.
    """

    member: Member
    at_equal_risk_s: Interval
    attentive_s: Interval
    at_equal_time: Interval


@dataclass(frozen=True, slots=True)
class Frontier:
    """The frontier of a run."""

    points: tuple[Point, ...]
    worth: tuple[Worth, ...]
    free_s: float
    episodes: int
    scenarios: int

    @property
    def today(self) -> Point:
        """Today's AMR."""
        return self.points[0]

    @property
    def line(self) -> tuple[Point, ...]:
        """The policies on the line without awareness, by time lost."""
        lost_s = np.array([point.time_lost_s.value for point in self.points])
        impacts = np.array([point.impacts.value for point in self.points])
        on_line = _efficient(_without_awareness(self.points), lost_s, impacts)
        return tuple(self.points[column] for column in on_line)


def frontier_of(records: Iterable[EpisodeRecord]) -> Frontier:
    """Return the frontier of episodes; it does not depend on their order.

    Only scenarios and seeds count of which every policy has an episode with a time lost and
    step-out impacts, so that all policies are compared on the same. Intervals come from resamples
    within scenarios.

    Raises:
        SimError: today's AMR is missing, a policy has an episode twice (as with two planners), or
            no scenario and seed is common to all policies.
    """
    groups = _by_policy(records)
    if TODAY not in groups:
        raise SimError(f"the frontier needs episodes of today's AMR, the policy {TODAY!r}")
    names = sorted(groups, key=_order)
    tasks = sorted(set.intersection(*(set(groups[name]) for name in names)))
    if not tasks:
        raise SimError("no scenario and seed is common to all policies of the run")
    rows = [[groups[name][task] for name in names] for task in tasks]
    strata = [task[:2] for task in tasks]
    lost_s = np.array([[each.time_lost_s for each in row] for row in rows], dtype=np.float64)
    impacts, never = (
        np.array([[getattr(each, name) for each in row] for row in rows], dtype=np.float64)
        for name in (RISK, "step_out_never")
    )
    lasted_s = np.array([[each.lasted_s for each in row] for row in rows], dtype=np.float64)
    free_s = [row[0].time_without_people_s or 0.0 for row in rows]
    points = tuple(
        Point(
            name,
            member_named(name),
            bootstrap_interval(lost_s[:, column], _rng(), strata=strata),
            bootstrap_interval(lasted_s[:, column], _rng(), over=lasted_s[:, 0], strata=strata),
            bootstrap_interval(impacts[:, column], _rng(), strata=strata),
            bootstrap_interval(never[:, column], _rng(), strata=strata),
        )
        for column, name in enumerate(names)
    )
    attentive = np.array([row[0].attention == _ATTENTIVE for row in rows], dtype=np.float64)
    return Frontier(
        points,
        _worth(points, _Means.of(lost_s, impacts, attentive, strata), len(rows)),
        float(np.mean(free_s)),
        len(rows),
        len(set(strata)),
    )


def _by_policy(records: Iterable[EpisodeRecord]) -> dict[str, dict[_Task, EpisodeRecord]]:
    groups: dict[str, dict[_Task, EpisodeRecord]] = {}
    for record in records:
        if record.error or record.time_lost_s is None or getattr(record, RISK) is None:
            continue
        task = (record.scenario, record.scenario_version, record.seed)
        episodes = groups.setdefault(record.policy, {})
        if task in episodes:
            raise SimError(
                f"the frontier compares policies alone, but the policy {record.policy!r} has "
                f"scenario {record.scenario!r}, seed {record.seed} twice: give one planner, one "
                "set of sensors and no fault"
            )
        episodes[task] = record
    return groups


def _order(name: str) -> tuple[int, str]:
    """Return the order of policies: today's AMR, the family in its order, then others by name."""
    members = [TODAY, *(each.name for each in family(memory=True))]
    return (members.index(name) if name in members else len(members)), name


@dataclass(frozen=True, slots=True)
class _Means:
    """Means of P policies: of all episodes in the first row, then of B resamples.

    Attributes:
        lost_s: (1 + B, P) time lost.
        impacts: (1 + B, P) step-out impacts.
        attentive_s: (1 + B, P) time lost in scenarios with attentive people; NaN without any.
    """

    lost_s: FloatArray
    impacts: FloatArray
    attentive_s: FloatArray

    @classmethod
    def of(
        cls,
        lost_s: FloatArray,
        impacts: FloatArray,
        attentive: FloatArray,
        strata: Sequence[tuple[str, int]],
    ) -> _Means:
        count = lost_s.shape[1]
        columns = np.hstack([lost_s, impacts, lost_s * attentive[:, None], attentive[:, None]])
        means = np.vstack([columns.mean(axis=0), resampled_means(columns, _rng(), strata=strata)])
        share = means[:, -1:]
        attentive_s = np.divide(
            means[:, 2 * count : -1],
            share,
            out=np.full((len(means), count), np.nan),
            where=share > 0,
        )
        return cls(means[:, :count], means[:, count : 2 * count], attentive_s)


def _worth(points: Sequence[Point], means: _Means, n: int) -> tuple[Worth, ...]:
    line, found = _without_awareness(points), []
    for column, point in enumerate(points):
        if point.member is None or point.member.kind == "blind":
            continue
        won = np.array([_won(means, row, line, column) for row in range(len(means.lost_s))])
        found.append(
            Worth(
                point.member, *(resampled_interval(float(each[0]), each[1:], n) for each in won.T)
            )
        )
    return tuple(found)


def _without_awareness(points: Sequence[Point]) -> list[int]:
    """Return the places of today's AMR and of the family without awareness."""
    return [
        column
        for column, point in enumerate(points)
        if column == 0 or (point.member is not None and point.member.kind == "blind")
    ]


def _won(means: _Means, row: int, line: Sequence[int], column: int) -> tuple[float, float, float]:
    """Return what a policy wins: seconds at equal risk, of attentive people too, and impacts."""
    lost_s, impacts, attentive_s = means.lost_s[row], means.impacts[row], means.attentive_s[row]
    on_line = _efficient(line, lost_s, impacts)
    own_s, own_impacts = lost_s[column], impacts[column]
    at_risk = on_line[::-1]  # impacts ascend
    seconds = attentive = avoided = np.nan
    if own_impacts <= impacts[at_risk[-1]]:
        seconds = np.interp(own_impacts, impacts[at_risk], lost_s[at_risk]) - own_s
        attentive = (
            np.interp(own_impacts, impacts[at_risk], attentive_s[at_risk]) - attentive_s[column]
        )
    if own_s <= lost_s[on_line[-1]]:
        avoided = np.interp(own_s, lost_s[on_line], impacts[on_line]) - own_impacts
    return float(seconds), float(attentive), float(avoided)


def _efficient(line: Sequence[int], lost_s: FloatArray, impacts: FloatArray) -> list[int]:
    """Return the policies of the line, by time lost, of which none is slower and as risky."""
    found: list[int] = []
    for column in sorted(line, key=lambda each: (lost_s[each], impacts[each])):
        if not found or impacts[column] < impacts[found[-1]]:
            found.append(column)
    return found


def _rng() -> np.random.Generator:
    return np.random.default_rng(0)
