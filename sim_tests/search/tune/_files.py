"""Which parameters decided how good a trial was.

The files that a tuning leaves behind, and its table.
"""

from __future__ import annotations

import csv
import json
import math
import warnings
from pathlib import Path
from typing import Any

from awarenav.files import csv_number

from ...scenario import ScenarioTemplate
from ...study.measures import Interval
from ...study.runs import policy_text
from .._optuna import optuna
from .._trials import NOTES
from ._evaluation import OBJECTIVES
from ._tune import Candidate, Tuning


def importances(study: optuna.Study) -> dict[str, dict[str, float]]:
    """Share of each parameter in being among the best tenth, by objective; they sum to 1.

    PED-ANOVA (Watanabe, Bansal and Hutter 2023). All are 0 where the trials do not differ in the
    objective, or are fewer than three.
    """
    done = [t for t in study.get_trials(deepcopy=False) if t.values is not None]
    names = sorted({name for trial in done for name in trial.params})
    return {objective: _one(study, row, names, done) for row, objective in enumerate(OBJECTIVES)}


def _one(
    study: optuna.Study, row: int, names: list[str], done: list[optuna.trial.FrozenTrial]
) -> dict[str, float]:
    nothing = dict.fromkeys(names, 0.0)
    if len(done) < 3 or len({trial.values[row] for trial in done}) < 2:
        return nothing
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = optuna.importance.get_param_importances(
            study,
            evaluator=optuna.importance.PedAnovaImportanceEvaluator(),
            target=lambda trial: trial.values[row],
        )
    known = {name: value for name, value in found.items() if math.isfinite(value)}
    return dict(sorted((nothing | known).items(), key=lambda each: -each[1]))


_LABELS = {"time_lost_s": "time lost", "violation_time_s": "time with a negative margin"}


def write_tuning(tuning: Tuning, folder: Path) -> None:
    """Write trials.csv, importances.json, chosen.json, chosen/*.yaml and pareto.png."""
    from ._picture import draw_tuning  # noqa: PLC0415 - tables need no matplotlib

    importance = importances(tuning.study)
    _write_trials(tuning, folder / "trials.csv")
    _write_json(folder / "importances.json", importance)
    base = tuning.anchors[0]
    _write_json(
        folder / "chosen.json",
        {
            "scenarios": _scenarios(tuning),
            "tuning_seeds": _ends(tuning.settings.tuning_seeds),
            "held_out_seeds": _ends(tuning.settings.held_out_seeds),
            "base": base.name,
            "base_on_front": not any(each.name == "beats_base" for each in tuning.chosen),
            "policies": [_figures(each, base) for each in (*tuning.anchors, *tuning.chosen)],
        },
    )
    for old in (folder / "chosen").glob("*.yaml"):  # of a shorter run of the same tuning
        old.unlink()
    for each in tuning.chosen:
        _write_text(
            folder / "chosen" / f"{each.name}.yaml",
            _header(tuning, each) + policy_text(each.policy),
        )
    draw_tuning(tuning, importance, folder / "pareto.png")


def table_lines(tuning: Tuning) -> list[str]:
    """Presets and chosen policies, on the tuning and on the held-out seeds, as lines of text."""
    lines = [
        f"{'':24s}{'tuning seeds':^52s}  {'held-out seeds':^52s}",
        f"{'policy':18s}{'trial':>6s}"
        + 2 * f"{'time lost (s)':>21s}{'violation (s)':>21s}{'contacts':>10s}  ",
    ]
    for each in (*tuning.anchors, *tuning.chosen):
        trial = "" if each.trial is None else str(each.trial)
        cells = f"{each.name:18s}{trial:>6s}"
        for found in (each.tuning, each.held_out):
            time_s, violation_s = (found.interval(name) for name in OBJECTIVES)
            cells += f"{time_s.text(2):>21s}{violation_s.text(3):>21s}{found.robot_contacts:10d}  "
        lines.append(cells.rstrip())
    return lines


def _write_trials(tuning: Tuning, path: Path) -> None:
    front = {trial.number for trial in tuning.front}
    names = list(tuning.space.ranges)
    notes = ("deficit_m", "robot_contacts", "reached")
    part = path.with_name(path.name + ".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["trial", "state", *OBJECTIVES, *notes, "on_front", *names])
        for trial in tuning.trials:
            writer.writerow(
                [
                    trial.number,
                    trial.state.name.lower(),
                    *map(csv_number, trial.values or [None, None]),
                    *(trial.user_attrs.get(NOTES, {}).get(note, "") for note in notes),
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
            "episodes": len(found.records),
            "robot_contacts": found.robot_contacts,
            "reached_goal": found.reached,
            "deficit_m": round(found.deficit_m, 6),
            **{key: _entry(found.interval(key)) for key in OBJECTIVES},
            "minus_base": {key: _entry(found.minus(other, key)) for key in OBJECTIVES},
        }
    return figures


def _entry(interval: Interval) -> dict[str, Any]:
    bounds = [round(interval.low, 6), round(interval.high, 6)] if interval.bounded else None
    return {"mean": round(interval.value, 6), "interval_95": bounds}


def _header(tuning: Tuning, candidate: Candidate) -> str:
    found, base, settings = candidate.held_out, tuning.anchors[0], tuning.settings
    lines = [
        f"{candidate.name.replace('_', ' ')}: trial {candidate.trial} of {len(tuning.trials)} in a "
        f"tuning of {settings.policy_name} ({settings.sampler}, seed {settings.seed}, perception "
        f"{settings.perception}).",
        f"On {len(found.records)} held-out episodes (seeds {_ends(settings.held_out_seeds)} in "
        f"{', '.join(_scenarios(tuning))}), means with 95 % intervals:",
    ]
    for key in OBJECTIVES:
        lines.append(
            f"  {_LABELS[key]} {found.interval(key).text(3)} s; minus that of {base.name}, paired: "
            f"{found.minus(base.held_out, key).text(3)} s"
        )
    lines.append(
        f"  contacts caused by the robot: {found.robot_contacts}; goals reached: {found.reached}; "
        f"deepest negative margin {found.deficit_m:.3f} m"
    )
    return "".join(f"# {line}\n" for line in lines)


def _scenarios(tuning: Tuning) -> list[str]:
    return [ScenarioTemplate.from_text(text).id for text in tuning.settings.scenarios]


def _ends(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def _write_json(path: Path, data: Any) -> None:
    _write_text(path, json.dumps(data, indent=1, ensure_ascii=False) + "\n")


def _write_text(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
