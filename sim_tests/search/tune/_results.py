"""The result files of a tuning, and its table."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from awarenav.errors import counted
from awarenav.files import csv_number, write_text

from ...actors.behaviour import DEFAULT_POPULATION
from ...study.measures import Interval
from ...study.runs import policy_text
from ...world.errors import SimError
from .._files import templates_of, write_csv
from .._optuna import optuna
from .._shared_study import NOTES
from ._evaluation import FIGURES, OBJECTIVE, RISK
from ._finalists import REASONS, Candidate
from ._plot import draw_tuning
from ._tune import Tuning
from ._verdict import verdict_text

# Words and unit of each figure.
_LABELS: Final = {
    OBJECTIVE: ("time lost", " s"),
    RISK: ("step-out impacts with unaware people per 1 000 crossings", ""),
}


def importances(study: optuna.Study) -> dict[str, dict[str, float]]:
    """Return the importance of each parameter, by figure; the importances of a figure sum to 1.

    The importance is a parameter's share in being among the best tenth, by PED-ANOVA (Watanabe,
    Bansal and Hutter 2023). All are 0 for fewer than three trials, and where the trials do not
    differ in the figure.
    """
    done = [t for t in study.get_trials(deepcopy=False) if t.values is not None]
    names = sorted({name for trial in done for name in trial.params})
    figures: dict[str, Callable[[optuna.trial.FrozenTrial], float]] = {
        OBJECTIVE: lambda trial: trial.values[0],
        RISK: lambda trial: float(trial.user_attrs[NOTES][RISK]),
    }
    return {name: _importance(study, target, names, done) for name, target in figures.items()}


def _importance(
    study: optuna.Study,
    target: Callable[[optuna.trial.FrozenTrial], float],
    names: list[str],
    done: list[optuna.trial.FrozenTrial],
) -> dict[str, float]:
    nothing = dict.fromkeys(names, 0.0)
    if len(done) < 3 or len({target(trial) for trial in done}) < 2:
        return nothing
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = optuna.importance.get_param_importances(
            study, evaluator=optuna.importance.PedAnovaImportanceEvaluator(), target=target
        )
    known = {name: value for name, value in found.items() if math.isfinite(value)}
    return dict(sorted((nothing | known).items(), key=lambda each: -each[1]))


def write_tuning(tuning: Tuning, folder: Path) -> None:
    """Write trials.csv, importances.json, chosen.json, chosen/*.yaml and tuning.png."""
    importance = importances(tuning.study)
    _write_trials(tuning, folder / "trials.csv")
    _write_json(folder / "importances.json", importance)
    base = tuning.base
    rows = (*tuning.anchors, *tuning.chosen)
    _write_json(
        folder / "chosen.json",
        {
            "scenarios": _scenarios(tuning),
            "hold_out_scenarios": list(tuning.settings.hold_out_scenarios),
            "tuning_seeds": _ends(tuning.settings.tuning_seeds),
            "held_out_seeds": _ends(tuning.settings.held_out_seeds),
            "base": base.name,
            "risk": {
                "tuning": round(tuning.risk, 6),
                "held_out": round(tuning.held_out_risk, 6),
            },
            "beats_base": None if tuning.winner is None else tuning.winner.trial,
            "verdict": verdict_text(tuning),
            "policies": [_figures(tuning, each) for each in rows],
        },
    )
    for earlier in (folder / "chosen").glob("*.yaml"):  # of this tuning with fewer trials
        earlier.unlink()
    for each in rows:
        for name in (name for name in each.names if name in REASONS):
            write_text(
                folder / "chosen" / f"{name}.yaml",
                _header(tuning, each, name) + policy_text(each.policy),
                SimError,
            )
    draw_tuning(tuning, importance, folder / "tuning.png")


def table_lines(tuning: Tuning) -> list[str]:
    """Return the presets and chosen policies on both sets of seeds, as lines of text.

    Equal policies have one row.
    """
    rows = (*tuning.anchors, *tuning.chosen)
    names = [", ".join(each.names) for each in rows]
    width = max(18, *map(len, names)) + 1
    asks = f"{'requests':>10s}" if tuning.asks else ""
    heads = f"{'time lost (s)':>21s}{'step-out':>21s}{'contacts':>10s}{asks}"
    lines = [
        " " * (width + 5)
        + f"{'tuning seeds':^{len(heads)}s}  {'held-out seeds':^{len(heads)}s}".rstrip(),
        f"{'policy':{width}s}{'trial':>5s}" + (2 * f"{heads}  ").rstrip(),
    ]
    for name, each in zip(names, rows, strict=True):
        trial = "" if each.trial is None else str(each.trial)
        cells = f"{name:{width}s}{trial:>5s}"
        for evaluation in (each.tuning, each.held_out):
            time_s, risk = (evaluation.interval(name) for name in FIGURES)
            cells += f"{time_s.text(2):>21s}{risk.text(2):>21s}{evaluation.moving_contacts:10d}"
            cells += f"{evaluation.requests:10.2f}  " if asks else "  "
        lines.append(cells.rstrip())
    lines.append(
        f"At most {tuning.risk:.2f} step-out impacts with unaware people per 1 000 crossings on "
        f"tuning seeds, {tuning.held_out_risk:.2f} on held-out seeds."
    )
    if tuning.settings.requests is not None:
        lines.append(f"At most {tuning.settings.requests:g} requests for attention per crossing.")
    trials = [trial.user_attrs.get(NOTES, {}) for trial in tuning.trials]
    early = [notes for notes in trials if notes.get("dropped")]
    if early:
        episodes = sum(notes["episodes"] for notes in early)
        lines.append(
            f"{len(early)} of {counted(len(trials), 'trial')} ended early, after "
            f"{counted(episodes, 'episode')} instead of {len(early) * len(rows[0].tuning.records)}."
        )
    return lines


def _write_trials(tuning: Tuning, path: Path) -> None:
    rank = {trial.number: place for place, trial in enumerate(tuning.ranked, start=1)}
    names = list(tuning.space.ranges)
    notes = ("moving_contacts", "requests", "reached", "episodes", "dropped")
    write_csv(
        path,
        ["trial", "state", *FIGURES, *notes, "rank", *names],
        (
            [
                trial.number,
                trial.state.name.lower(),
                *map(csv_number, trial.values or [None]),
                csv_number(trial.user_attrs.get(NOTES, {}).get(RISK)),
                *(trial.user_attrs.get(NOTES, {}).get(note, "") for note in notes),
                rank.get(trial.number, ""),
                *(repr(trial.params[name]) for name in names),
            ]
            for trial in tuning.trials
        ),
    )


def _figures(tuning: Tuning, candidate: Candidate) -> dict[str, Any]:
    """Return the figures of a policy on both sets of seeds, for JSON."""
    base, elsewhere = tuning.base, tuning.settings.hold_out_scenarios
    name, *also = candidate.names
    figures: dict[str, Any] = {"name": name, "also": also, "trial": candidate.trial}
    parts = [
        ("tuning", candidate.tuning, base.tuning),
        ("held_out", candidate.held_out, base.held_out),
    ]
    if elsewhere:
        own, other = (each.held_out.within(elsewhere) for each in (candidate, base))
        parts.append(("held_out_scenarios", own, other))
    for name, evaluation, other in parts:
        figures[name] = {
            "episodes": len(evaluation.records),
            "moving_contacts": evaluation.moving_contacts,
            "requests_per_crossing": round(evaluation.requests, 6),
            "reached_goal": evaluation.reached,
            **{key: _interval_data(evaluation.interval(key)) for key in FIGURES},
            "minus_base": {key: _interval_data(evaluation.minus(other, key)) for key in FIGURES},
        }
    return figures


def _interval_data(interval: Interval) -> dict[str, Any]:
    bounds = [round(interval.low, 6), round(interval.high, 6)] if interval.bounded else None
    return {"mean": round(interval.value, 6), "interval_95": bounds}


def _header(tuning: Tuning, candidate: Candidate, name: str) -> str:
    """Return the comment at the top of a policy file."""
    held_out, base, settings = candidate.held_out, tuning.base, tuning.settings
    which = (
        f"the policy {candidate.name}"
        if candidate.trial is None
        else f"trial {candidate.trial} of {len(tuning.trials)}"
    )
    lines = [
        f"{name.replace('_', ' ')}: {which} in a "
        f"tuning of {settings.policy_name} ({settings.sampler}, seed {settings.seed}, perception "
        f"{settings.perception}{_others(tuning)}).",
        f"On {counted(len(held_out.records), 'held-out episode')} (seeds "
        f"{_ends(settings.held_out_seeds)} in {', '.join(_scenarios(tuning))}), means with 95 % "
        "intervals:",
    ]
    for key, (label, unit) in _LABELS.items():
        lines.append(
            f"  {label} {held_out.interval(key).text(3)}{unit}; minus that of {base.name}, "
            f"paired: {held_out.minus(base.held_out, key).text(3)}{unit}"
        )
    lines.append(
        f"  contacts with the moving robot: {held_out.moving_contacts}; goals reached: "
        f"{held_out.reached}; requests for attention per crossing: {held_out.requests:.2f}"
    )
    return "".join(f"# {line}\n" for line in lines)


def _others(tuning: Tuning) -> str:
    """Return robots, populations and hearing that are not the default."""
    medians = [template.median() for template in tuning.settings.templates]
    robots = {each.robot_model.name for each in medians if each.robot_model is not None}
    populations = {each.population for each in medians} - {DEFAULT_POPULATION}
    words = [f"robot {name}" for name in sorted(robots)]
    words += [f"{name} people" for name in sorted(populations)]
    words += sorted({text for each in medians if (text := each.hearing.changes_text)})
    return "".join(f", {each}" for each in words)


def _scenarios(tuning: Tuning) -> list[str]:
    return [template.id for template in templates_of(tuning.settings.scenarios)]


def _ends(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def _write_json(path: Path, data: Any) -> None:
    write_text(path, json.dumps(data, indent=1, ensure_ascii=False) + "\n", SimError)
