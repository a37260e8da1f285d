"""``awarenav tune`` from its settings to its files."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

import yaml
from tqdm import tqdm

from nav_adapter import AwarenessPolicy

from ...scenario import ScenarioTemplate
from ...study.runs import plan_jobs
from ...world.errors import SimError
from .._crew import Crew
from .._file_lock import FileLock
from .._optuna import optuna
from .._search import Method, Outcome, Search
from .._settings_file import keep_settings
from .._trials import NOTES, Ticket, TrialBook
from ._evaluation import Evaluation, front, knee
from ._judge import Judge, TuneSettings
from ._policy_space import PolicyRange, PolicySpace

#: Evaluated beside the trials.
PRESETS: Final = ("blind", "conservative", "balanced", "assertive")
#: Trials in which the robot moved into a person are not chosen.
CONSTRAINT: Final = "robot_contacts"
_POLL_S: Final = 0.5
_MOST_CHOSEN: Final = 4


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A policy with what it came to on both sets of seeds.

    Attributes:
        name: a preset, the base policy, or why a trial was chosen.
        trial: its number; None for presets and the base policy.
        policy: the policy.
        tuning: on the tuning seeds.
        held_out: on the held-out seeds.
    """

    name: str
    trial: int | None
    policy: AwarenessPolicy
    tuning: Evaluation
    held_out: Evaluation


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """What a tuning came to.

    Attributes:
        settings: what was asked for.
        space: where was searched.
        study: Optuna's study.
        trials: all finished ones, by number.
        front: those on the front, without contact caused by the robot, by time lost.
        anchors: the base policy and the presets.
        chosen: from the front.
    """

    settings: TuneSettings
    space: PolicySpace
    study: optuna.Study
    trials: tuple[optuna.trial.FrozenTrial, ...]
    front: tuple[optuna.trial.FrozenTrial, ...]
    anchors: tuple[Candidate, ...]
    chosen: tuple[Candidate, ...]


def tune(
    settings: TuneSettings,
    folder: Path,
    *,
    workers: int,
    resume: bool,
    report: Callable[[Tuning], None] = lambda tuning: None,
) -> Tuning:
    """Search policies until the trials asked for are finished, here or by other processes.

    Args:
        settings: what is asked for.
        folder: made when missing; holds the study.
        workers: processes that run episodes.
        resume: go on with what is there.
        report: called with the result while the study is open.

    Raises:
        SimError: settings that do not go together, or episodes of a preset that have no result.
    """
    base = AwarenessPolicy.model_validate(yaml.safe_load(settings.policy))
    ranges = {path: PolicyRange.model_validate(each) for path, each in settings.ranges.items()}
    space = PolicySpace(base, ranges)
    search = Search(
        cast(Method, settings.sampler),
        space.ranges,
        generation=settings.generation,
        seed=settings.seed,
        objectives=2,
        first=[space.base_parameters()],
    )
    plan_jobs(  # says at once what cannot be run
        [ScenarioTemplate.from_text(text) for text in settings.scenarios],
        [(settings.policy_name, base)],
        settings.tuning_seeds,
        planners=[settings.planner],
        perception=settings.perception,
    )
    anchors = {settings.policy_name: base}
    for name in PRESETS:
        preset = AwarenessPolicy.preset(name)
        if name in anchors and anchors[name] != preset:
            raise SimError(f"a policy of your own needs a name of its own, got {name!r}")
        anchors[name] = preset
    keep_settings(settings, folder, "tune.json", "tuning", resume=resume, may_grow=["trials"])
    each_trial, each_held = (
        seeds * len(settings.scenarios) for seeds in (settings.episodes, settings.held_out)
    )
    with (
        TrialBook(folder, "tune", search, settings.trials) as book,
        tqdm(desc="tune", unit="episode", smoothing=0.05, file=sys.stderr) as bar,
        Crew(workers, lambda record: bar.update()) as crew,
    ):
        judge = Judge(settings, crew, folder)
        left = settings.trials - book.finished
        bar.total = each_trial * (left + len(anchors)) + each_held * (len(anchors) + _MOST_CHOSEN)
        bar.set_postfix_str("presets")
        tuned = {
            name: judge.sure(name, each, settings.tuning_seeds) for name, each in anchors.items()
        }
        while not book.done:
            bar.set_postfix_str(f"{book.finished} of {settings.trials} trials")
            tickets = book.claim(1)
            if not tickets:
                bar.set_postfix_str("others work on the rest of this generation")
                time.sleep(_POLL_S)
            for ticket in tickets:
                book.tell(ticket, _tried(ticket, space, judge, settings))
        bar.set_postfix_str("held-out seeds")
        trials = book.finished_trials()
        best = feasible_front(trials)
        held = settings.held_out_seeds

        def anchor(name: str, policy: AwarenessPolicy) -> Candidate:
            return Candidate(name, None, policy, tuned[name], judge.sure(name, policy, held))

        def candidate(name: str, trial: optuna.trial.FrozenTrial) -> Candidate:
            policy, label = space.policy(trial.params), f"trial_{trial.number:04d}"
            tuning = judge.sure(label, policy, settings.tuning_seeds)
            return Candidate(name, trial.number, policy, tuning, judge.sure(label, policy, held))

        tuning = Tuning(
            settings=settings,
            space=space,
            study=book.study,
            trials=tuple(trials),
            front=tuple(best),
            anchors=tuple(anchor(name, each) for name, each in anchors.items()),
            chosen=tuple(
                candidate(name, trial)
                for name, trial in _chosen(best, tuned[settings.policy_name]).items()
            ),
        )
        bar.total = bar.n  # whatever was known before, and reasons that share a trial
        bar.close()
        with FileLock(folder / "locks" / "report.lock"):  # several processes may end at once
            report(tuning)
    return tuning


