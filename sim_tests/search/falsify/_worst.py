"""The worst that a falsification found, as scenarios to play again."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from ...crossing import CrossingResult
from ...scenario import Scenario, ScenarioTemplate
from ...study.measures import EpisodeRecord
from ...study.runs import observed_episode
from ...world.errors import SimError
from .._search import Range
from ._falsify import Falsification, FalsifySettings, job_of, scenario_text
from ._hunt import CONTACT, NOTHING, Find
from ._no_floor import PLANNER

# Cases of one scenario are told apart by so much: the largest difference of a lever, as a share of
# its range.
_APART: Final = 0.2
_POLICY_FILE: Final = "policy.yaml"


@dataclass(frozen=True, slots=True, eq=False)
class WorstCase:
    """One of the worst.

    Attributes:
        find: as the search met it.
        path: its scenario's file.
        scenario: as read again from the file.
        result: of the crossing played from the file.
        record: measured in it.
    """

    find: Find
    path: Path
    scenario: Scenario
    result: CrossingResult
    record: EpisodeRecord

    @property
    def replays(self) -> bool:
        """Whether the file gives the margin and the contacts that the search met."""
        notes = self.find.notes
        return (self.record.min_margin_m, self.record.robot_contacts) == (
            notes["min_margin_m"],
            notes["robot_contacts"],
        )


def worst_finds(
    finds: Sequence[Find], ranges: Mapping[str, Mapping[str, Range]], most: int
) -> list[Find]:
    """The lowest scores, one for each kind of case: others of its scenario differ in a lever.

    Args:
        finds: to choose from.
        ranges: of each scenario's levers.
        most: how many.
    """
    kept: list[Find] = []
    for find in sorted(finds, key=lambda each: each.score):
        if len(kept) == most or find.score >= NOTHING:
            break
        if all(
            other.scenario != find.scenario
            or _difference(find, other, ranges[find.scenario]) >= _APART
            for other in kept
        ):
            kept.append(find)
    return kept


def write_worst(falsification: Falsification, folder: Path, most: int) -> list[WorstCase]:
    """Write ``worst_001.yaml`` and so on beside ``policy.yaml``, and play each from its file."""
    settings = falsification.settings
    _write(folder / _POLICY_FILE, settings.policy)
    for old in folder.glob("worst_*.yaml"):
        old.unlink()
    cases = []
    ranges = {name: space.ranges for name, space in falsification.spaces.items()}
    for number, find in enumerate(worst_finds(falsification.finds, ranges, most), start=1):
        scenario = falsification.spaces[find.scenario].scenario(find.parameters)
        name = f"{find.scenario}_worst_{number:03d}"
        scenario = scenario.model_copy(
            update={"name": name, "description": _description(scenario, find, settings)}
        )
        path = folder / f"worst_{number:03d}.yaml"
        _write(path, _header(find, settings, path.name) + scenario_text(scenario))
        again = ScenarioTemplate.from_yaml(path).median()
        result, record = observed_episode(job_of(settings, again))
        cases.append(WorstCase(find, path, again, result, record))
    return cases


def write_episodes(falsification: Falsification, path: Path) -> None:
    """Write every episode of the search as CSV; the levers are JSON in the last column."""
    notes = ("min_margin_m", "min_separation_m", "contact_by", "robot_contacts", "error")
    part = path.with_name(path.name + ".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["scenario", "round", "trial", "score", *notes, "levers"])
        for find in falsification.finds:
            cells = ("" if find.notes.get(note) is None else find.notes[note] for note in notes)
            levers = json.dumps(find.parameters, sort_keys=True)
            writer.writerow(
                [find.scenario, find.round, find.trial, f"{find.score:.6f}", *cells, levers]
            )
    part.replace(path)


def write_summary(
    falsification: Falsification, cases: Sequence[WorstCase], path: Path
) -> dict[str, Any]:
    """Write the figures of a falsification as JSON, and return them."""
    scenarios = {}
    for name in falsification.spaces:
        scores = [find.score for find in falsification.finds if find.scenario == name]
        touched = [row for row, each in enumerate(scores) if each <= CONTACT]
        scenarios[name] = {
            "episodes": len(scores),
            "robot_contacts": len(touched),
            "first_contact_at": touched[0] + 1 if touched else None,
            "lowest_score": round(min(scores), 6),
        }
    summary: dict[str, Any] = {
        "policy": falsification.settings.policy_name,
        "unsafe_no_floor": falsification.settings.unsafe_no_floor,
        "episodes": len(falsification.finds),
        "robot_contacts": falsification.contacts,
        "without_result": falsification.errors,
        "scenarios": scenarios,
        "worst": [
            {
                "file": case.path.name,
                "scenario": case.find.scenario,
                "min_margin_m": case.record.min_margin_m,
                "min_separation_m": case.record.min_separation_m,
                "contact_by": case.record.contact_by,
                "robot_contacts": case.record.robot_contacts,
                "speed_at_min_separation_mps": case.record.speed_at_min_separation_mps,
                "awareness": case.record.awareness,
                "replays": case.replays,
            }
            for case in cases
        ],
    }
    _write(path, json.dumps(summary, indent=1, ensure_ascii=False) + "\n")
    return summary


def _difference(first: Find, second: Find, ranges: Mapping[str, Range]) -> float:
    shares = [
        (first.parameters[name] - second.parameters[name]) / (each.high - each.low)
        for name, each in ranges.items()
    ]
    return float(np.max(np.abs(shares)))


def _description(scenario: Scenario, find: Find, settings: FalsifySettings) -> str:
    start = scenario.description.rstrip(".")
    return f"{start}; as a search of {settings.policy_name} made it worst."


def _header(find: Find, settings: FalsifySettings, file: str) -> str:
    margin = find.notes["min_margin_m"]
    separation = find.notes["min_separation_m"]
    planner = PLANNER if settings.unsafe_no_floor else settings.planner
    lines = [
        f"Found by falsification of {settings.policy_name} in {find.scenario}, round {find.round}, "
        f"trial {find.trial}.",
        f"Smallest separation margin at a moving robot {_metres(margin)}, smallest separation "
        f"{_metres(separation)}, contacts caused by the robot {find.notes['robot_contacts']}.",
        f"awarenav crossings --scenario {file} --policy {_POLICY_FILE} --perception "
        f"{settings.perception}" + (f" --planner {planner}" if planner else "") + " "
        f"--seed {settings.seed} --episodes 1 --out replay",
    ]
    if settings.unsafe_no_floor:
        lines.insert(0, "UNSAFE: the floor was taken away on purpose, in the simulation only.")
    return "".join(f"# {line}\n" for line in lines)


def _metres(value: object) -> str:
    return f"{value:.3f} m" if isinstance(value, float | int) else "none"


def _write(path: Path, text: str) -> None:
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as cause:
        raise SimError(f"cannot write {path}: {cause.strerror or cause}") from cause
