"""A tuning: the search for policies with little time lost and little margin violated."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, cast

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...study.measures import Interval
from ...study.runs import ProcessLock, policy_of
from ...world.errors import SimError
from .._episode_runner import EpisodeRunner
from .._files import write_or_check_settings
from .._optimizer import Optimizer, Outcome, SamplerName
from .._optuna import optuna
from .._shared_study import NOTES, Claim, SharedStudy
from ._evaluation import Evaluation, pareto_front
from ._evaluator import PolicyEvaluator
from ._finalists import BEATS_BASE, Candidate, chosen_trials, level_of, merged, named_winner
from ._policy_space import PolicyRange, PolicySpace
from ._race import Dropped, dropped, stages
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
class Tuning:
    """The result of a tuning.

    Attributes:
        settings: its settings.
        space: its search space.
        study: Optuna's study.
        trials: all finished trials, by number.
        front: trials on the Pareto front that ran every episode, by time lost.
        anchors: the base policy and the presets.
        chosen: trials chosen from the front; none equals one of ``anchors``.
    """

    settings: TuneSettings
    space: PolicySpace
    study: optuna.Study
    trials: tuple[optuna.trial.FrozenTrial, ...]
    front: tuple[optuna.trial.FrozenTrial, ...]
    anchors: tuple[Candidate, ...]
    chosen: tuple[Candidate, ...]

    @property
    def base(self) -> Candidate:
        """The base policy."""
        return self.anchors[0]

    @property
    def winner(self) -> Candidate | None:
        """The chosen policy that is shown to be better than the base policy, if there is one."""
        return next((each for each in self.chosen if each.name == BEATS_BASE), None)

    def minus_base(self, candidate: Candidate, objective: str) -> Interval:
        """Return the paired difference to the base policy on the held-out episodes.

        Its level is that of the decision: all chosen policies together have 95 %.
        """
        level = level_of(len(self.chosen))
        return candidate.held_out.minus(self.base.held_out, objective, level)


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
    # Refuses what cannot be run.
    settings.jobs(settings.policy_name, base, settings.tuning_seeds, settings.templates)
    anchors = _anchors(settings.policy_name, base)
    write_or_check_settings(
        settings,
        folder,
        _SETTINGS_FILE,
        "tuning",
        resume=resume,
        overwrite=overwrite,
        results=_RESULTS,
        may_grow=["trials", "held_out"],
    )
    with (
        SharedStudy(folder, "tune", optimizer, settings.trials) as study,
        EpisodeRunner(workers, "tune") as runner,
    ):
        evaluator = PolicyEvaluator(settings, runner, folder)
        runner.bar.total = _planned_episodes(settings, study.finished_count, len(anchors))
        runner.bar.set_postfix_str("presets")
        tuned = {
            name: evaluator.evaluate_all(
                name, policy, settings.tuning_seeds, settings.tuning_templates
            )
            for name, policy in anchors.items()
        }
        race = _Race(space, evaluator, settings, anchors, tuned)
        _run_trials(study, settings, race, runner)
        runner.bar.set_postfix_str("held-out seeds")
        tuning = _tuning(study, race)
        runner.bar.total = runner.bar.n  # some episodes were known before, some trials dropped
        runner.bar.close()
        with ProcessLock(folder / "locks" / "report.lock"):  # several processes may end at once
            report(tuning)
    return tuning


def _tuning(study: SharedStudy, race: _Race) -> Tuning:
    """Return the result of a finished study; runs the held-out seeds."""
    settings, trials = race.settings, study.finished_trials()
    front = feasible_front(trials)
    reasons = chosen_trials(front, race.tuned[settings.policy_name])
    rows = merged(
        [
            *(race.anchor(name) for name in race.anchors),
            *(race.finalist(front[row], names) for row, names in reasons.items()),
        ]
    )
    anchors = tuple(each for each in rows if each.trial is None)
    new = [each for each in rows if each.trial is not None]
    return Tuning(
        settings=settings,
        space=race.space,
        study=study.study,
        trials=tuple(trials),
        front=tuple(front),
        anchors=anchors,
        chosen=tuple(named_winner(new, anchors[0], settings.hold_out_scenarios)),
    )


def feasible_front(
    trials: Sequence[optuna.trial.FrozenTrial],
) -> list[optuna.trial.FrozenTrial]:
    """Return the Pareto front of the trials that satisfy every constraint, by time lost.

    A trial that was dropped before it ran every episode is not on it.
    """
    feasible = [
        trial
        for trial in trials
        if trial.state == optuna.trial.TrialState.COMPLETE
        and all(value <= 0.0 for value in trial.constraints.values())
        and not trial.user_attrs.get(NOTES, {}).get("dropped")
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
    per_trial = settings.episodes * len(settings.tuning_templates)
    per_held_out = settings.held_out * len(settings.scenarios)
    left = settings.trials - finished_trials
    return per_trial * (left + anchors) + per_held_out * (anchors + _MOST_CHOSEN)


def _run_trials(
    study: SharedStudy, settings: TuneSettings, race: _Race, runner: EpisodeRunner
) -> None:
    """Evaluate trials until all are finished, by this or other processes."""
    while not study.is_complete:
        runner.bar.set_postfix_str(f"{study.finished_count} of {counted(settings.trials, 'trial')}")
        if not study.evaluate(1, race.outcomes):
            runner.bar.set_postfix_str("others work on the rest of this generation")
            time.sleep(_POLL_S)


@dataclass(frozen=True, slots=True)
class _Race:
    """Runs trials, each only as long as it does not lose to the base policy, and the finalists.

    Attributes:
        space: gives the policy of a trial.
        evaluator: runs episodes.
        settings: settings of the tuning.
        anchors: the base policy and the presets, by name.
        tuned: their evaluations on the tuning seeds.
    """

    space: PolicySpace
    evaluator: PolicyEvaluator
    settings: TuneSettings
    anchors: dict[str, AwarenessPolicy]
    tuned: dict[str, Evaluation]

    def outcomes(self, claims: Sequence[Claim]) -> list[Outcome]:
        """Return the outcomes of trials."""
        return [self._outcome(claim) for claim in claims]

    def anchor(self, name: str) -> Candidate:
        """Return the base policy or a preset as a candidate."""
        policy = self.anchors[name]
        return Candidate((name,), None, policy, self.tuned[name], self._held_out(name, policy))

    def finalist(self, trial: optuna.trial.FrozenTrial, names: tuple[str, ...]) -> Candidate:
        """Return a trial as a candidate; as the anchor whose policy it has, if there is one."""
        policy, label = self.space.policy(trial.params), _trial_label(trial.number)
        for name, known in self.anchors.items():
            if known == policy:
                return replace(self.anchor(name), names=names)
        settings = self.settings
        tuned = self.evaluator.evaluate_all(
            label, policy, settings.tuning_seeds, settings.tuning_templates
        )
        return Candidate(names, trial.number, policy, tuned, self._held_out(label, policy))

    def _held_out(self, name: str, policy: AwarenessPolicy) -> Evaluation:
        settings = self.settings
        return self.evaluator.evaluate_all(
            name, policy, settings.held_out_seeds, settings.templates
        )

    def _outcome(self, claim: Claim) -> Outcome:
        policy, base = self.space.policy(claim.parameters), self.tuned[self.settings.policy_name]
        evaluation = Evaluation(())
        reason: Dropped = ""
        for name, known in self.anchors.items():
            if known == policy:  # the first trial is the base policy
                evaluation = self.tuned[name]
        if not evaluation.records:
            for seeds in stages(self.settings.tuning_seeds):
                part = self.evaluator.evaluate(
                    _trial_label(claim.number), policy, seeds, self.settings.tuning_templates
                )
                if part.errors:
                    # Episodes without a result must not make a policy look better.
                    return Outcome(None, notes={"error": part.errors[0]})
                evaluation = Evaluation.joined([evaluation, part])
                if len(evaluation.records) == len(base.records):
                    break
                reason = dropped(evaluation, base)
                if reason:
                    break
        return Outcome(
            evaluation.estimate(base),
            {_CONSTRAINT: float(evaluation.robot_contacts)},
            {
                "deficit_m": evaluation.deficit_m,
                "robot_contacts": evaluation.robot_contacts,
                "reached": evaluation.reached,
                "episodes": len(evaluation.records),
                "dropped": reason,
            },
        )


def _trial_label(number: int) -> str:
    return f"trial_{number:04d}"