def _tried(ticket: Ticket, space: PolicySpace, judge: Judge, settings: TuneSettings) -> Outcome:
    name = f"trial_{ticket.number:04d}"
    found = judge.run(name, space.policy(ticket.parameters), settings.tuning_seeds)
    if found.errors:
        # Episodes without a result must not make a policy look better.
        return Outcome(None, notes={"error": found.errors[0]})
    return Outcome(
        found.objectives,
        {CONSTRAINT: float(found.robot_contacts)},
        {
            "deficit_m": found.deficit_m,
            "robot_contacts": found.robot_contacts,
            "reached": found.reached,
        },
    )


def feasible_front(
    trials: Sequence[optuna.trial.FrozenTrial],
) -> list[optuna.trial.FrozenTrial]:
    """The trials on the front, by time lost, of those that keep every constraint."""
    good = [
        trial
        for trial in trials
        if trial.state == optuna.trial.TrialState.COMPLETE
        and all(value <= 0.0 for value in trial.constraints.values())
    ]
    return [good[row] for row in front([(t.values[0], t.values[1]) for t in good])]


def _chosen(
    best: list[optuna.trial.FrozenTrial], base: Evaluation
) -> dict[str, optuna.trial.FrozenTrial]:
    """Which trials of the front to look at, by why; a trial may be there for several reasons."""
    if not best:
        return {}
    points = [(trial.values[0], trial.values[1]) for trial in best]
    chosen = {
        "least_time_lost": best[0],
        "knee": best[knee(points)],
        "least_violation": best[-1],
    }
    time_s, violation_s = base.objectives
    better = [
        row
        for row, point in enumerate(points)
        if point[0] <= time_s and point[1] <= violation_s and point != (time_s, violation_s)
    ]
    if better:
        chosen["beats_base"] = best[better[knee([points[row] for row in better])]]
    return chosen


def require_trials(tuning: Tuning) -> None:
    """Raise SimError when no trial could be judged."""
    if not any(trial.state == optuna.trial.TrialState.COMPLETE for trial in tuning.trials):
        first = next(iter(tuning.trials)).user_attrs.get(NOTES, {}).get("error", "")
        raise SimError(f"no trial could be judged; the first said: {first}")
