"""A tuning: the search for policies with little time lost and little margin violated."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, cast

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...study.runs import ProcessLock, plan_jobs, policy_of
from ...world.errors import SimError
from .._episode_runner import EpisodeRunner
from .._files import templates_of, write_or_check_settings
from .._optimizer import Optimizer, Outcome, SamplerName
from .._optuna import optuna
from .._shared_study import NOTES, Claim, SharedStudy
from ._evaluation import Evaluation, knee, pareto_front
from ._evaluator import PolicyEvaluator
from ._policy_space import PolicyRange, PolicySpace
from ._settings import TuneSettings

_SETTINGS_FILE: Final = "tune.json"
_RESULTS: Final = (
    "evaluations/*.csv",
    "evaluations/*.damaged",
    "trials.csv",
    "importances.json",
    "chosen.json",
    "chosen/*.yaml",
    "pareto.png",
)
# Evaluated beside the trials.
_PRESETS: Final = ("blind", "conservative", "balanced", "assertive")
# A trial in which the robot moved into a person is not chosen.
_CONSTRAINT: Final = "robot_contacts"
_POLL_S: Final = 0.5
_MOST_CHOSEN: Final = 4


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A policy with its evaluation on both sets of seeds.

    Attributes:
        name: a preset, the base policy, or the reason why a trial was chosen.
        trial: number of the trial; None for presets and the base policy.
        policy: the policy.
        tuning: evaluation on the tuning seeds.
        held_out: evaluation on the held-out seeds.
    """

    name: str
    trial: int | None
    policy: AwarenessPolicy
    tuning: Evaluation
    held_out: Evaluation


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """The result of a tuning.

    Attributes:
        settings: its settings.
        space: its search space.
        study: Optuna's study.
        trials: all finished trials, by number.
        front: trials on the Pareto front without a contact caused by the robot, by time lost.
        anchors: the base policy and the presets.
        chosen: trials chosen from the front.
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
    overwrite: bool = False,
    report: Callable[[Tuning], None] = lambda tuning: None,
) -> Tuning:
    """Search until all trials are finished, by this or other processes.

    Args:
        settings: settings of the search.
        folder: made when missing; holds the study.
        workers: number of processes that run episodes.
        resume: continue the search in the folder.
        overwrite: replace the search in the folder.
        report: called with the result while the study is open.

    Raises:
        SimError: settings that do not fit together, or a preset with an episode without a result.
    """
    base = policy_of(settings.policy)
    ranges = {key: PolicyRange.model_validate(each) for key, each in settings.ranges.items()}
    space = PolicySpace(base, ranges)
    optimizer = Optimizer(
        cast(SamplerName, settings.sampler),
        space.ranges,
        generation=settings.generation,
        seed=settings.seed,
        objectives=2,
        initial=[space.base_parameters()],
    )
    plan_jobs(  # refuses what cannot be run
        templates_of(settings.scenarios),
        [(settings.policy_name, base)],
        settings.tuning_seeds,
        planners=[settings.planner],
        perception=settings.perception,
    )
    anchors = _anchors(settings.policy_name, base)
    write_or_check_settings(
        settings,
        folder,
        _SETTINGS_FILE,
        "tuning",
        resume=resume,
        overwrite=overwrite,
        results=_RESULTS,
        may_grow=["trials"],
    )
    with (
        SharedStudy(folder, "tune", optimizer, settings.trials) as study,
        EpisodeRunner(workers, "tune") as runner,
    ):
        evaluator = PolicyEvaluator(settings, runner, folder)
        runner.bar.total = _planned_episodes(settings, study.finished_count, len(anchors))
        runner.bar.set_postfix_str("presets")
        tuned = {
            name: evaluator.evaluate_all(name, policy, settings.tuning_seeds)
            for name, policy in anchors.items()
        }
        _run_trials(study, settings, space, evaluator, runner)
        runner.bar.set_postfix_str("held-out seeds")
        trials = study.finished_trials()
        front = feasible_front(trials)

        def anchor(name: str, policy: AwarenessPolicy) -> Candidate:
            held_out = evaluator.evaluate_all(name, policy, settings.held_out_seeds)
            return Candidate(name, None, policy, tuned[name], held_out)

        def candidate(name: str, trial: optuna.trial.FrozenTrial) -> Candidate:
            policy, label = space.policy(trial.params), _trial_label(trial.number)
            on_tuning_seeds = evaluator.evaluate_all(label, policy, settings.tuning_seeds)
            held_out = evaluator.evaluate_all(label, policy, settings.held_out_seeds)
            return Candidate(name, trial.number, policy, on_tuning_seeds, held_out)

        tuning = Tuning(
            settings=settings,
            space=space,
            study=study.study,
            trials=tuple(trials),
            front=tuple(front),
            anchors=tuple(anchor(name, policy) for name, policy in anchors.items()),
            chosen=tuple(
                candidate(name, trial)
                for name, trial in _chosen(front, tuned[settings.policy_name]).items()
            ),
        )
        runner.bar.total = runner.bar.n  # some episodes were known before, some trials chosen twice
        runner.bar.close()
        with ProcessLock(folder / "locks" / "report.lock"):  # several processes may end at once
            report(tuning)
    return tuning


def feasible_front(
    trials: Sequence[optuna.trial.FrozenTrial],
) -> list[optuna.trial.FrozenTrial]:
    """Return the Pareto front of the trials that satisfy every constraint, by time lost."""
    feasible = [
        trial
        for trial in trials
        if trial.state == optuna.trial.TrialState.COMPLETE
        and all(value <= 0.0 for value in trial.constraints.values())
    ]
    rows = pareto_front([(trial.values[0], trial.values[1]) for trial in feasible])
    return [feasible[row] for row in rows]


def require_trials(tuning: Tuning) -> None:
    """Raise SimError if no trial has a result."""
    if not any(trial.state == optuna.trial.TrialState.COMPLETE for trial in tuning.trials):
        first = next(iter(tuning.trials)).user_attrs.get(NOTES, {}).get("error", "")
        raise SimError(f"no trial could be judged; the first said: {first}")


def _anchors(policy_name: str, base: AwarenessPolicy) -> dict[str, AwarenessPolicy]:
    """Return the base policy and the presets by name; refuse a base with the name of a preset."""
    anchors = {policy_name: base}
    for name in _PRESETS:
        preset = AwarenessPolicy.preset(name)
        if name in anchors and anchors[name] != preset:
            raise SimError(f"a policy of your own needs a name of its own, got {name!r}")
        anchors[name] = preset
    return anchors


def _planned_episodes(settings: TuneSettings, finished_trials: int, anchors: int) -> int:
    """Return the number of episodes that are left at most."""
    per_trial, per_held_out = (
        seeds * len(settings.scenarios) for seeds in (settings.episodes, settings.held_out)
    )
    left = settings.trials - finished_trials
    return per_trial * (left + anchors) + per_held_out * (anchors + _MOST_CHOSEN)


def _run_trials(
    study: SharedStudy,
    settings: TuneSettings,
    space: PolicySpace,
    evaluator: PolicyEvaluator,
    runner: EpisodeRunner,
) -> None:
    """Evaluate trials until all are finished, by this or other processes."""

    def outcomes_of(claims: Sequence[Claim]) -> list[Outcome]:
        return [_outcome(claim, space, evaluator, settings) for claim in claims]

    while not study.is_complete:
        runner.bar.set_postfix_str(f"{study.finished_count} of {counted(settings.trials, 'trial')}")
        if not study.evaluate(1, outcomes_of):
            runner.bar.set_postfix_str("others work on the rest of this generation")
            time.sleep(_POLL_S)


def _outcome(
    claim: Claim, space: PolicySpace, evaluator: PolicyEvaluator, settings: TuneSettings
) -> Outcome:
    policy = space.policy(claim.parameters)
    evaluation = evaluator.evaluate(_trial_label(claim.number), policy, settings.tuning_seeds)
    if evaluation.errors:
        # Episodes without a result must not make a policy look better.
        return Outcome(None, notes={"error": evaluation.errors[0]})
    return Outcome(
        evaluation.objectives,
        {_CONSTRAINT: float(evaluation.robot_contacts)},
        {
            "deficit_m": evaluation.deficit_m,
            "robot_contacts": evaluation.robot_contacts,
            "reached": evaluation.reached,
        },
    )


def _trial_label(number: int) -> str:
    return f"trial_{number:04d}"


def _chosen(
    front: Sequence[optuna.trial.FrozenTrial], base: Evaluation
) -> dict[str, optuna.trial.FrozenTrial]:
    """Return the chosen trials of the front by reason; a trial may have several reasons."""
    if not front:
        return {}
    points = [(trial.values[0], trial.values[1]) for trial in front]
    chosen = {
        "least_time_lost": front[0],
        "knee": front[knee(points)],
        "least_violation": front[-1],
    }
    time_s, violation_s = base.objectives
    better = [
        row
        for row, point in enumerate(points)
        if point[0] <= time_s and point[1] <= violation_s and point != (time_s, violation_s)
    ]
    if better:
        chosen["beats_base"] = front[better[knee([points[row] for row in better])]]
    return chosen
