"""The worst cases of a falsification, written as scenarios that can be run again."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from awarenav.files import write_text

from ...crossing import CrossingResult
from ...crossing.eyes import Perception
from ...scenario import Scenario, ScenarioTemplate
from ...study.measures import EpisodeRecord
from ...study.runs import observed_episode
from ...world.errors import SimError
from .._files import write_csv
from .._optimizer import Range
from ._falsify import Falsification, FalsifySettings, job_of, scenario_text
from ._no_floor_planner import PLANNER
from ._restarted_search import CONTACT_SCORE, NO_MARGIN_SCORE, EvaluatedTrial

# Least difference between two cases of one scenario, in any parameter, as a share of its range.
_LEAST_DIFFERENCE: Final = 0.2
#: The falsified policy, in the folder of the worst cases.
POLICY_FILE: Final = "policy.yaml"


@dataclass(frozen=True, slots=True, eq=False)
class WorstCase:
    """One of the worst cases.

    Attributes:
        trial: the trial of the search.
        path: the file of its scenario.
        scenario: the scenario, as read from the file.
        result: the crossing, run from the file.
        record: the record of that crossing.
    """

    trial: EvaluatedTrial
    path: Path
    scenario: Scenario
    result: CrossingResult
    record: EpisodeRecord

    @property
    def replays(self) -> bool:
        """True if the file gives the margin and the contacts of the trial."""
        notes = self.trial.notes
        return (self.record.min_margin_unaware_m, self.record.moving_contacts) == (
            notes["min_margin_unaware_m"],
            notes["moving_contacts"],
        )


def worst_trials(
    trials: Sequence[EvaluatedTrial], ranges: Mapping[str, Mapping[str, Range]], most: int
) -> list[EvaluatedTrial]:
    """Return the trials with the lowest scores, which differ in each scenario.

    Args:
        trials: trials to choose from.
        ranges: ranges of the parameters, by scenario.
        most: number of trials to return at most.
    """
    worst: list[EvaluatedTrial] = []
    for trial in sorted(trials, key=lambda each: each.score):
        if len(worst) == most or trial.score >= NO_MARGIN_SCORE:
            break
        if all(
            other.scenario != trial.scenario
            or _difference(trial, other, ranges[trial.scenario]) >= _LEAST_DIFFERENCE
            for other in worst
        ):
            worst.append(trial)
    return worst


def write_worst(falsification: Falsification, folder: Path, most: int) -> list[WorstCase]:
    """Write ``worst_001.yaml`` and so on beside ``policy.yaml``, and run each from its file."""
    settings = falsification.settings
    write_text(folder / POLICY_FILE, settings.policy, SimError)
    for old in folder.glob("worst_*.yaml"):
        old.unlink()
    cases = []
    ranges = {name: space.ranges for name, space in falsification.spaces.items()}
    for number, trial in enumerate(worst_trials(falsification.trials, ranges, most), start=1):
        scenario = falsification.spaces[trial.scenario].scenario(trial.parameters)
        name = f"{trial.scenario}_worst_{number:03d}"
        scenario = scenario.model_copy(
            update={"name": name, "description": _description(scenario, settings)}
        )
        path = folder / f"worst_{number:03d}.yaml"
        text = _header(trial, settings, path.name) + scenario_text(scenario)
        write_text(path, text, SimError)
        written = ScenarioTemplate.from_yaml(path).median()
        result, record = observed_episode(job_of(settings, written))
        cases.append(WorstCase(trial, path, written, result, record))
    return cases


def write_episodes(falsification: Falsification, path: Path) -> None:
    """Write every episode of the search as CSV; the last column has the parameters as JSON."""
    notes = (
        *("min_margin_unaware_m", "min_separation_m", "contact_by"),
        *("moving_contacts", "moving_contacts_unaware", "moving_contact_mps", "error"),
    )
    write_csv(
        path,
        ["scenario", "round", "trial", "score", *notes, "levers"],
        (
            [
                trial.scenario,
                trial.round,
                trial.trial,
                f"{trial.score:.6f}",
                *("" if trial.notes.get(note) is None else trial.notes[note] for note in notes),
                json.dumps(trial.parameters, sort_keys=True),
            ]
            for trial in falsification.trials
        ),
    )


def write_summary(
    falsification: Falsification,
    cases: Sequence[WorstCase],
    path: Path,
    *,
    verdict: str,
    against: Mapping[str, EpisodeRecord],
) -> dict[str, Any]:
    """Write the figures of a falsification as JSON, and return them.

    Args:
        falsification: the finished search.
        cases: its worst cases.
        path: the file.
        verdict: the verdict in sentences.
        against: records of the worst cases with another policy, by the name of the file.
    """
    scenarios = {}
    for name in falsification.spaces:
        scores = [trial.score for trial in falsification.trials if trial.scenario == name]
        contacts = [row for row, each in enumerate(scores) if each <= CONTACT_SCORE]
        scenarios[name] = {
            "episodes": len(scores),
            "contacts": len(contacts),
            "first_contact_at": contacts[0] + 1 if contacts else None,
            "lowest_score": round(min(scores), 6),
        }
    summary: dict[str, Any] = {
        "policy": falsification.settings.policy_name,
        "unsafe_no_floor": falsification.settings.unsafe_no_floor,
        "episodes": len(falsification.trials),
        "contacts": falsification.contacts,
        "contact_mps": round(falsification.contact_mps, 6),
        "aware_contacts": falsification.aware_contacts,
        "aware_contact_mps": round(falsification.aware_contact_mps, 6),
        "without_result": falsification.errors,
        "verdict": verdict,
        "scenarios": scenarios,
        "worst": [
            {
                "file": case.path.name,
                "scenario": case.trial.scenario,
                "min_margin_unaware_m": case.record.min_margin_unaware_m,
                "min_separation_m": case.record.min_separation_m,
                "contact_by": case.record.contact_by,
                "moving_contacts": case.record.moving_contacts,
                "moving_contacts_unaware": case.record.moving_contacts_unaware,
                "speed_at_min_separation_mps": case.record.speed_at_min_separation_mps,
                "awareness": case.record.awareness,
                "replays": case.replays,
                "against": _figures_against(against.get(case.path.name)),
            }
            for case in cases
        ],
    }
    write_text(path, json.dumps(summary, indent=1, ensure_ascii=False) + "\n", SimError)
    return summary


def _figures_against(record: EpisodeRecord | None) -> dict[str, Any] | None:
    """Return the figures of a worst case with another policy; None without one."""
    if record is None:
        return None
    names = ("policy", "min_margin_unaware_m", "min_separation_m", "moving_contacts", "error")
    return {name: getattr(record, name) for name in names}


def _difference(
    first: EvaluatedTrial, second: EvaluatedTrial, ranges: Mapping[str, Range]
) -> float:
    """Return the largest difference in a parameter, as a share of its range."""
    shares = [
        (first.parameters[name] - second.parameters[name]) / (each.high - each.low)
        for name, each in ranges.items()
    ]
    return float(np.max(np.abs(shares)))


def _description(scenario: Scenario, settings: FalsifySettings) -> str:
    start = scenario.description.rstrip(".")
    return f"{start}; as a search of {settings.policy_name} made it worst."


def _header(trial: EvaluatedTrial, settings: FalsifySettings, file: str) -> str:
    margin = trial.notes["min_margin_unaware_m"]
    separation = trial.notes["min_separation_m"]
    planner = PLANNER if settings.unsafe_no_floor else settings.planner
    lines = [
        f"Found by falsification of {settings.policy_name} in {trial.scenario}, "
        f"round {trial.round}, trial {trial.trial}.",
        f"Smallest margin of unaware people {_metres(margin)}, smallest separation "
        f"{_metres(separation)}, contacts with the moving robot {trial.notes['moving_contacts']}.",
        f"awarenav crossings --scenario {file} --policy {POLICY_FILE} "
        f"{Perception.named(settings.perception).options}"
        + (f" --planner {planner}" if planner else "")
        + " "
        f"--seed {settings.seed} --episodes 1 --out replay",
    ]
    if settings.unsafe_no_floor:
        lines.insert(0, "UNSAFE: the floor was taken away on purpose, in the simulation only.")
    return "".join(f"# {line}\n" for line in lines)


def _metres(value: object) -> str:
    return f"{value:.3f} m" if isinstance(value, float | int) else "none"
