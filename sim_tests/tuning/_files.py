"""The files that a tuning leaves behind, and its table."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any, Final

import numpy as np

from .._tables import number_text
from ._evaluation import Evaluation
from ._importance import OBJECTIVES, importances
from ._interval import bootstrap_interval
from ._judge import policy_text
from ._tune import Candidate, Tuning

_DRAWS_FROM: Final = 0  # the intervals' seed: figures of the same episodes are the same


def write_tuning(tuning: Tuning, folder: Path) -> None:
    """Write trials.csv, importances.json, chosen.json, chosen/*.yaml and pareto.png."""
    from ._picture import draw_tuning  # noqa: PLC0415 - tables need no matplotlib

    importance = importances(tuning.study)
    _write_trials(tuning, folder / "trials.csv")
    _write_json(folder / "importances.json", importance)
    base = tuning.anchors[0]
    policies = [(each, _figures(each, base)) for each in (*tuning.anchors, *tuning.chosen)]
    _write_json(
        folder / "chosen.json",
        {
            "scenarios": [_name(text) for text in tuning.settings.scenarios],
            "tuning_seeds": _ends(tuning.settings.tuning_seeds),
            "held_out_seeds": _ends(tuning.settings.held_out_seeds),
            "base": base.name,
            "base_on_front": not any(each.name == "beats_base" for each in tuning.chosen),
            "policies": [figures for _, figures in policies],
        },
    )
    for candidate, figures in policies[len(tuning.anchors) :]:
        _write_text(
            folder / "chosen" / f"{candidate.name}.yaml",
            _header(tuning, candidate, figures) + policy_text(candidate.policy),
        )
    draw_tuning(tuning, importance, folder / "pareto.png")


def table_lines(tuning: Tuning) -> list[str]:
    """Presets and chosen policies, on the tuning and on the held-out seeds, as lines of text."""
    head = f"{'policy':18s}{'trial':>6s}" + "".join(
        f"  {name:>22s}{'violation':>20s}{'contacts':>9s}" for name in ("time lost", "held-out")
    )
    lines = [head]
    for each in (*tuning.anchors, *tuning.chosen):
        cells = ""
        for found in (each.tuning, each.held_out):
            low, high = _interval(found.time_lost_s)
            least, most = _interval(found.violation_time_s)
            time_s, violation_s = found.objectives
            cells += f"  {time_s:6.2f} [{low:5.2f}, {high:5.2f}] s"
            cells += f"{violation_s:7.3f} [{least:.3f}, {most:.3f}] s"[:22].rjust(22)
            cells += f"{found.robot_contacts:7d}"
        trial = "" if each.trial is None else str(each.trial)
        lines.append(f"{each.name:18s}{trial:>6s}{cells}")
    return lines


def _write_trials(tuning: Tuning, path: Path) -> None:
    front = {trial.number for trial in tuning.front}
    names = list(tuning.space.ranges)
    part = path.with_name(path.name + ".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        notes = ("deficit_m", "robot_contacts", "reached")
        writer.writerow(["trial", "state", *OBJECTIVES, *notes, "on_front", *names])
        for trial in tuning.trials:
            values = trial.values or [None, None]
            writer.writerow(
                [
                    trial.number,
                    trial.state.name.lower(),
                    *map(number_text, values),
                    *(trial.user_attrs.get(note, "") for note in notes),
                    str(trial.number in front).lower(),
                    *(repr(trial.params[name]) for name in names),
                ]
            )
    part.replace(path)


def _figures(candidate: Candidate, base: Candidate) -> dict[str, Any]:
    figures: dict[str, Any] = {"name": candidate.name, "trial": candidate.trial}
    for name, found, other in (
        ("tuning", candidate.tuning, base.tuning),
        ("held_out", candidate.held_out, base.held_out),
    ):
        figures[name] = {
            "episodes": len(found.time_lost_s),
            "robot_contacts": found.robot_contacts,
            "reached_goal": found.reached,
            **_means(found),
            "minus_base": {
                key: _mean(getattr(found, key) - getattr(other, key)) for key in OBJECTIVES
            },
        }
    return figures


def _means(found: Evaluation) -> dict[str, Any]:
    return {key: _mean(getattr(found, key)) for key in (*OBJECTIVES, "deficit_m")}


def _mean(values: Any) -> dict[str, Any]:
    low, high = _interval(values)
    return {"mean": round(float(values.mean()), 6), "interval_95": [round(low, 6), round(high, 6)]}


def _interval(values: Any) -> tuple[float, float]:
    return bootstrap_interval(values, np.random.default_rng(_DRAWS_FROM))


def _header(tuning: Tuning, candidate: Candidate, figures: dict[str, Any]) -> str:
    held, settings = figures["held_out"], tuning.settings
    lines = [
        f"{candidate.name.replace('_', ' ')}: trial {candidate.trial} of a tuning of "
        f"{settings.policy_name} with {len(tuning.trials)} trials ({settings.sampler}, seed "
        f"{settings.seed}, perception {settings.perception}).",
        f"On {held['episodes']} held-out episodes (seeds {_ends(settings.held_out_seeds)} in "
        f"{', '.join(_name(text) for text in settings.scenarios)}), with 95 % intervals:",
    ]
    for key, label, unit in (
        ("time_lost_s", "time lost", "s"),
        ("violation_time_s", "negative margin", "s"),
        ("deficit_m", "deepest deficit", "m"),
    ):
        entry = held[key]
        low, high = entry["interval_95"]
        line = f"  {label}: {entry['mean']:.3f} {unit} [{low:.3f}, {high:.3f}]"
        if key in held["minus_base"]:
            versus = held["minus_base"][key]
            low, high = versus["interval_95"]
            line += (
                f"; less that of {settings.policy_name}, paired: {versus['mean']:+.3f} "
                f"[{low:+.3f}, {high:+.3f}]"
            )
        lines.append(line)
    lines.append(
        f"  contacts caused by the robot: {held['robot_contacts']}; goals reached: "
        f"{held['reached_goal']}"
    )
    return "".join(f"# {line}\n" for line in lines)


def _name(scenario: str) -> str:
    from .._scenario_template import ScenarioTemplate  # noqa: PLC0415 - brings the simulator

    return ScenarioTemplate.from_text(scenario).id


def _ends(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def _write_json(path: Path, data: Any) -> None:
    _write_text(path, json.dumps(data, indent=1, ensure_ascii=False) + "\n")


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
