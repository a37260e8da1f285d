"""A tuning: the search for policies that lose the least time at a given risk."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, cast

from awarenav.errors import counted
from nav_adapter import AwarenessPolicy

from ...crossing import named_policy
from ...study.frontier import TODAY
from ...study.measures import Interval
from ...study.runs import policy_of
from ...world.errors import SimError
from .._episode_runner import EpisodeRunner
from .._files import write_or_check_settings
from .._optimizer import Optimizer, Outcome, SamplerName
from .._optuna import optuna
from .._process_lock import ProcessLock
from .._shared_study import NOTES, Claim, SharedStudy
from ._evaluation import OBJECTIVE, RISK, Evaluation
from ._evaluator import PolicyEvaluator
from ._finalists import BEATS_BASE, PLACES, Candidate, level_of, merged, named_winner
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
    "tuning.png",
)
# Evaluated beside the trials.
_PRESETS: Final = ("blind", "conservative", "balanced", "assertive", TODAY)
# Constraints of a trial: the moving robot touches nobody, and the risk and, with a bound, the
# requests for attention are at most the given ones.
_CONTACTS: Final = "moving_contacts"
_OVER_RISK: Final = "over_risk"
_OVER_REQUESTS: Final = "over_requests"
_POLL_S: Final = 0.5
# Without a number of their own, policies may have this share of the risk of today's AMR.
_SHARE_OF_TODAY: Final = 1.0 / 20.0


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """The result of a tuning.

    Attributes:
        settings: its settings.
        space: its search space.
        study: Optuna's study.
        trials: all finished trials, by number.
        ranked: trials within the constraints that ran every episode, by time lost.
        anchors: the base policy, the presets and today's AMR.
        chosen: the first of ``ranked``; none equals one of ``anchors``.
        risk: step-out impacts per 1 000 crossings that a policy may have on the tuning seeds.
        held_out_risk: the same on the held-out seeds.
    """

    settings: TuneSettings
    space: PolicySpace
    study: optuna.Study
    trials: tuple[optuna.trial.FrozenTrial, ...]
    ranked: tuple[optuna.trial.FrozenTrial, ...]
    anchors: tuple[Candidate, ...]
    chosen: tuple[Candidate, ...]
    risk: float
    held_out_risk: float

    @property
    def base(self) -> Candidate:
        """The base policy."""
        return self.anchors[0]

    @property
    def winner(self) -> Candidate | None:
        """The chosen policy that is shown to be better than the base policy, if there is one."""
        return next((each for each in self.chosen if each.name == BEATS_BASE), None)

    @property
    def asks(self) -> bool:
        """True if requests for attention are bounded, or a policy of the result made any."""
        rows = (*self.anchors, *self.chosen)
        made = any(each.tuning.requests or each.held_out.requests for each in rows)
        return made or self.settings.requests is not None

    def allows(self, candidate: Candidate) -> bool:
        """Return whether risk and requests of a policy on held-out are at most the given ones."""
        return candidate.held_out.is_within(self.held_out_risk, self.settings.requests)

    def minus_base(self, candidate: Candidate) -> Interval:
        """Return the paired difference in time lost to the base policy on the held-out episodes.

        Its level is that of the decision: all chosen policies together have 95 %.
        """
        level = level_of(len(self.chosen))
        return candidate.held_out.minus(self.base.held_out, OBJECTIVE, level)


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
        race = _Race(space, evaluator, settings, anchors, tuned, _risk(settings, tuned[TODAY]))
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
    ranked = ranked_trials(trials)
    rows = merged(
        [
            *(race.anchor(name) for name in race.anchors),
            *(race.finalist(trial, (name,)) for name, trial in zip(PLACES, ranked, strict=False)),
        ]
    )
    anchors = tuple(each for each in rows if each.trial is None)
    new = [each for each in rows if each.trial is not None]
    today = next(each for each in anchors if TODAY in each.names)
    held_out_risk = _risk(settings, today.held_out)
    return Tuning(
        settings=settings,
        space=race.space,
        study=study.study,
        trials=tuple(trials),
        ranked=tuple(ranked),
        anchors=anchors,
        chosen=tuple(
            named_winner(
                new, anchors[0], held_out_risk, settings.hold_out_scenarios, settings.requests
            )
        ),
        risk=race.risk,
        held_out_risk=held_out_risk,
    )


def _risk(settings: TuneSettings, today: Evaluation) -> float:
    """Return the impacts that a policy may have: the given ones, or a share of today's."""
    return _SHARE_OF_TODAY * today.risk if settings.risk is None else settings.risk


def ranked_trials(
    trials: Sequence[optuna.trial.FrozenTrial],
) -> list[optuna.trial.FrozenTrial]:
    """Return the trials that satisfy every constraint, by time lost.

    A trial that was dropped before it ran every episode is not among them.
    """
    feasible = [
        trial
        for trial in trials
        if trial.state == optuna.trial.TrialState.COMPLETE
        and all(value <= 0.0 for value in trial.constraints.values())
        and not trial.user_attrs.get(NOTES, {}).get("dropped")
    ]
    return sorted(feasible, key=lambda trial: (trial.values[0], trial.number))


def require_trials(tuning: Tuning) -> None:
    """Raise SimError if no trial has a result."""
    if not any(trial.state == optuna.trial.TrialState.COMPLETE for trial in tuning.trials):
        first = next(iter(tuning.trials)).user_attrs.get(NOTES, {}).get("error", "")
        raise SimError(f"no trial could be judged; the first said: {first}")


def _anchors(policy_name: str, base: AwarenessPolicy) -> dict[str, AwarenessPolicy]:
    """Return the base policy and the presets by name; refuse a base with the name of a preset."""
    anchors = {policy_name: base}
    for name in _PRESETS:
        _, preset = named_policy(name)
        if name in anchors and anchors[name] != preset:
            raise SimError(f"a policy of your own needs a name of its own, got {name!r}")
        anchors[name] = preset
    return anchors


def _planned_episodes(settings: TuneSettings, finished_trials: int, anchors: int) -> int:
    """Return the number of episodes that are left at most."""
    per_trial = settings.episodes * len(settings.tuning_templates)
    per_held_out = settings.held_out * len(settings.scenarios)
    left = settings.trials - finished_trials
    return per_trial * (left + anchors) + per_held_out * (anchors + len(PLACES))


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
        risk: step-out impacts per 1 000 crossings that a policy may have on the tuning seeds.
    """

    space: PolicySpace
    evaluator: PolicyEvaluator
    settings: TuneSettings
    anchors: dict[str, AwarenessPolicy]
    tuned: dict[str, Evaluation]
    risk: float

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
                reason = dropped(evaluation, base, self.risk)
                if reason:
                    break
        time_s, risk = evaluation.estimate(base)
        contacts, requests = evaluation.moving_contacts, evaluation.requests
        constraints = {_CONTACTS: float(contacts), _OVER_RISK: risk - self.risk}
        if self.settings.requests is not None:
            constraints[_OVER_REQUESTS] = requests - self.settings.requests
        return Outcome(
            (time_s,),
            constraints,
            {
                RISK: risk,
                _CONTACTS: contacts,
                "requests": requests,
                "reached": evaluation.reached,
                "episodes": len(evaluation.records),
                "dropped": reason,
            },
        )


def _trial_label(number: int) -> str:
    return f"trial_{number:04d}"
