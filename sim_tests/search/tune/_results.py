"""The results of a tuning: its command, files, plot, table, verdict and next command."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from awarenav.cli import styled, table_text
from awarenav.errors import counted
from awarenav.figures import new_figure, save_figure, scale_by_roots
from awarenav.files import csv_number, write_csv, write_text

from ...actors.behaviour import DEFAULT_POPULATION
from ...conditions import Experiment
from ...scenario import Scenario
from ...study.measures import Interval
from ...study.runs import policy_text
from ...world.errors import SimError
from .._settings import command_text, common_settings, episode_words, print_results, write_json
from .._study import importances
from ._evaluation import BEATS_BASE, FIGURES, OBJECTIVE, REASONS, RISK, RISK_WORDS, Candidate
from ._policy_space import read_ranges, shipped_ranges
from ._tune import TuneSettings, Tuning, held_out_scenarios, tune
from ._verdict import is_undecided, verdict_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Words and unit of each figure.
_LABELS: Final = {OBJECTIVE: ("time lost", " s"), RISK: (RISK_WORDS, "")}
_TRIAL: Final = "#9aa3ad"
_WITHIN: Final = "#1f5fa8"
_CONTACT: Final = "#b3261e"
_ANCHOR: Final = "#d9822b"
_CHOSEN: Final = "#2e7d4f"
_BARS: Final = 8
_MARKERS: Final = ("D", "s", "^", "v", "P", "*")
_WORDS: Final = {"time_lost_s": "the time lost", RISK: "the step-out impacts"}


def run_tune(
    *,
    experiment: Experiment,
    ranges: Path | None,
    workers: int,
    out: Path,
    resume: bool,
    overwrite: bool,
    as_json: bool,
    **fields: Any,
) -> int:
    """Run the command, whose options these are, and return its exit status.

    The other options are fields of :class:`TuneSettings`, by their names.
    """
    common = common_settings(experiment)
    scenarios = [Scenario.from_text(text) for text in common["scenarios"]]
    searched = shipped_ranges() if ranges is None else read_ranges(ranges)
    settings = TuneSettings(
        **common,
        **fields,
        ranges={key: each.model_dump(mode="json") for key, each in searched.items()},
        hold_out_scenarios=held_out_scenarios(scenarios),
    )
    given = {
        "--policy": experiment.one("policy"),
        "--ranges": ranges,
        "--workers": workers,
        "--out": out,
    }

    def report(tuning: Tuning) -> None:
        write_tuning(tuning, out)
        following = _next_command(tuning, experiment, given)
        table, verdict = table_lines(tuning), verdict_text(tuning)
        print_results(out / "chosen.json", table, verdict, following, as_json=as_json)

    tune(settings, out, workers=workers, resume=resume, overwrite=overwrite, report=report)
    return 0


def _next_command(tuning: Tuning, experiment: Experiment, given: Mapping[str, Any]) -> str:
    """Return the next command: falsify the winner, or go on with more seeds or more trials."""
    settings, out = tuning.settings, given["--out"]
    if tuning.winner is not None:
        return command_text(
            *("falsify", "--policy", out / "chosen" / f"{BEATS_BASE}.yaml"),
            *("--against", given["--policy"], *episode_words(experiment)),
            *("--workers", given["--workers"], "--out", out / "falsify"),
        )
    more_seeds = is_undecided(tuning)
    words = ["tune", "--policy", given["--policy"], *episode_words(experiment)]
    for name, value in (
        ("--ranges", given["--ranges"]),
        ("--risk", settings.risk),
        ("--requests", settings.requests),
        ("--trials", settings.trials * (1 if more_seeds else 2)),
        ("--episodes", settings.episodes),
        ("--held-out", settings.held_out * (2 if more_seeds else 1)),
    ):
        if value is not None:
            words += [name, value]
    return command_text(
        *words,
        *("--generation", settings.generation, "--sampler", settings.sampler),
        *("--seed", settings.seed, "--workers", given["--workers"], "--out", out, "--resume"),
    )


def write_tuning(tuning: Tuning, folder: Path) -> None:
    """Write trials.csv, importances.json, chosen.json, chosen/*.yaml and tuning.png."""
    done = [trial for trial in tuning.trials if trial.outcome.value is not None]
    points = [trial.parameters for trial in done]
    times_s = [float(trial.outcome.value or 0.0) for trial in done]
    risks = [float(trial.outcome.notes[RISK]) for trial in done]
    importance = {
        name: importances(points, values, tuning.ranges)
        for name, values in zip(FIGURES, (times_s, risks), strict=True)
    }
    _write_trials(tuning, folder / "trials.csv")
    write_json(folder / "importances.json", importance)
    base = tuning.base
    rows = (*tuning.anchors, *tuning.chosen)
    write_json(
        folder / "chosen.json",
        {
            "scenarios": _scenarios(tuning),
            "hold_out_scenarios": list(tuning.settings.hold_out_scenarios),
            "tuning_seeds": _ends(tuning.settings.tuning_seeds),
            "held_out_seeds": _ends(tuning.settings.held_out_seeds),
            "base": base.name,
            "risk": {"tuning": round(tuning.risk, 6), "held_out": round(tuning.held_out_risk, 6)},
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
    header = ["policy", "trial", "time lost (s)", "step-out", "contacts"]
    header += ["requests"] if tuning.asks else []
    lines = []
    for title, evaluations in (
        ("tuning seeds", [each.tuning for each in rows]),
        ("held-out seeds", [each.held_out for each in rows]),
    ):
        cells = []
        for name, each, evaluation in zip(names, rows, evaluations, strict=True):
            trial = "" if each.trial is None else str(each.trial)
            figures = (evaluation.interval(figure).text(2) for figure in FIGURES)
            asked = [f"{evaluation.requests:.2f}"] if tuning.asks else []
            cells.append([name, trial, *figures, str(evaluation.moving_contacts), *asked])
        lines += [styled(title, bold=True), table_text(header, cells), ""]
    lines.append(
        f"At most {tuning.risk:.2f} {RISK_WORDS}, on "
        f"tuning seeds, {tuning.held_out_risk:.2f} on held-out seeds."
    )
    if tuning.settings.requests is not None:
        lines.append(f"At most {tuning.settings.requests:g} requests for attention per crossing.")
    trials = [trial.outcome.notes for trial in tuning.trials]
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
    notes = ("moving_contacts", "requests", "reached", "episodes", "dropped")
    rows = []
    for trial in tuning.trials:
        value, found = trial.outcome.value, trial.outcome.notes
        rows.append(
            [
                trial.number,
                "fail" if value is None else "complete",
                *map(csv_number, (value, found.get(RISK))),
                *(found.get(note, "") for note in notes),
                rank.get(trial.number, ""),
                *(repr(trial.parameters[name]) for name in tuning.ranges),
            ]
        )
    header = ["trial", "state", *FIGURES, *notes, "rank", *tuning.ranges]
    write_csv(path, header, rows, SimError)


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
    medians = tuning.settings.all_scenarios
    robots = {each.robot_model.name for each in medians if each.robot_model is not None}
    populations = {each.population for each in medians} - {DEFAULT_POPULATION}
    words = [f"robot {name}" for name in sorted(robots)]
    words += [f"{name} people" for name in sorted(populations)]
    words += sorted({text for each in medians if (text := each.hearing.changes_text)})
    return "".join(f", {each}" for each in words)


def _scenarios(tuning: Tuning) -> list[str]:
    return [scenario.id for scenario in tuning.settings.all_scenarios]


def _ends(seeds: range) -> str:
    return f"{seeds[0]} to {seeds[-1]}"


def draw_tuning(tuning: Tuning, importance: Mapping[str, Mapping[str, float]], path: Path) -> None:
    """Draw trials, the risk, presets and chosen policies, and the importances beside them."""
    figure = new_figure(12.0, 6.0)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.7, 1.0))
    _draw_trials(figure.add_subplot(grid[:, 0]), tuning)
    for row, name in enumerate(FIGURES):
        _draw_importances(figure.add_subplot(grid[row, 1]), name, importance[name])
    save_figure(figure, path)


def _draw_trials(axes: Axes, tuning: Tuning) -> None:
    groups: dict[tuple[str, str, str], list[tuple[float, float]]] = {
        (_TRIAL, "o", "trial"): [],
        (_WITHIN, "o", "trial within the bounds"): [],
        (_CONTACT, "x", "trial with a contact"): [],
    }
    other, fine, touched = groups.values()
    for trial in tuning.trials:
        time_s, notes = trial.outcome.value, trial.outcome.notes
        if time_s is not None:
            kind = (
                touched if notes["moving_contacts"] else fine if trial in tuning.ranked else other
            )
            kind.append((time_s, max(notes[RISK], 0.0)))
    for (colour, marker, label), points in groups.items():
        if points:
            times_s, risks = zip(*points, strict=True)
            axes.scatter(times_s, risks, c=colour, marker=marker, s=26, label=label)
    axes.axhline(tuning.risk, color=_WITHIN, lw=1.0, ls="--", label="the given risk")
    for anchor, marker in zip(tuning.anchors, _MARKERS, strict=False):
        x, y = anchor.tuning.figures
        colour = _CONTACT if anchor.tuning.moving_contacts else _ANCHOR
        axes.scatter([x], [y], marker=marker, s=60, c=colour, zorder=3, label=anchor.name)
    places: dict[tuple[float, float], list[str]] = {}
    for chosen in tuning.chosen:
        places.setdefault(chosen.tuning.figures, []).append(chosen.name.replace("_", " "))
    for row, ((x, y), names) in enumerate(sorted(places.items())):
        below = row % 2 == 0  # so that the names of neighbours do not overlap
        axes.scatter([x], [y], marker="o", s=120, facecolors="none", edgecolors=_CHOSEN, lw=2)
        axes.annotate(
            ",\n".join(names),
            (x, y),
            xytext=(9, -7 if below else 7),
            textcoords="offset points",
            color=_CHOSEN,
            va="top" if below else "bottom",
        )
    settings = tuning.settings
    axes.set_title(
        f"{counted(len(tuning.trials), 'trial')} in "
        f"{counted(len(settings.tuning_scenarios), 'scenario')}, "
        f"{counted(settings.episodes, 'seed')} each unless it ended early",
        loc="left",
        fontsize=10,
    )
    axes.set_xlabel("mean time lost (s an episode)")
    axes.set_ylabel(RISK_WORDS)
    axes.grid(alpha=0.25)
    axes.margins(0.12)
    scale_by_roots(axes, max(anchor.tuning.risk for anchor in tuning.anchors))
    axes.legend(loc="upper right", fontsize=8)


def _draw_importances(axes: Axes, figure: str, importance: Mapping[str, float]) -> None:
    first = sorted(importance.items(), key=lambda each: -each[1])[:_BARS][::-1]
    names, values = [name for name, _ in first], [value for _, value in first]
    axes.barh(names, values, color=_WITHIN)
    axes.set_title(f"what decided {_WORDS[figure]}", loc="left", fontsize=10)
    axes.tick_params(labelsize=8)
    if not any(values):
        axes.set_axis_off()
        axes.text(0.0, 0.9, "nothing: all trials are equal", transform=axes.transAxes, va="top")
    axes.set_xlim(0.0, max(1e-9, *values) * 1.1 if any(values) else 1.0)
    axes.grid(alpha=0.25, axis="x")
